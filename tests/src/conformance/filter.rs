//! How far hardware filtering may move a pixel: the fast mode's tolerance, per pixel.
//!
//! **Weights.** A texture unit snaps the position to 2^-b of a texel along each axis, b being `subTexelPrecisionBits`. A
//! weight is off by at most 2^-b (truncated; half of it if rounded), which moves the value by at most 2^-b of the greatest
//! difference along that axis, so all three by at most 3 2^-b R, R being the range of the cell's eight samples.
//!
//! **Codes.** Texture units may filter 8-bit texels in 8-bit arithmetic (llvmpipe does): each of the three steps of
//! interpolation then rounds to the nearest code: at most [`CODES`] codes in all, whatever R is.
//!
//! **Pixel.** A node whose value may lie anywhere in v +- dv may have any extinction and colour that the transfer
//! function has there: this is where its slope enters, exactly and on both sides of knots and jumps. A segment that may have
//! depth d' and emission e' instead of d and e changes a channel by at most T (|e' - e| + |e^-d' - e^-d|), T being the
//! greatest transmittance that the segments before may leave. The sum along the ray is the bound.

use brickfield::frame::{FramePlan, PlanRay, SampleFormat};
use brickfield_core::glam::DVec3;
use brickfield_core::{Aabb, Ray, TransferFunction};
use brickfield_optics::{Segment, transmittance};
use rayon::prelude::*;

use super::samples::{PlanSamples, Samples};

/// Rounding of an 8-bit filter: three steps, half a code each.
const CODES: f64 = 1.5;

/// A node's value, and how far it may be off.
#[derive(Clone, Copy, Debug)]
struct Node {
    value: f64,
    stray: f64,
}

/// The most that filtering with weights of `bits` bits may change any channel of each pixel, rows from the top; for segments of
/// whole rays with their true lengths.
pub(crate) fn filter_bound(plan: &FramePlan, bits: u32) -> Vec<f64> {
    let size = plan.size();
    let pixel = |i: u32| of_ray(plan, bits, &plan.rays.ray(i % size.x, i / size.x));
    (0..size.x * size.y).into_par_iter().map(pixel).collect()
}

fn of_ray(plan: &FramePlan, bits: u32, ray: &PlanRay) -> f64 {
    let eye = plan.rays.center + ray.anchor - ray.direction * (ray.t_anchor - ray.t_eye);
    let from_eye = Ray { origin: eye, direction: ray.direction };
    let Some(span) = from_eye.clip(&grown(&plan.domain)) else { return 0.0 };
    let (mut bound, mut least_depth) = (0.0, 0.0);
    let step = plan.sampling.step_world() * ray.stretch;
    // Surface 0 is a parameter -t_eye from the eye.
    let (first, last) = (((span.start + ray.t_eye) / step).floor(), ((span.end + ray.t_eye) / step).ceil());
    for k in (0..(last - first) as u64).map(|i| first + i as f64) {
        let surface = |k: f64| (k * step - ray.t_eye).clamp(span.start, span.end);
        let (start, length) = (surface(k), surface(k + 1.0) - surface(k));
        let node = |x: &f64| node_at(plan, bits, from_eye.at(start + length * x));
        let nodes: Vec<Option<Node>> = plan.sampling.rule().nodes().iter().map(node).collect();
        let (change, least) = spread(plan, &nodes, length);
        bound += transmittance(least_depth) * change;
        least_depth += least;
    }
    bound
}

/// Rays that graze the domain count as inside.
fn grown(domain: &Aabb) -> Aabb {
    Aabb { min: domain.min - 1e-9, max: domain.max + 1e-9 }
}

fn node_at(plan: &FramePlan, bits: u32, q: DVec3) -> Option<Node> {
    let cell = PlanSamples(plan).cell(q)?;
    let range = cell.range();
    let weights = 3.0 * (-f64::from(bits)).exp2() * (range.max - range.min);
    let by_code = plan.bricks.format() == SampleFormat::Unorm8 && bits < f32::MANTISSA_DIGITS - 1;
    let code = if by_code { CODES * plan.bricks.decode().scale.abs() / SampleFormat::Unorm8.unit() } else { 0.0 };
    // Interpolation never leaves the cell's range by more than a code.
    Some(Node { value: cell.value(), stray: (weights + code).min(range.max - range.min + code) })
}

/// How far a segment may stray, and the least depth that it may have.
fn spread(plan: &FramePlan, nodes: &[Option<Node>], length: f64) -> (f64, f64) {
    let rule = plan.sampling.rule();
    // A node in a transparent block has extinction 0; rules of two nodes are bounded by the node that is left.
    let seen: Vec<Node> = nodes.iter().flatten().copied().collect();
    let (Some(first), Some(last)) = (seen.first(), seen.last()) else { return (0.0, 0.0) };
    let segment = |a: f64, b: f64| rule.segment(&plan.transfer, &[a, b], length);
    let own = segment(first.value, last.value);
    let (mut change, mut least) = (0.0f64, own.depth);
    let seconds = if rule.nodes().len() == 2 { candidates(&plan.transfer, *last) } else { vec![last.value] };
    for a in candidates(&plan.transfer, *first) {
        for b in &seconds {
            let other = segment(a, *b);
            change = change.max(difference(&own, &other));
            least = least.min(other.depth);
        }
    }
    // Extinction and colour are extreme at the candidates; their product may pass its ends by second order.
    (1.05 * change, least)
}

/// The values at which extinction and colour are extreme: the ends, the knots between, and both sides of jumps.
fn candidates(transfer: &TransferFunction, node: Node) -> Vec<f64> {
    let (low, high) = (node.value - node.stray, node.value + node.stray);
    let knots = transfer.knots().iter().map(|k| k.value).filter(|v| low <= *v && *v <= high);
    knots.flat_map(|v| [v.next_down(), v]).chain([low, node.value, high]).collect()
}

fn difference(a: &Segment, b: &Segment) -> f64 {
    let emission = a.emission.iter().zip(b.emission).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
    emission + (transmittance(a.depth) - transmittance(b.depth)).abs()
}
