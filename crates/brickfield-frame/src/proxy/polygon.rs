//! Convex polygons: slices of boxes, clipped and grown.

use brickfield_core::Aabb;
use brickfield_core::glam::{DVec2, DVec3};

/// A plane gradient . p = level.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    pub(super) gradient: DVec3,
    pub(super) level: f64,
}

/// Where a plane cuts a box: at most six corners, in order; empty if it does not.
pub(super) fn slice(b: &Aabb, plane: Plane) -> Vec<DVec3> {
    let reach = (plane.gradient * b.extent()).abs();
    // Along the axis on which the plane is steepest, the other two say where it is.
    let axis = if reach.x >= reach.y && reach.x >= reach.z { 0 } else { 1 + usize::from(reach.z > reach.y) };
    let corner = |[u, v]: [f64; 2]| {
        let mut p = DVec3::ZERO;
        (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (u, v);
        p[axis] = (plane.level - plane.gradient.dot(p)) / plane.gradient[axis];
        p
    };
    let over_box = rectangle(b, axis).map(corner).to_vec();
    let above = clip(&over_box, |p| p[axis] - b.min[axis]);
    clip(&above, |p| b.max[axis] - p[axis])
}

/// The face of a box on its lower or upper side of an axis.
pub(super) fn face(b: &Aabb, axis: usize, at: f64) -> Vec<DVec3> {
    let corner = |[u, v]: [f64; 2]| {
        let mut p = DVec3::ZERO;
        (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (at, u, v);
        p
    };
    rectangle(b, axis).map(corner).to_vec()
}

/// The box seen along an axis.
fn rectangle(b: &Aabb, axis: usize) -> [[f64; 2]; 4] {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    [[b.min[u], b.min[v]], [b.max[u], b.min[v]], [b.max[u], b.max[v]], [b.min[u], b.max[v]]]
}

/// The part of a convex polygon where `inside` is not negative; it is affine (Sutherland and Hodgman 1974).
pub(super) fn clip<P: Point>(polygon: &[P], inside: impl Fn(P) -> f64) -> Vec<P> {
    let mut out = Vec::with_capacity(polygon.len() + 1);
    for (i, a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (da, db) = (inside(*a), inside(b));
        if da >= 0.0 {
            out.push(*a);
        }
        if (da >= 0.0) != (db >= 0.0) {
            out.push(a.toward(b, da / (da - db)));
        }
    }
    out
}

/// A point of the plane or of space.
pub(super) trait Point: Copy {
    /// The point at `fraction` of the way to another.
    fn toward(self, other: Self, fraction: f64) -> Self;
}

impl Point for DVec2 {
    fn toward(self, other: DVec2, fraction: f64) -> DVec2 {
        self.lerp(other, fraction)
    }
}

impl Point for DVec3 {
    fn toward(self, other: DVec3, fraction: f64) -> DVec3 {
        self.lerp(other, fraction)
    }
}

/// The corners of the convex hull of some points, counter-clockwise, none of them on a line between two others (Andrew 1979).
pub(super) fn hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let mut hull = half(points.iter().copied());
    hull.extend(half(points.iter().rev().copied()));
    hull
}

/// One side of the hull of sorted points, without its last.
fn half(points: impl Iterator<Item = DVec2>) -> Vec<DVec2> {
    let mut side: Vec<DVec2> = Vec::new();
    for p in points {
        while side.len() >= 2 && (side[side.len() - 1] - side[side.len() - 2]).perp_dot(p - side[side.len() - 1]) <= 0.0
        {
            side.pop();
        }
        side.push(p);
    }
    side.pop();
    side
}

/// The area of a polygon, counter-clockwise positive.
pub(super) fn area(polygon: &[DVec2]) -> f64 {
    let n = polygon.len();
    0.5 * (0..n).map(|i| polygon[i].perp_dot(polygon[(i + 1) % n])).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const UNIT: Aabb = Aabb { min: DVec3::ZERO, max: DVec3::ONE };

    #[test]
    fn slices_of_a_cube_have_three_to_six_corners() {
        let at = |gradient: DVec3, level| slice(&UNIT, Plane { gradient, level });
        assert_eq!(at(DVec3::Z, 0.25).len(), 4);
        assert_eq!(at(DVec3::ONE, 1.5).len(), 6);
        assert_eq!(at(DVec3::ONE, 0.5).len(), 3);
        assert!(at(DVec3::ONE, 3.5).is_empty() && at(-DVec3::Y, 0.5).is_empty());
        for p in at(DVec3::new(3.0, -1.0, 0.5), 1.0) {
            assert!((DVec3::new(3.0, -1.0, 0.5).dot(p) - 1.0).abs() < 1e-14);
            assert!(p.cmpge(DVec3::splat(-1e-14)).all() && p.cmple(DVec3::splat(1.0 + 1e-14)).all());
        }
    }

    fn holds(polygon: &[DVec2], p: DVec2) -> bool {
        let n = polygon.len();
        (0..n).all(|i| (polygon[(i + 1) % n] - polygon[i]).perp_dot(p - polygon[i]) >= -1e-9)
    }

    proptest! {
        #[test]
        fn a_hull_is_convex_and_holds_its_points_and_no_others(
            points in prop::collection::vec((-9i32..9, -9i32..9), 3..20),
        ) {
            let points: Vec<DVec2> = points.into_iter().map(|(x, y)| DVec2::new(x.into(), y.into())).collect();
            let hull = hull(points.clone());
            prop_assert!(hull.iter().all(|p| points.contains(p)));
            prop_assert!(hull.len() < 3 || points.iter().all(|p| holds(&hull, *p)), "{hull:?}");
            // Convex and counter-clockwise, so that a fan of triangles covers nothing twice.
            let n = hull.len();
            let turn = |i: usize| (hull[(i + 1) % n] - hull[i]).perp_dot(hull[(i + 2) % n] - hull[(i + 1) % n]);
            prop_assert!(n < 3 || (0..n).all(|i| turn(i) > 0.0) && area(&hull) > 0.0);
        }
    }
}
