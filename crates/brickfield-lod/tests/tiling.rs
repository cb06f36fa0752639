//! Whatever is asked for, the selection tiles the volume once, and every brick satisfies the criterion.

mod scene;

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{BrickId, Cut, IndexPos, Level};
use brickfield_lod::{Answer, Criterion, Culling, Frustum, Planes, Selection, Tile, select_by, select_cut};
use proptest::prelude::*;
use scene::{Scene, criterion, scene};

fn select(scene: &Scene, criterion: &Criterion) -> Selection {
    select_cut(&scene.layout, &scene.grid, &scene.view, criterion)
}

/// The criterion by its words, in the world, from the positions of the tile's corners.
fn is_fine_enough(scene: &Scene, criterion: &Criterion, id: BrickId) -> bool {
    match criterion {
        Criterion::Uniform(level) => id.level <= *level,
        Criterion::Distance { factor } => {
            let corners = scene.layout.sample_box(id).corners().map(|c| scene.grid.world(IndexPos(c + 0.5)).0);
            let diagonal = (0..4).map(|i| corners[i].distance(corners[7 - i])).fold(0.0, f64::max);
            let center = corners.iter().sum::<DVec3>() / 8.0;
            center.distance(scene.view.camera.eye()) > factor * diagonal
        }
        _ => id.level == Level(0),
    }
}

fn points(dims: UVec3) -> impl Iterator<Item = DVec3> {
    (0..60u32).map(move |i| {
        let unit = DVec3::new(0.754_877_666, 0.569_840_291, 0.430_159_709) * f64::from(i);
        unit.fract() * dims.as_dvec3()
    })
}

proptest! {
    #[test]
    fn the_cut_tiles_the_volume_once(scene in scene(Culling::Frustum), criterion in criterion()) {
        let selection = select(&scene, &criterion);
        let cut = selection.cut();
        prop_assert!(Cut::new(scene.layout, cut.bricks().to_vec()).is_ok());
        prop_assert_eq!(cut.bricks().len(), selection.is_ignored().len());
        prop_assert_eq!(selection.drawn().count() + selection.ignored().count(), cut.bricks().len());
        for p in points(scene.layout.dims()) {
            let holders = cut.bricks().iter().filter(|id| scene.layout.index_box(**id).contains(p)).count();
            prop_assert_eq!(holders, 1, "index position {}", p);
        }
    }

    #[test]
    fn drawn_bricks_are_fine_enough_and_their_parents_are_not(
        scene in scene(Culling::Off),
        criterion in criterion(),
    ) {
        let selection = select(&scene, &criterion);
        prop_assert_eq!(selection.ignored().count(), 0);
        for id in selection.drawn() {
            prop_assert!(id.level == Level(0) || is_fine_enough(&scene, &criterion, id), "{}", id);
            prop_assert!(id == scene.layout.root() || !is_fine_enough(&scene, &criterion, id.parent()), "{}", id);
        }
    }

    #[test]
    fn culling_changes_no_brick_that_is_drawn(scene in scene(Culling::Frustum), criterion in criterion()) {
        let culled = select(&scene, &criterion);
        let mut all = scene.clone();
        all.view.culling = Culling::Off;
        let all: Vec<BrickId> = select(&all, &criterion).drawn().collect();
        prop_assert!(culled.drawn().all(|id| all.contains(&id)));
    }

    #[test]
    fn a_filter_of_ones_own_can_say_the_same(scene in scene(Culling::Frustum), factor in 0.0..3.0) {
        let frustum = Frustum::new(&scene.grid, &scene.view.camera, scene.view.size);
        let in_view = |id| match frustum.crossed(&scene.layout.index_box(id), Planes::ALL) {
            Some(_) => Answer::Render,
            None => Answer::Ignore,
        };
        let far = |id| {
            let tile = Tile::new(&scene.layout, &scene.grid, id);
            let distance = tile.center.0.distance(scene.view.camera.eye());
            if distance > factor * tile.diagonal_world { Answer::Render } else { Answer::Descend }
        };
        let own = select_by(&scene.layout, |id| in_view(id).and(far(id)));
        prop_assert_eq!(own, select(&scene, &Criterion::Distance { factor }));
    }

    #[test]
    fn extreme_factors_and_levels(scene in scene(Culling::Off)) {
        let bricks = |criterion| select(&scene, &criterion).cut().n_bricks_per_level();
        let finest = bricks(Criterion::FullResolution);
        prop_assert_eq!(finest[0], scene.layout.n_bricks_total(Level(0)));
        for factor in [f64::INFINITY, f64::NAN] {
            prop_assert_eq!(&bricks(Criterion::Distance { factor }), &finest);
        }
        let root = bricks(Criterion::Uniform(Level(200)));
        prop_assert_eq!(root.iter().sum::<usize>(), 1);
        prop_assert_eq!(&bricks(Criterion::Distance { factor: -1.0 }), &root);
    }
}
