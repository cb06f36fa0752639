//! Preparing a frame of 65,536 bricks: again, from another side, and with a brick more; and the bytes that a brick more costs.

use std::sync::OnceLock;

use brickfield::bricks::{BrickTree, BuildOptions, build_tree};
use brickfield::core::glam::{DVec3, UVec2, UVec3};
use brickfield::core::{BrickId, BrickSide, Camera, Grid, Knot, Level, TransferFunction, Volume};
use brickfield::lod::{Answer, Selection, Tile, select_by};
use brickfield::{BackendKind, Residency, Scene, Validation, open_backend, prepare, prepare_selection};

/// Bricks of 16 along x, y, z.
const BRICKS: UVec3 = UVec3::new(64, 32, 32);

fn main() {
    print_bytes();
    divan::main();
}

fn tree() -> &'static BrickTree {
    static TREE: OnceLock<BrickTree> = OnceLock::new();
    TREE.get_or_init(|| {
        let dims = BRICKS * 15 + 1;
        let grid = Grid::axis_aligned(dims, DVec3::ONE).expect("a grid");
        // Bands along x: every brick has dark parts and visible ones.
        let values = (0..grid.n_voxels()).map(|i| (i % dims.x as usize % 15 * 16) as u8).collect::<Vec<u8>>();
        let options = BuildOptions { side: BrickSide::S16, ..BuildOptions::default() };
        build_tree(&Volume::new(grid, values).expect("a value for each voxel"), &options).expect("the tree fits")
    })
}

/// A view of all bricks.
fn scene(degrees: f64) -> Scene {
    let from = DVec3::new(degrees.to_radians().cos(), degrees.to_radians().sin(), 0.3);
    let camera = Camera::framing(&tree().grid().world_box(), from, DVec3::Z).expect("a box has a view");
    let knots = [(60.0, 0.0), (200.0, 0.02)].map(|(value, extinction)| Knot { value, extinction, color: [1.0; 3] });
    let transfer = TransferFunction::new(knots.to_vec()).expect("knots ascend");
    Scene::new(camera, UVec2::splat(512), transfer)
}

/// All bricks, or all but one in the middle.
fn selections() -> [Selection; 2] {
    let middle = BrickId { level: Level(0), coords: BRICKS / 2 };
    let but_middle = |tile: &Tile<'_>| if tile.id() == middle { Answer::Ignore } else { Answer::Descend };
    let all = |_: &Tile<'_>| Answer::Descend;
    let (layout, grid) = (tree().layout(), tree().grid());
    [select_by(layout, grid, all), select_by(layout, grid, but_middle)]
}

/// The bytes that are copied and uploaded for a frame with a brick more than the last.
fn print_bytes() {
    let [all, all_but_one] = selections();
    let mut small = scene(30.0);
    small.size = UVec2::splat(64);
    for kind in BackendKind::ALL {
        let Ok(mut backend) = open_backend(kind, None, Validation::Off) else { continue };
        let mut residency = Residency::default();
        let mut draw = |selection| {
            let plan = prepare_selection(tree(), &small, selection, &mut residency).expect("a plan");
            let frame = backend.render(&plan).expect("a frame");
            (residency.copied(), frame.uploaded_bytes)
        };
        let ((before, uploaded_before), (copied, uploaded)) = (draw(&all_but_one), draw(&all));
        println!(
            "{kind}: first {} bricks, {} bytes copied, {uploaded_before} uploaded; then {} more, {} bytes copied, \
             {uploaded} uploaded",
            before.n_bricks, before.n_bytes, copied.n_bricks, copied.n_bytes
        );
    }
}

#[divan::bench(sample_count = 50)]
fn unchanged_frame(bencher: divan::Bencher) {
    let (scene, mut residency) = (scene(30.0), Residency::default());
    prepare(tree(), &scene, &mut residency).expect("a plan");
    bencher.bench_local(|| prepare(tree(), &scene, &mut residency));
}

/// The camera turns by a degree; the bricks stay.
#[divan::bench(sample_count = 20)]
fn turned_camera(bencher: divan::Bencher) {
    let mut residency = Residency::default();
    let mut degrees = 30.0;
    bencher.bench_local(|| {
        degrees += 1.0;
        prepare(tree(), &scene(degrees), &mut residency)
    });
}

/// A brick comes and goes.
#[divan::bench(sample_count = 20)]
fn a_brick_more_or_less(bencher: divan::Bencher) {
    let (scene, selections, mut residency) = (scene(30.0), selections(), Residency::default());
    let mut i = 0;
    bencher.bench_local(|| {
        i = 1 - i;
        prepare_selection(tree(), &scene, &selections[i], &mut residency)
    });
}

/// Everything anew.
#[divan::bench(sample_count = 5)]
fn first_frame(bencher: divan::Bencher) {
    let scene = scene(30.0);
    bencher.bench_local(|| prepare(tree(), &scene, &mut Residency::default()));
}
