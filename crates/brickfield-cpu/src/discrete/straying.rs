//! By how much a pixel could change because its ray runs along the face of a block within rounding.
//!
//! Where segments end with their brick, such a ray has the segments of the brick that f32 puts it in, and it may cross the face,
//! which cuts a segment, anywhere. Piece by piece, between surfaces of the coarsest level: the light that the ray has there is
//! held against its values in each of the blocks beside it; and two cuts through the middle of a segment are added, one where
//! the ray crosses the face, one where it might. Segments too short to hold [`LITTLE`] are left out.

use brickfield_core::glam::DVec3;
use brickfield_core::{Aabb, Level, Span};
use brickfield_frame::{FramePlan, PlanRay};
use brickfield_optics::{Segment, transmittance};

use super::change::difference;
use super::field::FieldReader;
use super::walk::{CutSegment, parts_in_block, segments};
use super::{part_nodes, segment};
use crate::blocks::{Blocks, Crossing};

/// An optical depth that is less than the tolerance of exact mode.
const LITTLE: f64 = 1e-5;

/// How much the light along some of a ray may change, and by how much its depth may be less.
#[derive(Clone, Copy, Default)]
struct Change {
    light: f64,
    less_depth: f64,
}

/// The light of a piece of a ray, and the most that a cut through the middle of one of its segments changes.
#[derive(Default)]
struct Light {
    sum: Segment,
    by_cut: f64,
}

/// The most by which a channel of the ray's pixel may change if its positions are off by `delta`.
pub(super) fn straying(
    field: &impl FieldReader,
    ray: &PlanRay,
    span: Span,
    delta: DVec3,
    (max_extinction, coarsest): (f64, Level),
) -> f64 {
    let plan = field.plan();
    let own: Vec<Crossing> = Blocks::new(plan, ray, span).collect();
    let along = |c: &Crossing| along_faces(ray, &plan.block_box(c.cell), c.span, delta, LITTLE / max_extinction);
    let alongs: Vec<Vec<Span>> = own.iter().map(along).collect();
    if alongs.iter().all(Vec::is_empty) {
        return 0.0;
    }
    let step = plan.sampling().step_world() * f64::from(coarsest.stride()) * ray.stretch;
    let (mut bound, mut least_depth) = (0.0, 0.0f64);
    for (crossing, alongs) in own.iter().zip(&alongs) {
        let depth = light(field, ray, &own, crossing.span).sum.depth;
        let of = |along: &Span| change_along(field, ray, *along, step, (&own, &ways_beside(plan, ray, *along, delta)));
        let change = alongs.iter().map(of).fold(Change::default(), |sum, change| Change {
            light: sum.light + change.light,
            less_depth: sum.less_depth + change.less_depth,
        });
        bound += transmittance(least_depth) * change.light;
        least_depth += (depth - change.less_depth).max(0.0);
    }
    bound
}

/// Where a ray is within `delta` of a face of a box, for longer than `least`.
fn along_faces(ray: &PlanRay, b: &Aabb, span: Span, delta: DVec3, least: f64) -> Vec<Span> {
    let near = |(axis, face): (usize, f64)| {
        let (d, slab) = (ray.direction[axis], [face - delta[axis], face + delta[axis]]);
        let at = slab.map(|p| (p - ray.anchor[axis]) / d + ray.t_anchor);
        match d == 0.0 {
            true if slab[0] <= ray.anchor[axis] && ray.anchor[axis] <= slab[1] => span,
            true => Span { start: 0.0, end: 0.0 },
            false => Span { start: span.start.max(at[0].min(at[1])), end: span.end.min(at[0].max(at[1])) },
        }
    };
    let faces = (0..3).flat_map(|axis| [(axis, b.min[axis]), (axis, b.max[axis])]);
    faces.map(near).filter(|along| along.end - along.start > least).collect()
}

/// The blocks along a span, as rays cross them that are off by `delta`: to all sides.
fn ways_beside(plan: &FramePlan, ray: &PlanRay, along: Span, delta: DVec3) -> Vec<Vec<Crossing>> {
    let side = |corner: u32, axis: u32| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 };
    let beside = |corner: u32| {
        let off = delta * DVec3::new(side(corner, 0), side(corner, 1), side(corner, 2));
        PlanRay { anchor: ray.anchor + off, ..*ray }
    };
    (0..8).map(|corner| Blocks::new(plan, &beside(corner), along).collect()).collect()
}

/// The change along a span if its blocks are crossed in any of other ways.
fn change_along(
    field: &impl FieldReader,
    ray: &PlanRay,
    along: Span,
    step: f64,
    (own, ways): (&[Crossing], &[Vec<Crossing>]),
) -> Change {
    let (mut change, mut by_cut) = (Change::default(), 0.0f64);
    for piece in segments(along, step) {
        let piece = Span { start: piece.start.max(along.start), end: piece.end.min(along.end) };
        let here = light(field, ray, own, piece);
        let (mut most, mut least) = (0.0f64, here.sum.depth);
        by_cut = by_cut.max(here.by_cut);
        for there in ways.iter().map(|way| light(field, ray, way, piece)) {
            most = most.max(difference(field.plan(), &here.sum, &there.sum));
            least = least.min(there.sum.depth);
            by_cut = by_cut.max(there.by_cut);
        }
        change.light += most;
        change.less_depth += here.sum.depth - least;
    }
    change.light += 2.0 * by_cut;
    change
}

/// The light of a piece of a ray that crosses blocks.
fn light(field: &impl FieldReader, ray: &PlanRay, crossings: &[Crossing], piece: Span) -> Light {
    let mut light = Light::default();
    let of = |part: CutSegment| segment(field.plan(), part_nodes(field, ray, part), part.length);
    for crossing in crossings {
        let span = Span { start: piece.start.max(crossing.span.start), end: piece.end.min(crossing.span.end) };
        for part in parts_in_block(field.plan(), ray, span, crossing.cell) {
            let (whole, mut halves) = (of(part), Segment::default());
            part.halves().into_iter().for_each(|half| push(&mut halves, &of(half)));
            light.by_cut = light.by_cut.max(difference(field.plan(), &whole, &halves));
            push(&mut light.sum, &whole);
        }
    }
    light
}

/// Adds a segment behind others.
fn push(sum: &mut Segment, behind: &Segment) {
    let through = transmittance(sum.depth);
    sum.emission = std::array::from_fn(|c| sum.emission[c] + through * behind.emission[c]);
    sum.depth += behind.depth;
}
