//! Random layouts, grids, cameras and criteria.
#![allow(dead_code, reason = "each test file takes what it needs")]

use brickfield_core::glam::{DMat3, DVec3, UVec2, UVec3};
use brickfield_core::{BrickLayout, BrickSide, Camera, Grid, IndexPos, Level, Projection, WorldPos};
use brickfield_lod::{Criterion, Culling, View};
use proptest::prelude::*;

#[derive(Clone, Debug)]
pub(crate) struct SelectionInput {
    pub(crate) layout: BrickLayout,
    pub(crate) grid: Grid,
    pub(crate) view: View,
}

fn vector(range: std::ops::Range<f64>) -> impl Strategy<Value = DVec3> + Clone {
    [range.clone(), range.clone(), range].prop_map(DVec3::from)
}

fn dims() -> impl Strategy<Value = UVec3> {
    let long = [1u32..300, 1u32..120, 1u32..90].prop_map(UVec3::from);
    let thin = (1u32..3000, 1u32..3, 1u32..3).prop_map(|(x, y, z)| UVec3::new(z, x, y));
    prop_oneof![4 => long, 1 => thin]
}

/// Sheared, mirrored, anisotropic and far from the origin.
fn grid(dims: UVec3) -> impl Strategy<Value = Grid> {
    let spacing = prop_oneof![Just(DVec3::ONE), vector(0.1..2.0), Just(DVec3::new(1e-3, 1.0, 1.0))];
    let shear = prop_oneof![
        Just(DMat3::IDENTITY),
        vector(-0.6..0.6).prop_map(|s| {
            DMat3::from_cols(DVec3::new(1.0, s.x, 0.0), DVec3::new(s.y, -1.0, 0.0), DVec3::new(0.0, s.z, 1.0))
        })
    ];
    let origin = prop_oneof![4 => vector(-100.0..100.0), 1 => vector(-1e7..1e7)];
    (spacing, shear, origin).prop_map(move |(spacing, direction, origin)| {
        Grid::from_first_sample(dims, spacing, origin, direction).expect("an invertible grid")
    })
}

/// In units of the volume: outside, inside, on a face, on an edge or corner.
fn eye() -> impl Strategy<Value = DVec3> {
    let face = (vector(0.0..1.0), 0usize..3, 0u8..2).prop_map(|(mut p, axis, end)| {
        p[axis] = f64::from(end);
        p
    });
    let corner = [0u8..3, 0u8..3, 0u8..3].prop_map(|p| DVec3::from(p.map(|c| f64::from(c) * 0.5)));
    prop_oneof![vector(-3.0..4.0), vector(0.0..1.0), face, corner]
}

fn projection(size_world: f64) -> impl Strategy<Value = Projection> {
    prop_oneof![
        (0.02..3.1).prop_map(|fov_y| Projection::Perspective { fov_y }),
        (0.01..2.0).prop_map(move |h| Projection::Orthographic { height: h * size_world }),
    ]
}

fn camera(grid: Grid) -> impl Strategy<Value = Camera> {
    let along_axis = (eye(), 0usize..3).prop_map(|(eye, axis)| (eye, eye + DVec3::AXES[axis]));
    let rays = prop_oneof![(eye(), vector(-0.5..1.5)), along_axis];
    let world = move |unit: DVec3| grid.world(IndexPos(unit * grid.dims().as_dvec3())).0;
    let parts = (rays, vector(-1.0..1.0), projection(grid.world_box().diagonal()));
    parts.prop_filter_map("a camera without a direction", move |((eye, target), up, projection)| {
        Camera::look_at(world(eye), world(target), up, projection).ok()
    })
}

pub(crate) fn scene(culling: Culling) -> impl Strategy<Value = SelectionInput> {
    let size = [1u32..40, 1u32..40].prop_map(UVec2::from);
    let grids = (dims(), 0usize..3).prop_flat_map(|(dims, side)| (grid(dims), Just(BrickSide::ALL[side])));
    let cameras = grids.prop_flat_map(|(grid, side)| (Just(grid), Just(side), camera(grid)));
    (cameras, size).prop_map(move |((grid, side, camera), size)| SelectionInput {
        layout: BrickLayout::new(grid.dims(), side),
        grid,
        view: View { camera, size, culling },
    })
}

/// A criterion of each kind, with tolerances about where the answers change; points in units of a world of size 100.
pub(crate) fn criterion() -> impl Strategy<Value = Criterion> {
    let factor = || 0.0..5.0;
    prop_oneof![
        Just(Criterion::FullResolution),
        (0u8..12).prop_map(|l| Criterion::Uniform(Level(l))),
        factor().prop_map(|factor| Criterion::Distance { factor }),
        (vector(-100.0..200.0), factor())
            .prop_map(|(point, factor)| Criterion::DistanceFrom { point: WorldPos(point), factor }),
        (0.0..1.2).prop_map(|fraction| Criterion::FieldOfView { fraction }),
        (0.0..6.0).prop_map(|log: f64| Criterion::ScreenSpaceError { pixels: 10f64.powf(log - 3.0) }),
    ]
}

/// None, one, or several that must all be satisfied.
pub(crate) fn criteria() -> impl Strategy<Value = Vec<Criterion>> {
    proptest::collection::vec(criterion(), 0..4)
}
