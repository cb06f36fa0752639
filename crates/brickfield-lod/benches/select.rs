//! Time to select from an octree of 32,768 leaves.

use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{BrickLayout, BrickSide, Camera, Grid, Projection};
use brickfield_lod::{Criterion, Culling, View, select_cut};
use divan::Bencher;

fn main() {
    divan::main();
}

#[derive(Debug)]
enum Eye {
    Outside,
    Inside,
}

const CRITERIA: [Criterion; 3] =
    [Criterion::FullResolution, Criterion::Distance { factor: 1.0 }, Criterion::Distance { factor: 4.0 }];

#[divan::bench(args = [Eye::Outside, Eye::Inside], consts = [0, 1, 2])]
fn select<const CRITERION: usize>(bencher: Bencher<'_, '_>, eye: &Eye) {
    let dims = UVec3::splat(32 * BrickSide::S32.n_cells() + 1);
    let layout = BrickLayout::new(dims, BrickSide::S32);
    let grid = Grid::axis_aligned(dims, DVec3::ONE).expect("a plain grid");
    let view = View { camera: camera(&grid, eye), size: UVec2::new(1920, 1080), culling: Culling::Frustum };
    bencher.bench(|| select_cut(&layout, &grid, &view, &CRITERIA[CRITERION]));
}

fn camera(grid: &Grid, eye: &Eye) -> Camera {
    let b = grid.world_box();
    let camera = match eye {
        Eye::Outside => Camera::framing(&b, DVec3::new(1.0, 0.5, 0.3), DVec3::Z),
        Eye::Inside => {
            let corner = b.min + 0.3 * b.extent();
            Camera::look_at(corner, b.center(), DVec3::Z, Projection::Perspective { fov_y: 1.0 })
        }
    };
    camera.expect("a plain camera")
}
