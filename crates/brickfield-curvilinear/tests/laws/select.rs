//! Selections by size and by error, against plain definitions; and updates, against selections from nothing.

use std::sync::Arc;

use crate::grids::{KINDS, Kind};
use brickfield_core::glam::{DVec3, UVec2};
use brickfield_core::{Camera, Level, Projection};
use brickfield_curvilinear::*;
use proptest::prelude::*;

fn view(eye: DVec3, target: DVec3) -> View {
    let camera = Camera::look_at(eye, target, DVec3::new(0.1, 0.2, 1.0), Projection::Perspective { fov_y: 0.7 });
    View::new(camera.unwrap(), UVec2::new(400, 300)).unwrap()
}

fn holed(kind: Kind, m: u32, n: u32) -> Arc<QuadTree> {
    Arc::new(QuadTree::build(kind.grid(m, n).with_holes(|i| i % 211 == 7)))
}

/// All zones with a label, from the root down.
fn labelled(selection: &Selection) -> Vec<(Zone, Label)> {
    let mut all = vec![(selection.layout().root(), selection.label(selection.layout().root()).unwrap())];
    let mut done = 0;
    while let Some((zone, label)) = all.get(done).copied() {
        done += 1;
        if label == Label::Branch {
            all.extend(selection.layout().children(zone).map(|child| (child, selection.label(child).unwrap())));
        }
    }
    all
}

/// Whether a point is inside the picture, by where its ray would pass the picture's plane.
fn is_in_picture(view: &View, point: DVec3) -> bool {
    let (camera, size) = (view.camera(), view.size().as_dvec2());
    let from_eye = point - camera.eye();
    let depth = from_eye.dot(camera.forward());
    let Projection::Perspective { fov_y } = camera.projection() else { panic!("a perspective view") };
    let half_height = depth * (fov_y / 2.0).tan();
    depth > 0.0
        && from_eye.dot(camera.up()).abs() < half_height * (1.0 - 1e-9)
        && from_eye.dot(camera.right()).abs() < half_height * size.x / size.y * (1.0 - 1e-9)
}

fn kinds() -> impl Strategy<Value = Kind> {
    proptest::sample::select(&KINDS[..])
}

fn points() -> impl Strategy<Value = DVec3> {
    (-6.0..9.0, -6.0..9.0, 0.3..6.0).prop_map(|(x, y, z)| DVec3::new(x, y, z))
}

/// Small steps, now and then a jump.
fn paths() -> impl Strategy<Value = Vec<View>> {
    let steps = proptest::collection::vec((points(), points(), 0usize..4), 2..9);
    (points(), points(), steps).prop_map(|(mut eye, mut target, steps)| {
        let mut views = vec![view(eye, target - DVec3::Z * 9.0)];
        for (to, aim, size) in steps {
            let part = [0.0, 1e-3, 0.03, 1.0][size];
            (eye, target) = (eye.lerp(to, part), target.lerp(aim, part));
            views.push(view(eye, target - DVec3::Z * 9.0));
        }
        views
    })
}

/// The selection under a budget from the plain definition: a list of leaves, of which the one with the first turn is divided.
fn plain_greedy(tree: &QuadTree, view: &View, budget: usize) -> Vec<Zone> {
    /// The nice zones that stand for a zone, with their ranks; none if it is not seen.
    fn standing(tree: &QuadTree, view: &View, zone: Zone, above: f32) -> Vec<(Zone, f32)> {
        let summary = tree.summary(zone);
        if summary.is_void() || !view.sees(&tree.extent(zone)) {
            return Vec::new();
        }
        let rank = above.min(summary.error);
        if summary.is_nice() {
            return vec![(zone, rank)];
        }
        tree.layout().children(zone).flat_map(|child| standing(tree, view, child, rank)).collect()
    }
    let mut leaves = standing(tree, view, tree.layout().root(), f32::INFINITY);
    let mut bound = leaves.len().max(1);
    loop {
        let turn = |(zone, rank): &(Zone, f32)| (-rank, std::cmp::Reverse(zone.level), zone.row, zone.column);
        let open = leaves.iter().filter(|(zone, rank)| zone.level > Level(0) && *rank > 0.0);
        let Some(next) = open.min_by(|a, b| turn(a).partial_cmp(&turn(b)).unwrap()).copied() else { break };
        let (zone, rank) = next;
        let parts: Vec<_> = tree.layout().children(zone).flat_map(|child| standing(tree, view, child, rank)).collect();
        bound += parts.len().max(1) - 1;
        if bound > budget {
            break;
        }
        leaves.retain(|leaf| *leaf != next);
        leaves.extend(parts);
    }
    let mut zones: Vec<Zone> = leaves.into_iter().map(|(zone, _)| zone).collect();
    zones.sort();
    zones
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(80))]

    #[test]
    fn leaves_are_small_and_branches_are_not(
        kind in kinds(), m in 3u32..50, n in 3u32..50, eye in points(), target in points(), granularity in 1.0f64..80.0,
    ) {
        let tree = holed(kind, m, n);
        let view = view(eye, target - DVec3::Z * 9.0);
        let mut selector = SizeSelector::new(tree.clone(), granularity).unwrap();
        selector.update(&view);
        for (zone, label) in labelled(selector.selection()) {
            let (summary, extent) = (tree.summary(zone), tree.extent(zone));
            let is_small = view.pixels(f64::from(summary.size), view.nearest(&extent)) < granularity;
            match label {
                Label::Leaf => prop_assert!(summary.is_nice() && (is_small || zone.level == Level(0))),
                Label::Branch => prop_assert!(!summary.is_nice() || !is_small),
                Label::Out => {
                    let range = tree.layout().descendants(zone);
                    let is_seen = |row, column| {
                        let node = Node { row, column };
                        !tree.grid().value(node).is_nan() && is_in_picture(&view, tree.grid().position(node))
                    };
                    let seen = (range.rows.start..=range.rows.end)
                        .any(|row| (range.columns.start..=range.columns.end).any(|column| is_seen(row, column)));
                    prop_assert!(summary.is_void() || !seen, "{zone} is out and has a node in the picture");
                }
            }
        }
    }

    #[test]
    fn labelled_zones_tile_the_grid(kind in kinds(), m in 3u32..40, n in 3u32..40, eye in points(), budget in 1usize..400) {
        let tree = holed(kind, m, n);
        let mut selector = BudgetSelector::new(tree.clone());
        selector.update(&view(eye, DVec3::ZERO - DVec3::Z), budget);
        let ends = labelled(selector.selection()).into_iter().filter(|(_, label)| *label != Label::Branch);
        let mut n_over = vec![0; (m * n) as usize];
        for (zone, label) in ends {
            let range = tree.layout().descendants(zone);
            for row in range.rows {
                for column in range.columns.clone() {
                    n_over[(row * n + column) as usize] += 1;
                    let leaf = (label == Label::Leaf).then_some(zone);
                    prop_assert_eq!(selector.selection().leaf_over(row, column), leaf);
                }
            }
        }
        prop_assert!(n_over.iter().all(|times| *times == 1));
    }

    #[test]
    fn updates_by_size_equal_selections_from_nothing(
        kind in kinds(), m in 3u32..60, n in 3u32..60, path in paths(), granularity in 1.0f64..60.0,
    ) {
        let tree = holed(kind, m, n);
        let mut selector = SizeSelector::new(tree.clone(), granularity).unwrap();
        for view in &path {
            let work = selector.update(view);
            let mut fresh = SizeSelector::new(tree.clone(), granularity).unwrap();
            let work_from_nothing = fresh.update(view);
            prop_assert_eq!(selector.selection(), fresh.selection());
            prop_assert!(work.n_visited <= work_from_nothing.n_visited);
            prop_assert_eq!(selector.selection().n_leaves(), selector.selection().leaves().len());
        }
    }

    #[test]
    fn updates_by_budget_equal_selections_from_nothing(
        kind in kinds(), m in 3u32..60, n in 3u32..60, path in paths(), budgets in proptest::collection::vec(1usize..600, 9),
    ) {
        let tree = holed(kind, m, n);
        let mut selector = BudgetSelector::new(tree.clone());
        for (view, budget) in path.iter().zip(budgets) {
            selector.update(view, budget);
            let mut fresh = BudgetSelector::new(tree.clone());
            fresh.update(view, budget);
            prop_assert_eq!(selector.selection(), fresh.selection());
            prop_assert_eq!(selector.selection().n_leaves(), selector.selection().leaves().len());
        }
    }

    #[test]
    fn budgets_buy_what_the_definition_says(
        kind in kinds(), m in 3u32..40, n in 3u32..40, eye in points(), target in points(), budget in 1usize..300,
    ) {
        let tree = holed(kind, m, n);
        let view = view(eye, target - DVec3::Z * 9.0);
        let mut selector = BudgetSelector::new(tree.clone());
        selector.update(&view, budget);
        prop_assert_eq!(selector.selection().leaves(), plain_greedy(&tree, &view, budget));
    }
}

fn terrain() -> (Arc<QuadTree>, View) {
    let tree = Arc::new(QuadTree::build(Kind::Waves.grid(256, 256)));
    (tree, view(DVec3::new(20.0, -30.0, 20.0), DVec3::new(60.0, 30.0, 0.0)))
}

fn moved(view: &View, by: DVec3) -> View {
    let camera = view.camera();
    let up = DVec3::new(0.1, 0.2, 1.0);
    let eye = camera.eye() + by;
    let camera = Camera::look_at(eye, eye + camera.forward(), up, camera.projection()).unwrap();
    View::new(camera, view.size()).unwrap()
}

#[test]
fn an_update_costs_only_the_zones_that_may_have_changed() {
    let (tree, start) = terrain();
    let mut by_size = SizeSelector::new(tree.clone(), 4.0).unwrap();
    let mut by_error = BudgetSelector::new(tree);
    let (all_by_size, all_by_error) = (by_size.update(&start), by_error.update(&start, 5_000));
    assert!(all_by_size.n_visited > 3_000 && all_by_error.n_visited > 3_000, "{all_by_size:?} {all_by_error:?}");
    // The same view: nothing but the division that does not fit.
    assert_eq!(by_size.update(&start), SelectionWork::default());
    assert!(by_error.update(&start, 5_000).n_visited <= 5);
    // A step of 1/1000 of the grid's width, and ten more zones of budget.
    let near = moved(&start, DVec3::new(0.1, 0.0, 0.0));
    let (work_by_size, work_by_error) = (by_size.update(&near), by_error.update(&near, 5_010));
    assert!(work_by_size.n_visited * 5 < all_by_size.n_visited, "{work_by_size:?} of {all_by_size:?}");
    assert!(work_by_error.n_visited * 5 < all_by_error.n_visited, "{work_by_error:?} of {all_by_error:?}");
}

#[test]
fn a_greater_budget_never_has_a_greater_error() {
    let (tree, view) = terrain();
    let mut selector = BudgetSelector::new(tree.clone());
    let mut last = f32::INFINITY;
    for budget in [1, 10, 100, 1_000, 10_000, 100_000] {
        selector.update(&view, budget);
        let n_leaves = selector.selection().n_leaves();
        let error = selector.selection().greatest_error(&tree);
        assert!(n_leaves <= budget && error <= last, "{n_leaves} of {budget} zones, error {error} after {last}");
        last = error;
    }
    assert_eq!(last, 0.0);
}

#[test]
fn zones_that_are_not_nice_are_divided_whatever_the_budget() {
    let tree = Arc::new(QuadTree::build(Kind::Annulus.grid(32, 32)));
    let mut selector = BudgetSelector::new(tree.clone());
    selector.update(&view(DVec3::new(0.0, 0.0, 9.0), DVec3::ZERO), 1);
    assert!(selector.selection().n_leaves() > 1);
    assert!(selector.selection().leaves().iter().all(|zone| tree.summary(*zone).is_nice()));
}

#[test]
fn orthographic_sizes_do_not_depend_on_the_distance() {
    let tree = Arc::new(QuadTree::build(Kind::Flat.grid(64, 64)));
    let view = |height: f64, distance: f64| {
        let (middle, projection) = (DVec3::new(3.5, 2.5, 0.0), Projection::Orthographic { height });
        let camera = Camera::look_at(middle + DVec3::Z * distance, middle, DVec3::Y, projection);
        View::new(camera.unwrap(), UVec2::splat(512)).unwrap()
    };
    let leaves = |view: &View| {
        let mut selector = SizeSelector::new(tree.clone(), 16.0).unwrap();
        selector.update(view);
        selector.selection().leaves()
    };
    assert_eq!(leaves(&view(8.0, 1.0)), leaves(&view(8.0, 100.0)));
    // 512 pixels are 8 units: zones of 16 pixels are a quarter of a unit, twice the final zones' diagonal of 0.13.
    assert!(leaves(&view(8.0, 1.0)).iter().all(|zone| zone.level == Level(0) || zone.level == Level(1)));
    assert_eq!(leaves(&view(1e4, 1.0)), [tree.layout().root()]);
}

#[test]
fn leaves_that_are_no_selection_are_named() {
    let tree = QuadTree::build(Kind::Annulus.grid(16, 40));
    let zone = |level, row, column| Zone { level: Level(level), row, column };
    let error = |zones: &[Zone]| Selection::of_leaves(&tree, zones.iter().copied()).unwrap_err().to_string();
    assert_eq!(error(&[zone(0, 16, 3)]), "zone (16, 3) of level 0 is not in a grid of 16 x 40 zones");
    let (small, large) = (zone(0, 2, 3), zone(1, 1, 1));
    let message = "zone (1, 1) of level 1 is a leaf, and so is zone (2, 3) of level 0, which overlaps it";
    assert_eq!(error(&[small, large]), message);
    assert_eq!(
        error(&[large, small]),
        "zone (2, 3) of level 0 is a leaf, and so is zone (1, 1) of level 1, which overlaps it"
    );
    let message = "zone (0, 0) of level 5 must not be drawn as one quadrilateral: it is not nice, or it has holes";
    assert_eq!(error(&[tree.layout().root()]), message);
    assert!(SizeSelector::new(Arc::new(tree), 0.0).unwrap_err().to_string().contains("granularity of 0 pixels"));
    let camera = *view(DVec3::ONE, DVec3::ZERO).camera();
    assert_eq!(
        View::new(camera, UVec2::new(4, 0)).unwrap_err().to_string(),
        "a picture of 4 x 0 pixels; each side needs at least 1"
    );
}
