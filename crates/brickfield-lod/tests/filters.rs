//! Filters of one's own, and how they compose.

mod scene;

use brickfield_core::glam::Vec3Swizzles;
use brickfield_core::{BrickId, Level};
use brickfield_lod::{Answer, Criterion, Culling, Filter, Frustum, Selection, Tile, select_by, select_cut};
use proptest::prelude::*;
use scene::{SelectionInput, criteria, criterion, scene};

fn by<F: Filter>(scene: &SelectionInput, filter: F) -> Selection {
    select_by(&scene.layout, &scene.grid, filter)
}

fn frustum(scene: &SelectionInput) -> Frustum {
    Frustum::new(&scene.grid, &scene.view.camera, scene.view.size)
}

/// Answers without a pattern.
fn noise(tile: &Tile<'_>) -> Answer {
    let BrickId { level: Level(level), coords } = tile.id();
    match coords.dot(coords.yzx() * 5 + 3).wrapping_add(u32::from(level)) % 7 {
        0 => Answer::Ignore,
        1 | 2 => Answer::Render,
        _ => Answer::Descend,
    }
}

proptest! {
    #[test]
    fn a_filter_of_ones_own_can_say_the_same(scene in scene(Culling::Frustum), factor in 0.0..3.0) {
        let eye = scene.view.camera.eye();
        let far = |tile: &Tile<'_>| match tile.center().0.distance(eye) > factor * tile.diagonal_world() {
            true => Answer::Render,
            false => Answer::Descend,
        };
        let selection = select_cut(&scene.layout, &scene.grid, &scene.view, &[Criterion::Distance { factor }]);
        prop_assert_eq!(by(&scene, frustum(&scene).and(far)), selection);
    }

    #[test]
    fn what_is_known_of_a_parent_spares_work_and_changes_nothing(scene in scene(Culling::Frustum), one in criterion()) {
        let (frustum, fine) = (frustum(&scene), one.in_view(&scene.view));
        let asked_anew = |tile: &Tile<'_>| frustum.answer(tile).and(fine.answer(tile));
        prop_assert_eq!(by(&scene, frustum.and(fine)), by(&scene, asked_anew));
    }

    #[test]
    fn filters_commute_and_associate(scene in scene(Culling::Frustum), one in criterion()) {
        let (frustum, fine) = (frustum(&scene), one.in_view(&scene.view));
        let all = by(&scene, frustum.and(fine).and(noise));
        prop_assert_eq!(&all, &by(&scene, Filter::and(noise, fine).and(frustum)));
        prop_assert_eq!(&all, &by(&scene, fine.and(Filter::and(noise, frustum))));
    }

    #[test]
    fn a_list_of_criteria_is_their_composition(scene in scene(Culling::Frustum), criteria in criteria()) {
        let together = |tile: &Tile<'_>| {
            let answers = criteria.iter().map(|criterion| criterion.in_view(&scene.view).answer(tile));
            answers.fold(Answer::Render, Answer::and)
        };
        let list = select_cut(&scene.layout, &scene.grid, &scene.view, &criteria);
        prop_assert_eq!(list, by(&scene, frustum(&scene).and(together)));
    }
}
