//! Table 1: fixed tiles against multiresolution.

use brickfield::Scene;
use brickfield::bricks::{BrickTree, Downsampling};
use brickfield::frame::Backend;
use brickfield::lod::Criterion;
use brickfield_core::{Camera, Image};
use serde::Serialize;

use super::LamarArgs;
use super::measure::{Distance, Drawn, Judge, SceneTimes, answer, distance, duel};
use super::scenes::{Geometry, data_sets, geometries, geometries_of, scene, sides, tree, views};
use crate::compare::rivals::Rivals;
use crate::paper::{Missed, PaperError, Subject, print};
use crate::turns::{Bound, Claim, Claims, Ratio, Spread, Standing};

/// A line of the table: one data set, view, tile size, geometry and backend.
#[derive(Clone, Debug, Serialize)]
struct TableRow {
    data: String,
    dims: [u32; 3],
    view: &'static str,
    side: u32,
    geometry: &'static str,
    backend: &'static str,
    fixed: Tiling,
    multiresolution: Tiling,
    /// The time of fixed tiles over that of multiresolution.
    ratio: Ratio,
}

/// One way of drawing: fixed tiles, or multiresolution.
#[derive(Clone, Debug, Serialize)]
struct Tiling {
    drawn: Drawn,
    ms: Spread,
    /// The part of it for selection, order and polygons.
    prepare_ms: Spread,
    error: Distance,
    /// Why the picture is not within the rule of its own cut's f64 reference.
    complaint: Option<String>,
}

/// One tree seen from one place.
struct Seat<'a> {
    data_set: &'a Subject,
    tree: &'a BrickTree,
    camera: Camera,
    view: &'static str,
    side: u32,
    answer: &'a Image<f64>,
}

pub(super) fn run(args: &LamarArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, PaperError> {
    print(&format!(
        "{} x {} pixels, steps of {} voxel(s) of level 0, 2^level of them in coarser bricks (subsampled); times are medians of {} rounds in which both took turns,\n\
         from the scene to the picture (selection, order and polygons included, bricks resident); the ratio is the median of the rounds' ratios, with the interval that\n\
         holds the true one and its confidence; \"undecided\": the interval holds 1, or has less than 95 %. Errors are against the continuous integral at full resolution;\n\
         \"ok\": within the rule of the f64 sum of the same cut, nothing culled.\n",
        args.common.size.x, args.common.size.y, args.common.step, args.common.frames
    ))?;
    print(HEADER)?;
    let mut rows = Vec::new();
    for data_set in data_sets(args)? {
        let data_set = data_set?;
        let views = views(&data_set, args.common.size)?;
        let full = geometries(args)[3];
        let answers =
            views.map(|(_, camera)| answer(&data_set.volume, &scene(args, &data_set.transfer, camera, full, &[])));
        for side in sides(args) {
            let tree = tree(&data_set.volume, side, Downsampling::Subsample)?;
            for ((view, camera), answer) in views.into_iter().zip(&answers) {
                let seat = Seat { data_set: &data_set, tree: &tree, camera, view, side: side.n_samples(), answer };
                rows.extend(of_seat(args, rivals, &seat)?);
            }
        }
    }
    args.common.write_rows("table.json", &rows)?;
    let claims = claims(&rows);
    print(&format!("\n{}", Claims(&claims)))?;
    args.common.write_rows("table-claims.json", &claims)?;
    Ok(missed(&rows, &claims))
}

const HEADER: &str = "\
data               view     side  tiles: fixed multi  geometry        backend  fixed ms (min to max)      multi ms (min to max)      fixed / multi              multi is   \
RMSE: fixed    multi  max: fixed    multi  as the cut says";

fn of_seat(args: &LamarArgs, rivals: &mut Rivals, seat: &Seat<'_>) -> Result<Vec<TableRow>, PaperError> {
    let mut rows = Vec::new();
    for geometry in geometries(args) {
        let with = |detail: &[Criterion]| scene(args, &seat.data_set.transfer, seat.camera, geometry, detail);
        let scenes = [with(&[Criterion::FullResolution]), with(&args.detail)];
        let draws = |backend: &dyn Backend| geometries_of(args, backend).any(|own| own == geometry);
        let Some(any) = rivals.present.iter().find(|backend| draws(backend.as_ref())) else { continue };
        let judge = |scene: &Scene| Judge::new(seat.tree, scene, any.as_ref());
        let judges = [judge(&scenes[0])?, judge(&scenes[1])?];
        for backend in rivals.present.iter_mut().filter(|backend| draws(backend.as_ref())) {
            let row = contest(args, backend.as_mut(), seat, geometry, (&scenes, &judges))?;
            print(&line(&row))?;
            rows.push(row);
        }
    }
    Ok(rows)
}

/// Fixed and multiresolution take turns.
fn contest(
    args: &LamarArgs,
    backend: &mut dyn Backend,
    seat: &Seat<'_>,
    geometry: Geometry,
    (scenes, judges): (&[Scene; 2], &[Judge; 2]),
) -> Result<TableRow, PaperError> {
    let duel = duel(seat.tree, scenes, backend, args.common.frames)?;
    let tiling = |times: SceneTimes, judge: &Judge| -> Result<Tiling, PaperError> {
        let (error, complaint) = (distance(&times.image, seat.answer)?, judge.complaint(&times.image));
        let SceneTimes { drawn, ms, prepare_ms, .. } = times;
        Ok(Tiling { drawn, ms, prepare_ms, error, complaint })
    };
    Ok(TableRow {
        data: seat.data_set.name.clone(),
        dims: seat.data_set.volume.grid().dims().to_array(),
        view: seat.view,
        side: seat.side,
        geometry: geometry.name,
        backend: backend.describe().backend,
        fixed: tiling(duel.first, &judges[0])?,
        multiresolution: tiling(duel.second, &judges[1])?,
        ratio: duel.ratio,
    })
}

fn line(row: &TableRow) -> String {
    let ms = |s: &Spread| format!("{:>7.1} ({:.1} to {:.1})", s.median, s.min, s.max);
    let verdict = |c: &Tiling| c.complaint.as_deref().unwrap_or("ok").to_owned();
    format!(
        "{:<18} {:<8} {:>4} {:>12} {:>5}  {:<15} {:<7} {:<26} {:<26} {:<26} {:<9} {:>11.2e} {:>8.2e} {:>11.2e} {:>8.2e}  {}, {}",
        row.data,
        row.view,
        row.side,
        row.fixed.drawn.n_bricks,
        row.multiresolution.drawn.n_bricks,
        row.geometry,
        row.backend,
        ms(&row.fixed.ms),
        ms(&row.multiresolution.ms),
        row.ratio.to_string(),
        words(&row.ratio),
        row.fixed.error.rmse,
        row.multiresolution.error.rmse,
        row.fixed.error.max,
        row.multiresolution.error.max,
        verdict(&row.fixed),
        verdict(&row.multiresolution),
    )
}

/// Which is faster, in a word.
fn words(ratio: &Ratio) -> &'static str {
    match ratio.standing(1.0) {
        Standing::Above => "faster",
        Standing::Below => "slower",
        Standing::Undecided => "undecided",
    }
}

/// The paper's claim: from near, multiresolution is faster. Where both draw the same bricks, there is nothing to gain.
fn claims(rows: &[TableRow]) -> Vec<Claim> {
    let near = rows.iter().filter(|row| row.view != "outside" && row.fixed.drawn != row.multiresolution.drawn);
    let claim = |row: &TableRow| Claim::of_ratio(format!("{}: fixed / multi", name(row)), row.ratio, Bound::Above(1.0));
    near.map(claim).collect()
}

fn name(row: &TableRow) -> String {
    format!("{}, {}, {}^3, {}, {}", row.data, row.view, row.side, row.geometry, row.backend)
}

/// The claims that do not hold: about times, about bricks, about pictures.
fn missed(rows: &[TableRow], claims: &[Claim]) -> Vec<Missed> {
    let of_times = claims.iter().filter_map(Missed::of_claim);
    let alike = rows.iter().filter(|row| row.view != "outside" && row.fixed.drawn == row.multiresolution.drawn);
    let alike =
        alike.map(|row| format!("{}: the same bricks both ways, {} of them", name(row), row.fixed.drawn.n_bricks));
    let wrong = rows.iter().filter_map(|row| {
        let why = row.fixed.complaint.as_ref().or(row.multiresolution.complaint.as_ref())?;
        Some(format!("{}: {why}", name(row)))
    });
    of_times.chain(alike.map(Missed::of_times)).chain(wrong.map(Missed::of_pictures)).collect()
}
