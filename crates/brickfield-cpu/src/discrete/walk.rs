//! Where a ray runs in the domain, and the segments there.

use brickfield_core::glam::UVec3;
use brickfield_core::{Aabb, Level, Span};
use brickfield_frame::{Division, FramePlan, IndexEntry, Lengths, PlanRay};

use crate::blocks::Blocks;

/// A segment of a ray, already cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CutSegment {
    start: f64,
    end: f64,
    /// The length that its light is computed for, in world units.
    pub(super) length: f64,
    /// An index cell of the block that holds its nodes; `None` where each node is in the block that owns its position.
    pub(super) cell: Option<UVec3>,
}

impl CutSegment {
    /// The segment cut in two.
    pub(super) fn halves(self) -> [CutSegment; 2] {
        let middle = self.at(0.5);
        [
            CutSegment { end: middle, length: 0.5 * self.length, ..self },
            CutSegment { start: middle, length: 0.5 * self.length, ..self },
        ]
    }

    /// The parameter at fraction `x` of the segment.
    pub(super) fn at(self, x: f64) -> f64 {
        self.start + (self.end - self.start) * x
    }
}

/// The segments of a ray's span in the domain, front to back (ARCHITECTURE.md, rule 2).
pub(super) fn parts(plan: &FramePlan, ray: &PlanRay, span: Span) -> Vec<CutSegment> {
    match plan.sampling().division() {
        Division::Ray => divided(plan, ray, span, Level(0), None),
        Division::Brick => {
            Blocks::new(plan, ray, span).flat_map(|c| parts_in_block(plan, ray, c.span, c.cell)).collect()
        }
    }
}

/// The segments of a span, if all of it is in the block that has an index cell.
pub(super) fn parts_in_block(plan: &FramePlan, ray: &PlanRay, span: Span, cell: UVec3) -> Vec<CutSegment> {
    match plan.field().index().at(cell) {
        _ if span.start >= span.end => Vec::new(),
        IndexEntry::Resident { .. } => divided(plan, ray, span, plan.field().level_at(cell), Some(cell)),
        IndexEntry::Empty { .. } => Vec::new(),
    }
}

fn divided(plan: &FramePlan, ray: &PlanRay, span: Span, level: Level, cell: Option<UVec3>) -> Vec<CutSegment> {
    let nominal = plan.sampling().step_world() * f64::from(level.stride());
    let uncut = segments(span, nominal * ray.stretch);
    match plan.sampling().lengths() {
        Lengths::True => uncut.filter_map(|s| cut(s, span, cell)).collect(),
        Lengths::Nominal => uncut.filter(|s| is_inside(middle(s), span)).map(|s| whole(s, nominal, cell)).collect(),
    }
}

/// The segments [k h, (k + 1) h) that reach into `span`, not cut.
pub(super) fn segments(span: Span, step: f64) -> impl Iterator<Item = Span> {
    let (first, end) = ((span.start / step).floor() as i64, (span.end / step).ceil() as i64);
    (first..end).map(move |k| Span { start: k as f64 * step, end: (k + 1) as f64 * step })
}

pub(super) fn middle(segment: &Span) -> f64 {
    0.5 * (segment.start + segment.end)
}

fn is_inside(t: f64, span: Span) -> bool {
    span.start <= t && t < span.end
}

/// A segment with its true length.
fn cut(segment: Span, span: Span, cell: Option<UVec3>) -> Option<CutSegment> {
    let (start, end) = (segment.start.max(span.start), segment.end.min(span.end));
    (start < end).then_some(CutSegment { start, end, length: end - start, cell })
}

/// A segment that counts as a whole, for a given length.
pub(super) fn whole(Span { start, end }: Span, length: f64, cell: Option<UVec3>) -> CutSegment {
    CutSegment { start, end, length, cell }
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

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::glam::DVec3;

    #[test]
    fn segments_tile_the_span_at_the_global_phase() {
        let span = Span { start: 0.7, end: 3.1 };
        let parts: Vec<_> = segments(span, 0.5).filter_map(|s| cut(s, span, None)).map(|p| (p.start, p.end)).collect();
        assert_eq!(parts, [(0.7, 1.0), (1.0, 1.5), (1.5, 2.0), (2.0, 2.5), (2.5, 3.0), (3.0, 3.1)]);
    }

    #[test]
    fn a_parallel_ray_in_a_lower_face_is_inside_in_an_upper_face_outside() {
        let b = Aabb { min: DVec3::splat(-1.0), max: DVec3::ONE };
        let ray = |y| PlanRay {
            anchor: DVec3::new(0.0, y, 0.0),
            direction: DVec3::X,
            t_anchor: 5.0,
            t_eye: 0.0,
            stretch: 1.0,
        };
        assert_eq!(clip(&ray(-1.0), &b, 0.0), Some(Span { start: 4.0, end: 6.0 }));
        assert_eq!(clip(&ray(-1.0), &b, 5.5), Some(Span { start: 5.5, end: 6.0 }));
        assert_eq!(clip(&ray(1.0), &b, 0.0), None);
        assert_eq!(clip(&ray(0.0), &b, 6.0), None);
        assert_eq!(clip(&ray(0.0), &Aabb { min: b.max, max: b.min }, 0.0), None);
    }
}
