//! Table 1: fixed tiles against multiresolution.

use brickfield::Scene;
use brickfield::bricks::{BrickTree, Downsampling};
use brickfield::frame::Backend;
use brickfield::lod::Criterion;
use brickfield_core::{Camera, Image};
use serde::Serialize;

use super::measure::{Distance, Drawn, Judge, Outcome, Spread, answer, distance, duel};
use super::scenes::{Exhibit, Geometry, exhibits, geometries, geometries_of, scene, sides, tree, views};
use super::{LamarArgs, LamarError, Missed, print, write_rows};
use crate::compare::rivals::Rivals;

/// A line of the table: one data set, view, tile size, geometry and backend.
#[derive(Clone, Debug, Serialize)]
struct Row {
    data: String,
    dims: [u32; 3],
    view: &'static str,
    side: u32,
    geometry: &'static str,
    backend: &'static str,
    fixed: Cell,
    multiresolution: Cell,
    /// Fixed over multiresolution: the median over rounds in which they took turns.
    ratio: f64,
    n_rounds: usize,
}

/// One way of drawing.
#[derive(Clone, Debug, Serialize)]
struct Cell {
    drawn: Drawn,
    ms: Spread,
    /// Of those, selection, order and polygons.
    prepare_ms: Spread,
    error: Distance,
    /// Why the picture is not within the rule of its own cut's f64 reference.
    complaint: Option<String>,
}

/// One tree seen from one place.
struct Seat<'a> {
    exhibit: &'a Exhibit,
    tree: &'a BrickTree,
    camera: Camera,
    view: &'static str,
    side: u32,
    answer: &'a Image<f64>,
}

pub(super) fn run(args: &LamarArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, LamarError> {
    print(&format!(
        "{} x {} pixels, steps of {} voxel(s) of level 0, 2^level of them in coarser bricks (subsampled); times are medians of {} frames or more from\n\
         the scene to the picture (selection, order and polygons included, bricks resident), the ratio is that of rounds in which both took turns; errors are against the continuous integral\n\
         at full resolution; \"ok\": within the rule of the f64 sum of the same cut, nothing culled.\n",
        args.size.x, args.size.y, args.step, args.frames
    ))?;
    print(HEADER)?;
    let mut rows = Vec::new();
    for exhibit in exhibits(args)? {
        let exhibit = exhibit?;
        let views = views(&exhibit, args.size)?;
        let full = geometries(args)[3];
        let answers =
            views.map(|(_, camera)| answer(&exhibit.volume, &scene(args, &exhibit.transfer, camera, full, &[])));
        for side in sides(args) {
            let tree = tree(&exhibit.volume, side, Downsampling::Subsample)?;
            for ((view, camera), answer) in views.into_iter().zip(&answers) {
                let seat = Seat { exhibit: &exhibit, tree: &tree, camera, view, side: side.n_samples(), answer };
                rows.extend(of_seat(args, rivals, &seat)?);
            }
        }
    }
    write_rows(args, "table.json", &rows)?;
    Ok(missed(&rows))
}

const HEADER: &str = "\
data               view     side  tiles: fixed multi  geometry        backend  fixed ms (min to max)      multi ms (min to max)      ratio  \
RMSE: fixed    multi  max: fixed    multi  as the cut says";

fn of_seat(args: &LamarArgs, rivals: &mut Rivals, seat: &Seat<'_>) -> Result<Vec<Row>, LamarError> {
    let mut rows = Vec::new();
    for geometry in geometries(args) {
        let with = |detail: &[Criterion]| scene(args, &seat.exhibit.transfer, seat.camera, geometry, detail);
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

/// Most rounds of a row in which it stays in doubt which is faster, for each that is asked for.
const MOST_ROUNDS: u32 = 27;

/// Fixed and multiresolution take turns.
fn contest(
    args: &LamarArgs,
    backend: &mut dyn Backend,
    seat: &Seat<'_>,
    geometry: Geometry,
    (scenes, judges): (&[Scene; 2], &[Judge; 2]),
) -> Result<Row, LamarError> {
    let duel = duel(seat.tree, scenes, backend, args.frames..=args.frames.saturating_mul(MOST_ROUNDS))?;
    let cell = |outcome: Outcome, judge: &Judge| -> Result<Cell, LamarError> {
        let (error, complaint) = (distance(&outcome.image, seat.answer)?, judge.complaint(&outcome.image));
        let Outcome { drawn, ms, prepare_ms, .. } = outcome;
        Ok(Cell { drawn, ms, prepare_ms, error, complaint })
    };
    Ok(Row {
        data: seat.exhibit.name.clone(),
        dims: seat.exhibit.volume.grid().dims().to_array(),
        view: seat.view,
        side: seat.side,
        geometry: geometry.name,
        backend: backend.describe().backend,
        fixed: cell(duel.first, &judges[0])?,
        multiresolution: cell(duel.second, &judges[1])?,
        ratio: duel.ratio,
        n_rounds: duel.n_rounds,
    })
}

fn line(row: &Row) -> String {
    let ms = |s: &Spread| format!("{:>7.1} ({:.1} to {:.1})", s.median, s.min, s.max);
    let verdict = |c: &Cell| c.complaint.as_deref().unwrap_or("ok").to_owned();
    format!(
        "{:<18} {:<8} {:>4} {:>12} {:>5}  {:<15} {:<7} {:<26} {:<26} {:>5.2}  {:>10.2e} {:>8.2e} {:>11.2e} {:>8.2e}  {}, {}",
        row.data,
        row.view,
        row.side,
        row.fixed.drawn.n_bricks,
        row.multiresolution.drawn.n_bricks,
        row.geometry,
        row.backend,
        ms(&row.fixed.ms),
        ms(&row.multiresolution.ms),
        row.ratio,
        row.fixed.error.rmse,
        row.multiresolution.error.rmse,
        row.fixed.error.max,
        row.multiresolution.error.max,
        verdict(&row.fixed),
        verdict(&row.multiresolution),
    )
}

/// What the paper claims and a row does not show.
fn missed(rows: &[Row]) -> Vec<Missed> {
    let name = |r: &Row| format!("{}, {}, {}^3, {}, {}", r.data, r.view, r.side, r.geometry, r.backend);
    let wrong = |r: &Row| r.fixed.complaint.clone().or_else(|| r.multiresolution.complaint.clone());
    let not_faster = rows.iter().filter(|r| r.view != "outside").filter_map(|r| {
        let Row { fixed, multiresolution, ratio, n_rounds, .. } = r;
        match fixed.drawn == multiresolution.drawn {
            true => Some(format!("{}: the same bricks both ways, {} of them", name(r), fixed.drawn.n_bricks)),
            false if *ratio <= 1.0 => Some(format!("{}: {ratio:.2} times as fast over {n_rounds} rounds", name(r))),
            false => None,
        }
    });
    let wrong = rows.iter().filter_map(|r| wrong(r).map(|why| format!("{}: {why}", name(r))));
    let (not_faster, wrong) = (not_faster.map(Missed::of_times), wrong.map(Missed::of_pictures));
    not_faster.chain(wrong).collect()
}
