//! Errors by number of triangles: zones, a uniform grid, and right-triangulated irregular networks.

use std::sync::Arc;

use brickfield::curvilinear::{BudgetSelector, CurvilinearGrid, Positions, QuadTree, Selection, View, surrogate_mesh};
use brickfield_core::glam::UVec2;
use serde::Serialize;

use super::WynnArgs;
use super::data::{Terrain, terrains};
use super::deviation::{Triangles, deviation};
use super::rtin::Rtin;
use crate::paper::{Missed, PaperError, print};

/// The errors of the paper's table 1, in per cent.
const ERRORS: [f64; 4] = [25.8, 19.3, 10.45, 4.71];

/// The fewest triangles with an error.
#[derive(Clone, Debug, Serialize)]
struct ErrorRow {
    data: String,
    error_percent: f64,
    /// By the error that the method itself states.
    zones_stated: Option<usize>,
    rtin_stated: Option<usize>,
    /// By the greatest deviation of any node.
    zones: Option<usize>,
    uniform: Option<usize>,
    rtin: Option<usize>,
}

/// A triangulation: how many triangles, the error that its method states, and the greatest deviation.
struct Sample {
    n_triangles: usize,
    stated: f64,
    actual: f64,
}

pub(super) fn run(args: &WynnArgs) -> Result<Vec<Missed>, PaperError> {
    print(
        "The fewest triangles with an error of at most so many per cent of the values' range, of a square of 2^k + 1 nodes a side; without a number, none has it.\n\
         Stated: by the error that the method works with (of zones: their own, as in the paper; of networks: the deviations of middles). Actual: by the greatest deviation\n\
         of any node from the triangle over it. Networks: right-triangulated, as Martini builds them.\n",
    )?;
    let mut rows = Vec::new();
    for terrain in terrains(args)? {
        let terrain = square(terrain?);
        let Some((terrain, k)) = terrain else {
            print("a terrain without a square of 65 x 65 nodes without holes is left out")?;
            continue;
        };
        let n = terrain.tree.grid().n_rows() + 1;
        print(&format!("{}, {n} x {n} nodes, {} to {}", terrain.name, terrain.range.min, terrain.range.max))?;
        print("   error %   zones, stated   networks, stated   zones, actual   uniform, actual   networks, actual")?;
        for row in compare(&terrain, k)? {
            let number = |n: Option<usize>| n.map_or("-".to_owned(), |n| n.to_string());
            print(&format!(
                "  {:>8.2} {:>15} {:>18} {:>15} {:>17} {:>18}",
                row.error_percent,
                number(row.zones_stated),
                number(row.rtin_stated),
                number(row.zones),
                number(row.uniform),
                number(row.rtin)
            ))?;
            rows.push(row);
        }
    }
    args.common.write_rows("errors.json", &rows)?;
    Ok(Vec::new())
}

/// A square of 2^k + 1 nodes without a hole, with the greatest k: the first one by rows, then columns. `None` if there is none of k = 6 or
/// more.
fn square(terrain: Terrain) -> Option<(Terrain, u32)> {
    let grid = terrain.tree.grid();
    let Positions::Heights(field) = grid.positions() else { return None };
    let most = grid.n_rows().min(grid.n_columns()).ilog2();
    let (k, [row, column]) = (6..=most).rev().find_map(|k| Some((k, without_holes(grid, 1 << k)?)))?;
    let (side, n_columns) = (1u32 << k, grid.n_columns() as usize + 1);
    let of_row =
        |r: u32| grid.values()[r as usize * n_columns + column as usize..][..side as usize + 1].iter().copied();
    let values: Vec<f32> = (row..=row + side).flat_map(of_row).collect();
    let square = CurvilinearGrid::new(side, side, Positions::Heights(*field), values).ok()?;
    Some((Terrain::new(terrain.name, square), k))
}

/// The first row and column of a square of so many zones without a hole.
fn without_holes(grid: &CurvilinearGrid, side: u32) -> Option<[u32; 2]> {
    let n = grid.n_columns() as usize + 1;
    // Holes above and to the left of each node, which is itself not counted.
    let mut before = vec![0u32; (grid.n_rows() as usize + 2) * (n + 1)];
    for (i, value) in grid.values().iter().enumerate() {
        let (row, column) = (i / n, i % n);
        let at = |r: usize, c: usize| r * (n + 1) + c;
        let above = before[at(row, column + 1)] - before[at(row, column)];
        before[at(row + 1, column + 1)] = before[at(row + 1, column)] + above + u32::from(value.is_nan());
    }
    let at = |row: u32, column: u32| before[row as usize * (n + 1) + column as usize];
    let n_holes = |row: u32, column: u32| {
        let end = side + 1;
        at(row + end, column + end) + at(row, column) - at(row, column + end) - at(row + end, column)
    };
    let places =
        (0..=grid.n_rows() - side).flat_map(|row| (0..=grid.n_columns() - side).map(move |column| [row, column]));
    places.into_iter().find(|[row, column]| n_holes(*row, *column) == 0)
}

fn compare(terrain: &Terrain, k: u32) -> Result<Vec<ErrorRow>, PaperError> {
    let view = terrain.seen_from_above(UVec2::splat(640), 1.0)?;
    let of_zones = zones(terrain, &view);
    let (of_rtin, of_uniform) = (networks(terrain, k), uniform(terrain));
    let fewest = |samples: &[Sample], error: fn(&Sample) -> f64, percent: f64| {
        // An error in per cent is rounded.
        let fits = |s: &&Sample| terrain.percent(error(s)) <= percent * (1.0 + 1e-12);
        samples.iter().filter(fits).map(|s| s.n_triangles).min()
    };
    let row = |percent: f64| ErrorRow {
        data: terrain.name.clone(),
        error_percent: percent,
        zones_stated: fewest(&of_zones, |s| s.stated, percent),
        rtin_stated: fewest(&of_rtin, |s| s.stated, percent),
        zones: fewest(&of_zones, |s| s.actual, percent),
        uniform: fewest(&of_uniform, |s| s.actual, percent),
        rtin: fewest(&of_rtin, |s| s.actual, percent),
    };
    Ok(ERRORS.map(row).into())
}

/// Numbers of zones that are tried: each 3 % more than the one before.
fn zones(terrain: &Terrain, view: &View) -> Vec<Sample> {
    let most = terrain.tree.layout().n_zones(brickfield_core::Level(0)) / 4;
    let budgets = std::iter::successors(Some(4.0f64), |n| Some(n * 1.03)).map(|n| n as usize).take_while(|n| *n < most);
    let mut selector = BudgetSelector::new(Arc::clone(&terrain.tree));
    let sample = |budget: usize| {
        selector.update(view, budget);
        of_selection(&terrain.tree, selector.selection())
    };
    budgets.map(sample).collect()
}

fn uniform(terrain: &Terrain) -> Vec<Sample> {
    let layout = terrain.tree.layout();
    let of_level = |level| {
        let zones = (0..layout.n_zones(level)).map(|i| layout.zone_at(level, i));
        Some(of_selection(&terrain.tree, &Selection::of_leaves(&terrain.tree, zones).ok()?))
    };
    layout.levels().skip(1).filter_map(of_level).collect()
}

fn of_selection(tree: &QuadTree, selection: &Selection) -> Sample {
    let mesh = surrogate_mesh(tree.grid(), selection).expect("a selection of the tree");
    let triangles = Triangles { nodes: &mesh.nodes, values: &mesh.values, corners: &mesh.triangles };
    Sample {
        n_triangles: mesh.triangles.len(),
        stated: selection.greatest_error(tree).into(),
        actual: deviation(tree.grid(), &triangles),
    }
}

/// Bounds that are tried: each 2 % less than the one before.
fn networks(terrain: &Terrain, k: u32) -> Vec<Sample> {
    let grid = terrain.tree.grid();
    let Some(rtin) = Rtin::new(grid, k) else { return Vec::new() };
    let range = terrain.range.max - terrain.range.min;
    let bounds =
        std::iter::successors(Some(0.3 * range), |bound| Some(bound * 0.98)).take_while(|bound| *bound > 0.005 * range);
    // The errors that are asked for are bounds, too.
    let bounds: Vec<f64> = bounds.chain(ERRORS.map(|percent| percent / 100.0 * range)).collect();
    let sample = |bound: f64| {
        let (nodes, corners) = rtin.triangles(bound as f32);
        let values: Vec<f32> = nodes.iter().map(|node| grid.value(*node)).collect();
        let triangles = Triangles { nodes: &nodes, values: &values, corners: &corners };
        Sample { n_triangles: corners.len(), stated: bound, actual: deviation(grid, &triangles) }
    };
    bounds.into_iter().map(sample).collect()
}
