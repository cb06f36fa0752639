//! Addresses in three dimensions, against sets of cells that are joined step by step, for all grids of up to 11 x 11 x 11 cells.

use brickfield_core::Level;
use brickfield_core::glam::UVec3;
use brickfield_curvilinear::*;

const LONGEST: u32 = 11;

/// For one axis: which cells each zone holds, level by level, by joining neighbours until one zone is left.
fn joined(n: u32) -> Vec<Vec<Vec<u32>>> {
    let mut levels = vec![(0..n).map(|i| vec![i]).collect::<Vec<_>>()];
    while levels[levels.len() - 1].len() > 1 {
        let below = &levels[levels.len() - 1];
        let mut zones: Vec<Vec<u32>> = below.chunks_exact(2).map(<[Vec<u32>]>::concat).collect();
        if below.len() % 2 == 1 {
            let left_over = below[below.len() - 1].clone();
            zones.last_mut().unwrap().extend(left_over);
        }
        levels.push(zones);
    }
    levels
}

#[test]
fn addresses_agree_with_joined_cells() {
    let joined: Vec<Vec<Vec<Vec<u32>>>> = (0..=LONGEST).map(|n| joined(n.max(1))).collect();
    let sizes = (1..=LONGEST).flat_map(|x| (1..=LONGEST).flat_map(move |y| (1..=LONGEST).map(move |z| [x, y, z])));
    for size in sizes {
        let layout = OctLayout::new(UVec3::from(size)).unwrap();
        let axes = size.map(|n| &joined[n as usize]);
        assert_eq!(usize::from(layout.top().0) + 1, axes.iter().map(|axis| axis.len()).max().unwrap());
        for level in layout.levels() {
            let zones = axes.map(|axis| &axis[usize::from(level.0).min(axis.len() - 1)]);
            assert_eq!(layout.n(level).to_array(), zones.map(|zones| zones.len() as u32));
            let mut n_cells = 0;
            for address in 0..layout.n_zones(level) {
                let zone = layout.zone_at(level, address);
                assert_eq!((layout.address(zone), layout.contains(zone)), (address, true));
                let cells = [0, 1, 2].map(|axis| &zones[axis][zone.coords[axis] as usize]);
                let range = layout.descendants(zone);
                let along = |axis: usize| (range.first[axis]..range.first[axis] + range.n[axis]).collect::<Vec<_>>();
                assert_eq!([0, 1, 2].map(along).each_ref(), cells, "{zone} of {size:?}");
                n_cells += cells.iter().map(|cells| cells.len()).product::<usize>();
                let ends = cells.map(|cells| [cells[0], cells[cells.len() - 1]]);
                for cell in [0, 1].map(|end| UVec3::from(ends.map(|ends| ends[end]))) {
                    assert_eq!(layout.ancestor(level, cell), zone);
                }
                for child in layout.children(zone) {
                    assert!(layout.contains(child) && layout.parent(child) == Some(zone));
                }
                // The children hold the cells of the zone.
                let of_children: u32 =
                    layout.children(zone).map(|child| layout.descendants(child).n.element_product()).sum();
                assert_eq!(of_children, if level == Level(0) { 0 } else { range.n.element_product() });
            }
            // Every cell lies in one zone of each level.
            assert_eq!(n_cells as u32, size.iter().product());
        }
    }
}

#[test]
fn numbers_of_children_in_three_dimensions() {
    let children = |n: [u32; 3]| {
        let layout = OctLayout::new(UVec3::from(n)).unwrap();
        layout.children(layout.root()).count()
    };
    assert_eq!(children([2, 2, 2]), 8);
    assert_eq!([children([3, 2, 2]), children([3, 3, 2]), children([3, 3, 3])], [12, 18, 27]);
    assert_eq!([children([8, 2, 1]), children([1, 1, 1])], [2, 0]);
}

#[test]
fn octrees_without_cells_are_named() {
    let error = |n: [u32; 3]| OctLayout::new(UVec3::from(n)).unwrap_err().to_string();
    assert_eq!(error([4, 0, 4]), "a grid of 4 x 0 x 4 cells; each axis needs at least 1");
    assert_eq!(
        error([1 << 31, 1 << 31, 2]),
        "a grid of 2147483648 x 2147483648 x 2 cells; at most 4611686018427387904 are possible"
    );
    assert!(OctLayout::new(UVec3::new(1 << 31, 1 << 31, 1)).is_ok());
}
