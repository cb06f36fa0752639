//! By how much a pixel may change because its nodes' values are not exactly the plan's.
//!
//! **Positions.** A position in f32 is the sum of terms as large as the volume (see `RayFrame::rounding`), each rounded: along an
//! axis it is off by about 2^-24 * (|center| + |anchor| + |direction| (|t| + |t_anchor|)), one roundoff of each. The interpolated
//! value moves by at most that distance times the range of its cell. Where the transfer function is steep and opaque, that
//! changes a pixel by more than 1e-5.
//!
//! **Weights.** A texture unit snaps the position to 2^-b of a texel along each axis, b being `subTexelPrecisionBits`. A
//! weight is off by at most 2^-b (truncated; half of it if rounded), which moves the value by at most 2^-b of the greatest
//! difference along that axis, so all three by at most 3 2^-b R, R being the range of the cell's eight samples.
//!
//! **Codes.** Texture units may filter 8-bit texels in 8-bit arithmetic (llvmpipe does): each of the three steps of
//! interpolation then rounds to the nearest code: at most [`CODES`] codes in all, for any R.
//!
//! **Pixel.** A node whose value may lie anywhere in v +- dv may have any extinction and colour that the transfer function has
//! there: this is where its slope enters, exactly and on both sides of knots and jumps. A segment changes the pixel by at most
//! T (|e' - e| + |e^-d' - e^-d|), T being the greatest transmittance that the segments before it may leave. The sum along the ray
//! is the bound.

use brickfield_core::TransferFunction;
use brickfield_core::glam::{DVec3, UVec2};
use brickfield_frame::{FramePlan, SampleFormat};
use brickfield_optics::{ValueSpread, transmittance};
use rayon::prelude::*;

use super::change::{Candidates, spread};
use super::field::{FieldReader, Node, Patch, Work, with_field};
use super::relative;
use super::walk::{CutSegment, clip, parts};

/// Roundings that `RayFrame::rounding` reckons with at worst; here one of them.
const AT_WORST: f64 = 8.0;
/// Rounding of an 8-bit filter: three steps, half a code each.
const CODES: f64 = 1.5;
/// Extinction and colour are extreme at the candidates; of wide ranges their product may pass its ends by second order.
const SECOND_ORDER: f64 = 1.05;

/// For each pixel, rows from the top: the change, in any channel, by one rounding of each term of its nodes' positions.
///
/// Cost: several times that of [`discrete`](crate::discrete()).
pub fn position_rounding(plan: &FramePlan) -> Vec<f64> {
    of_plan(plan, Cause::Positions)
}

/// For each pixel, rows from the top: the change by a texture unit that filters with weights of `sub_texel_bits` bits, in any
/// channel.
///
/// Cost: several times that of [`discrete`](crate::discrete()).
pub fn filter_rounding(plan: &FramePlan, sub_texel_bits: u32) -> Vec<f64> {
    of_plan(plan, Cause::Filter { sub_texel_bits })
}

/// Why values are off.
#[derive(Clone, Copy)]
enum Cause {
    Positions,
    Filter { sub_texel_bits: u32 },
}

fn of_plan(plan: &FramePlan, cause: Cause) -> Vec<f64> {
    with_field(plan, OfPicture(cause))
}

struct OfPicture(Cause);

impl Work for OfPicture {
    type Output = Vec<f64>;
    fn run(self, field: &impl FieldReader) -> Vec<f64> {
        let size = field.plan().size();
        let pixel = |i: u32| of_pixel(field, UVec2::new(i % size.x, i / size.x), self.0);
        (0..size.x * size.y).into_par_iter().map(pixel).collect()
    }
}

fn of_pixel(field: &impl FieldReader, at: UVec2, cause: Cause) -> f64 {
    let plan = field.plan();
    let ray = &plan.rays().ray(at.x, at.y);
    let Some(span) = clip(ray, &relative(plan.domain(), plan.rays().center), ray.t_eye) else { return 0.0 };
    let delta = plan.rays().rounding(at.x, at.y, ray, span.start.abs().max(span.end.abs())) / AT_WORST;
    let stray = |reader: &dyn FieldReader, patch: &Patch, q: DVec3| match cause {
        Cause::Positions => reader.gain() * reader.moved(patch, q, delta),
        Cause::Filter { sub_texel_bits } => reader
            .around(patch, q)
            .map_or(0.0, |around| filtered(reader, reader.gain() * around.widest, sub_texel_bits)),
    };
    let (mut bound, mut least_depth) = (0.0, 0.0);
    for part in parts(plan, ray, span) {
        let candidates = |x: &f64| candidates_at(field, part, plan.rays().center + ray.at(part.at(*x)), stray);
        let nodes: Vec<Candidates> = plan.sampling().rule().nodes().iter().map(candidates).collect();
        let (change, least) = spread(plan, &nodes, part);
        bound += transmittance(least_depth) * change;
        least_depth += least;
    }
    SECOND_ORDER * bound
}

/// How far filtering may move a number between samples of a range, in data values.
fn filtered(field: &dyn FieldReader, range: f64, bits: u32) -> f64 {
    let weights = 3.0 * (-f64::from(bits)).exp2() * range;
    let by_code = field.slots().format() == SampleFormat::Unorm8 && bits < f32::MANTISSA_DIGITS - 1;
    let code = if by_code { CODES * field.gain() } else { 0.0 };
    // Interpolation never leaves the cell's range by more than a code.
    (weights + code).min(range + code)
}

/// What a node at `q` may be; nothing where its block is empty. `stray` says how far a number may move, in data values.
fn candidates_at(
    field: &impl FieldReader,
    part: CutSegment,
    q: DVec3,
    stray: impl Fn(&dyn FieldReader, &Patch, DVec3) -> f64,
) -> Candidates {
    let q = field.clamped(q);
    let patch = field.patch_of(part.cell.unwrap_or_else(|| field.cell_at(q)));
    let Some(node) = field.node(&patch, q) else { return vec![None] };
    let means = extremes(field.plan().transfer(), node.value(), stray(field, &patch, q));
    match (node, field.spreads()) {
        (Node::Values(values), Some(spreads)) => {
            let off = stray(spreads, &patch, q);
            let deviations = [0.0, -off, off].map(|off| (values.deviation + off).max(0.0));
            let of = |mean: &f64| {
                deviations.map(|deviation| Some(Node::Values(ValueSpread { mean: *mean, deviation, ..values })))
            };
            means.iter().flat_map(of).collect()
        }
        _ => means.into_iter().map(|value| Some(Node::Value(value))).collect(),
    }
}

/// The values at which extinction and colour are extreme: the node's own first, the ends, and both sides of knots between.
fn extremes(transfer: &TransferFunction, value: f64, stray: f64) -> Vec<f64> {
    if stray == 0.0 {
        return vec![value];
    }
    let (low, high) = (value - stray, value + stray);
    let knots = transfer.knots().iter().map(|k| k.value).filter(|v| low <= *v && *v <= high);
    [value, low, high].into_iter().chain(knots.flat_map(|v| [v.next_down(), v])).collect()
}
