//! The volumes and transfer functions that cases share.

use brickfield_core::glam::{DMat3, DVec3, UVec3};
use brickfield_core::{Grid, Knot, LinearRgb, ScalarType, TransferFunction, Volume};

use crate::volumes::{FieldFormula, fill, fill_unit, spread};

/// Neither cubic nor a whole number of bricks: 3 x 2 x 2 of 16, so that neither the index nor the atlas (3 x 2 x 2) is
/// the same along x and y.
pub(super) const DIMS: UVec3 = UVec3::new(40, 29, 27);

pub(super) const WARM: LinearRgb = [0.9, 0.35, 0.1];
pub(super) const COOL: LinearRgb = [0.1, 0.4, 0.85];

pub(super) fn grid() -> Grid {
    Grid::axis_aligned(DIMS, DVec3::ONE).expect("a grid")
}

/// 1 : 2.2 : 0.7, mirrored, axes swapped, away from the origin.
pub(super) fn skew_grid() -> Grid {
    let direction = DMat3::from_cols(DVec3::new(0.0, 0.6, 0.8), DVec3::X, DVec3::new(0.0, 0.8, -0.6));
    let grid = Grid::from_first_sample(DIMS, DVec3::new(1.0, 2.2, 0.7), DVec3::new(-31.0, 17.0, 5.5), direction);
    grid.expect("a grid")
}

pub(super) fn knot(value: f64, extinction: f64, color: LinearRgb) -> Knot {
    Knot { value, extinction, color }
}

/// A soft transfer function over [0, 1]: nothing below 0.2, a bump, then denser and denser.
pub(super) fn soft_knots() -> Vec<Knot> {
    vec![knot(0.2, 0.0, WARM), knot(0.4, 0.08, WARM), knot(0.6, 0.03, [0.3, 0.9, 0.2]), knot(1.0, 0.25, COOL)]
}

/// The soft transfer function for the values of a type.
pub(super) fn soft(scalar: ScalarType) -> TransferFunction {
    spread(&soft_knots(), scalar).expect("knots ascend")
}

/// A ball that is denser towards its centre, off the volume's centre; values in [0, 1].
pub(super) fn ball_field(grid: &Grid) -> FieldFormula {
    let b = grid.world_box();
    let center = b.center() + b.extent() * DVec3::new(0.06, -0.04, 0.05);
    FieldFormula::GaussianBall { center, sigma: 0.18 * b.extent().min_element(), peak: 1.0 }
}

pub(super) fn ball(grid: &Grid, scalar: ScalarType) -> Volume {
    let field = ball_field(grid);
    fill_unit(grid, scalar, |p| field.at(p))
}

/// A ball on a slope and a wave: every voxel and every brick is different, nothing is empty, nothing symmetric.
pub(super) fn hills(grid: &Grid, scalar: ScalarType) -> Volume {
    let ball = ball_field(grid);
    let b = *grid;
    fill_unit(grid, scalar, move |p| {
        let q = b.world_to_index().transform_point3(p) / b.dims().as_dvec3();
        let wave = (5.0 * q.x + 3.0 * q.y * q.y - 4.0 * q.z).sin();
        (0.35 * ball.at(p) + 0.25 + 0.15 * wave + 0.15 * q.x + 0.08 * q.y).clamp(0.0, 1.0)
    })
}

/// A field that is linear in the voxel index, in f32.
pub(super) fn ramp(grid: &Grid) -> Volume {
    let b = *grid;
    fill(grid, ScalarType::F32, move |p| {
        let q = b.world_to_index().transform_point3(p) / b.dims().as_dvec3();
        0.1 + 0.4 * q.x + 0.3 * q.y + 0.15 * q.z
    })
}

pub(super) fn constant(grid: &Grid, scalar: ScalarType, unit: f64) -> Volume {
    fill_unit(grid, scalar, move |_| unit)
}

/// A hollow sphere.
pub(super) fn shell(grid: &Grid, scalar: ScalarType) -> Volume {
    let b = grid.world_box();
    let r = 0.5 * b.extent().min_element();
    let field = FieldFormula::Shell { center: b.center() + 0.3, inner: 0.55 * r, outer: 0.85 * r, edge: 3.0 };
    fill_unit(grid, scalar, |p| field.at(p))
}

/// A ball without a rim: dark values outside, other dark ones inside; interpolation and rules that see the values between show.
pub(super) fn jump(grid: &Grid) -> Volume {
    let center = grid.world_box().center() + 0.3;
    let r = 0.35 * grid.world_box().extent().min_element();
    fill_unit(grid, ScalarType::U8, |p| if p.distance(center) < r { 0.9 } else { 0.1 })
}

/// Two small balls in opposite corners of an empty volume.
pub(super) fn sparse(grid: &Grid, scalar: ScalarType) -> Volume {
    let b = grid.world_box();
    let at = |f: DVec3| b.min + b.extent() * f;
    let ball =
        |f| FieldFormula::Shell { center: at(f), inner: -1.0, outer: 0.12 * b.extent().min_element(), edge: 3.0 };
    let (near, far) = (ball(DVec3::new(0.2, 0.22, 0.18)), ball(DVec3::new(0.8, 0.75, 0.8)));
    fill_unit(grid, scalar, |p| near.at(p) + far.at(p))
}

/// Bricks of 16 that are full up to their borders beside empty ones: a jump that goes too far over an empty one shows at once.
pub(super) fn checkers(dims: UVec3) -> Volume {
    let grid = Grid::axis_aligned(dims, DVec3::ONE).expect("a grid");
    fill_unit(&grid, ScalarType::U8, |p| {
        let i = p.floor().as_uvec3();
        let border = (i % 15).cmpeq(UVec3::ZERO).any();
        let brick = i / 15;
        let full = (brick.x + brick.y + brick.z) % 2 == 1 && brick.x != 2;
        let grain = f64::from((i.x * 7 + i.y * 13 + i.z * 29) % 16) / 15.0;
        if border || !full { 0.0 } else { 0.5 + 0.5 * grain }
    })
}

pub(super) fn marschner_lobb(n: u32, scalar: ScalarType) -> Volume {
    let grid = Grid::axis_aligned(UVec3::splat(n), DVec3::ONE).expect("a grid");
    let field = FieldFormula::MarschnerLobb { center: grid.world_box().center(), half_side: 0.5 * f64::from(n) };
    fill_unit(&grid, scalar, |p| field.at(p))
}
