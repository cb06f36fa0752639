//! Addresses, against a tree with pointers, for all grids of up to 33 x 33 zones.

use brickfield_core::Level;
use brickfield_curvilinear::*;

const LONGEST: u32 = 33;

/// A zone that owns its children; a final zone has none.
struct Pointers {
    zone: Zone,
    children: Vec<Pointers>,
}

/// Groups of two neighbours; the last group takes the one that is left over, too.
fn grouped<T>(items: Vec<T>) -> Vec<Vec<T>> {
    let mut groups: Vec<Vec<T>> = Vec::new();
    let n = items.len();
    for (i, item) in items.into_iter().enumerate() {
        if i % 2 == 0 && (i + 1 < n || n == 1) {
            groups.push(Vec::new());
        }
        groups.last_mut().unwrap().push(item);
    }
    groups
}

/// Built from the final zones up, by joining neighbours until one zone is left.
fn pointer_tree(n_rows: u32, n_columns: u32) -> Pointers {
    let leaf = |row, column| Pointers { zone: Zone { level: Level(0), row, column }, children: Vec::new() };
    let mut table: Vec<Vec<Pointers>> =
        (0..n_rows).map(|row| (0..n_columns).map(|column| leaf(row, column)).collect()).collect();
    let mut level = 0;
    while table.len() * table[0].len() > 1 {
        level += 1;
        let joined_rows = grouped(table).into_iter().enumerate().map(|(row, rows)| {
            let mut columns: Vec<Vec<Pointers>> = rows[0].iter().map(|_| Vec::new()).collect();
            for zones in rows {
                zones.into_iter().zip(&mut columns).for_each(|(zone, column)| column.push(zone));
            }
            let joined = grouped(columns).into_iter().enumerate().map(|(column, group)| Pointers {
                zone: Zone { level: Level(level), row: row as u32, column: column as u32 },
                children: group.into_iter().flatten().collect(),
            });
            joined.collect()
        });
        table = joined_rows.collect();
    }
    table.remove(0).remove(0)
}

/// Holds addresses below a zone against the pointers, and returns its final zones.
fn compare(layout: &QuadLayout, tree: &Pointers, n_seen: &mut [usize]) -> Vec<Zone> {
    let zone = tree.zone;
    assert!(layout.contains(zone));
    assert_eq!(layout.zone_at(zone.level, layout.address(zone)), zone);
    n_seen[usize::from(zone.level.0)] += 1;
    let by_address: Vec<Zone> = layout.children(zone).collect();
    let mut by_pointer: Vec<Zone> = tree.children.iter().map(|child| child.zone).collect();
    by_pointer.sort();
    assert_eq!(by_address, by_pointer, "children of {zone}");
    assert!(by_address.iter().all(|child| layout.parent(*child) == Some(zone)));

    let mut finals: Vec<Zone> = tree.children.iter().flat_map(|child| compare(layout, child, n_seen)).collect();
    if zone.level == Level(0) {
        finals.push(zone);
    }
    finals.sort();
    let range = layout.descendants(zone);
    let of_range =
        range.rows.flat_map(|row| range.columns.clone().map(move |column| Zone { level: Level(0), row, column }));
    assert!(of_range.eq(finals.iter().copied()), "final zones of {zone}");
    assert!(finals.iter().all(|f| layout.ancestor(zone.level, f.row, f.column) == zone));
    finals
}

#[test]
fn addresses_agree_with_pointers() {
    for (m, n) in (1..=LONGEST).flat_map(|m| (1..=LONGEST).map(move |n| (m, n))) {
        let layout = QuadLayout::new(m, n).unwrap();
        let tree = pointer_tree(m, n);
        assert_eq!(layout.root(), tree.zone, "{m} x {n}");
        assert_eq!(layout.parent(layout.root()), None);
        let mut n_seen = vec![0; usize::from(layout.top().0) + 1];
        let finals = compare(&layout, &tree, &mut n_seen);
        assert_eq!(finals.len(), (m * n) as usize);
        // Each zone was seen once, so that every final zone lies below exactly one zone of each level.
        assert!(layout.levels().map(|level| layout.n_zones(level)).eq(n_seen));
    }
}

#[test]
fn numbers_of_children() {
    for (m, n) in (1..=LONGEST).flat_map(|m| (1..=LONGEST).map(move |n| (m, n))) {
        let layout = QuadLayout::new(m, n).unwrap();
        for level in layout.levels().skip(1) {
            let [rows, columns] = [layout.rows(), layout.columns()];
            for zone in (0..layout.n_zones(level)).map(|i| layout.zone_at(level, i)) {
                // Two along a split axis, three at the slop, one along an axis that is not split.
                let along = |axis: &SplitAxis, i: u32| match axis.is_split(level) {
                    false => 1,
                    true if axis.has_slop(level) && i + 1 == axis.n(level) => 3,
                    true => 2,
                };
                let expected = along(rows, zone.row) * along(columns, zone.column);
                assert_eq!(layout.children(zone).count(), expected);
                assert!([2, 3, 4, 6, 9].contains(&expected));
            }
        }
    }
}

#[test]
fn slop_of_the_paper() {
    let children = |m, n, level, row, column| {
        QuadLayout::new(m, n).unwrap().children(Zone { level: Level(level), row, column }).count()
    };
    // Figure 3: the last of two zones over five has three children.
    assert_eq!([children(1, 5, 1, 0, 0), children(1, 5, 1, 0, 1)], [2, 3]);
    // Three, six or nine children in the last position, four elsewhere.
    let last_and_first = [children(5, 7, 1, 1, 2), children(5, 7, 1, 0, 0)];
    assert_eq!(last_and_first, [9, 4]);
    assert_eq!([children(5, 7, 1, 1, 0), children(5, 7, 1, 0, 2)], [6, 6]);
}

#[test]
fn the_shorter_axis_is_split_as_late_as_possible() {
    // 4 rows, 64 columns: only columns near the root, both near the final zones.
    for (m, n) in [(4, 64), (64, 4)] {
        let layout = QuadLayout::new(m, n).unwrap();
        let (short, long) = if m < n { (layout.rows(), layout.columns()) } else { (layout.columns(), layout.rows()) };
        let split = |axis: &SplitAxis| layout.levels().skip(1).map(|l| axis.is_split(l)).collect::<Vec<_>>();
        assert_eq!(split(short), [true, true, false, false, false, false]);
        assert_eq!(split(long), [true; 6]);
    }
}

#[test]
fn siblings_share_an_edge_or_a_vertex() {
    let layout = QuadLayout::new(9, 14).unwrap();
    for level in layout.levels() {
        let zones: Vec<Zone> = (0..layout.n_zones(level)).map(|i| layout.zone_at(level, i)).collect();
        for zone in &zones {
            let near = |other: &&Zone| {
                *other != zone && other.row.abs_diff(zone.row) <= 1 && other.column.abs_diff(zone.column) <= 1
            };
            assert!(layout.siblings(*zone).eq(zones.iter().filter(near).copied()));
        }
    }
}

#[test]
fn the_longest_axes_do_not_overflow() {
    let layout = QuadLayout::new(QuadLayout::MAX_ZONES, 1).unwrap();
    for level in layout.levels() {
        let last = Zone { level, row: layout.rows().n(level) - 1, column: 0 };
        assert_eq!(layout.descendants(last).rows.end, QuadLayout::MAX_ZONES);
        assert_eq!(layout.ancestor(level, QuadLayout::MAX_ZONES - 1, 0), last);
        assert!(layout.children(last).all(|child| layout.parent(child) == Some(last)));
    }
}

#[test]
fn layouts_without_zones_are_named() {
    let error = |m, n| QuadLayout::new(m, n).unwrap_err().to_string();
    assert_eq!(error(0, 4), "a grid's rows of 0 zones; each axis needs at least 1");
    assert_eq!(error(4, u32::MAX), "a grid's columns of 4294967295 zones; at most 4294967294 are possible");
}
