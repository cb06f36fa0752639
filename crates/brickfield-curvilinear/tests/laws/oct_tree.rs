//! Summaries of an octree's zones, and faces of volumes as surfaces.

use brickfield_core::Level;
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_curvilinear::*;
use proptest::prelude::*;

fn nodes(n: UVec3) -> impl Iterator<Item = UVec3> {
    (0..=n.z).flat_map(move |z| (0..=n.y).flat_map(move |y| (0..=n.x).map(move |x| UVec3::new(x, y, z))))
}

/// A part of a ring, twisted along z.
fn twisted(n: UVec3) -> CurvilinearVolume {
    let at = |node: UVec3| {
        let p = node.as_dvec3() / n.as_dvec3();
        let (radius, angle) = (1.0 + p.x, 1.5 * p.y + 0.3 * p.z);
        DVec3::new(radius * angle.cos(), radius * angle.sin(), p.z + 0.1 * p.y)
    };
    CurvilinearVolume::new(n, nodes(n).map(at).collect()).unwrap()
}

fn sheared(n: UVec3) -> CurvilinearVolume {
    let at = |node: UVec3| {
        let p = node.as_dvec3();
        DVec3::new(p.x + 0.25 * p.y, p.y - 0.5 * p.z, 0.75 * p.z)
    };
    CurvilinearVolume::new(n, nodes(n).map(at).collect()).unwrap()
}

fn number(n: UVec3, node: UVec3) -> usize {
    (node.x + (n.x + 1) * (node.y + (n.y + 1) * node.z)) as usize
}

fn zones(layout: &OctLayout) -> impl Iterator<Item = OctZone> + use<> {
    let layout = *layout;
    layout.levels().flat_map(move |level| (0..layout.n_zones(level)).map(move |i| layout.zone_at(level, i)))
}

fn nodes_of(cells: CellBox) -> impl Iterator<Item = UVec3> {
    nodes(cells.n).map(move |node| cells.first + node)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn boxes_and_ranges_hold_all_nodes(x in 1u32..9, y in 1u32..7, z in 1u32..6, seed in any::<u32>()) {
        let n = UVec3::new(x, y, z);
        let value = |i: usize| ((i as u32).wrapping_mul(2_654_435_761) ^ seed) as f32 / 1e9;
        let volume = twisted(n);
        let values: Vec<f32> = (0..volume.positions().len()).map(value).collect();
        let tree = OctTree::build(volume, values.clone()).unwrap();
        for zone in zones(tree.layout()) {
            let (extent, summary) = (tree.extent(zone), tree.summary(zone));
            let [low, high] = summary.range;
            for node in nodes_of(tree.layout().descendants(zone)) {
                let i = number(n, node);
                let p = tree.volume().positions()[i];
                prop_assert!(p.cmpge(extent.min).all() && p.cmple(extent.max).all(), "{} of {zone}", p);
                prop_assert!((low..=high).contains(&values[i]));
            }
            let nodes = || nodes_of(tree.layout().descendants(zone)).map(|node| values[number(n, node)]);
            prop_assert_eq!([low, high], [nodes().fold(f32::INFINITY, f32::min), nodes().fold(f32::NEG_INFINITY, f32::max)]);
        }
    }

    /// The mean of a zone is that of its cells, children weighted by their cells; so is that of cells without holes.
    #[test]
    fn means_are_those_of_cells(x in 1u32..8, y in 1u32..7, z in 1u32..6, hole in 0usize..400) {
        let n = UVec3::new(x, y, z);
        let volume = sheared(n);
        let mut values: Vec<f32> = (0..volume.positions().len()).map(|i| (i * i % 97) as f32).collect();
        if hole < values.len() {
            values[hole] = f32::NAN;
        }
        let tree = OctTree::build(volume, values.clone()).unwrap();
        for zone in zones(tree.layout()) {
            let CellBox { first, n: n_zone } = tree.layout().descendants(zone);
            let cells = nodes(n_zone - 1).map(|cell| first + cell);
            let mean = |cell: UVec3| nodes(UVec3::ONE).map(|c| f64::from(values[number(n, cell + c)])).sum::<f64>() / 8.0;
            let means: Vec<f64> = cells.map(mean).filter(|m| !m.is_nan()).collect();
            let summary = tree.summary(zone);
            prop_assert_eq!(summary.is_void(), means.is_empty());
            let expected = means.iter().sum::<f64>() / means.len() as f64;
            prop_assert!(means.is_empty() || (f64::from(summary.value) - expected).abs() < 1e-4 * (1.0 + expected));
            let has_hole = nodes_of(CellBox { first, n: n_zone }).any(|node| values[number(n, node)].is_nan());
            prop_assert_eq!(has_hole, summary.error.is_infinite());
        }
    }
}

/// In sheared cells a linear field is drawn exactly at every level; a peak at one node is missed by all of itself.
#[test]
fn errors_are_those_of_the_coarse_cell() {
    let n = UVec3::new(8, 7, 6);
    let linear = |p: &DVec3| (2.0 * p.x - p.y + 0.5 * p.z) as f32;
    let values: Vec<f32> = sheared(n).positions().iter().map(linear).collect();
    let tree = OctTree::build(sheared(n), values.clone()).unwrap();
    assert!(zones(tree.layout()).all(|zone| tree.summary(zone).error < 1e-5));
    let mut peaked = values;
    peaked[number(n, UVec3::new(3, 3, 3))] += 5.0;
    let tree = OctTree::build(sheared(n), peaked).unwrap();
    for zone in zones(tree.layout()) {
        let cells = tree.layout().descendants(zone);
        let has_peak = nodes_of(cells).any(|node| node == UVec3::splat(3));
        let (first, end) = (cells.first, cells.first + cells.n);
        let is_corner = (0..3).all(|axis| first[axis] == 3 || end[axis] == 3);
        if !has_peak {
            assert!(tree.summary(zone).error < 1e-5);
        } else if !is_corner {
            assert!((tree.summary(zone).error - 5.0).abs() < 1e-4, "{zone}");
        }
    }
    assert!((tree.summary(tree.layout().root()).error - 5.0).abs() < 1e-4);
}

/// A smooth field on a smooth grid: errors fall with the square of the zones' size.
#[test]
fn errors_fall_by_four_from_level_to_level() {
    let n = UVec3::splat(64);
    let field = |p: &DVec3| ((1.5 * p.x).sin() + (p.y + 2.0 * p.z).cos()) as f32;
    let volume = twisted(n);
    let values: Vec<f32> = volume.positions().iter().map(field).collect();
    let tree = OctTree::build(volume, values).unwrap();
    let worst = |level: u8| tree.summaries(Level(level)).iter().map(|s| s.error).fold(0.0, f32::max);
    for level in 1..4 {
        let ratio = worst(level + 1) / worst(level);
        assert!((3.3..4.7).contains(&ratio), "level {level}: {ratio}");
    }
    let account = tree.byte_account();
    assert_eq!((account.bytes_per_zone, account.n_stored_zones), (32, (1 << 15) + (1 << 12) + (1 << 9) + 64 + 8 + 1));
    assert!(account.ratio() < 0.16, "{}", account.ratio());
}

#[test]
fn bad_values_are_named() {
    let error = |values: Vec<f32>| OctTree::build(sheared(UVec3::ONE), values).unwrap_err().to_string();
    assert_eq!(error(vec![0.0; 7]), "7 values for 8 nodes");
    assert!(error(vec![f32::INFINITY; 8]).starts_with("node (0, 0, 0) has the value inf"));
}

#[test]
fn the_faces_of_a_volume_are_its_outer_nodes() {
    let n = UVec3::new(5, 4, 3);
    let volume = twisted(n);
    let values: Vec<f32> = (0..volume.positions().len()).map(|i| i as f32).collect();
    let whole = volume.layout().descendants(volume.layout().root());
    let sizes = [(4, 3), (4, 3), (3, 5), (3, 5), (5, 4), (5, 4)];
    for (plane, (columns, rows)) in whole.faces().into_iter().zip(sizes) {
        let surface = volume.surface(&values, &whole, plane).unwrap();
        assert_eq!((surface.n_columns(), surface.n_rows()), (columns, rows));
        for row in 0..=rows {
            for column in 0..=columns {
                let node = match plane {
                    IndexPlane::X(x) => UVec3::new(x, column, row),
                    IndexPlane::Y(y) => UVec3::new(row, y, column),
                    IndexPlane::Z(z) => UVec3::new(column, row, z),
                };
                let (i, at) = (number(n, node), Node { row, column });
                assert_eq!((surface.value(at), surface.position(at)), (values[i], volume.positions()[i]));
            }
        }
        // The two-dimensional half takes it from here.
        let tree = QuadTree::build(surface);
        assert_eq!(tree.layout().top(), Level(2));
    }
}

#[test]
fn a_zone_has_faces_and_slices_and_no_others() {
    let volume = twisted(UVec3::new(8, 8, 8));
    let values = vec![1.0; volume.positions().len()];
    let cells = volume.layout().descendants(OctZone { level: Level(1), coords: UVec3::new(1, 2, 3) });
    assert_eq!(cells.faces()[2..4], [IndexPlane::Y(4), IndexPlane::Y(6)]);
    assert_eq!(volume.surface(&values, &cells, IndexPlane::Y(5)).unwrap().n_rows(), 2);
    let error = |values: &[f32], cells: &CellBox, plane| volume.surface(values, cells, plane).unwrap_err().to_string();
    assert_eq!(error(&values, &cells, IndexPlane::Y(7)), "Y(7) of cells with nodes from 4 to 6 along that axis");
    assert!(error(&[], &cells, IndexPlane::Y(5)).starts_with("0 values"));
    let beyond = CellBox { first: UVec3::splat(7), n: UVec3::splat(2) };
    assert!(error(&values, &beyond, IndexPlane::X(7)).starts_with("cells from [7, 7, 7] to [9, 9, 9]"));
}
