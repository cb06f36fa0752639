//! Segments one by one, wherever their nodes lie: for plans whose slots differ, and for light.

use std::ops::Range;

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Aabb, Level};
use brickfield_frame::{Division, FramePlan, PlanRay};

use super::Renderer;
use super::classify::Optics32;
use super::light::Lamp;
use super::march::{self, Path, clip, nodes_of};
use super::segment::{Ray32, Segment32, lit_segment, segment_of};
use crate::blocks::{Blocks, Crossing};

/// A ray, of which some runs of segments may see something, front to back, behind what it has seen.
pub(super) fn march_singly(renderer: &impl Renderer, ray: &PlanRay, runs: &[Range<i64>], state: &mut Ray32) {
    let (plan, center) = (renderer.plan(), renderer.plan().rays().center);
    let domain = (plan.domain().min - center, plan.domain().max - center);
    let Some(span) = clip(ray, domain, ray.t_eye) else { return };
    let (lamp, floor) = (Lamp::of(renderer), plan.sampling().transmittance_floor());
    match plan.sampling().division() {
        Division::Ray => {
            let path = Path::new(plan.sampling(), ray, span, Level(0));
            for run in runs {
                let (mut k, end) = (path.first.max(run.start), path.end.min(run.end));
                let mut seen_until = k;
                while k < end && !state.has_ended(floor) {
                    if k >= seen_until {
                        let (n, is_dark) = alike(plan, &path, k);
                        if is_dark && n > 0 {
                            k += n;
                            continue;
                        }
                        seen_until = k + n.max(1);
                    }
                    if !is_lent(plan, &path, k) {
                        state.push(one(renderer, lamp.as_ref(), &path, k, |q| plan.field().cell_at(q)));
                    }
                    k += 1;
                }
            }
        }
        Division::Brick => {
            let is_seen = |c: &Crossing| c.entry.slot().is_some() && !plan.is_lent(c.cell);
            for crossing in Blocks::new(plan, ray, span).filter(is_seen) {
                if state.has_ended(floor) {
                    break;
                }
                let level = plan.field().level_at(crossing.cell);
                let path = Path::new(plan.sampling(), ray, crossing.span, level);
                for k in path.first..path.end {
                    state.push(one(renderer, lamp.as_ref(), &path, k, |_| crossing.cell));
                }
            }
        }
    }
}

/// Whether a segment is another batch's: of a segment whose first node is in an empty block, the second one's block decides.
fn is_lent(plan: &FramePlan, path: &Path, k: i64) -> bool {
    if !plan.has_lent() {
        return false;
    }
    let (nodes, _) = nodes_of(plan, path, k, |q| Some(plan.field().cell_at(q)));
    let is_empty = |cell: &UVec3| plan.field().index().at(*cell).slot().is_none();
    nodes.into_iter().flatten().find(|cell| !is_empty(cell)).is_some_and(|cell| plan.is_lent(cell))
}

/// How many segments from `k` on have all their nodes in one region that is dark, or in one that may not be; and which it is.
fn alike(plan: &FramePlan, path: &Path, k: i64) -> (i64, bool) {
    if !path.is_whole(k) {
        return (0, false);
    }
    let nodes = plan.sampling().rule().nodes();
    let (near, far) = (nodes[0], nodes[nodes.len() - 1]);
    let center = plan.rays().center;
    let (region, is_dark) = region_at(plan, center + path.position(k, near));
    (path.n_before(k, far, exit(path.ray, center, region)), is_dark)
}

/// Where a ray leaves a box in sample space.
fn exit(ray: &PlanRay, center: DVec3, region: Aabb) -> f64 {
    let origin = ray.anchor + center;
    let mut exit = f64::INFINITY;
    for axis in 0..3 {
        let d = ray.direction[axis];
        if d != 0.0 {
            let face = if d > 0.0 { region.max[axis] } else { region.min[axis] };
            exit = exit.min((face - origin[axis]) / d);
        }
    }
    exit + ray.t_anchor
}

/// A region around a sample position: all of it dark, or none of it known to be.
fn region_at(plan: &FramePlan, q: DVec3) -> (Aabb, bool) {
    let field = plan.field();
    let cell = field.cell_at(q);
    let mut region = field.block_box(cell);
    let Some(slot) = field.index().at(cell).slot() else { return (region, true) };
    if plan.is_lent(cell) {
        return (region, true);
    }
    let Some(kept) = plan.kept().map(|kept| kept.boxes()[slot as usize]) else { return (region, false) };
    let in_region = |p: DVec3| p.clamp(region.min, region.max);
    let kept = Aabb { min: in_region(kept.min), max: in_region(kept.max) };
    // Beside one pair of the box's faces, the slab that the position lies in.
    for axis in 0..3 {
        if q[axis] < kept.min[axis] {
            region.max[axis] = kept.min[axis];
            return (region, true);
        }
        if q[axis] > kept.max[axis] {
            region.min[axis] = kept.max[axis];
            return (region, true);
        }
    }
    (kept, false)
}

/// One segment; its nodes lie in the blocks around these index cells.
fn one(renderer: &impl Renderer, lamp: Option<&Lamp>, path: &Path, k: i64, cell: impl Fn(DVec3) -> UVec3) -> Segment32 {
    match renderer.is_prefiltered() {
        true => of_expected(renderer, lamp, path, k, cell),
        false => of_values(renderer, lamp, path, k, cell),
    }
}

/// One segment by the optics that are expected at its nodes.
fn of_expected(
    renderer: &impl Renderer,
    lamp: Option<&Lamp>,
    path: &Path,
    k: i64,
    cell: impl Fn(DVec3) -> UVec3,
) -> Segment32 {
    let (plan, rule) = (renderer.plan(), renderer.plan().sampling().rule());
    let (nodes, length) = nodes_of(plan, path, k, |q| Some((q, renderer.expected_in(cell(q), q)?)));
    let unlit = segment_of(rule, nodes.map(|node| node.map(|(_, optics)| optics)), length);
    let Some(lamp) = lamp.filter(|_| unlit.depth > 0.0) else { return unlit };
    let lit = |(q, optics): (DVec3, Optics32)| lamp.shade(renderer, cell(q), q, path.ray).on(optics);
    segment_of(rule, nodes.map(|node| node.map(lit)), length)
}

/// One segment by the values at its nodes.
fn of_values(
    renderer: &impl Renderer,
    lamp: Option<&Lamp>,
    path: &Path,
    k: i64,
    cell: impl Fn(DVec3) -> UVec3,
) -> Segment32 {
    let (plan, transfer) = (renderer.plan(), renderer.transfer());
    let value = |q: DVec3| renderer.value_in(cell(q), q);
    let unlit = march::one((plan, transfer), path, k, value);
    let Some(lamp) = lamp.filter(|_| unlit.depth > 0.0) else { return unlit };
    let lit = |q: DVec3| Some((value(q)?, lamp.shade(renderer, cell(q), q, path.ray)));
    let (nodes, length) = nodes_of(plan, path, k, lit);
    lit_segment(plan.sampling().rule(), transfer, nodes, length)
}
