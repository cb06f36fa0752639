//! Rays through curvilinear cells, against analytic grids; and rays at corners, edges and faces, which must not slip through.

use std::f64::consts::TAU;

use brickfield_core::Ray;
use brickfield_core::glam::{DMat3, DVec3, UVec3};
use brickfield_curvilinear::*;
use proptest::prelude::*;

fn volume(n: UVec3, at: impl Fn(UVec3) -> DVec3) -> CurvilinearVolume {
    let n_nodes = n + 1;
    let node = |i: u32| UVec3::new(i % n_nodes.x, i / n_nodes.x % n_nodes.y, i / n_nodes.x / n_nodes.y);
    let positions = (0..n_nodes.element_product()).map(|i| at(node(i))).collect();
    CurvilinearVolume::new(n, positions).unwrap()
}

fn walk(walker: &CellWalker, ray: &Ray) -> Vec<CellSegment> {
    walker.walk(ray).unwrap().collect()
}

/// Where a point lies in a grid: its cell and local coordinates.
type Located = Option<(UVec3, DVec3)>;

fn located(index: DVec3, n: UVec3) -> Located {
    let is_inside = index.cmpge(DVec3::ZERO).all() && index.cmplt(n.as_dvec3()).all();
    is_inside.then(|| (index.as_uvec3(), index - index.floor()))
}

/// Holds segments against a way to find the cell of a point: between the ends of each segment, and in the gaps.
fn hold(walker: &CellWalker, ray: &Ray, find: impl Fn(DVec3) -> Located) {
    let segments = walk(walker, ray);
    let mut last = 0.0;
    for s in &segments {
        assert!(s.t_in >= last && s.t_out > s.t_in, "{s:?} after {last}");
        // What lies between two segments is outside.
        for part in [0.1, 0.5, 0.9] {
            assert!(
                s.t_in - last < 1e-9 || find(ray.at(last + (s.t_in - last) * part)).is_none(),
                "a gap before {s:?}"
            );
        }
        last = s.t_out;
        if s.t_out - s.t_in < 1e-9 {
            continue;
        }
        for part in [0.01, 0.5, 0.99] {
            let found = find(ray.at(s.t_in + (s.t_out - s.t_in) * part)).map(|(cell, _)| cell);
            assert_eq!(found, Some(s.cell), "{s:?}");
        }
        for (t, local) in [(s.t_in, s.local_in), (s.t_out, s.local_out)] {
            let back = walker.volume().position(s.cell, local);
            assert!(back.distance(ray.at(t)) < 1e-9, "{s:?}: {back} is not {}", ray.at(t));
        }
        let middle = ray.at(0.5 * (s.t_in + s.t_out));
        let (_, expected) = find(middle).unwrap();
        let newton = walker.volume().local(s.cell, middle).unwrap();
        assert!(newton.distance(expected) < 1e-8, "{s:?}: {newton} is not {expected}");
    }
    // Behind the last segment is nothing, for a way of ten directions.
    assert!((1..200).all(|i| find(ray.at(last + 0.05 * f64::from(i))).is_none()), "an early end");
}

/// Parallelepipeds: a linear map of the index.
fn sheared(n: UVec3, map: DMat3) -> (CellWalker, impl Fn(DVec3) -> Located) {
    let walker = CellWalker::new(volume(n, |node| map * node.as_dvec3())).unwrap();
    let inverse = map.inverse();
    (walker, move |p| located(inverse * p, n))
}

/// A ring of cells with plane faces around the z axis, closed: the last nodes of y are the first ones.
fn ring(n: UVec3) -> (CellWalker, impl Fn(DVec3) -> Located) {
    let turn = TAU / f64::from(n.y);
    let at = move |node: UVec3| {
        let (radius, angle) = (1.0 + f64::from(node.x) / f64::from(n.x), turn * f64::from(node.y % n.y));
        DVec3::new(radius * angle.cos(), radius * angle.sin(), f64::from(node.z) * 0.3)
    };
    let find = move |p: DVec3| {
        let sector = (p.y.atan2(p.x).rem_euclid(TAU) / turn).floor();
        let middle = (sector + 0.5) * turn;
        // The chords of a sector are perpendicular to its middle; the arc's radius is the distance over the cosine of half a turn.
        let radius = (p.x * middle.cos() + p.y * middle.sin()) / (0.5 * turn).cos();
        let along = (p.y * middle.cos() - p.x * middle.sin()) / (2.0 * radius * (0.5 * turn).sin()) + 0.5;
        located(DVec3::new((radius - 1.0) * f64::from(n.x), sector + along.clamp(0.0, 1.0 - 1e-15), p.z / 0.3), n)
    };
    (CellWalker::new(volume(n, at)).unwrap(), find)
}

/// Cells with bent faces in a unit cube: inner nodes are moved.
fn bent(n: UVec3, seed: u64) -> CellWalker {
    let at = |node: UVec3| {
        let noise = |axis: u64| {
            let i = u64::from(node.x) + 100 * u64::from(node.y) + 10_000 * u64::from(node.z) + 1_000_000 * axis;
            let bits = (i ^ seed).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            (bits ^ bits >> 31).wrapping_mul(0xbf58_476d_1ce4_e5b9) as f64 / 2f64.powi(64) - 0.5
        };
        let is_inner = node.cmpgt(UVec3::ZERO).all() && node.cmplt(n).all();
        let moved = if is_inner { DVec3::new(noise(0), noise(1), noise(2)) * 0.5 } else { DVec3::ZERO };
        (node.as_dvec3() + moved) / n.as_dvec3()
    };
    CellWalker::new(volume(n, at)).unwrap()
}

/// Through a unit cube no ray may slip: its segments follow each other without gaps, and add up to the cube's chord.
fn hold_chord(walker: &CellWalker, ray: &Ray) {
    let segments = walk(walker, ray);
    let cube = brickfield_core::Aabb { min: DVec3::ZERO, max: DVec3::ONE };
    let chord = ray.clip(&cube).map_or(0.0, |span| span.end - span.start);
    let total: f64 = segments.iter().map(|s| s.t_out - s.t_in).sum();
    assert!(segments.windows(2).all(|s| s[0].t_out == s[1].t_in), "{ray:?}: {segments:?}");
    assert!((total - chord).abs() * ray.direction.length() < 1e-9, "{ray:?}: {total} of {chord}");
}

fn points(low: f64, high: f64) -> impl Strategy<Value = DVec3> {
    (low..high, low..high, low..high).prop_map(|(x, y, z)| DVec3::new(x, y, z))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn sheared_cells(eye in points(-9.0, 9.0), aim in points(0.0, 1.0), rows in points(-0.3, 0.3), mirror in 0u32..2) {
        let n = UVec3::new(5, 4, 7);
        let side = if mirror == 1 { -1.0 } else { 1.0 };
        let map = DMat3::from_cols(
            DVec3::new(side, rows.x, 0.1),
            DVec3::new(rows.y, 0.8, rows.z),
            DVec3::new(rows.z, -rows.x, 0.6),
        );
        let (walker, find) = sheared(n, map);
        let ray = Ray { origin: eye, direction: map * (aim * n.as_dvec3()) - eye };
        hold(&walker, &ray, find);
    }

    #[test]
    fn polar_cells(eye in points(-4.0, 4.0), aim in points(-1.0, 1.0)) {
        let (walker, find) = ring(UVec3::new(4, 12, 5));
        let ray = Ray { origin: eye, direction: aim * DVec3::new(2.0, 2.0, 1.5) - eye };
        hold(&walker, &ray, find);
    }

    #[test]
    fn no_ray_slips_between_bent_cells(eye in points(-2.0, 3.0), aim in points(0.0, 1.0), seed in 0u64..1000) {
        let walker = bent(UVec3::new(5, 6, 4), seed);
        hold_chord(&walker, &Ray { origin: eye, direction: aim - eye });
    }

    #[test]
    fn no_ray_slips_through_corners_and_edges(
        eye in points(-2.0, 3.0), seed in 0u64..1000, node in 0usize..210, step in 0usize..4, part in 0.0f64..1.0,
    ) {
        // Aimed at a corner, or a point of an edge or a face's diagonal.
        let walker = bent(UVec3::new(5, 6, 4), seed);
        let positions = walker.volume().positions();
        let to = (node + [0, 1, 6, 43][step]).min(209);
        let target = positions[node].lerp(positions[to], part);
        hold_chord(&walker, &Ray { origin: eye, direction: target - eye });
    }

    #[test]
    fn newton_finds_the_local_coordinates(seed in 0u64..1000, local in points(0.0, 1.0), cell in 0u32..120) {
        let walker = bent(UVec3::new(5, 6, 4), seed);
        let cell = UVec3::new(cell % 5, cell / 5 % 6, cell / 30);
        let found = walker.volume().local(cell, walker.volume().position(cell, local)).unwrap();
        prop_assert!(found.distance(local) < 1e-8, "{found} is not {local}");
    }
}

#[test]
fn rays_along_edges_faces_and_diagonals_of_even_cells() {
    // Every ray meets corners or runs in faces: from each node of a lattice around the cube to each other one.
    let n = UVec3::splat(2);
    let walker = CellWalker::new(volume(n, |node| node.as_dvec3() * 0.5)).unwrap();
    let lattice: Vec<DVec3> = (0..125u32)
        .map(|i| UVec3::new(i % 5, i / 5 % 5, i / 25).as_dvec3() * 0.5 - 0.5)
        .filter(|p| p.min_element() < 0.0 || p.max_element() > 1.0)
        .collect();
    for from in &lattice {
        for to in lattice.iter().filter(|to| *to != from) {
            let ray = Ray { origin: *from, direction: to - from };
            let segments = walk(&walker, &ray);
            assert!(segments.windows(2).all(|s| s[0].t_out == s[1].t_in), "{ray:?}: {segments:?}");
            // A ray inside the cube, or in a lower face, has all its chord; in an upper face it may pass beside it.
            let total: f64 = segments.iter().map(|s| s.t_out - s.t_in).sum();
            let grown = brickfield_core::Aabb { min: DVec3::splat(-1e-12), max: DVec3::splat(1.0 + 1e-12) };
            let shrunk = brickfield_core::Aabb { min: DVec3::splat(1e-12), max: DVec3::splat(1.0 - 1e-12) };
            let [most, least] = [grown, shrunk].map(|b| ray.clip(&b).map_or(0.0, |s| s.end - s.start));
            assert!(total <= most + 1e-9 && total >= least - 1e-9, "{ray:?}: {total} of {least} to {most}");
        }
    }
}

/// The chord of a ray in a grid of unit cells without some of them: between the planes of all axes, the middle of each piece decides.
fn chord_without(ray: &Ray, n: UVec3, is_void: impl Fn(UVec3) -> bool) -> f64 {
    let planes = (0..3).flat_map(|axis| (0..=n[axis]).map(move |i| (axis, f64::from(i))));
    let mut t: Vec<f64> = planes.map(|(axis, x)| (x - ray.origin[axis]) / ray.direction[axis]).collect();
    t.push(0.0);
    t.sort_by(f64::total_cmp);
    let is_inside = |t: f64| located(ray.at(t), n).is_some_and(|(cell, _)| !is_void(cell));
    let pieces = t.windows(2).filter(|t| t[0] >= 0.0 && is_inside(0.5 * (t[0] + t[1])));
    pieces.map(|t| t[1] - t[0]).sum()
}

proptest! {
    #[test]
    fn rays_leave_at_voids_and_enter_behind_them(eye in points(-3.0, 8.0), aim in points(0.0, 5.0), seed in any::<u64>()) {
        let n = UVec3::new(5, 4, 6);
        let is_void = |cell: UVec3| seed >> ((cell.x + 7 * cell.y + 13 * cell.z) % 61) & 3 == 3;
        let walker = CellWalker::with_voids(volume(n, |node| node.as_dvec3()), is_void).unwrap();
        let ray = Ray { origin: eye, direction: aim - eye };
        let segments = walk(&walker, &ray);
        prop_assert!(segments.iter().all(|s| !is_void(s.cell)));
        prop_assert!(segments.windows(2).all(|s| s[0].t_out <= s[1].t_in));
        let total: f64 = segments.iter().map(|s| s.t_out - s.t_in).sum();
        prop_assert!((total - chord_without(&ray, n, is_void)).abs() < 1e-8);
    }
}

#[test]
fn a_volume_of_voids_alone_is_refused() {
    let grid = volume(UVec3::ONE, |node| node.as_dvec3());
    assert!(
        CellWalker::with_voids(grid, |_| true).unwrap_err().to_string().starts_with("the cells have a volume of 0")
    );
}

#[test]
fn a_ray_from_inside_starts_at_zero() {
    let (walker, _) = sheared(UVec3::splat(4), DMat3::IDENTITY);
    let ray = Ray { origin: DVec3::new(1.25, 2.5, 0.5), direction: DVec3::X * 2.0 };
    let segments = walk(&walker, &ray);
    let t: Vec<f64> = segments.iter().map(|s| s.t_in).collect();
    assert_eq!(t.len(), 3);
    assert!(t.iter().zip([0.0, 0.375, 0.875]).all(|(t, expected)| (t - expected).abs() < 1e-11), "{t:?}");
    assert_eq!(segments[0].cell, UVec3::new(1, 2, 0));
    assert!(segments[0].local_in.distance(DVec3::new(0.25, 0.5, 0.5)) < 1e-12);
}

#[test]
fn far_origins_and_long_directions_change_nothing() {
    let (walker, _) = ring(UVec3::new(4, 12, 5));
    let (near, direction) = (DVec3::new(-3.0, 0.4, 0.7), DVec3::new(1.0, 0.1, 0.02));
    let cells = |away: f64, length: f64| {
        let ray = Ray { origin: near - direction * away, direction: direction * length };
        walk(&walker, &ray).iter().map(|s| s.cell).collect::<Vec<_>>()
    };
    let expected = cells(0.0, 1.0);
    assert!(expected.len() > 6);
    assert_eq!([cells(1e6, 1.0), cells(0.0, 1e-9), cells(1e3, 1e12)], [expected.clone(), expected.clone(), expected]);
}

#[test]
fn bad_volumes_and_rays_are_named() {
    let flat = volume(UVec3::ONE, |node| DVec3::new(f64::from(node.x), f64::from(node.y), 0.0));
    assert_eq!(CellWalker::new(flat).unwrap_err().to_string(), "the cells have a volume of 0; they must not be flat");
    let error = CurvilinearVolume::new(UVec3::new(2, 1, 1), vec![DVec3::ZERO; 7]).unwrap_err().to_string();
    assert_eq!(error, "7 positions; 2 x 1 x 1 cells have 12 nodes");
    let mut positions = vec![DVec3::ZERO; 8];
    positions[6].z = f64::INFINITY;
    let error = CurvilinearVolume::new(UVec3::ONE, positions).unwrap_err().to_string();
    assert_eq!(error, "node (0, 1, 1) lies at [0, 0, inf]; it must be finite");
    let (walker, _) = sheared(UVec3::ONE, DMat3::IDENTITY);
    let error = walker.walk(&Ray { origin: DVec3::ONE, direction: DVec3::ZERO }).unwrap_err().to_string();
    assert_eq!(error, "a ray from [1, 1, 1] along [0, 0, 0]; both must be finite, and the direction not 0");
}
