//! Generated grids: time to build, bytes of a zone, time to select, memory.

use std::sync::Arc;
use std::time::Instant;

use brickfield::curvilinear::{
    BudgetSelector, CurvilinearGrid, HeightField, Positions, QuadTree, Selection, SelectionWork, SizeSelector, View,
    surrogate_mesh,
};
use brickfield_core::glam::{DVec3, UVec2};
use brickfield_core::{Camera, Projection};
use rayon::prelude::*;
use serde::Serialize;

use super::WynnArgs;
use crate::memory::{peak, restart_peak};
use crate::metrics::median;
use crate::paper::{Missed, PaperError, mib, print};

/// A grid and its hierarchy.
#[derive(Clone, Debug, Serialize)]
struct LargeRow {
    n_zones: u32,
    build_seconds: f64,
    data_bytes: u64,
    hierarchy_bytes: u64,
    /// Bytes of a stored zone, and of the hierarchy over all final zones.
    bytes_per_zone: u64,
    bytes_per_final_zone: f64,
    /// The peak of the process while it builds; `None` where the system does not tell.
    peak_bytes: Option<u64>,
    selections: Vec<SelectionRow>,
}

/// A selection: from nothing, and after a step of the flight.
#[derive(Clone, Debug, Serialize)]
struct SelectionRow {
    what: String,
    n_zones: usize,
    first_ms: f64,
    first_visited: usize,
    next_ms: f64,
    next_visited: usize,
    n_triangles: usize,
    mesh_ms: f64,
}

pub(super) fn run(args: &WynnArgs) -> Result<Vec<Missed>, PaperError> {
    print(
        "Height fields of as many zones a side, built once; selections of a flight near the ground, 1920 x 1080 pixels: from nothing, and 20 m further.\n",
    )?;
    let mut rows = Vec::new();
    for n in &args.large_zones {
        let row = measure(args, *n);
        let LargeRow { build_seconds, data_bytes, hierarchy_bytes, bytes_per_zone, bytes_per_final_zone, .. } = row;
        let peak = row.peak_bytes.map_or("unknown".to_owned(), |bytes| format!("{:.0} MiB", mib(bytes)));
        print(&format!(
            "{n} x {n} zones: built in {build_seconds:.2} s; {bytes_per_zone} bytes a stored zone, {bytes_per_final_zone:.2} bytes a final zone; hierarchy {:.1} MiB, {:.2} of the data's {:.1} MiB; peak of the process {peak}",
            mib(hierarchy_bytes),
            hierarchy_bytes as f64 / data_bytes as f64,
            mib(data_bytes)
        ))?;
        for s in &row.selections {
            print(&format!(
                "  {}: {} zones in {:.1} ms ({} looked at), then {:.2} ms ({} looked at); {} triangles in {:.0} ms",
                s.what, s.n_zones, s.first_ms, s.first_visited, s.next_ms, s.next_visited, s.n_triangles, s.mesh_ms
            ))?;
        }
        rows.push(row);
    }
    args.common.write_rows("large.json", &rows)?;
    Ok(Vec::new())
}

fn measure(args: &WynnArgs, n: u32) -> LargeRow {
    let grid = terrain(n);
    restart_peak();
    let begin = Instant::now();
    let tree = Arc::new(QuadTree::build(grid));
    let build_seconds = begin.elapsed().as_secs_f64();
    let peak_bytes = peak();
    let account = tree.byte_account();
    let n_final = f64::from(n) * f64::from(n);
    let mut by_size = SizeSelector::new(Arc::clone(&tree), 8.0).expect("above 0");
    let mut by_error = BudgetSelector::new(Arc::clone(&tree));
    let of_size = flown(args, &tree, "zones of 8 pixels", |view| {
        let work = by_size.update(view);
        (work, by_size.selection().clone())
    });
    let of_error = flown(args, &tree, "50,000 zones by error", |view| {
        let work = by_error.update(view, 50_000);
        (work, by_error.selection().clone())
    });
    LargeRow {
        n_zones: n,
        build_seconds,
        data_bytes: account.data_bytes as u64,
        hierarchy_bytes: account.hierarchy_bytes as u64,
        bytes_per_zone: account.bytes_per_zone as u64,
        bytes_per_final_zone: account.hierarchy_bytes as f64 / n_final,
        peak_bytes,
        selections: vec![of_size, of_error],
    }
}

fn flown(
    args: &WynnArgs,
    tree: &QuadTree,
    what: &str,
    mut select: impl FnMut(&View) -> (SelectionWork, Selection),
) -> SelectionRow {
    let mut timed = |step| {
        let view = flight(tree, step);
        let begin = Instant::now();
        let (work, selection) = select(&view);
        (begin.elapsed().as_secs_f64() * 1e3, work, selection)
    };
    let (first_ms, first, _) = timed(0);
    let next: Vec<_> = (1..=args.common.frames).map(&mut timed).collect();
    let (_, last, selection) = next.last().expect("at least one frame");
    let begin = Instant::now();
    let mesh = surrogate_mesh(tree.grid(), selection).expect("a selection of the tree");
    SelectionRow {
        what: what.to_owned(),
        n_zones: selection.n_leaves(),
        first_ms,
        first_visited: first.n_visited,
        next_visited: last.n_visited,
        next_ms: median(next.iter().map(|(ms, ..)| *ms).collect()),
        n_triangles: mesh.triangles.len(),
        mesh_ms: begin.elapsed().as_secs_f64() * 1e3,
    }
}

/// Values with mountains of all sizes, in metres; posts 30 m apart.
fn terrain(n: u32) -> CurvilinearGrid {
    let height = |row: u32, column: u32| {
        let (y, x) = (f64::from(row) / 1024.0, f64::from(column) / 1024.0);
        let octave = |i: i32| {
            let (f, turn) = (2f64.powi(i), 1.3 * f64::from(i));
            let (u, v) = (x * turn.cos() - y * turn.sin(), x * turn.sin() + y * turn.cos());
            (7.0 * f * u + f64::from(i)).sin() * (6.0 * f * v).cos() / f.powf(1.1)
        };
        let rough = 0.5 + 0.5 * (3.0 * x + 1.0).sin() * (2.0 * y).cos();
        (600.0 * (octave(0) + rough * (1..9).map(octave).sum::<f64>())) as f32
    };
    let rows = (0..=n).into_par_iter();
    let values = rows.flat_map_iter(|row| (0..=n).map(move |column| height(row, column))).collect();
    let field = HeightField {
        origin: DVec3::ZERO,
        along_column: DVec3::X * 30.0,
        along_row: DVec3::Y * 30.0,
        along_value: DVec3::Z,
    };
    CurvilinearGrid::new(n, n, Positions::Heights(field), values).expect("a plain grid")
}

/// A flight over the terrain, near the ground.
fn flight(tree: &QuadTree, step: u32) -> View {
    let extent = tree.extent(tree.layout().root());
    let middle = extent.center();
    let eye = DVec3::new(middle.x + 20.0 * f64::from(step), extent.min.y, extent.max.z + 1_000.0);
    let projection = Projection::Perspective { fov_y: 0.7 };
    let camera = Camera::look_at(eye, eye + DVec3::new(0.0, 1.0, -0.3), DVec3::Z, projection).expect("a camera");
    View::new(camera, UVec2::new(1920, 1080)).expect("a picture")
}
