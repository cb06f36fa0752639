//! A screen-space error of one pixel: bricks, time and error, view by view.

use brickfield::Scene;
use brickfield::bricks::{BrickTree, Downsampling};
use brickfield::frame::Backend;
use brickfield::lod::Criterion;
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{BrickSide, Camera, Grid, Projection, ScalarType};
use serde::Serialize;

use super::LamarArgs;
use super::measure::{Distance, Drawn, Judge, distance, duel};
use super::scenes::{geometries, scene, tree};
use crate::compare::rivals::Rivals;
use crate::paper::{Missed, PaperError, print};
use crate::turns::{Bound, Claim, Claims, Ratio, Spread};
use crate::volumes::{Phantom, phantom_of};

#[derive(Clone, Debug, Serialize)]
struct ViewRow {
    view: u32,
    backend: &'static str,
    full: (Drawn, Spread),
    pixel: (Drawn, Spread),
    /// The time of full resolution over that of a pixel's error.
    ratio: Ratio,
    error: Distance,
    /// Why the picture of a pixel's error is not within the rule of its own cut's f64 reference.
    complaint: Option<String>,
}

pub(super) fn run(args: &LamarArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, PaperError> {
    let Phantom { volume, transfer, .. } = phantom_of(UVec3::splat(args.volume_side), ScalarType::U8);
    let tree = tree(&volume, BrickSide::S32, Downsampling::Subsample)?;
    print(&format!(
        "The phantom at {}^3, {} views, {} x {} pixels, ray caster, steps of {} voxel(s) times 2^level, bricks of 32. Errors are against\n\
         the same backend's picture at full resolution; \"ok\": within the rule of the f64 sum of the same cut, nothing culled.\n",
        args.volume_side, args.views, args.common.size.x, args.common.size.y, args.common.step
    ))?;
    print(
        "view  backend  bricks: full   1 px     MB: full   1 px    ms: full    1 px  ratio   max        RMSE       colour difference: mean  as the cut says",
    )?;
    let rays = geometries(args)[3];
    let mut rows = Vec::new();
    for view in 0..args.views {
        let camera = camera(volume.grid(), view, args.views)?;
        let with = |criterion| scene(args, &transfer, camera, rays, &[criterion]);
        let scenes = [with(Criterion::FullResolution), with(Criterion::ScreenSpaceError { pixels: 1.0 })];
        let judge = Judge::new(&tree, &scenes[1], rivals.present[0].as_ref())?;
        for backend in &mut rivals.present {
            let row = of_view(args, backend.as_mut(), &tree, view, (&scenes, &judge))?;
            print(&line(&row))?;
            rows.push(row);
        }
    }
    args.common.write_rows("views.json", &rows)?;
    summary(args, &rows)
}

/// On a spiral around the volume, every fourth view from inside.
fn camera(grid: &Grid, view: u32, n: u32) -> Result<Camera, PaperError> {
    let b = grid.world_box();
    let height = 1.0 - 2.0 * (f64::from(view) + 0.5) / f64::from(n);
    let angle = f64::from(view) * std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let across = (1.0 - height * height).sqrt();
    let direction = DVec3::new(across * angle.cos(), across * angle.sin(), height);
    let distance = [1.6, 1.0, 0.6, 0.25][view as usize % 4] * b.diagonal();
    let projection = Projection::Perspective { fov_y: 45f64.to_radians() };
    let up = if direction.z.abs() > 0.95 { DVec3::Y } else { DVec3::Z };
    Ok(Camera::look_at(b.center() + direction * distance, b.center(), up, projection)?)
}

fn of_view(
    args: &LamarArgs,
    backend: &mut dyn Backend,
    tree: &BrickTree,
    view: u32,
    (scenes, judge): (&[Scene; 2], &Judge),
) -> Result<ViewRow, PaperError> {
    let duel = duel(tree, scenes, backend, args.common.frames)?;
    let (full, pixel) = (duel.first, duel.second);
    Ok(ViewRow {
        view,
        backend: backend.describe().backend,
        full: (full.drawn, full.ms),
        pixel: (pixel.drawn, pixel.ms),
        ratio: duel.ratio,
        error: distance(&pixel.image, &full.image.map(f64::from))?,
        complaint: judge.complaint(&pixel.image),
    })
}

fn line(row: &ViewRow) -> String {
    let ((full, full_ms), (pixel, pixel_ms)) = (row.full, row.pixel);
    let megabytes = |d: Drawn| d.n_bytes as f64 / 1e6;
    format!(
        "{:>4}  {:<7} {:>13} {:>6} {:>12.1} {:>6.1} {:>11.1} {:>7.1} {:>6.2}   {:.2e}   {:.2e}   {:<23.3}  {}",
        row.view,
        row.backend,
        full.n_bricks,
        pixel.n_bricks,
        megabytes(full),
        megabytes(pixel),
        full_ms.median,
        pixel_ms.median,
        row.ratio.median,
        row.error.max,
        row.error.rmse,
        row.error.delta_e_mean,
        row.complaint.as_deref().unwrap_or("ok"),
    )
}

/// Medians over the views, and the claims that do not hold. The claim about times is about the median over views: no
/// row is decided by itself.
fn summary(args: &LamarArgs, rows: &[ViewRow]) -> Result<Vec<Missed>, PaperError> {
    let more = |r: &&ViewRow| r.pixel.0.n_bricks > r.full.0.n_bricks;
    let more = rows
        .iter()
        .filter(more)
        .map(|r| format!("view {}, {}: more bricks than at full resolution", r.view, r.backend));
    let wrong =
        rows.iter().filter_map(|r| r.complaint.as_ref().map(|why| format!("view {}, {}: {why}", r.view, r.backend)));
    let mut missed: Vec<Missed> = more.chain(wrong).map(Missed::of_pictures).collect();
    let mut claims = Vec::new();
    let mut names: Vec<&str> = rows.iter().map(|r| r.backend).collect();
    names.sort_unstable();
    names.dedup();
    for name in names {
        let own = || rows.iter().filter(|r| r.backend == name);
        let over_views = |f: &dyn Fn(&ViewRow) -> f64| crate::metrics::median(own().map(f).collect());
        let bricks = over_views(&|r| r.pixel.0.n_bricks as f64 / r.full.0.n_bricks.max(1) as f64);
        let time = Ratio::of_rounds(own().map(|r| r.ratio.median).collect());
        let worst = own().map(|r| r.error.max).fold(0.0, f64::max);
        let rmse = over_views(&|r| r.error.rmse);
        print(&format!(
            "\n{name}: medians over views: {:.0} % of the bricks, {time} times as fast, RMSE {rmse:.1e}; greatest difference in any view {worst:.2e}",
            100.0 * bricks
        ))?;
        if bricks >= 1.0 {
            let what = format!("views, {name}: {:.0} % of the bricks of full resolution", 100.0 * bricks);
            missed.push(Missed::of_pictures(what));
        }
        claims.push(Claim::of_ratio(format!("views, {name}: full resolution / one pixel"), time, Bound::Above(1.0)));
    }
    print(&format!("\n{}", Claims(&claims)))?;
    args.common.write_rows("views-claims.json", &claims)?;
    missed.extend(claims.iter().filter_map(Missed::of_claim));
    Ok(missed)
}
