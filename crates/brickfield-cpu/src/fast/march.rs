//! Marching one ray.

use brickfield_core::Span;
use brickfield_core::glam::DVec3;
use brickfield_frame::{IndexEntry, PlanRay};

use super::batch;
use super::brick::{LANES, Nodes, Stored};
use super::detail::{Parts, Runs};
use super::scene::{Block, Scene};
use super::segment::{Ray32, Segment32, segment};

/// A ray inside the domain: segments first..end, the first and the last of them cut to the span.
struct Path<'a> {
    ray: &'a PlanRay,
    span: Span,
    step: f64,
    first: i64,
    end: i64,
}

impl Path<'_> {
    /// Near end and length of segment `k`.
    fn segment(&self, k: i64) -> (f64, f64) {
        let start = (k as f64 * self.step).max(self.span.start);
        (start, (((k + 1) as f64 * self.step).min(self.span.end) - start).max(0.0))
    }

    /// Whether segment `k` has its full length.
    fn is_whole(&self, k: i64) -> bool {
        self.first < k && k < self.end - 1
    }
}

/// The pixel of a ray.
#[inline(always)]
pub(super) fn march<const N: usize, S: Stored>(scene: &Scene<N, S>, ray: &PlanRay) -> [f32; 4] {
    let plan = scene.plan;
    let least = -plan.rays.start;
    let relative = |b: &brickfield_core::Aabb| (b.min - scene.center, b.max - scene.center);
    let Some(span) = clip(ray, relative(&plan.domain), least) else { return [0.0; 4] };
    let Some(visible) = clip(ray, relative(&plan.visible), least) else { return [0.0; 4] };
    let step = plan.sampling.step_world();
    let path = Path { ray, span, step, first: floor(span.start / step), end: floor(span.end / step) + 1 };
    let from = path.first.max(floor(visible.start / step) - 1);
    let to = path.end.min(floor(visible.end / step) + 2);
    let mut state = Ray32::default();
    along(scene, &path, from, to, &mut state);
    state.rgba()
}

fn floor(x: f64) -> i64 {
    x.floor() as i64
}

/// Segments `from..to`, block by block.
#[inline(always)]
fn along<const N: usize, S: Stored>(scene: &Scene<N, S>, path: &Path, from: i64, to: i64, state: &mut Ray32) {
    let nodes = scene.plan.sampling.rule().nodes();
    let (near, far) = (nodes[0], nodes[nodes.len() - 1]);
    let floor = scene.plan.sampling.transmittance_floor();
    let mut k = from;
    while k < to {
        let n = if path.is_whole(k) { run(scene, path, k, (near, far), to, state) } else { 0 };
        if n == 0 {
            state.push(single(scene, path, k));
        }
        k += n.max(1);
        if state.transmittance < floor || state.transmittance == 0.0 {
            return;
        }
    }
}

/// One segment, wherever its nodes lie.
fn single<const N: usize, S: Stored>(scene: &Scene<N, S>, path: &Path, k: i64) -> Segment32 {
    let rule = scene.plan.sampling.rule();
    let (start, length) = path.segment(k);
    let value = |x: &f64| scene.value(scene.center + path.ray.at(start + length * x));
    let nodes = rule.nodes();
    segment(rule, &scene.transfer, [value(&nodes[0]), nodes.get(1).and_then(value)], length as f32)
}

/// All whole segments from `k` on whose nodes lie in the block of segment `k`'s first node; returns how many they are.
#[inline(always)]
fn run<const N: usize, S: Stored>(
    scene: &Scene<N, S>,
    path: &Path,
    k: i64,
    (near, far): (f64, f64),
    to: i64,
    state: &mut Ray32,
) -> i64 {
    let t = (k as f64 + near) * path.step;
    let block = scene.block(scene.center + path.ray.at(t));
    let exit = exit(scene, path.ray, &block);
    let n = ((exit / path.step - far).ceil() - k as f64).min((to.min(path.end - 1) - k) as f64) as i64;
    if let (IndexEntry::Resident { slot, level }, true) = (block.entry, n > 0) {
        let scale = 1.0 / f64::from(level.stride());
        let array = |v: DVec3| v.as_vec3().to_array();
        let nodes = Nodes {
            origin: array((scene.center + path.ray.at(t) - block.corner) * scale),
            change: array(path.ray.direction * (path.step * scale)),
            last: array(((scene.last - block.corner) * scale).min(DVec3::splat((N - 1) as f64))),
            bias: scene.bias,
        };
        let inner = Inner { brick: scene.brick(slot), nodes, far: (far - near) as f32 };
        match scene.visible.get(slot as usize) {
            Some(&parts) if parts != Parts::MAX => {
                Runs::new::<N>(&nodes, inner.far, parts, n).for_each(|(from, to)| inner.march(scene, from, to, state));
            }
            _ => inner.march(scene, 0, n, state),
        }
    }
    n
}

/// Where the ray leaves a block.
#[inline(always)]
fn exit<const N: usize, S: Stored>(scene: &Scene<N, S>, ray: &PlanRay, block: &Block) -> f64 {
    let origin = ray.anchor + scene.center;
    let mut exit = f64::INFINITY;
    for axis in 0..3 {
        let d = ray.direction[axis];
        let face = if d > 0.0 { block.high[axis] } else { block.low[axis] };
        if d != 0.0 {
            exit = exit.min((face - origin[axis]) / d);
        }
    }
    exit + ray.t_anchor
}

/// A run of segments inside one brick.
struct Inner<'a> {
    brick: &'a [u8],
    /// The segments' first nodes.
    nodes: Nodes,
    /// Distance between the rule's nodes, in segments.
    far: f32,
}

impl Inner<'_> {
    /// Puts segments `from..to` behind what has been seen so far.
    #[inline(always)]
    fn march<const N: usize, S: Stored>(&self, scene: &Scene<N, S>, from: i64, to: i64, state: &mut Ray32) {
        let sampling = &scene.plan.sampling;
        let (rule, length, floor) = (sampling.rule(), sampling.step_world() as f32, sampling.transmittance_floor());
        for first in (from..to).step_by(LANES) {
            let n = ((to - first) as usize).min(LANES);
            let near = scene.values(&self.nodes, self.brick, first as f32);
            match rule.nodes().len() {
                1 => batch::one_node(rule, &scene.transfer, near, n, length, state),
                _ => {
                    let far = scene.values(&self.nodes, self.brick, first as f32 + self.far);
                    batch::two_nodes(rule, &scene.transfer, (&near, &far), n, length, state);
                }
            }
            if state.transmittance < floor {
                return;
            }
        }
    }
}

/// Where the ray runs in a box relative to the frame's centre, at parameters of at least `least`.
#[inline(always)]
fn clip(ray: &PlanRay, (min, max): (DVec3, DVec3), least: f64) -> Option<Span> {
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
