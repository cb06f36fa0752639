//! Table 1: frame rates, polygons and errors.

use std::sync::Arc;

use brickfield::curvilinear::{BudgetSelector, FrameTarget, FrameTime, PredictiveBudget, View, surrogate_mesh};
use brickfield::frame::Backend;
use serde::Serialize;

use super::WynnArgs;
use super::data::{Terrain, terrains, timed_frame};
use super::deviation::{Triangles, deviation};
use crate::compare::rivals::Rivals;
use crate::metrics::median;
use crate::paper::{Missed, PaperError, print};

/// A line of the table.
#[derive(Clone, Debug, Serialize)]
struct TableRow {
    data: String,
    backend: &'static str,
    /// Frames a second that were asked for, or polygons.
    asked: String,
    frames_per_second: f64,
    n_zones: usize,
    n_triangles: usize,
    /// The greatest error of a zone, in % of the values' range.
    error_percent: f64,
    /// The greatest deviation of any node from the mesh, patches included.
    deviation_percent: f64,
}

/// What the paper's table says of the San Francisco Bay, on an SGI Indigo2 IMPACT: frames a second, polygons, error in %.
const PAPER: [(f64, usize, f64); 4] =
    [(10.0, 934, 25.8), (5.0, 2_290, 19.3), (1.0, 13_654, 10.45), (0.2, 57_884, 4.71)];
/// Frames until a budget has settled.
const SETTLING: usize = 6;

pub(super) fn run(args: &WynnArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, PaperError> {
    let size = args.common.size;
    print(&format!(
        "{} x {} pixels, from above. Frames: from the view to the picture in memory; polygons: zones. Error: of zones, as in the paper; deviation: of all nodes from the drawn mesh.\n\
         The paper, on other elevations and a machine of 1997: {}.\n",
        size.x,
        size.y,
        PAPER.map(|(fps, n, error)| format!("{fps} frames/s, {n} polygons, {error} %")).join("; ")
    ))?;
    let mut rows = Vec::new();
    for terrain in terrains(args)? {
        let terrain = terrain?;
        let view = terrain.seen_from_above(size, 1.0)?;
        print(&format!("{}: {} to {}", terrain.name, terrain.range.min, terrain.range.max))?;
        for backend in &mut rivals.present {
            print("  backend  asked for          frames/s    zones  triangles   error %   deviation %")?;
            for (fps, n_polygons, _) in PAPER {
                let of_rate = at_frame_rate(args, &terrain, &view, backend.as_mut(), fps)?;
                let of_number = at_budget(args, &terrain, &view, backend.as_mut(), n_polygons)?;
                for row in [of_rate, of_number] {
                    print(&line(&row))?;
                    rows.push(row);
                }
            }
        }
        picture(args, &terrain, &view, rivals)?;
    }
    args.common.write_rows("table.json", &rows)?;
    Ok(Vec::new())
}

/// As many zones as a frame rate allows, found by feedback.
fn at_frame_rate(
    args: &WynnArgs,
    terrain: &Terrain,
    view: &View,
    backend: &mut dyn Backend,
    fps: f64,
) -> Result<TableRow, PaperError> {
    let most = terrain.tree.layout().n_zones(brickfield_core::Level(0)) as u32;
    let target = FrameTarget::new(1.0 / fps, 1, most).expect("a rate above 0");
    let mut budget = PredictiveBudget::new(target, 1000);
    let mut selector = BudgetSelector::new(Arc::clone(&terrain.tree));
    let mut times = Vec::new();
    for i in 0..SETTLING + args.common.frames as usize {
        let (_, _, seconds) = timed_frame(backend, || {
            selector.update(view, budget.budget() as usize);
            terrain.plan(view, selector.selection(), None)
        })?;
        let n_polygons = selector.selection().n_leaves() as u32;
        // A frame that is drawn takes some time.
        budget.observe(FrameTime { n_polygons, seconds: seconds.max(1e-6) }).expect("a time");
        if i >= SETTLING {
            times.push(seconds);
        }
    }
    row(terrain, &selector, backend, format!("{fps} frames/s"), median(times))
}

fn at_budget(
    args: &WynnArgs,
    terrain: &Terrain,
    view: &View,
    backend: &mut dyn Backend,
    n_polygons: usize,
) -> Result<TableRow, PaperError> {
    let mut selector = BudgetSelector::new(Arc::clone(&terrain.tree));
    let mut times = Vec::new();
    for _ in 0..=args.common.frames {
        let (_, _, seconds) = timed_frame(backend, || {
            selector.update(view, n_polygons);
            terrain.plan(view, selector.selection(), None)
        })?;
        times.push(seconds);
    }
    row(terrain, &selector, backend, format!("{n_polygons} polygons"), median(times.split_off(1)))
}

fn row(
    terrain: &Terrain,
    selector: &BudgetSelector,
    backend: &dyn Backend,
    asked: String,
    seconds: f64,
) -> Result<TableRow, PaperError> {
    let (tree, selection) = (&terrain.tree, selector.selection());
    let mesh = surrogate_mesh(tree.grid(), selection).expect("a selection of the tree");
    let triangles = Triangles { nodes: &mesh.nodes, values: &mesh.values, corners: &mesh.triangles };
    Ok(TableRow {
        data: terrain.name.clone(),
        backend: backend.describe().backend,
        asked,
        frames_per_second: 1.0 / seconds,
        n_zones: selection.n_leaves(),
        n_triangles: mesh.triangles.len(),
        error_percent: terrain.percent(selection.greatest_error(tree).into()),
        deviation_percent: terrain.percent(deviation(tree.grid(), &triangles)),
    })
}

fn line(row: &TableRow) -> String {
    format!(
        "  {:<8} {:<16} {:>10.2} {:>8} {:>10} {:>9.2} {:>13.2}",
        row.backend,
        row.asked,
        row.frames_per_second,
        row.n_zones,
        row.n_triangles,
        row.error_percent,
        row.deviation_percent
    )
}

/// Figures 11 to 14: the terrain with the paper's numbers of polygons, drawn by the first backend.
fn picture(args: &WynnArgs, terrain: &Terrain, view: &View, rivals: &mut Rivals) -> Result<(), PaperError> {
    let Some(backend) = rivals.present.first_mut() else { return Ok(()) };
    let stem = terrain.stem();
    for (_, n_polygons, _) in PAPER {
        let mut selector = BudgetSelector::new(Arc::clone(&terrain.tree));
        selector.update(view, n_polygons);
        let (_, frame, _) = timed_frame(backend.as_mut(), || terrain.plan(view, selector.selection(), None))?;
        let what = format!("{}, {} zones", terrain.name, selector.selection().n_leaves());
        args.common.write_picture(&format!("wynn-{stem}-{n_polygons}"), &frame.image(), &what)?;
    }
    Ok(())
}
