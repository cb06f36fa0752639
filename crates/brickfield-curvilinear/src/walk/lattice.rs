//! On which side of an edge a line passes, decided by integers.

use brickfield_core::glam::DVec3;
use brickfield_core::{Aabb, Ray};

/// Positions as integers: the grid's box takes 2^38 steps on both sides of its centre. A step is 2^-38 of half the box's longest edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lattice {
    center: DVec3,
    steps: f64,
}

const BITS: i32 = 38;

/// A line among the lattice's points: its point nearest to the centre, and a direction of length 2^38.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    lattice: Lattice,
    foot: [i64; 3],
    direction: [i64; 3],
    /// The axes along which the line is shifted where it meets an edge.
    shifts: [usize; 2],
}

/// A corner relative to the line's foot.
pub(crate) type Corner = [i64; 3];

impl Lattice {
    pub(crate) fn over(extent: &Aabb) -> Lattice {
        let half = 0.5 * extent.extent().max_element();
        let steps = if half > 0.0 { 2f64.powi(BITS) / half } else { 1.0 };
        Lattice { center: extent.center(), steps }
    }

    /// `None` if the line passes far beside the box.
    pub(crate) fn line(&self, ray: &Ray) -> Option<Line> {
        let direction = ray.direction.normalize();
        let origin = (ray.origin - self.center) * self.steps;
        let foot = origin - direction * origin.dot(direction);
        // The corners of the box are at most sqrt(3) half edges from its centre.
        if foot.length() >= 2f64.powi(BITS + 1) {
            return None;
        }
        let steep = direction.abs().max_position();
        Some(Line {
            lattice: *self,
            foot: whole(foot),
            direction: whole(direction * 2f64.powi(BITS)),
            shifts: [(steep + 1) % 3, (steep + 2) % 3],
        })
    }
}

impl Line {
    /// The line in the world, from its foot.
    pub(crate) fn ray(&self) -> Ray {
        let world = |v: [i64; 3]| DVec3::from(v.map(|x| x as f64)) / self.lattice.steps;
        Ray { origin: self.lattice.center + world(self.foot), direction: world(self.direction) }
    }

    pub(crate) fn corner(&self, position: DVec3) -> Corner {
        let at = whole((position - self.lattice.center) * self.lattice.steps);
        std::array::from_fn(|axis| at[axis] - self.foot[axis])
    }

    /// The side of the edge from `a` to `b`, the sign of d . (a x b): 1 if the edge goes round the line counter-clockwise, seen against
    /// the line's direction; 0 if it is parallel to the line.
    ///
    /// A line that meets the edge is taken for one that is shifted by an infinitely small way along one axis, and by a much smaller one
    /// along another. So all triangles around an edge or a corner agree on a line that meets it: exactly as many are left as are
    /// entered.
    pub(crate) fn side(&self, a: Corner, b: Corner) -> i8 {
        let by_float = determinant(self.direction.map(|i| i as f64), a.map(|i| i as f64), b.map(|i| i as f64));
        // Factors are at most 2^38, 2^41 and 2^41: six products with three roundings each.
        if by_float.abs() > 2f64.powi(BITS + 2 * (BITS + 3) + 6 - 52) {
            return if by_float > 0.0 { 1 } else { -1 };
        }
        let d = self.direction.map(i128::from);
        let exact = determinant(d, a.map(i128::from), b.map(i128::from));
        if exact == 0 { self.side_if_shifted(d, a, b) } else { exact.signum() as i8 }
    }

    /// d . ((a - e) x (b - e)) = d . (a x b) - d . (e x (b - a)) for a shift e.
    fn side_if_shifted(&self, d: [i128; 3], a: Corner, b: Corner) -> i8 {
        let edge: [i128; 3] = std::array::from_fn(|axis| i128::from(b[axis] - a[axis]));
        let by_shift = |axis: usize| {
            let shift = std::array::from_fn(|i| i128::from(i == axis));
            -determinant(d, shift, edge).signum() as i8
        };
        self.shifts.into_iter().map(by_shift).find(|sign| *sign != 0).unwrap_or(0)
    }
}

fn whole(v: DVec3) -> [i64; 3] {
    v.round().to_array().map(|x| x as i64)
}

/// d . (a x b)
fn determinant<T>(d: [T; 3], a: [T; 3], b: [T; 3]) -> T
where
    T: Copy + std::ops::Mul<Output = T> + std::ops::Sub<Output = T> + std::ops::Add<Output = T>,
{
    d[0] * (a[1] * b[2] - a[2] * b[1]) + d[1] * (a[2] * b[0] - a[0] * b[2]) + d[2] * (a[0] * b[1] - a[1] * b[0])
}
