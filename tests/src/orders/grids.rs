//! Grid refinement: a Gaussian ball on finer and finer grids, the step far below the voxel, against its closed form.

use brickfield::bricks::{BuildOptions, Downsampling, build_tree};
use brickfield::cpu::discrete;
use brickfield::{Residency, Scene, prepare};
use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{BrickSide, Camera, Grid, Knot, ScalarType, TransferFunction};
use brickfield_optics::QuadratureRule;

use super::fit::OrderRow;
use crate::volumes::{FieldFormula, fill};

/// Side of the volume in world units; the ball's sigma is 1/14 of it, so that nothing of it is lost at the faces.
const SIDE: f64 = 14.0;
const EXTINCTION: f64 = 0.7;

/// Five halvings of the voxel.
pub fn grid_refinement() -> OrderRow {
    let errors = (0..6).map(|k| 12 << k).map(|n| (SIDE / f64::from(n), error(n))).collect();
    OrderRow { what: "grid, f64, trilinear".into(), order: 2.0, errors, floor: 1e-7, n_halvings: 5 }
}

/// Greatest difference in alpha of a small picture of n^3 voxels.
fn error(n: u32) -> f64 {
    let grid = Grid::axis_aligned(UVec3::splat(n), DVec3::splat(SIDE / f64::from(n))).expect("a grid");
    // Off every grid's symmetry, so that finer grids do not sample the same places.
    let center = grid.world_box().center() + DVec3::new(0.013, -0.027, 0.019) * SIDE;
    let ball = FieldFormula::GaussianBall { center, sigma: 1.0, peak: 1.0 };
    let volume = fill(&grid, ScalarType::F32, |p| ball.at(p));
    let options = BuildOptions { side: BrickSide::S32, downsampling: Downsampling::Subsample, max_bytes: None };
    let tree = build_tree(&volume, &options).expect("an octree");
    let camera = Camera::framing(&grid.world_box(), DVec3::new(0.6, -1.0, 0.35), DVec3::Z).expect("a camera");
    let size = UVec2::new(7, 7);
    let scene = Scene { step_voxels: 0.125, rule: QuadratureRule::Gauss2, ..Scene::new(camera, size, transfer()) };
    let plan = prepare(&tree, &scene, &mut Residency::default()).expect("a scene");
    let image = discrete(&plan).image;
    let rays = camera.pixel_rays(size);
    let of_pixel = |i: u32| {
        let depth = EXTINCTION * ball.line_integral(&rays.pixel_ray(i % size.x, i / size.x)).unwrap_or(0.0);
        (image.pixels()[i as usize][3] - brickfield_optics::alpha(depth)).abs()
    };
    (0..size.x * size.y).map(of_pixel).fold(0.0, f64::max)
}

fn transfer() -> TransferFunction {
    let knot = |value, extinction| Knot { value, extinction, color: [1.0; 3] };
    TransferFunction::new(vec![knot(0.0, 0.0), knot(1.0, EXTINCTION)]).expect("knots ascend")
}
