//! Marching one ray.

use std::ops::Range;

use brickfield_core::glam::DVec3;
use brickfield_core::{Level, Span};
use brickfield_frame::{Division, FramePlan, IndexEntry, Lengths, PlanRay, Sampling};

use super::brick::{Nodes, Stored};
use super::classify::Classifier;
use super::detail::Sieve;
use super::eight::{Eight, F32s, LANES};
use super::f32_plan::{Block, F32Plan};
use super::segment::{Ray32, Segment32, segment};
use super::waiting::Waiting;
use super::walk::Walk;
use crate::blocks::Blocks;

/// The segments of a ray's span: first..end, the first and the last of them cut to the span.
pub(super) struct Path<'a> {
    pub(super) ray: &'a PlanRay,
    span: Span,
    pub(super) step: f64,
    /// The length that the light of a whole segment is computed for.
    length: f32,
    lengths: Lengths,
    /// Segments per world unit.
    pub(super) per_unit: f64,
    pub(super) first: i64,
    pub(super) end: i64,
}

impl<'a> Path<'a> {
    /// A span, divided by the steps of a level.
    #[inline(always)]
    pub(super) fn new(sampling: &Sampling, ray: &'a PlanRay, span: Span, level: Level) -> Path<'a> {
        let nominal = sampling.step_world() * f64::from(level.stride());
        let step = nominal * ray.stretch;
        let per_unit = 1.0 / step;
        let length = match sampling.lengths() {
            Lengths::True => step,
            Lengths::Nominal => nominal,
        };
        Path {
            ray,
            span,
            step,
            length: length as f32,
            lengths: sampling.lengths(),
            per_unit,
            first: floor(span.start * per_unit),
            end: floor(span.end * per_unit) + 1,
        }
    }

    /// Near end of segment `k`, how far its far end is, and the length that its light is computed for.
    #[inline(always)]
    pub(super) fn segment(&self, k: i64) -> (f64, f64, f32) {
        let uncut = k as f64 * self.step;
        match self.lengths {
            Lengths::True => {
                let start = uncut.max(self.span.start);
                let length = (((k + 1) as f64 * self.step).min(self.span.end) - start).max(0.0);
                (start, length, length as f32)
            }
            Lengths::Nominal => {
                let middle = uncut + 0.5 * self.step;
                let counts = self.span.start <= middle && middle < self.span.end;
                (uncut, self.step, if counts { self.length } else { 0.0 })
            }
        }
    }

    /// The position of a point in segment `k` relative to the plan's centre, from 0 at its near end to 1, if it is not cut.
    pub(super) fn position(&self, k: i64, along: f64) -> DVec3 {
        self.ray.at((k as f64 + along) * self.step)
    }

    /// How many whole segments from `k` on have the point `along` of theirs before a parameter of the ray.
    pub(super) fn n_before(&self, k: i64, along: f64, parameter: f64) -> i64 {
        let n = ((parameter * self.per_unit - along).ceil() - k as f64).min(MOST as f64) as i64;
        n.min(self.end - 1 - k)
    }

    /// Whether segment `k` is not cut.
    pub(super) fn is_whole(&self, k: i64) -> bool {
        self.first < k && k < self.end - 1
    }
}

/// Most segments that are counted from one node: in f32 they are still whole.
const MOST: i64 = 1 << 23;

/// A ray, of which some runs of segments may see something, front to back, behind what it has seen.
#[inline(always)]
pub(super) fn march<const N: usize, S: Stored>(
    plan32: &F32Plan<N, S>,
    eight: impl Eight,
    ray: &PlanRay,
    runs: &[Range<i64>],
    state: &mut Ray32,
) {
    let plan = plan32.plan;
    let domain = (plan.domain().min - plan32.center, plan.domain().max - plan32.center);
    let Some(span) = clip(ray, domain, ray.t_eye) else { return };
    match plan.sampling().division() {
        Division::Ray => along(plan32, eight, &Path::new(plan.sampling(), ray, span, Level(0)), runs, state),
        Division::Brick => brick_by_brick(plan32, eight, ray, span, state),
    }
}

fn floor(x: f64) -> i64 {
    x.floor() as i64
}

/// The segments of some runs, block by block.
#[inline(always)]
fn along<const N: usize, S: Stored>(
    plan32: &F32Plan<N, S>,
    eight: impl Eight,
    path: &Path,
    runs: &[Range<i64>],
    state: &mut Ray32,
) {
    let nodes = plan32.plan.sampling().rule().nodes();
    let (near, far) = (nodes[0], nodes[nodes.len() - 1]);
    let floor = plan32.plan.sampling().transmittance_floor();
    let mut waiting = Waiting::new(eight, state, path.length);
    for segments in runs {
        let (mut k, to) = (path.first.max(segments.start), path.end.min(segments.end));
        if k < to && k == path.first {
            waiting.push(plan32, single(plan32, path, k));
            k += 1;
        }
        k = along_blocks(plan32, path, k..to.min(path.end - 1), (near, far), &mut waiting);
        if k < to && !waiting.ray.has_ended(floor) {
            waiting.push(plan32, single(plan32, path, k));
        }
        if waiting.ray.has_ended(floor) {
            return;
        }
    }
    waiting.push_all(plan32);
}

/// Whole segments, block by block, until the ray has ended; the first that is left.
#[inline(always)]
fn along_blocks<const N: usize, S: Stored>(
    plan32: &F32Plan<N, S>,
    path: &Path,
    segments: Range<i64>,
    (near, far): (f64, f64),
    waiting: &mut Waiting<impl Eight>,
) -> i64 {
    let (mut k, to) = (segments.start, segments.end);
    if k >= to {
        return k;
    }
    let floor = plan32.plan.sampling().transmittance_floor();
    let mut walk = Walk::new(plan32, path, k as f64 + near);
    loop {
        let n = ((walk.exit - far).ceil() - k as f64).min((to - k).min(MOST) as f64) as i32;
        if n > 0 {
            if let Some(resident) = walk.resident() {
                resident.run(plan32, path, k, (near, far), n, waiting);
            }
            k += i64::from(n);
            if k < to && k as f64 + far < walk.exit {
                continue;
            }
        }
        // Segments that begin in this block and end in the next.
        while k < to && k as f64 + near < walk.exit {
            waiting.push(plan32, single(plan32, path, k));
            k += 1;
        }
        if k >= to || waiting.ray.has_ended(floor) {
            return k;
        }
        walk.leave(k as f64 + near);
    }
}

/// The segments of each brick.
#[inline(always)]
fn brick_by_brick<const N: usize, S: Stored>(
    plan32: &F32Plan<N, S>,
    eight: impl Eight,
    ray: &PlanRay,
    span: Span,
    state: &mut Ray32,
) {
    let nodes = plan32.plan.sampling().rule().nodes();
    let nodes = (nodes[0], nodes[nodes.len() - 1]);
    let floor = plan32.plan.sampling().transmittance_floor();
    for crossing in Blocks::new(plan32.plan, ray, span) {
        let IndexEntry::Resident { slot, reach } = crossing.entry else { continue };
        let level = reach.level_of_brick();
        let path = Path::new(plan32.plan.sampling(), ray, crossing.span, level);
        let block = plan32.block_of(crossing.cell);
        let resident = Resident { slot, level, corner: block.corner };
        let (mut k, mut waiting) = (path.first + 1, Waiting::new(eight, state, path.length));
        waiting.push(plan32, single_in(plan32, &path, &block, path.first));
        while k < path.end - 1 {
            let n = (path.end - 1 - k).min(MOST);
            resident.run(plan32, &path, k, nodes, n as i32, &mut waiting);
            k += n;
        }
        waiting.push_all(plan32);
        if path.end - 1 > path.first {
            waiting.push(plan32, single_in(plan32, &path, &block, path.end - 1));
        }
        if state.has_ended(floor) {
            return;
        }
    }
}

/// One segment whose nodes lie in a block.
fn single_in<const N: usize, S: Stored>(plan32: &F32Plan<N, S>, path: &Path, block: &Block, k: i64) -> Segment32 {
    one((plan32.plan, &plan32.transfer), path, k, |q| plan32.value_in(block, q))
}

/// One segment, wherever its nodes lie.
#[inline(always)]
fn single<const N: usize, S: Stored>(plan32: &F32Plan<N, S>, path: &Path, k: i64) -> Segment32 {
    one((plan32.plan, &plan32.transfer), path, k, |q| plan32.value(q))
}

/// One segment, by the values at its nodes' sample positions.
#[inline(always)]
pub(super) fn one(
    (plan, transfer): (&FramePlan, &Classifier),
    path: &Path,
    k: i64,
    value: impl Fn(DVec3) -> Option<f32>,
) -> Segment32 {
    let (values, length) = nodes_of(plan, path, k, value);
    segment(plan.sampling().rule(), transfer, values, length)
}

/// What a segment has at its nodes' sample positions, and the length that its light is computed for.
#[inline(always)]
pub(super) fn nodes_of<T>(
    plan: &FramePlan,
    path: &Path,
    k: i64,
    at: impl Fn(DVec3) -> Option<T>,
) -> ([Option<T>; 2], f32) {
    let (start, length, weight) = path.segment(k);
    let at = |x: &f64| at(plan.rays().center + path.ray.at(start + length * x));
    let nodes = plan.sampling().rule().nodes();
    ([at(&nodes[0]), nodes.get(1).and_then(at)], weight)
}

/// A brick in a slot.
pub(super) struct Resident {
    pub(super) slot: u32,
    pub(super) level: Level,
    /// Where it begins in sample space.
    pub(super) corner: DVec3,
}

impl Resident {
    /// Whole segments `k..k + n`, all of whose nodes lie in the brick.
    #[inline(always)]
    fn run<const N: usize, S: Stored>(
        &self,
        plan32: &F32Plan<N, S>,
        path: &Path,
        k: i64,
        (near, far): (f64, f64),
        n: i32,
        waiting: &mut Waiting<impl Eight>,
    ) {
        let t = (k as f64 + near) * path.step;
        let scale = 1.0 / f64::from(self.level.stride());
        let array = |v: DVec3| v.as_vec3().to_array();
        let nodes = Nodes {
            origin: array((plan32.center + path.ray.at(t) - self.corner) * scale),
            change: array(path.ray.direction * (path.step * scale)),
            last: array(((plan32.last - self.corner) * scale).min(DVec3::splat((N - 1) as f64))),
        };
        let far = (far - near) as f32;
        let brick = plan32.brick(self.slot);
        let inner = Inner { brick, nodes, far };
        match plan32.plan.occupancy().filter(|occupancy| !occupancy.is_visible_throughout(self.slot)) {
            Some(occupancy) => {
                let sieve = Sieve::<N>::new(nodes, far, occupancy.brick(self.slot));
                inner.push(plan32, Some(&sieve), n, waiting);
            }
            None => inner.push(plan32, None, n, waiting),
        }
    }
}

/// The segments of a ray inside one brick.
struct Inner<'a> {
    brick: &'a [u8],
    /// The segments' first nodes.
    nodes: Nodes,
    /// Distance between the rule's nodes, in segments.
    far: f32,
}

impl Inner<'_> {
    /// Those of segments `0..n` that may see something.
    #[inline(always)]
    fn push<const N: usize, S: Stored, V: Eight>(
        &self,
        plan32: &F32Plan<N, S>,
        sieve: Option<&Sieve<N>>,
        n: i32,
        waiting: &mut Waiting<V>,
    ) {
        let (eight, sampling) = (waiting.eight, plan32.plan.sampling());
        let floor = sampling.transmittance_floor();
        let mut first = 0;
        while first < n {
            let at = F32s::count(eight) + F32s::all(eight, first as f32);
            let near = self.nodes.places::<N, V>(eight, at);
            let far = match sampling.rule().nodes().len() {
                1 => None,
                _ => Some(self.nodes.places::<N, V>(eight, at + F32s::all(eight, self.far))),
            };
            let mut n_here = (n - first).min(LANES as i32) as usize;
            let mut next = first + LANES as i32;
            if let Some(sieve) = sieve {
                let (visible, behind) = sieve.find(first, &near, far.as_ref());
                // Up to the last one that may.
                n_here = n_here.min(u8::BITS as usize - visible.leading_zeros() as usize);
                next = behind;
            }
            first = next;
            if n_here == 0 {
                continue;
            }
            let far = match far {
                None => None,
                Some(far) => Some(plan32.values(eight, self.brick, &far)),
            };
            waiting.add(plan32, plan32.values(eight, self.brick, &near), far, n_here);
            if waiting.ray.transmittance < floor {
                return;
            }
        }
    }
}

/// Where the ray runs in a box relative to the frame's centre, at parameters of at least `least`.
#[inline(always)]
pub(super) fn clip(ray: &PlanRay, (min, max): (DVec3, DVec3), least: f64) -> Option<Span> {
    let (mut start, mut end) = (least - ray.t_anchor, f64::INFINITY);
    for axis in 0..3 {
        let (o, d) = (ray.anchor[axis], ray.direction[axis]);
        if d == 0.0 {
            if o < min[axis] || o >= max[axis] {
                return None;
            }
            continue;
        }
        let (a, b) = ((min[axis] - o) / d, (max[axis] - o) / d);
        start = start.max(a.min(b));
        end = end.min(a.max(b));
    }
    (start < end).then_some(Span { start: start + ray.t_anchor, end: end + ray.t_anchor })
}
