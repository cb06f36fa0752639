//! Marching one ray.

use brickfield_core::Span;
use brickfield_core::glam::DVec3;
use brickfield_frame::{IndexEntry, PlanRay};

use super::brick::{Stored, trilinear};
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
        let inner = Inner {
            brick: scene.brick(slot),
            origin: (scene.center + path.ray.at(t) - block.corner) * scale,
            change: path.ray.direction * (path.step * scale),
            last: ((scene.last - block.corner) * scale).min(DVec3::splat((N - 1) as f64)),
            far: far - near,
        };
        inner.march(scene, n, state);
    }
    n
}

/// Where the ray leaves a block.
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

/// A run of segments inside one brick; positions are the brick's own.
struct Inner<'a> {
    brick: &'a [u8],
    /// Position of the first node, and its change per segment.
    origin: DVec3,
    change: DVec3,
    last: DVec3,
    /// Distance between the rule's nodes, in segments.
    far: f64,
}

impl Inner<'_> {
    fn march<const N: usize, S: Stored>(&self, scene: &Scene<N, S>, n: i64, state: &mut Ray32) {
        let sampling = &scene.plan.sampling;
        let (rule, length, floor) = (sampling.rule(), sampling.step_world() as f32, sampling.transmittance_floor());
        let (origin, change) = (self.origin.as_vec3().to_array(), self.change.as_vec3().to_array());
        let last = self.last.as_vec3().to_array();
        let value = |x: f32| {
            let at = |a: usize| (origin[a] + change[a] * x).max(0.0).min(last[a]);
            scene.decoded(trilinear::<N, S>(self.brick, [at(0), at(1), at(2)]))
        };
        let two_nodes = rule.nodes().len() == 2;
        for j in 0..n {
            let x = j as f32;
            let second = if two_nodes { Some(value(x + self.far as f32)) } else { None };
            state.push(segment(rule, &scene.transfer, [Some(value(x)), second], length));
            if state.transmittance < floor {
                return;
            }
        }
    }
}

/// Where the ray runs in a box relative to the frame's centre, at parameters of at least `least`.
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
