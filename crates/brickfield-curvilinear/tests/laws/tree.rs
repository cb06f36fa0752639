//! Summaries of zones, against plain definitions.

use crate::grids::{KINDS, Kind, coarse_zones};
use brickfield_core::Level;
use brickfield_core::glam::DVec3;
use brickfield_curvilinear::*;
use proptest::prelude::*;

fn nodes(range: &ZoneRange) -> impl Iterator<Item = Node> {
    let columns = range.columns.start..=range.columns.end;
    (range.rows.start..=range.rows.end).flat_map(move |row| columns.clone().map(move |column| Node { row, column }))
}

/// The value that two triangles show at a point of their common plane, seen along `normal`; `None` outside.
fn drawn_value(p: [DVec3; 4], v: [f64; 4], normal: DVec3, at: DVec3) -> Option<f64> {
    let split = if p[1].distance(p[3]) < p[0].distance(p[2]) { [[1, 2, 3], [3, 0, 1]] } else { [[0, 1, 2], [2, 3, 0]] };
    split.into_iter().find_map(|t| {
        let area = |a: DVec3, b: DVec3, c: DVec3| (b - a).cross(c - a).dot(normal);
        let [a, b, c] = t.map(|i| p[i]);
        let weights = [area(at, b, c), area(a, at, c), area(a, b, at)].map(|w| w / area(a, b, c));
        let is_inside = weights.iter().all(|w| *w > -1e-12);
        is_inside.then(|| (0..3).map(|i| weights[i] * v[t[i]]).sum())
    })
}

/// The deviations of all nodes from the zone as it is drawn; `None` if an inner node lies outside.
fn deviation(grid: &CurvilinearGrid, range: &ZoneRange) -> Option<f64> {
    let node = |row, column| Node { row, column };
    let (rows, columns) = (&range.rows, &range.columns);
    let corners = [
        node(rows.start, columns.start),
        node(rows.start, columns.end),
        node(rows.end, columns.end),
        node(rows.end, columns.start),
    ];
    let is_height_field = matches!(grid.positions(), Positions::Heights(_));
    let at = |n: Node| match is_height_field {
        true => DVec3::new(f64::from(n.column), f64::from(n.row), 0.0),
        false => grid.position(n),
    };
    let (p, v) = (corners.map(at), corners.map(|n| f64::from(grid.value(n))));
    let normal = (p[2] - p[0]).cross(p[3] - p[1]);
    let mut most: f64 = 0.0;
    for n in nodes(range) {
        let edges = [n.row == rows.start, n.column == columns.end, n.row == rows.end, n.column == columns.start];
        let drawn = match edges.iter().position(|on| *on) {
            // On an edge: at the nearest point of it.
            Some(i) => {
                let (a, b) = (i, (i + 1) % 4);
                let t = (at(n) - p[a]).dot(p[b] - p[a]) / p[a].distance_squared(p[b]);
                v[a] * (1.0 - t) + v[b] * t
            }
            None => drawn_value(p, v, normal, at(n))?,
        };
        most = most.max((f64::from(grid.value(n)) - drawn).abs());
    }
    Some(most)
}

fn kinds() -> impl Strategy<Value = Kind> {
    proptest::sample::select(&KINDS[..])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn errors_are_those_of_the_definition_and_never_below(kind in kinds(), m in 3u32..40, n in 3u32..40) {
        let tree = QuadTree::build(kind.grid(m, n));
        for zone in coarse_zones(tree.layout()) {
            let summary = tree.summary(zone);
            let expected = deviation(tree.grid(), &tree.layout().descendants(zone));
            if summary.is_nice() {
                let expected = expected.expect("a nice zone has its nodes inside");
                prop_assert!(f64::from(summary.error) >= expected - 1e-13, "{zone}: {} < {expected}", summary.error);
                prop_assert!(f64::from(summary.error) <= expected + 1e-6, "{zone}: {} > {expected}", summary.error);
            }
        }
    }

    #[test]
    fn boxes_hold_all_nodes_and_are_tight(kind in kinds(), m in 3u32..40, n in 3u32..40) {
        let tree = QuadTree::build(kind.grid(m, n));
        for zone in coarse_zones(tree.layout()) {
            let range = tree.layout().descendants(zone);
            let extent = tree.extent(zone);
            let positions: Vec<DVec3> = nodes(&range).map(|node| tree.grid().position(node)).collect();
            prop_assert!(positions.iter().all(|p| p.cmpge(extent.min).all() && p.cmple(extent.max).all()), "{zone}");
            // An axis is extended on both sides by what one side needs: at least one of the sides touches a node.
            for axis in 0..3 {
                let (low, high) = positions.iter().fold((f64::MAX, f64::MIN), |(l, h), p| (l.min(p[axis]), h.max(p[axis])));
                let gap = (low - extent.min[axis]).min(extent.max[axis] - high);
                prop_assert!(gap <= 1e-5, "{zone} has a gap of {gap}");
            }
        }
    }

    #[test]
    fn values_are_means_of_final_zones(kind in kinds(), m in 3u32..30, n in 3u32..30, holes in 0u64..u64::MAX) {
        let is_hole = |i: usize| holes != 0 && (i as u64).wrapping_mul(holes | 1) >> 32 & 15 == 0;
        let tree = QuadTree::build(kind.grid(m, n).with_holes(is_hole));
        for zone in coarse_zones(tree.layout()) {
            let range = tree.layout().descendants(zone);
            let finals = range.rows.clone().flat_map(|row| {
                range.columns.clone().map(move |column| Zone { level: Level(0), row, column })
            });
            let drawn: Vec<f64> =
                finals.map(|f| f64::from(tree.summary(f).value)).filter(|v| !v.is_nan()).collect();
            let summary = tree.summary(zone);
            prop_assert_eq!(summary.is_void(), drawn.is_empty());
            let mean = drawn.iter().sum::<f64>() / drawn.len() as f64;
            prop_assert!(drawn.is_empty() || (f64::from(summary.value) - mean).abs() < 1e-6);
            let has_hole = nodes(&range).any(|node| tree.grid().value(node).is_nan());
            prop_assert!(!(has_hole && summary.is_nice()), "{zone} has a hole and may be drawn coarse");
        }
    }
}

#[test]
fn weights_of_figure_8() {
    let field = HeightField { origin: DVec3::ZERO, along_column: DVec3::X, along_row: DVec3::Y, along_value: DVec3::Z };
    let weight = |i: usize| {
        let values = (0..9).map(|j| if i == j { 16.0 } else { 0.0 }).collect();
        let tree = QuadTree::build(CurvilinearGrid::new(2, 2, Positions::Heights(field), values).unwrap());
        tree.summary(tree.layout().root()).value
    };
    let weights: Vec<f32> = (0..9).map(weight).collect();
    assert_eq!(weights, [1.0, 2.0, 1.0, 2.0, 4.0, 2.0, 1.0, 2.0, 1.0]);
}

#[test]
fn linear_values_have_no_error_on_uneven_grids() {
    // Rows and columns are straight, their distances uneven. Where an edge is curved its nodes are moved, and so have errors.
    let uneven = |i: u32| 0.1 * f64::from(i) + 0.01 * f64::from(i * i);
    let positions: Vec<DVec3> = (0..25 * 25).map(|i| DVec3::new(uneven(i % 25), uneven(i / 25), 0.0)).collect();
    let values = positions.iter().map(|p| (0.5 * p.x - 2.0 * p.y) as f32).collect();
    let tree = QuadTree::build(CurvilinearGrid::new(24, 24, Positions::Curvilinear(positions), values).unwrap());
    let errors: Vec<f32> = coarse_zones(tree.layout()).map(|zone| tree.summary(zone).error).collect();
    assert!(errors.iter().all(|error| *error < 2e-6), "{errors:?}");
}

/// A zone of 4 x 4 final zones in a plane, after one node of 5 x 5 was moved.
fn moved_node(row: u32, column: u32, to: DVec3) -> Niceness {
    let nodes = (0..=6).flat_map(|r| (0..=6).map(move |c| (r, c)));
    let position = |(r, c)| if (r, c) == (row, column) { to } else { DVec3::new(f64::from(c), f64::from(r), 0.0) };
    let positions = Positions::Curvilinear(nodes.map(position).collect());
    let grid = CurvilinearGrid::new(6, 6, positions, vec![1.0; 49]).unwrap();
    examine(&grid, &ZoneRange { rows: 0..4, columns: 0..4 }).1
}

#[test]
fn zones_that_are_not_nice_are_told_apart() {
    assert_eq!(moved_node(2, 2, DVec3::new(2.5, 2.4, 0.3)), Niceness::Nice);
    assert_eq!(moved_node(2, 2, DVec3::new(4.5, 2.0, 0.0)), Niceness::NodeOutside);
    assert_eq!(moved_node(4, 4, DVec3::new(1.0, 1.0, 0.0)), Niceness::NotConvex);
    assert_eq!(moved_node(2, 4, DVec3::new(4.1, 0.5, 0.0)), Niceness::EdgeTurnsBack);
    assert_eq!(moved_node(2, 5, DVec3::new(3.9, 2.0, 0.0)), Niceness::NeighbourInside);
    // A node of the common edge may lie on either side: it is moved onto the edge.
    assert_eq!(moved_node(2, 4, DVec3::new(4.3, 2.0, 0.0)), Niceness::Nice);
    assert_eq!(moved_node(2, 4, DVec3::new(3.7, 2.0, 0.0)), Niceness::Nice);
}

#[test]
fn niceness_of_the_generated_grids() {
    let share = |kind: Kind, n: u32| {
        let tree = QuadTree::build(kind.grid(n, n));
        let zones: Vec<Zone> = coarse_zones(tree.layout()).collect();
        let n_nice = zones.iter().filter(|zone| tree.summary(**zone).is_nice()).count();
        n_nice as f64 / zones.len() as f64
    };
    assert_eq!([Kind::Flat, Kind::Waves].map(|kind| share(kind, 64)), [1.0, 1.0]);
    // Coarse chords of circles leave out nodes; at fine levels they do not.
    for kind in [Kind::Annulus, Kind::Torus] {
        assert!((0.5..1.0).contains(&share(kind, 64)), "{kind:?} {}", share(kind, 64));
        let tree = QuadTree::build(kind.grid(64, 64));
        assert!(!tree.summary(tree.layout().root()).is_nice());
    }
}

#[test]
fn bytes_of_the_hierarchy() {
    let tree = QuadTree::build(Kind::Flat.grid(64, 64));
    let account = tree.byte_account();
    // 1/16 + 1/64 + ... of the final zones, 24 bytes each; positions in f64 and values take 28 bytes a node.
    assert_eq!((account.n_stored_zones, account.bytes_per_zone), (256 + 64 + 16 + 4 + 1, 24));
    assert_eq!(account.data_bytes, 65 * 65 * 28);
    assert!((account.ratio() - 0.0692).abs() < 1e-4, "{}", account.ratio());
    let n_stored = |level| tree.summaries(Level(level)).len();
    assert_eq!([0, 1, 2, 6].map(n_stored), [0, 0, 256, 1]);
}

#[test]
fn bands_of_threads_give_the_same_summary() {
    // 700 x 700 nodes are looked at in bands.
    let grid = Kind::Waves.grid(700, 700);
    let whole = ZoneRange { rows: 0..700, columns: 0..700 };
    let pool = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
    let [one, two] = [1, 2].map(|n| pool(n).install(|| examine(&grid, &whole)));
    assert_eq!(one, two);
    let expected = deviation(&grid, &whole).unwrap();
    assert!((f64::from(one.0.error) - expected).abs() < 1e-6);
}

#[test]
fn bad_grids_are_named() {
    let error = |positions, values: Vec<f32>| CurvilinearGrid::new(1, 2, positions, values).unwrap_err().to_string();
    let six = || Positions::Curvilinear(vec![DVec3::ZERO; 6]);
    assert_eq!(error(six(), vec![0.0; 5]), "5 values; a grid of 1 x 2 zones has 6 nodes");
    assert_eq!(error(Positions::Curvilinear(vec![]), vec![0.0; 6]), "0 positions; a grid of 1 x 2 zones has 6 nodes");
    let mut values = vec![0.0; 6];
    values[4] = f32::NEG_INFINITY;
    let message = "the node of row 1 and column 1 has the value -inf; it must be finite, or NaN for a hole";
    assert_eq!(error(six(), values), message);
    let mut positions = vec![DVec3::ZERO; 6];
    positions[2].y = f64::NAN;
    let message = error(Positions::Curvilinear(positions), vec![0.0; 6]);
    assert_eq!(message, "the node of row 0 and column 2 lies at [0, NaN, 0]; it must be finite");

    let open = Kind::Annulus.grid(4, 8);
    let ends = GridEnds { rows: End::Closed, columns: End::Open };
    let message = open.with_ends(ends).unwrap_err().to_string();
    assert!(
        message
            .starts_with("the rows are closed, but the node of row 4 and column 0 is another one than that of row 0")
    );
    let short = CurvilinearGrid::new(1, 2, six(), vec![0.0; 6]).unwrap().with_ends(ends).unwrap_err().to_string();
    assert_eq!(short, "a closed axis of 1 rows; it needs at least 3");
}
