//! Meshes of selections: without cracks, upright, and no further from the data than their zones say.

use std::sync::Arc;

use crate::grids::{KINDS, Kind, random_leaves};
use brickfield_core::glam::{DVec2, DVec3, UVec2};
use brickfield_core::{Camera, Level};
use brickfield_curvilinear::*;
use proptest::prelude::*;

fn kinds() -> impl Strategy<Value = Kind> {
    proptest::sample::select(&KINDS[..])
}

fn areas(mesh: &SurrogateMesh) -> Vec<f64> {
    let area = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|v| mesh.positions[v as usize]);
        (b - a).cross(c - a).z * 0.5
    };
    mesh.triangles.iter().map(area).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn no_mesh_has_cracks(
        kind in kinds(), m in 3u32..40, n in 3u32..40, seed in 0u64..u64::MAX, holes in 0usize..3,
    ) {
        let tree = QuadTree::build(kind.grid(m, n).with_holes(|i| holes > 0 && i % 97 == 31));
        let selection = Selection::of_leaves(&tree, random_leaves(&tree, seed)).unwrap();
        let mesh = surrogate_mesh(tree.grid(), &selection).unwrap();
        prop_assert_eq!(check_mesh(tree.grid(), &selection, &mesh), Ok(()));
        prop_assert!(mesh.values.iter().all(|value| !value.is_nan()), "a hole is drawn");
        prop_assert_eq!(mesh.triangles.len(), 2 * selection.n_leaves() + mesh.n_moved);
        if kind.is_planar() {
            let areas = areas(&mesh);
            prop_assert!(areas.iter().all(|area| *area > 0.0), "{:?}", areas.iter().copied().fold(1.0, f64::min));
        }
    }

    #[test]
    fn vertices_are_as_far_from_the_data_as_their_zones_say(
        kind in kinds(), m in 3u32..40, n in 3u32..40, seed in 0u64..u64::MAX,
    ) {
        let (tree, mesh, bound) = patched(kind, m, n, seed);
        for (node, value) in mesh.nodes.iter().zip(&mesh.values) {
            let deviation = (tree.grid().value(*node) - value).abs();
            prop_assert!(deviation <= bound + 1e-6, "{deviation} > {bound}");
        }
    }

    #[test]
    fn all_nodes_of_height_fields_are(m in 3u32..40, n in 3u32..40, seed in 0u64..u64::MAX) {
        let (tree, mesh, bound) = patched(Kind::Waves, m, n, seed);
        for triangle in &mesh.triangles {
            for (node, drawn) in drawn_nodes(&mesh, *triangle) {
                let deviation = (f64::from(tree.grid().value(node)) - drawn).abs();
                prop_assert!(deviation <= f64::from(bound) + 1e-6, "{deviation} > {bound}");
            }
        }
    }
}

/// A mesh, and how far it may be from the data: a vertex may lie on an edge of a coarser zone, whose ends may lie on edges of coarser ones, so
/// that one error counts for each level.
fn patched(kind: Kind, m: u32, n: u32, seed: u64) -> (QuadTree, SurrogateMesh, f32) {
    let tree = QuadTree::build(kind.grid(m, n));
    let selection = Selection::of_leaves(&tree, random_leaves(&tree, seed)).unwrap();
    let mesh = surrogate_mesh(tree.grid(), &selection).unwrap();
    let mut errors = vec![0.0f32; usize::from(tree.layout().top().0) + 1];
    for leaf in selection.leaves() {
        let error = &mut errors[usize::from(leaf.level.0)];
        *error = error.max(tree.summary(leaf).error);
    }
    let bound = errors.iter().sum();
    (tree, mesh, bound)
}

/// The nodes under a triangle of a height field's mesh, with the values that are drawn there.
fn drawn_nodes(mesh: &SurrogateMesh, triangle: [u32; 3]) -> Vec<(Node, f64)> {
    let p = triangle.map(|v| mesh.nodes[v as usize]).map(|n| DVec2::new(f64::from(n.column), f64::from(n.row)));
    let v = triangle.map(|v| f64::from(mesh.values[v as usize]));
    let area = |a: DVec2, b: DVec2, c: DVec2| (b - a).perp_dot(c - a);
    let (low, high) = (p[0].min(p[1]).min(p[2]).as_uvec2(), p[0].max(p[1]).max(p[2]).as_uvec2());
    let nodes = (low.y..=high.y).flat_map(|row| (low.x..=high.x).map(move |column| Node { row, column }));
    let drawn = |node: Node| {
        let at = DVec2::new(f64::from(node.column), f64::from(node.row));
        let weights = [area(at, p[1], p[2]), area(p[0], at, p[2]), area(p[0], p[1], at)];
        let value = (0..3).map(|i| weights[i] * v[i]).sum::<f64>() / area(p[0], p[1], p[2]);
        weights.iter().all(|weight| *weight >= 0.0).then_some((node, value))
    };
    nodes.filter_map(drawn).collect()
}

#[test]
fn a_mesh_of_selected_zones_is_sound() {
    for kind in KINDS {
        let tree = Arc::new(QuadTree::build(kind.grid(64, 96)));
        let extent = tree.extent(tree.layout().root());
        let camera = Camera::framing(&extent, DVec3::new(1.0, -2.0, 1.5), DVec3::Z).unwrap();
        let view = View::new(camera, UVec2::new(640, 480)).unwrap();
        let mut by_size = SizeSelector::new(tree.clone(), 12.0).unwrap();
        let mut by_error = BudgetSelector::new(tree.clone());
        by_size.update(&view);
        by_error.update(&view, 1_500);
        for selection in [by_size.selection(), by_error.selection()] {
            let mesh = surrogate_mesh(tree.grid(), selection).unwrap();
            assert_eq!(check_mesh(tree.grid(), selection, &mesh), Ok(()), "{kind:?}");
            assert!(mesh.n_moved > 0, "{kind:?} has zones of one level only");
        }
    }
}

#[test]
fn a_coarse_zone_beside_fine_ones() {
    let field = HeightField { origin: DVec3::ZERO, along_column: DVec3::X, along_row: DVec3::Y, along_value: DVec3::Z };
    // Two rows of four zones; the node in the middle of the left half's right edge has the value 9.
    let values = (0..15).map(|i| if i == 7 { 9.0 } else { 0.0 }).collect();
    let tree = QuadTree::build(CurvilinearGrid::new(2, 4, Positions::Heights(field), values).unwrap());
    let left = Zone { level: Level(1), row: 0, column: 0 };
    let right = [(0, 2), (0, 3), (1, 2), (1, 3)].map(|(row, column)| Zone { level: Level(0), row, column });
    let selection = Selection::of_leaves(&tree, right.into_iter().chain([left])).unwrap();
    let mesh = surrogate_mesh(tree.grid(), &selection).unwrap();
    // The coarse zone has three triangles; the vertex on its edge is drawn where the edge is, at value 0.
    assert_eq!((mesh.triangles.len(), mesh.n_moved), (4 * 2 + 3, 1));
    let moved = mesh.nodes.iter().position(|node| *node == Node { row: 1, column: 2 }).unwrap();
    assert_eq!((mesh.positions[moved], mesh.values[moved]), (DVec3::new(2.0, 1.0, 0.0), 0.0));
    assert_eq!(areas(&mesh).iter().sum::<f64>(), 8.0);
    assert_eq!(mesh.positions_from(DVec3::X)[moved].x, 1.0);
}

#[test]
fn only_the_drawn_zones_meet_at_a_border() {
    // The same coarse zone with nothing beside it is two triangles.
    let tree = QuadTree::build(Kind::Waves.grid(2, 4));
    let left = Zone { level: Level(1), row: 0, column: 0 };
    let selection = Selection::of_leaves(&tree, [left]).unwrap();
    let mesh = surrogate_mesh(tree.grid(), &selection).unwrap();
    assert_eq!((mesh.triangles.len(), mesh.n_moved), (2, 0));
    assert_eq!(check_mesh(tree.grid(), &selection, &mesh), Ok(()));
}

#[test]
fn a_selection_of_another_grid_is_named() {
    let [tree, other] = [4, 5].map(|n| QuadTree::build(Kind::Flat.grid(4, n)));
    let selection = Selection::of_leaves(&other, [other.layout().root()]).unwrap();
    let error = surrogate_mesh(tree.grid(), &selection).unwrap_err().to_string();
    assert_eq!(error, "a selection of 4 x 5 zones; the grid has 4 x 4");
}

#[test]
fn holes_on_a_seam_are_holes_on_both_sides() {
    let grid = Kind::Torus.grid(5, 7).with_holes(|i| i == 3);
    let is_hole = |row, column| grid.value(Node { row, column }).is_nan();
    assert!(is_hole(0, 3) && is_hole(5, 3) && !is_hole(1, 3));
    assert_eq!(grid.clone().with_ends(grid.ends()).map(|grid| grid.ends()), Ok(Kind::Torus.ends()));
}
