//! Marching one ray.

use std::ops::Range;

use brickfield_core::glam::DVec3;
use brickfield_core::{Level, Span};
use brickfield_frame::{Division, FramePlan, IndexEntry, Lengths, PlanRay, Sampling};

use super::brick::{LANES, Lanes, Nodes, Stored};
use super::classify::Classifier;
use super::detail::Sieve;
use super::f32_plan::{Block, F32Plan};
use super::segment::{Ray32, Segment32, segment};
use super::waiting::Waiting;
use crate::blocks::Blocks;

/// The segments of a ray's span: first..end, the first and the last of them cut to the span.
pub(super) struct Path<'a> {
    pub(super) ray: &'a PlanRay,
    span: Span,
    step: f64,
    /// The length that the light of a whole segment is computed for.
    length: f32,
    lengths: Lengths,
    /// Segments per world unit, and world units per voxel along each axis.
    per_unit: f64,
    reciprocal: DVec3,
    pub(super) first: i64,
    pub(super) end: i64,
}

impl<'a> Path<'a> {
    /// A span, divided by the steps of a level.
    #[inline(always)]
    pub(super) fn new(sampling: &Sampling, ray: &'a PlanRay, span: Span, level: Level) -> Path<'a> {
        let nominal = sampling.step_world() * f64::from(level.stride());
        let step = nominal * ray.stretch;
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
            per_unit: 1.0 / step,
            reciprocal: ray.direction.recip(),
            first: floor(span.start / step),
            end: floor(span.end / step) + 1,
        }
    }

    /// Near end of segment `k`, how far its far end is, and the length that its light is computed for.
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
    ray: &PlanRay,
    runs: &[Range<i64>],
    state: &mut Ray32,
) {
    let plan = plan32.plan;
    let domain = (plan.domain().min - plan32.center, plan.domain().max - plan32.center);
    let Some(span) = clip(ray, domain, ray.t_eye) else { return };
    match plan.sampling().division() {
        Division::Ray => along(plan32, &Path::new(plan.sampling(), ray, span, Level(0)), runs, state),
        Division::Brick => brick_by_brick(plan32, ray, span, state),
    }
}

fn floor(x: f64) -> i64 {
    x.floor() as i64
}

/// The segments of some runs, block by block.
#[inline(always)]
fn along<const N: usize, S: Stored>(plan32: &F32Plan<N, S>, path: &Path, runs: &[Range<i64>], state: &mut Ray32) {
    let nodes = plan32.plan.sampling().rule().nodes();
    let (near, far) = (nodes[0], nodes[nodes.len() - 1]);
    let floor = plan32.plan.sampling().transmittance_floor();
    let mut waiting = Waiting::new(state, path.length);
    for segments in runs {
        let (mut k, to) = (path.first.max(segments.start), path.end.min(segments.end));
        while k < to {
            let n = if path.is_whole(k) { run(plan32, path, k, (near, far), to, &mut waiting) } else { 0 };
            if n == 0 {
                waiting.push(plan32, single(plan32, path, k));
            }
            k += n.max(1);
            if waiting.ray.has_ended(floor) {
                return;
            }
        }
    }
    waiting.push_all(plan32);
}

/// The segments of each brick.
#[inline(always)]
fn brick_by_brick<const N: usize, S: Stored>(plan32: &F32Plan<N, S>, ray: &PlanRay, span: Span, state: &mut Ray32) {
    let nodes = plan32.plan.sampling().rule().nodes();
    let nodes = (nodes[0], nodes[nodes.len() - 1]);
    let floor = plan32.plan.sampling().transmittance_floor();
    for crossing in Blocks::new(plan32.plan, ray, span) {
        let IndexEntry::Resident { slot, reach } = crossing.entry else { continue };
        let level = reach.level_of_brick();
        let path = Path::new(plan32.plan.sampling(), ray, crossing.span, level);
        let block = plan32.block_of(crossing.cell);
        let resident = Resident { block: &block, slot, level };
        let (mut k, mut waiting) = (path.first + 1, Waiting::new(state, path.length));
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
fn single<const N: usize, S: Stored>(plan32: &F32Plan<N, S>, path: &Path, k: i64) -> Segment32 {
    one((plan32.plan, &plan32.transfer), path, k, |q| plan32.value(q))
}

/// One segment, by the values at its nodes' sample positions.
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

/// All whole segments from `k` on whose nodes lie in the block of segment `k`'s first node; returns how many they are.
#[inline(always)]
fn run<const N: usize, S: Stored>(
    plan32: &F32Plan<N, S>,
    path: &Path,
    k: i64,
    (near, far): (f64, f64),
    to: i64,
    waiting: &mut Waiting,
) -> i64 {
    let t = (k as f64 + near) * path.step;
    let block = plan32.block(plan32.center + path.ray.at(t));
    let exit = exit(path, plan32.center, (block.low, block.high));
    let n = ((exit * path.per_unit - far).ceil() - k as f64).min((to.min(path.end - 1) - k).min(MOST) as f64) as i32;
    if let (IndexEntry::Resident { slot, reach }, true) = (block.entry, n > 0) {
        Resident { block: &block, slot, level: reach.level_of_brick() }.run(plan32, path, k, (near, far), n, waiting);
    }
    // Rounding may have put the node into a block that the ray has left already.
    i64::from(n.max(0))
}

/// A block that is a brick.
struct Resident<'a> {
    block: &'a Block,
    slot: u32,
    level: Level,
}

impl Resident<'_> {
    /// Whole segments `k..k + n`, all of whose nodes lie in the brick.
    #[inline(always)]
    fn run<const N: usize, S: Stored>(
        &self,
        plan32: &F32Plan<N, S>,
        path: &Path,
        k: i64,
        (near, far): (f64, f64),
        n: i32,
        waiting: &mut Waiting,
    ) {
        let t = (k as f64 + near) * path.step;
        let scale = 1.0 / f64::from(self.level.stride());
        let array = |v: DVec3| v.as_vec3().to_array();
        let corner = self.block.corner;
        let nodes = Nodes {
            origin: array((plan32.center + path.ray.at(t) - corner) * scale),
            change: array(path.ray.direction * (path.step * scale)),
            last: array(((plan32.last - corner) * scale).min(DVec3::splat((N - 1) as f64))),
            bias: plan32.numbers.bias,
        };
        let far = (far - near) as f32;
        let brick = plan32.brick(self.slot);
        let inner = Inner { brick, nodes, far };
        match plan32.plan.occupancy().filter(|occupancy| !occupancy.is_visible_throughout(self.slot)) {
            Some(occupancy) => {
                let sieve = Sieve::<N>::new(nodes, far, occupancy.brick(self.slot));
                inner.push_visible(plan32, &sieve, n, waiting);
            }
            None => inner.push_all(plan32, n, waiting),
        }
    }
}

/// Where the ray leaves a box in sample space.
#[inline(always)]
pub(super) fn exit(path: &Path, center: DVec3, (low, high): (DVec3, DVec3)) -> f64 {
    let origin = path.ray.anchor + center;
    let mut exit = f64::INFINITY;
    for axis in 0..3 {
        let d = path.ray.direction[axis];
        let face = if d > 0.0 { high[axis] } else { low[axis] };
        if d != 0.0 {
            exit = exit.min((face - origin[axis]) * path.reciprocal[axis]);
        }
    }
    exit + path.ray.t_anchor
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
    /// Segments `0..n`, one after the other.
    #[inline(always)]
    fn push_all<const N: usize, S: Stored>(&self, plan32: &F32Plan<N, S>, n: i32, waiting: &mut Waiting) {
        for first in (0..n).step_by(LANES) {
            let at = std::array::from_fn(|l| (first + l as i32) as f32);
            self.look(plan32, &at, ((n - first) as usize).min(LANES), waiting);
            if waiting.ray.transmittance < plan32.plan.sampling().transmittance_floor() {
                return;
            }
        }
    }

    /// Those of segments `0..n` that may see something.
    #[inline(always)]
    fn push_visible<const N: usize, S: Stored>(
        &self,
        plan32: &F32Plan<N, S>,
        sieve: &Sieve<N>,
        n: i32,
        waiting: &mut Waiting,
    ) {
        // Room for less than a batch, and those of another one.
        let (mut visible, mut n_visible) = ([0f32; 3 * LANES], 0);
        let mut first = 0;
        while first < n {
            let (n_found, next) = sieve.find(first..n, &mut visible[n_visible..]);
            n_visible += n_found;
            if n_visible >= LANES {
                self.look(plan32, &std::array::from_fn(|l| visible[l]), LANES, waiting);
                if waiting.ray.transmittance < plan32.plan.sampling().transmittance_floor() {
                    return;
                }
                n_visible -= LANES;
                visible.copy_within(LANES..2 * LANES, 0);
            }
            first = next;
        }
        if n_visible > 0 {
            self.look(plan32, &std::array::from_fn(|l| visible[l]), n_visible, waiting);
        }
    }

    /// Lets the first `n` of some segments wait behind those before them. Few take half a batch.
    #[inline(always)]
    fn look<const N: usize, S: Stored>(&self, plan32: &F32Plan<N, S>, at: &Lanes, n: usize, waiting: &mut Waiting) {
        match n <= LANES / 2 {
            true => self.look_at::<N, S, { LANES / 2 }>(plan32, std::array::from_fn(|l| at[l]), n, waiting),
            false => self.look_at::<N, S, LANES>(plan32, *at, n, waiting),
        }
        waiting.push_batch(plan32);
    }

    #[inline(always)]
    fn look_at<const N: usize, S: Stored, const L: usize>(
        &self,
        plan32: &F32Plan<N, S>,
        mut at: [f32; L],
        n: usize,
        waiting: &mut Waiting,
    ) {
        let near = plan32.values(&self.nodes, self.brick, &at);
        let far = (plan32.plan.sampling().rule().nodes().len() > 1).then(|| {
            at.iter_mut().for_each(|at| *at += self.far);
            plan32.values(&self.nodes, self.brick, &at)
        });
        waiting.add(&near, far.as_ref(), n);
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
