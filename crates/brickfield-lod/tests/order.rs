//! No brick that is drawn hides behind one that was drawn before it.

mod scene;

use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{BrickId, BrickLayout, BrickSide, Camera, Grid, Level, Projection, Ray};
use brickfield_lod::{Answer, Criterion, Culling, Filter, Tile, View, back_to_front, select_by};
use proptest::prelude::*;
use scene::{SelectionInput, criteria, scene};

/// Rays in index space; the parameter stays in world units. At most 8 x 8 pixels.
fn rays(scene: &SelectionInput) -> Vec<Ray> {
    let View { camera, size, .. } = scene.view;
    let size = size.min(UVec2::splat(8));
    let (rays, to_index) = (camera.pixel_rays(size), scene.grid.world_to_index());
    let pixels = (0..size.y).flat_map(|y| (0..size.x).map(move |x| rays.pixel_ray(x, y)));
    let index = pixels.map(|ray| Ray {
        origin: to_index.transform_point3(ray.origin),
        direction: to_index.transform_vector3(ray.direction),
    });
    index.collect()
}

/// Some bricks of a random cut, which is at least as fine as the criteria ask for, in an order of their own.
fn bricks(scene: &SelectionInput, criteria: &[Criterion], seed: u32) -> Vec<BrickId> {
    let noise = |id: BrickId| {
        let place = id.coords * UVec3::new(73_856_093, 19_349_663, 83_492_791);
        (place.element_sum() ^ u32::from(id.level.0) ^ seed).wrapping_mul(0x9e37_79b9) >> 16
    };
    let split = |tile: &Tile<'_>| if noise(tile.id()).is_multiple_of(4) { Answer::Render } else { Answer::Descend };
    let fine = |tile: &Tile<'_>| {
        let answers = criteria.iter().map(|criterion| criterion.in_view(&scene.view).answer(tile));
        answers.fold(Answer::Render, Answer::and)
    };
    let cut = select_by(&scene.layout, &scene.grid, Filter::and(split, fine));
    let mut bricks: Vec<BrickId> = cut.drawn().filter(|id| noise(*id) % 16 > seed % 8).collect();
    bricks.sort_by_key(|id| noise(*id) % 1021);
    bricks
}

/// Parameters at which a ray enters the bricks it meets, each with the brick's place in the drawing.
fn met(scene: &SelectionInput, drawn: &[BrickId], ray: &Ray) -> Vec<(f64, usize)> {
    let boxes = drawn.iter().enumerate().map(|(place, id)| (place, scene.layout.index_box(*id)));
    boxes.filter_map(|(place, b)| Some((ray.clip(&b)?.start, place))).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]
    #[test]
    fn along_every_ray_bricks_come_from_far_to_near(
        scene in scene(Culling::Off),
        criteria in criteria(),
        seed in any::<u32>(),
    ) {
        let bricks = bricks(&scene, &criteria, seed);
        let order = back_to_front(&scene.layout, &scene.grid, &scene.view.camera, &bricks);
        let drawn: Vec<BrickId> = order.iter().map(|i| bricks[*i]).collect();
        for ray in rays(&scene) {
            let mut met = met(&scene, &drawn, &ray);
            met.sort_by(|a, b| b.0.total_cmp(&a.0));
            let is_in_order = met.is_sorted_by_key(|(_, place)| *place);
            prop_assert!(is_in_order, "{:?}: {:?}", ray, met);
        }
    }

    #[test]
    fn the_order_has_every_brick_once(scene in scene(Culling::Off), criteria in criteria(), seed in any::<u32>()) {
        let bricks = bricks(&scene, &criteria, seed);
        let mut order = back_to_front(&scene.layout, &scene.grid, &scene.view.camera, &bricks);
        order.sort_unstable();
        prop_assert!(order.into_iter().eq(0..bricks.len()));
    }

    #[test]
    fn bricks_that_overlap_or_do_not_exist_come_in_some_order(
        scene in scene(Culling::Off),
        levels in proptest::collection::vec((0u8..40, 0u32..u32::MAX), 0..30),
    ) {
        let id = |(level, x): (u8, u32)| {
            BrickId { level: Level(level), coords: UVec3::new(x, x / 3, x % 5) }
        };
        let bricks: Vec<BrickId> = levels.into_iter().map(id).collect();
        let order = back_to_front(&scene.layout, &scene.grid, &scene.view.camera, &bricks);
        prop_assert_eq!(order.len(), bricks.len());
    }
}

#[test]
fn eight_bricks_from_inside_start_at_the_far_corner() {
    let dims = UVec3::splat(31);
    let (layout, grid) = (BrickLayout::new(dims, BrickSide::S16), Grid::axis_aligned(dims, DVec3::ONE).unwrap());
    let bricks: Vec<BrickId> = layout.bricks(Level(0)).collect();
    let ends = |eye: DVec3, projection| {
        let camera = Camera::look_at(eye, eye + DVec3::new(1.0, 2.0, -3.0), DVec3::Z, projection).unwrap();
        let order = back_to_front(&layout, &grid, &camera, &bricks);
        (bricks[order[0]].coords.to_array(), bricks[order[7]].coords.to_array())
    };
    let eye = DVec3::new(20.0, 10.0, 12.0);
    assert_eq!(ends(eye, Projection::Perspective { fov_y: 1.0 }), ([0, 1, 1], [1, 0, 0]));
    assert_eq!(ends(eye, Projection::Orthographic { height: 9.0 }), ([1, 1, 0], [0, 0, 1]));
    // The face runs through the shared sample 15, at 15.5 in index space, which is the world here.
    let beside = |x| ends(DVec3::new(x, 10.0, 12.0), Projection::Perspective { fov_y: 1.0 }).1;
    assert_eq!((beside(15.3), beside(15.7)), ([0, 0, 0], [1, 0, 0]));
}
