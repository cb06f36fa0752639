//! No ray meets an ignored brick; and bricks out of sight are ignored.

mod scene;

use brickfield_core::glam::{DMat3, DVec2, DVec3, UVec2, UVec3, Vec3Swizzles};
use brickfield_core::{BrickLayout, BrickSide, Camera, Grid, Projection, Ray};
use brickfield_lod::{Answer, Criterion, Culling, Filter, Frustum, Tile, View, select_cut};
use proptest::prelude::*;
use scene::{SelectionInput, criteria, scene};

/// In index space; the parameter stays in world units.
fn rays(scene: &SelectionInput) -> Vec<Ray> {
    let View { camera, size, .. } = scene.view;
    let (rays, to_index) = (camera.pixel_rays(size), scene.grid.world_to_index());
    let pixels = (0..size.y).flat_map(|y| (0..size.x).map(move |x| DVec2::new(f64::from(x), f64::from(y)) + 0.5));
    let end = size.as_dvec2();
    let corners = [DVec2::ZERO, DVec2::new(end.x, 0.0), DVec2::new(0.0, end.y), end];
    let world = pixels.chain(corners).map(|at| rays.at(at));
    let index = world.map(|ray| Ray {
        origin: to_index.transform_point3(ray.origin),
        direction: to_index.transform_vector3(ray.direction),
    });
    index.collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]
    #[test]
    fn no_ray_meets_an_ignored_brick(scene in scene(Culling::Frustum), criteria in criteria()) {
        let selection = select_cut(&scene.layout, &scene.grid, &scene.view, &criteria);
        let rays = rays(&scene);
        for id in selection.ignored() {
            let b = scene.layout.index_box(id);
            for ray in &rays {
                // Corner rays run in two of the planes: what they share with a brick beside them is rounding.
                let length = ray.clip(&b).map_or(0.0, |span| span.end - span.start);
                prop_assert!(length <= 1e-9 * scene.grid.world_box().diagonal(), "{} for {}", id, length);
            }
        }
    }

    #[test]
    fn a_brick_is_ignored_only_below_one_that_is_in_view(scene in scene(Culling::Frustum), criteria in criteria()) {
        let frustum = Frustum::new(&scene.grid, &scene.view.camera, scene.view.size);
        let in_view = |id| frustum.answer(&Tile::new(&scene.layout, &scene.grid, id)) == Answer::Render;
        let selection = select_cut(&scene.layout, &scene.grid, &scene.view, &criteria);
        prop_assert!(selection.drawn().all(in_view));
        prop_assert!(selection.ignored().all(|id| !in_view(id)));
        prop_assert!(selection.ignored().all(|id| id == scene.layout.root() || in_view(id.parent())));
    }
}

fn slab(eye: DVec3, target: DVec3, projection: Projection) -> (BrickLayout, Grid, View) {
    let dims = UVec3::new(16 * 15 + 1, 16 * 15 + 1, 1);
    let grid = Grid::from_first_sample(dims, DVec3::ONE, DVec3::ZERO, DMat3::IDENTITY).unwrap();
    let camera = Camera::look_at(eye, target, DVec3::Y, projection).unwrap();
    let view = View { camera, size: UVec2::new(64, 64), culling: Culling::Frustum };
    (BrickLayout::new(dims, BrickSide::S16), grid, view)
}

#[test]
fn a_volume_behind_the_eye_is_ignored_whole() {
    for projection in [Projection::Perspective { fov_y: 1.0 }, Projection::Orthographic { height: 1e3 }] {
        let (layout, grid, view) = slab(DVec3::Z * 10.0, DVec3::Z * 20.0, projection);
        let selection = select_cut(&layout, &grid, &view, &[Criterion::FullResolution]);
        assert_eq!(selection.ignored().collect::<Vec<_>>(), [layout.root()]);
    }
}

#[test]
fn a_picture_of_four_tiles_draws_four_tiles() {
    // The picture shows samples 95 to 115 of both axes: parts of tiles 6 (samples 90 to 105) and 7.
    let at = DVec3::new(105.0, 105.0, 0.0);
    let (layout, grid, view) = slab(at + DVec3::Z * 10.0, at, Projection::Orthographic { height: 20.0 });
    let selection = select_cut(&layout, &grid, &view, &[Criterion::FullResolution]);
    assert_eq!(selection.n_drawn_per_level(), [4, 0, 0, 0, 0]);
    assert!(selection.drawn().all(|id| (id.coords.xy() - 6).cmple(UVec2::ONE).all()));
}

#[test]
fn a_perspective_picture_draws_the_tiles_that_it_shows() {
    // Half the height at distance 100 is 100 tan(0.1) = 10.03.
    let at = DVec3::new(105.0, 105.0, 0.0);
    let (layout, grid, view) = slab(at + DVec3::Z * 100.0, at, Projection::Perspective { fov_y: 0.2 });
    let selection = select_cut(&layout, &grid, &view, &[Criterion::FullResolution]);
    assert_eq!(selection.n_drawn_per_level(), [4, 0, 0, 0, 0]);
}
