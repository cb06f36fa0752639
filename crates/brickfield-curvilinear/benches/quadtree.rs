//! Memory and times of the hierarchy, selections and meshes; errors of selections, next to uniform grids.
//!
//! `cargo bench -p brickfield-curvilinear --profile dev -- [ZONES ...]` builds terrains of ZONES x ZONES zones (default 1024 and 4096).
//! With `BRICKFIELD_DATA`, the elevations of `dem/N00E010.hgt` are compared, too.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use brickfield_core::glam::{DVec3, UVec2};
use brickfield_core::{Camera, Projection};
use brickfield_curvilinear::{
    BudgetSelector, CurvilinearGrid, HeightField, Positions, QuadTree, Selection, SelectionWork, SizeSelector,
    SurrogateMesh, View, surrogate_mesh,
};
use rayon::prelude::*;

fn main() {
    let sizes: Vec<u32> = std::env::args().skip(1).filter_map(|argument| argument.parse().ok()).collect();
    let sizes = if sizes.is_empty() { vec![1024, 4096] } else { sizes };
    for n in sizes {
        let tree = build(n);
        select(&tree);
        if n <= 4096 {
            compare(&format!("generated terrain, {n} x {n} zones"), &tree);
        }
    }
    if let Some(tree) = elevations() {
        compare("N00E010.hgt", &tree);
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

fn elevations() -> Option<Arc<QuadTree>> {
    let path = PathBuf::from(std::env::var_os("BRICKFIELD_DATA")?).join("dem/N00E010.hgt");
    let bytes = std::fs::read(&path).map_err(|error| eprintln!("{}: {error}", path.display())).ok()?;
    let values: Vec<f32> = bytes.chunks_exact(2).map(|two| hgt_value(i16::from_be_bytes([two[0], two[1]]))).collect();
    let n = values.len().isqrt() as u32 - 1;
    let field = HeightField {
        origin: DVec3::ZERO,
        along_column: DVec3::X * 90.0,
        along_row: DVec3::Y * -90.0,
        along_value: DVec3::Z,
    };
    let grid = CurvilinearGrid::new(n, n, Positions::Heights(field), values).expect("a square of posts");
    Some(Arc::new(QuadTree::build(grid)))
}

/// The same nodes with stored positions.
fn stored(grid: &CurvilinearGrid) -> CurvilinearGrid {
    let nodes = (0..=grid.n_rows()).flat_map(|row| (0..=grid.n_columns()).map(move |column| (row, column)));
    let at = |(row, column)| grid.position(brickfield_curvilinear::Node { row, column }).as_vec3();
    let positions = Positions::Offsets { origin: DVec3::ZERO, offsets: nodes.map(at).collect() };
    let (n_rows, n_columns) = (grid.n_rows(), grid.n_columns());
    CurvilinearGrid::new(n_rows, n_columns, positions, grid.values().to_vec()).expect("a plain grid")
}

fn build(n: u32) -> Arc<QuadTree> {
    let tree = built(&format!("{n} x {n} zones"), terrain(n));
    if n <= 4096 {
        built("  with stored positions (f32)", stored(tree.grid()));
    }
    Arc::new(tree)
}

/// A large grid is built once: it is not copied for another turn.
fn built(what: &str, grid: CurvilinearGrid) -> QuadTree {
    let n_turns = if grid.n_rows() > 2048 { 0 } else { 5 };
    let more = if n_turns > 0 { turns(n_turns, || QuadTree::build(grid.clone())) } else { String::new() };
    let start = Instant::now();
    let tree = QuadTree::build(grid);
    let once = format!("{:.0} ms", start.elapsed().as_secs_f64() * 1e3);
    let account = tree.byte_account();
    println!(
        "{what}: {} stored zones of {} bytes, {:.1} MiB; data {:.1} MiB, ratio {:.2}; built in {}",
        account.n_stored_zones,
        account.bytes_per_zone,
        mib(account.hierarchy_bytes),
        mib(account.data_bytes),
        account.ratio(),
        if n_turns > 0 { more } else { once },
    );
    tree
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

fn select(tree: &Arc<QuadTree>) {
    let fresh = |step| {
        let mut by_size = SizeSelector::new(tree.clone(), 8.0).expect("a granularity");
        let work = by_size.update(&flight(tree, step));
        (by_size, work)
    };
    let (mut by_size, work) = fresh(0);
    report("by size, 8 pixels, from nothing", &turns(5, || fresh(0)), work, by_size.selection());
    let mut step = 0;
    let mut last = SelectionWork::default();
    let times = turns(9, || {
        step += 1;
        last = by_size.update(&flight(tree, step));
    });
    report("  20 m further", &times, last, by_size.selection());
    report_mesh(tree, by_size.selection());

    let fresh = |step| {
        let mut by_error = BudgetSelector::new(tree.clone());
        let work = by_error.update(&flight(tree, step), 50_000);
        (by_error, work)
    };
    let (mut by_error, work) = fresh(0);
    report("by error, 50,000 zones, from nothing", &turns(5, || fresh(0)), work, by_error.selection());
    let mut step = 0;
    let times = turns(9, || {
        step += 1;
        last = by_error.update(&flight(tree, step), 50_000);
    });
    report("  20 m further", &times, last, by_error.selection());
    report_mesh(tree, by_error.selection());
}

fn report_mesh(tree: &QuadTree, selection: &Selection) {
    let time = turns(7, || mesh(tree, selection));
    println!("    mesh of {} triangles in {time}", mesh(tree, selection).triangles.len());
}

fn report(what: &str, times: &str, work: SelectionWork, selection: &Selection) {
    println!("  {what}: {} zones, {} looked at, {times}", selection.n_leaves(), work.n_visited);
}

/// The whole grid from above.
fn above(tree: &QuadTree) -> View {
    let extent = tree.extent(tree.layout().root());
    let (middle, height) = (extent.center(), 2.0 * extent.diagonal());
    let camera = Camera::look_at(middle + DVec3::Z * height, middle, DVec3::Y, Projection::Orthographic { height });
    View::new(camera.expect("a camera"), UVec2::splat(1000)).expect("a picture")
}

/// Errors in per cent of the values' range: of a uniform grid, and of the greedy selection with as many zones; then with the numbers of
/// polygons of table 1.
fn compare(what: &str, tree: &Arc<QuadTree>) {
    let values = tree.grid().values();
    let low = values.iter().fold(f32::INFINITY, |low, v| low.min(*v));
    let high = values.iter().fold(f32::NEG_INFINITY, |high, v| high.max(*v));
    println!("{what}: values from {low} to {high}; error in % of this range");
    println!(
        "| level | zones | triangles | uniform: all data | greedy: triangles | of zones | of the mesh, all data | the same, vertices not moved |"
    );
    let percent = |error: f32| 100.0 * error / (high - low);
    let view = above(tree);
    let layout = tree.layout();
    for level in layout.levels().skip(1).filter(|level| (100..200_000).contains(&layout.n_zones(*level))) {
        let zones = (0..layout.n_zones(level)).map(|i| layout.zone_at(level, i));
        let Ok(uniform) = Selection::of_leaves(tree, zones) else { continue };
        let n_triangles = 2 * uniform.n_leaves();
        let [of_uniform, ..] = errors(tree, &uniform);
        println!(
            "| {} | {} | {n_triangles} | {:.2} | {}",
            level.0,
            uniform.n_leaves(),
            percent(of_uniform),
            greedy(tree, &view, uniform.n_leaves(), percent)
        );
    }
    for budget in [934, 2_290, 13_654, 57_884] {
        println!("| table 1 | {budget} | | | {}", greedy(tree, &view, budget, percent));
    }
}

fn greedy(tree: &Arc<QuadTree>, view: &View, budget: usize, percent: impl Fn(f32) -> f32) -> String {
    let mut selector = BudgetSelector::new(tree.clone());
    selector.update(view, budget);
    let drawn = mesh(tree, selector.selection());
    let [of_zones, of_mesh] = errors(tree, selector.selection());
    let values = drawn.nodes.iter().map(|node| tree.grid().value(*node)).collect();
    let of_stitched = deviation(tree.grid(), &SurrogateMesh { values, ..drawn.clone() });
    let [of_zones, of_mesh, of_stitched] = [of_zones, of_mesh, of_stitched].map(percent);
    format!("{} | {of_zones:.2} | {of_mesh:.2} | {of_stitched:.2} |", drawn.triangles.len())
}

/// The greatest error that zones say, and the greatest deviation of a node from the drawn mesh, patches included.
fn errors(tree: &QuadTree, selection: &Selection) -> [f32; 2] {
    let drawn = mesh(tree, selection);
    [selection.greatest_error(tree), deviation(tree.grid(), &drawn)]
}

fn mesh(tree: &QuadTree, selection: &Selection) -> SurrogateMesh {
    surrogate_mesh(tree.grid(), selection).expect("a selection of the tree")
}

/// Looks at every node below every triangle of a height field's mesh.
fn deviation(grid: &CurvilinearGrid, mesh: &SurrogateMesh) -> f32 {
    let of_triangle = |triangle: &[u32; 3]| {
        let p = triangle.map(|v| mesh.nodes[v as usize]).map(|n| [f64::from(n.column), f64::from(n.row)]);
        let v = triangle.map(|v| f64::from(mesh.values[v as usize]));
        let cross =
            |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        let area = cross(p[0], p[1], p[2]);
        let ends =
            |axis: usize| [p[0][axis].min(p[1][axis]).min(p[2][axis]), p[0][axis].max(p[1][axis]).max(p[2][axis])];
        let ([left, right], [top, bottom]) = (ends(0), ends(1));
        let mut most: f64 = 0.0;
        for row in top as u32..=bottom as u32 {
            for column in left as u32..=right as u32 {
                let at = [f64::from(column), f64::from(row)];
                let weights = [cross(at, p[1], p[2]), cross(p[0], at, p[2]), cross(p[0], p[1], at)];
                if weights.iter().all(|w| *w >= 0.0) {
                    let drawn = (0..3).map(|i| weights[i] * v[i]).sum::<f64>() / area;
                    let value = f64::from(grid.value(brickfield_curvilinear::Node { row, column }));
                    most = most.max((value - drawn).abs());
                }
            }
        }
        most
    };
    mesh.triangles.iter().map(of_triangle).fold(0.0, f64::max) as f32
}

/// Median and spread of some turns, in milliseconds.
fn turns<T>(n: usize, mut turn: impl FnMut() -> T) -> String {
    let mut one = || {
        let start = Instant::now();
        let made = turn();
        let seconds = start.elapsed().as_secs_f64();
        drop(made);
        seconds * 1e3
    };
    let mut times: Vec<f64> = (0..n).map(|_| one()).collect();
    times.sort_by(f64::total_cmp);
    let median = times[n / 2];
    format!("{median:.2} ms ({:.2} to {:.2})", times[0], times[n - 1])
}

fn mib(bytes: usize) -> f64 {
    bytes as f64 / f64::from(1 << 20)
}

/// An elevation of an HGT file in metres; NaN, a hole, for its void mark.
fn hgt_value(elevation: i16) -> f32 {
    if elevation == i16::MIN { f32::NAN } else { f32::from(elevation) }
}
