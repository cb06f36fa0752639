//! Whatever is asked for, the selection tiles the volume once.

mod scene;

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{BrickId, Cut};
use brickfield_lod::{Criterion, Culling, Selection, select_cut};
use proptest::prelude::*;
use scene::{SelectionInput, criteria, scene};

fn select(scene: &SelectionInput, criteria: &[Criterion]) -> Selection {
    select_cut(&scene.layout, &scene.grid, &scene.view, criteria)
}

fn points(dims: UVec3) -> impl Iterator<Item = DVec3> {
    (0..60u32).map(move |i| {
        let unit = DVec3::new(0.754_877_666, 0.569_840_291, 0.430_159_709) * f64::from(i);
        unit.fract() * dims.as_dvec3()
    })
}

proptest! {
    #[test]
    fn the_cut_tiles_the_volume_once(scene in scene(Culling::Frustum), criteria in criteria()) {
        let selection = select(&scene, &criteria);
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
    fn culling_changes_no_brick_that_is_drawn(scene in scene(Culling::Frustum), criteria in criteria()) {
        let culled = select(&scene, &criteria);
        let mut all = scene.clone();
        all.view.culling = Culling::Off;
        let all: Vec<BrickId> = select(&all, &criteria).drawn().collect();
        prop_assert!(culled.drawn().all(|id| all.contains(&id)));
    }
}
