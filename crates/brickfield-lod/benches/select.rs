//! Time to select from an octree of 32,768 leaves, and to order what is drawn.

use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{BrickId, BrickLayout, BrickSide, Camera, Grid, Projection, WorldPos};
use brickfield_lod::{Criterion, Culling, Selection, View, back_to_front, select_cut};
use divan::Bencher;

fn main() {
    divan::main();
}

/// Where the eye is, in a volume of 993^3 voxels.
#[derive(Clone, Copy, Debug)]
enum Eye {
    Outside,
    Surface,
    Inside,
}

const EYES: [Eye; 3] = [Eye::Outside, Eye::Surface, Eye::Inside];

#[divan::bench(args = EYES)]
fn full_resolution(bencher: Bencher<'_, '_>, eye: Eye) {
    culled(bencher, eye, &[Criterion::FullResolution]);
}

#[divan::bench]
fn full_resolution_without_culling(bencher: Bencher<'_, '_>) {
    let scene = SelectionInput::new(Eye::Outside, Culling::Off);
    bencher.bench(|| scene.select(&[Criterion::FullResolution]));
}

#[divan::bench(args = EYES)]
fn distance_1(bencher: Bencher<'_, '_>, eye: Eye) {
    culled(bencher, eye, &[Criterion::Distance { factor: 1.0 }]);
}

#[divan::bench(args = EYES)]
fn distance_4(bencher: Bencher<'_, '_>, eye: Eye) {
    culled(bencher, eye, &[Criterion::Distance { factor: 4.0 }]);
}

#[divan::bench(args = EYES)]
fn distance_4_from_a_point(bencher: Bencher<'_, '_>, eye: Eye) {
    let point = WorldPos(DVec3::new(300.0, 500.0, 700.0));
    culled(bencher, eye, &[Criterion::DistanceFrom { point, factor: 4.0 }]);
}

#[divan::bench(args = EYES)]
fn field_of_view_half(bencher: Bencher<'_, '_>, eye: Eye) {
    culled(bencher, eye, &[Criterion::FieldOfView { fraction: 0.5 }]);
}

#[divan::bench(args = EYES)]
fn field_of_view_eighth(bencher: Bencher<'_, '_>, eye: Eye) {
    culled(bencher, eye, &[Criterion::FieldOfView { fraction: 0.125 }]);
}

#[divan::bench(args = EYES)]
fn error_1_pixel(bencher: Bencher<'_, '_>, eye: Eye) {
    culled(bencher, eye, &[Criterion::ScreenSpaceError { pixels: 1.0 }]);
}

#[divan::bench(args = EYES)]
fn error_2_pixels(bencher: Bencher<'_, '_>, eye: Eye) {
    culled(bencher, eye, &[Criterion::ScreenSpaceError { pixels: 2.0 }]);
}

#[divan::bench(args = EYES)]
fn error_2_pixels_and_field_of_view_half(bencher: Bencher<'_, '_>, eye: Eye) {
    culled(bencher, eye, &[Criterion::ScreenSpaceError { pixels: 2.0 }, Criterion::FieldOfView { fraction: 0.5 }]);
}

#[divan::bench(args = EYES)]
fn order_of_error_1_pixel(bencher: Bencher<'_, '_>, eye: Eye) {
    let scene = SelectionInput::new(eye, Culling::Frustum);
    ordered(bencher, &scene, &[Criterion::ScreenSpaceError { pixels: 1.0 }]);
}

#[divan::bench]
fn order_of_all_leaves(bencher: Bencher<'_, '_>) {
    ordered(bencher, &SelectionInput::new(Eye::Inside, Culling::Off), &[Criterion::FullResolution]);
}

fn culled(bencher: Bencher<'_, '_>, eye: Eye, criteria: &[Criterion]) {
    let scene = SelectionInput::new(eye, Culling::Frustum);
    bencher.bench(|| scene.select(criteria));
}

fn ordered(bencher: Bencher<'_, '_>, scene: &SelectionInput, criteria: &[Criterion]) {
    let drawn: Vec<BrickId> = scene.select(criteria).drawn().collect();
    bencher.bench(|| back_to_front(&scene.layout, &scene.grid, &scene.view.camera, &drawn));
}

struct SelectionInput {
    layout: BrickLayout,
    grid: Grid,
    view: View,
}

impl SelectionInput {
    fn new(eye: Eye, culling: Culling) -> SelectionInput {
        let dims = UVec3::splat(32 * BrickSide::S32.n_cells() + 1);
        let grid = Grid::axis_aligned(dims, DVec3::ONE).expect("a plain grid");
        let view = View { camera: camera(&grid, eye), size: UVec2::new(1920, 1080), culling };
        SelectionInput { layout: BrickLayout::new(dims, BrickSide::S32), grid, view }
    }

    fn select(&self, criteria: &[Criterion]) -> Selection {
        select_cut(&self.layout, &self.grid, &self.view, criteria)
    }
}

fn camera(grid: &Grid, eye: Eye) -> Camera {
    let b = grid.world_box();
    let toward_middle = |from: DVec3| {
        let eye = b.min + from * b.extent();
        Camera::look_at(eye, b.center(), DVec3::Z, Projection::Perspective { fov_y: 1.0 })
    };
    let camera = match eye {
        Eye::Outside => Camera::framing(&b, DVec3::new(1.0, 0.5, 0.3), DVec3::Z),
        Eye::Surface => toward_middle(DVec3::new(1.0, 0.6, 0.4)),
        Eye::Inside => toward_middle(DVec3::splat(0.3)),
    };
    camera.expect("a plain camera")
}
