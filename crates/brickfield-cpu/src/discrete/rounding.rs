//! By how much a pixel may change because f32 rounds where its nodes lie.
//!
//! A position in f32 is the sum of terms as large as the volume (see `ambiguity`), each rounded: along an axis it is off by
//! about 2^-24 * (|center| + |anchor| + |direction| (|t| + |t_anchor|)), one roundoff of each. The interpolated value moves by at
//! most that distance times the range of its cell, the extinction and colour of the segment with it, and the pixel by at most
//! T (|e' - e| + |e^-d' - e^-d|) for each segment, T being the transmittance before it. Where the transfer function is steep and
//! opaque, that is more than 1e-5.

use brickfield_core::TransferFunction;
use brickfield_core::glam::{DVec3, UVec2};
use brickfield_frame::{FramePlan, PlanRay, SampleFormat};
use brickfield_optics::transmittance;
use rayon::prelude::*;

use super::ambiguity::{Values, distance, spread};
use super::field::{Field, Float32, Stored, Unorm8, Unorm16};
use super::relative;
use super::walk::{Part, clip, parts};

/// Roundings that `distance` reckons with at worst; here one of them.
const AT_WORST: f64 = 8.0;

/// For each pixel, rows from the top: what one rounding of each term of its nodes' positions may change, in any channel.
///
/// Cost: several times that of [`discrete`](crate::discrete()).
///
/// # Panics
/// As [`discrete`](crate::discrete()).
pub fn position_rounding(plan: &FramePlan) -> Vec<f64> {
    match plan.bricks.format() {
        SampleFormat::Unorm8 => of_picture::<Unorm8>(plan),
        SampleFormat::Unorm16 => of_picture::<Unorm16>(plan),
        SampleFormat::Float32 => of_picture::<Float32>(plan),
    }
}

fn of_picture<S: Stored>(plan: &FramePlan) -> Vec<f64> {
    let (field, size): (Field<S>, UVec2) = (Field::new(plan), plan.size());
    let pixel = |i: u32| of_ray(&field, &plan.rays.ray(i % size.x, i / size.x));
    (0..size.x * size.y).into_par_iter().map(pixel).collect()
}

fn of_ray<S: Stored>(field: &Field<S>, ray: &PlanRay) -> f64 {
    let plan = field.plan;
    let Some(span) = clip(ray, &relative(&plan.domain, plan.rays.center), ray.t_eye) else { return 0.0 };
    let delta = distance(plan, ray, span.start.abs().max(span.end.abs())) / AT_WORST;
    let (mut bound, mut least_depth) = (0.0, 0.0);
    for part in parts(plan, ray, span) {
        let values = |x: &f64| values(field, part, plan.rays.center + ray.at(part.at(*x)), delta);
        let nodes: Vec<Values> = plan.sampling.rule().nodes().iter().map(values).collect();
        let (change, least) = spread(plan, &nodes, part);
        bound += transmittance(least_depth) * change;
        least_depth += least;
    }
    bound
}

/// The values that a node at `q` may have; none where its block is transparent.
fn values<S: Stored>(field: &Field<S>, part: Part, q: DVec3, delta: DVec3) -> Values {
    let q = field.clamped(q);
    let cell = part.cell.unwrap_or_else(|| field.index_cell(q));
    let (Some(value), Some(at)) = (field.in_block(cell, q), field.interpolation_cell(cell, q)) else {
        return vec![None];
    };
    let stride = f64::from(field.plan.index.at(cell).level().stride());
    let (min, max) = at.samples.iter().fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)));
    let gain = (field.plan.bricks.decode().scale / field.plan.bricks.format().unit()).abs();
    candidates(&field.plan.transfer, value, gain * (max - min) * delta.element_sum() / stride)
}

/// The values at which extinction and colour are extreme: the node's own first, the ends, and both sides of knots between.
fn candidates(transfer: &TransferFunction, value: f64, stray: f64) -> Values {
    if stray == 0.0 {
        return vec![Some(value)];
    }
    let (low, high) = (value - stray, value + stray);
    let knots = transfer.knots().iter().map(|k| k.value).filter(|v| low <= *v && *v <= high);
    [value, low, high].into_iter().chain(knots.flat_map(|v| [v.next_down(), v])).map(Some).collect()
}
