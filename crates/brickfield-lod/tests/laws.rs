//! The law of every criterion: by its words, by hand, and for numbers that mean nothing.

mod scene;

use std::f64::consts::PI;

use brickfield_core::glam::{DMat3, DVec3, UVec2, UVec3};
use brickfield_core::{BrickId, BrickLayout, BrickSide, Camera, Grid, IndexPos, Level, Projection, WorldPos};
use brickfield_lod::{Criterion, Culling, Selection, View, select_cut};
use proptest::prelude::*;
use scene::{SelectionInput, criteria, criterion, scene};

fn select(scene: &SelectionInput, criteria: &[Criterion]) -> Selection {
    select_cut(&scene.layout, &scene.grid, &scene.view, criteria)
}

/// The corners of the box of a brick's samples in the world.
fn corners(scene: &SelectionInput, id: BrickId) -> [DVec3; 8] {
    scene.layout.sample_box(id).corners().map(|c| scene.grid.world(IndexPos(c + 0.5)).0)
}

fn greatest<T: Copy>(all: &[T], between: impl Fn(T, T) -> f64) -> f64 {
    all.iter().flat_map(|a| all.iter().map(|b| between(*a, *b))).fold(0.0, f64::max)
}

/// How many times too coarse a brick is by the words of a criterion: it is fine enough up to 1.
fn coarseness(scene: &SelectionInput, criterion: &Criterion, id: BrickId) -> f64 {
    let (corners, camera) = (corners(scene, id), scene.view.camera);
    let distance = |point: DVec3, factor: f64| {
        let diagonal = (0..4).map(|i| corners[i].distance(corners[7 - i])).fold(0.0, f64::max);
        factor * diagonal / (corners.iter().sum::<DVec3>() / 8.0).distance(point)
    };
    match *criterion {
        Criterion::FullResolution => f64::from(id.level.0) * 2.0,
        Criterion::Uniform(level) if id.level <= level => 0.0,
        Criterion::Uniform(_) => 2.0,
        Criterion::Distance { factor } => distance(camera.eye(), factor),
        Criterion::DistanceFrom { point, factor } => distance(point.0, factor),
        Criterion::FieldOfView { fraction } => field_of_view(&corners, &camera, fraction, holds_eye(scene, id, 0.0)),
        Criterion::ScreenSpaceError { pixels } => voxel_pixels(scene, id) / pixels,
        _ => unreachable!(),
    }
}

fn field_of_view(corners: &[DVec3; 8], camera: &Camera, fraction: f64, holds_eye: bool) -> f64 {
    match camera.projection() {
        Projection::Perspective { .. } if holds_eye => f64::INFINITY,
        Projection::Perspective { fov_y } => {
            let toward = corners.map(|c| c - camera.eye());
            greatest(&toward, |a, b| a.cross(b).length().atan2(a.dot(b))) / (fraction * fov_y)
        }
        Projection::Orthographic { height } => {
            let in_picture = corners.map(|c| c - camera.forward() * c.dot(camera.forward()));
            greatest(&in_picture, |a, b| a.distance(b)) / (fraction * height)
        }
    }
}

/// Length of a brick's voxels in pixels where the brick is nearest.
fn voxel_pixels(scene: &SelectionInput, id: BrickId) -> f64 {
    let View { camera, size, .. } = scene.view;
    let axes = (0..3).filter(|axis| scene.layout.dims()[*axis] > 1);
    let voxel = axes.map(|axis| scene.grid.spacing()[axis]).fold(0.0, f64::max) * f64::from(1 << id.level.0);
    let picture = match camera.projection() {
        Projection::Orthographic { height } => height,
        Projection::Perspective { fov_y } => {
            let depths = corners(scene, id).map(|c| (c - camera.eye()).dot(camera.forward()));
            2.0 * (fov_y / 2.0).tan() * depths.into_iter().fold(f64::INFINITY, f64::min).max(0.0)
        }
    };
    if voxel == 0.0 { 0.0 } else { voxel * f64::from(size.y) / picture }
}

/// Whether the eye lies in a brick's tile, grown by some voxels.
fn holds_eye(scene: &SelectionInput, id: BrickId, voxels: f64) -> bool {
    let b = scene.layout.sample_box(id);
    let eye = scene.grid.index(WorldPos(scene.view.camera.eye())).0 - 0.5;
    eye.cmpge(b.min - voxels).all() && eye.cmple(b.max + voxels).all()
}

/// Whether rounding may put the eye inside a tile or outside.
fn is_eye_on_face(scene: &SelectionInput, id: BrickId) -> bool {
    holds_eye(scene, id, 1e-4) != holds_eye(scene, id, -1e-4)
}

const ROUNDING: f64 = 1e-6;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]
    #[test]
    fn drawn_bricks_satisfy_all_criteria_and_their_parents_do_not(
        scene in scene(Culling::Off),
        criteria in criteria(),
    ) {
        let selection = select(&scene, &criteria);
        prop_assert_eq!(selection.ignored().count(), 0);
        let coarsest = |id| criteria.iter().map(|c| coarseness(&scene, c, id)).fold(0.0, f64::max);
        for id in selection.drawn() {
            let is_fine = coarsest(id) <= 1.0 + ROUNDING;
            prop_assert!(id.level == Level(0) || is_fine || is_eye_on_face(&scene, id), "{}", id);
            if id != scene.layout.root() {
                let is_coarse = coarsest(id.parent()) >= 1.0 - ROUNDING;
                prop_assert!(is_coarse || is_eye_on_face(&scene, id.parent()), "{}", id);
            }
        }
    }

    #[test]
    fn a_smaller_tolerance_draws_no_brick_coarser(
        scene in scene(Culling::Frustum),
        criterion in criterion(),
        share in 0.0..1.0,
    ) {
        let coarse = select(&scene, &[criterion]);
        let fine = select(&scene, &[smaller(criterion, share)]);
        prop_assert!(is_nowhere_coarser(&fine, &coarse));
    }

    #[test]
    fn criteria_commute_repeat_and_only_refine(
        scene in scene(Culling::Frustum),
        criteria in criteria(),
        more in criterion(),
    ) {
        let cut = select(&scene, &criteria);
        let and = select(&scene, &[&criteria[..], &[more]].concat());
        prop_assert_eq!(&and, &select(&scene, &[&[more], &criteria[..]].concat()));
        prop_assert_eq!(&and, &select(&scene, &[&[more], &criteria[..], &[more]].concat()));
        prop_assert!(is_nowhere_coarser(&and, &cut));
        prop_assert!(is_nowhere_coarser(&and, &select(&scene, &[more])));
    }

    #[test]
    fn numbers_that_mean_nothing_draw_level_0_or_the_root(scene in scene(Culling::Off), point in any_point()) {
        let bricks = |criteria: &[Criterion]| select(&scene, criteria).cut().n_bricks_per_level();
        let finest = bricks(&[Criterion::FullResolution]);
        prop_assert_eq!(finest[0], scene.layout.n_bricks_total(Level(0)));
        let distance = |factor| [Criterion::Distance { factor }];
        let distance_from = |point, factor| [Criterion::DistanceFrom { point: WorldPos(point), factor }];
        let field_of_view = |fraction| [Criterion::FieldOfView { fraction }];
        let error = |pixels| [Criterion::ScreenSpaceError { pixels }];
        for factor in [f64::INFINITY, f64::NAN] {
            prop_assert_eq!(&bricks(&distance(factor)), &finest);
            prop_assert_eq!(&bricks(&distance_from(point, factor)), &finest);
        }
        for tolerance in [0.0, -0.0, -1.0, f64::NEG_INFINITY, f64::NAN] {
            prop_assert_eq!(&bricks(&field_of_view(tolerance)), &finest);
            prop_assert_eq!(&bricks(&error(tolerance)), &finest);
        }
        prop_assert_eq!(&bricks(&distance_from(DVec3::NAN, 1.0)), &finest);
        let root = bricks(&[]);
        prop_assert_eq!(root.iter().sum::<usize>(), 1);
        prop_assert_eq!(&bricks(&[Criterion::Uniform(Level(u8::MAX))]), &root);
        prop_assert_eq!(&bricks(&distance_from(DVec3::INFINITY, 1.0)), &root);
        for factor in [-1.0, f64::MIN] {
            prop_assert_eq!(&bricks(&distance(factor)), &root);
            prop_assert_eq!(&bricks(&distance_from(point, factor)), &root);
        }
        for criteria in [field_of_view(f64::INFINITY), error(f64::INFINITY)] {
            let is_before_eye = |id| voxel_pixels(&scene, id) < 1e9 && !holds_eye(&scene, id, 1e-4);
            let selection = select(&scene, &criteria);
            let mut parents = selection.drawn().filter(|id| *id != scene.layout.root()).map(BrickId::parent);
            prop_assert!(!parents.any(is_before_eye));
        }
    }
}

fn any_point() -> impl Strategy<Value = DVec3> {
    [-1e3..1e3, -1e3..1e3, -1e3..1e3].prop_map(DVec3::from)
}

/// The same criterion, harder to satisfy.
fn smaller(criterion: Criterion, share: f64) -> Criterion {
    match criterion {
        Criterion::Uniform(Level(l)) => Criterion::Uniform(Level((f64::from(l) * share) as u8)),
        Criterion::Distance { factor } => Criterion::Distance { factor: factor / share },
        Criterion::DistanceFrom { point, factor } => Criterion::DistanceFrom { point, factor: factor / share },
        Criterion::FieldOfView { fraction } => Criterion::FieldOfView { fraction: fraction * share },
        Criterion::ScreenSpaceError { pixels } => Criterion::ScreenSpaceError { pixels: pixels * share },
        other => other,
    }
}

fn is_nowhere_coarser(fine: &Selection, coarse: &Selection) -> bool {
    let top = coarse.cut().layout().root().level;
    let is_below = |id: &BrickId| (id.level.0..=top.0).any(|l| coarse.cut().bricks().contains(&id.ancestor(Level(l))));
    fine.cut().bricks().iter().all(is_below)
}

/// A slice of 4 x 4 tiles in three levels, of 1 x 2 units a voxel, seen along z in a picture of 64 x 64 pixels.
fn slice(eye: DVec3, projection: Projection, pixels: f64) -> Vec<usize> {
    let dims = UVec3::new(61, 61, 1);
    let grid = Grid::from_first_sample(dims, DVec3::new(1.0, 2.0, 50.0), DVec3::ZERO, DMat3::IDENTITY).unwrap();
    let camera = Camera::look_at(eye, eye + DVec3::Z, DVec3::Y, projection).unwrap();
    let view = View { camera, size: UVec2::splat(64), culling: Culling::Off };
    let layout = BrickLayout::new(dims, BrickSide::S16);
    select_cut(&layout, &grid, &view, &[Criterion::ScreenSpaceError { pixels }]).n_drawn_per_level()
}

#[test]
fn a_voxel_in_a_parallel_picture_has_one_size() {
    // 64 units on 64 pixels: the longest edges are 2, 4 and 8 pixels; the third axis has no second sample.
    let drawn = |pixels| slice(DVec3::new(30.0, 60.0, -9.0), Projection::Orthographic { height: 64.0 }, pixels);
    assert_eq!(drawn(3.999), [16, 0, 0]);
    assert_eq!(drawn(4.0), [0, 4, 0]);
    assert_eq!(drawn(7.999), [0, 4, 0]);
    assert_eq!(drawn(8.0), [0, 0, 1]);
}

#[test]
fn a_voxel_in_perspective_shrinks_with_depth_along_the_view() {
    // The picture is as high as it is far: a pixel's side at depth 64 is a unit, wherever in the picture.
    let lens = Projection::Perspective { fov_y: 2.0 * 0.5f64.atan() };
    for x in [0.0, 30.0, 500.0] {
        let drawn = |depth: f64| slice(DVec3::new(x, 60.0, -depth), lens, 4.0);
        assert_eq!(drawn(63.9), [16, 0, 0]);
        assert_eq!(drawn(64.1), [0, 4, 0]);
        assert_eq!(drawn(127.9), [0, 4, 0]);
        assert_eq!(drawn(128.1), [0, 0, 1]);
    }
}

#[test]
fn of_what_reaches_the_eye_plane_level_0_is_drawn() {
    let lens = Projection::Perspective { fov_y: 2.0 * 0.5f64.atan() };
    for z in [0.0, 5.0] {
        assert_eq!(slice(DVec3::new(30.0, 60.0, z), lens, 1e9), [16, 0, 0]);
    }
}

#[test]
fn the_eye_in_a_tile_sees_it_from_all_sides() {
    // A lens of nearly half a turn, a tolerance of nearly two: only the tiles that hold the eye are too coarse.
    let (dims, fov_y) = (UVec3::new(61, 61, 1), PI - 0.01);
    let grid = Grid::axis_aligned(dims, DVec3::ONE).unwrap();
    let layout = BrickLayout::new(dims, BrickSide::S16);
    let eye = DVec3::new(5.5, 8.5, 0.5);
    let camera = Camera::look_at(eye, eye + DVec3::X, DVec3::Z, Projection::Perspective { fov_y }).unwrap();
    let view = View { camera, size: UVec2::splat(64), culling: Culling::Off };
    let selection = select_cut(&layout, &grid, &view, &[Criterion::FieldOfView { fraction: 1.9 }]);
    assert_eq!(selection.n_drawn_per_level(), [4, 3, 0]);
}
