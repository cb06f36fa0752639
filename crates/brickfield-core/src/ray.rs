//! Rays and axis-aligned boxes.

use glam::DVec3;

/// A half line: `origin + t * direction`, t >= 0.
///
/// The direction is not normalised in general: t keeps its unit (world units) when a ray is mapped to index space.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Ray {
    pub origin: DVec3,
    pub direction: DVec3,
}

/// An interval [start, end) of ray parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Span {
    pub start: f64,
    pub end: f64,
}

/// An axis-aligned box, half-open: [min, max) on every axis.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Aabb {
    pub min: DVec3,
    pub max: DVec3,
}

impl Ray {
    /// The point at parameter `t`.
    #[inline]
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + self.direction * t
    }

    /// Where the ray, t >= 0, runs inside `b`; `None` if it misses or touches in a point only.
    ///
    /// A ray that runs inside a lower face is inside, in an upper face outside (half-open), with no division by zero.
    pub fn clip(&self, b: &Aabb) -> Option<Span> {
        let mut span = Span { start: 0.0, end: f64::INFINITY };
        for axis in 0..3 {
            let (o, d) = (self.origin[axis], self.direction[axis]);
            let (lo, hi) = (b.min[axis], b.max[axis]);
            if d == 0.0 {
                if o < lo || o >= hi {
                    return None;
                }
                continue;
            }
            let (a, b) = ((lo - o) / d, (hi - o) / d);
            span = Span { start: span.start.max(a.min(b)), end: span.end.min(a.max(b)) };
        }
        (span.start < span.end).then_some(span)
    }
}

impl Aabb {
    /// The smallest box around some points; inverted (empty) if there are none.
    pub fn of_points(points: impl IntoIterator<Item = DVec3>) -> Aabb {
        let empty = Aabb { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };
        points.into_iter().fold(empty, |b, p| Aabb { min: b.min.min(p), max: b.max.max(p) })
    }

    /// The eight corners, x varying fastest.
    pub fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|i| {
            let pick = |axis: usize| if i >> axis & 1 == 0 { self.min[axis] } else { self.max[axis] };
            DVec3::new(pick(0), pick(1), pick(2))
        })
    }

    /// The centre.
    pub fn center(&self) -> DVec3 {
        (self.min + self.max) * 0.5
    }

    /// Edge lengths; negative on an axis where the box is inverted.
    pub fn extent(&self) -> DVec3 {
        self.max - self.min
    }

    /// Length of the diagonal.
    pub fn diagonal(&self) -> f64 {
        self.extent().length()
    }

    /// Whether the half-open box holds no point.
    pub fn is_empty(&self) -> bool {
        !self.min.cmplt(self.max).all()
    }

    /// Whether `p` lies in the half-open box.
    pub fn contains(&self, p: DVec3) -> bool {
        p.cmpge(self.min).all() && p.cmplt(self.max).all()
    }

    /// The common part; may be empty.
    pub fn intersection(&self, other: &Aabb) -> Aabb {
        Aabb { min: self.min.max(other.min), max: self.max.min(other.max) }
    }

    /// The smallest box around both.
    pub fn union(&self, other: &Aabb) -> Aabb {
        Aabb { min: self.min.min(other.min), max: self.max.max(other.max) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: Aabb = Aabb { min: DVec3::ZERO, max: DVec3::ONE };

    #[test]
    fn axis_parallel_ray_in_a_lower_face_is_inside_and_in_an_upper_face_outside() {
        let ray = |y| Ray { origin: DVec3::new(-1.0, y, 0.5), direction: DVec3::X };
        assert_eq!(ray(0.0).clip(&UNIT), Some(Span { start: 1.0, end: 2.0 }));
        assert_eq!(ray(1.0).clip(&UNIT), None);
    }

    #[test]
    fn eye_inside_starts_at_zero_and_behind_misses() {
        let ray = |x| Ray { origin: DVec3::new(x, 0.5, 0.5), direction: DVec3::X };
        assert_eq!(ray(0.25).clip(&UNIT), Some(Span { start: 0.0, end: 0.75 }));
        assert_eq!(ray(2.0).clip(&UNIT), None);
    }
}
