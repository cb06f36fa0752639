//! Where a ray runs in the domain, and the segments there.

use brickfield_core::{Aabb, Span};
use brickfield_frame::PlanRay;

/// A segment of a ray, already cut to the ray's span.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Part {
    start: f64,
    end: f64,
}

impl Part {
    /// The parameter at fraction `x` of the segment.
    pub(super) fn at(self, x: f64) -> f64 {
        self.start + (self.end - self.start) * x
    }

    /// Length in world units.
    pub(super) fn length(self) -> f64 {
        self.end - self.start
    }
}

/// Where a ray with parameter at least `least` runs in the half-open box `b` (relative to the frame's centre).
pub(super) fn clip(ray: &PlanRay, b: &Aabb, least: f64) -> Option<Span> {
    if b.is_empty() {
        return None;
    }
    let mut span = Span { start: least - ray.t_anchor, end: f64::INFINITY };
    for axis in 0..3 {
        let (o, d) = (ray.anchor[axis], ray.direction[axis]);
        if d == 0.0 && !(b.min[axis] <= o && o < b.max[axis]) {
            return None;
        }
        if d != 0.0 {
            let (a, b) = ((b.min[axis] - o) / d, (b.max[axis] - o) / d);
            span = Span { start: span.start.max(a.min(b)), end: span.end.min(a.max(b)) };
        }
    }
    let span = Span { start: span.start + ray.t_anchor, end: span.end + ray.t_anchor };
    (span.start < span.end).then_some(span)
}

/// The segments [k h, (k + 1) h), cut to `span`.
pub(super) fn segments(span: Span, step: f64) -> impl Iterator<Item = Part> {
    let (first, end) = ((span.start / step).floor() as i64, (span.end / step).ceil() as i64);
    let part =
        move |k: i64| Part { start: (k as f64 * step).max(span.start), end: ((k + 1) as f64 * step).min(span.end) };
    (first..end).map(part).filter(|p| p.start < p.end)
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::glam::DVec3;

    #[test]
    fn segments_tile_the_span_at_the_global_phase() {
        let span = Span { start: 0.7, end: 3.1 };
        let parts: Vec<_> = segments(span, 0.5).map(|p| (p.start, p.end)).collect();
        assert_eq!(parts, [(0.7, 1.0), (1.0, 1.5), (1.5, 2.0), (2.0, 2.5), (2.5, 3.0), (3.0, 3.1)]);
    }

    #[test]
    fn a_parallel_ray_in_a_lower_face_is_inside_in_an_upper_face_outside() {
        let b = Aabb { min: DVec3::splat(-1.0), max: DVec3::ONE };
        let ray = |y| PlanRay { anchor: DVec3::new(0.0, y, 0.0), direction: DVec3::X, t_anchor: 5.0 };
        assert_eq!(clip(&ray(-1.0), &b, 0.0), Some(Span { start: 4.0, end: 6.0 }));
        assert_eq!(clip(&ray(-1.0), &b, 5.5), Some(Span { start: 5.5, end: 6.0 }));
        assert_eq!(clip(&ray(1.0), &b, 0.0), None);
        assert_eq!(clip(&ray(0.0), &b, 6.0), None);
        assert_eq!(clip(&ray(0.0), &Aabb { min: b.max, max: b.min }, 0.0), None);
    }
}
