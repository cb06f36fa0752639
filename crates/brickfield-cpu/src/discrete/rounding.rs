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
//! **Light.** A node's shade is as far off as its gradient is: each of the six values that this is made of may move as the node's own
//! does, and has a rounding of its own besides.
//!
//! **Pixel.** A node whose value may lie anywhere in v +- dv may have any extinction and colour that the transfer function has
//! there: this is where its slope enters, exactly and on both sides of knots and jumps. A segment changes the pixel by at most
//! T (|e' - e| + |e^-d' - e^-d|), T being the greatest transmittance that the segments before it may leave. The sum along the ray
//! is the bound.

use brickfield_core::TransferFunction;
use brickfield_core::glam::{DVec3, UVec2};
use brickfield_frame::{FramePlan, PlanRay, SampleFormat};
use brickfield_optics::{ValueSpread, transmittance};
use rayon::prelude::*;

use super::change::{Nodes, spread};
use super::field::{Code, FieldReader, Patch, Values, Work, with_field};
use super::light::{Beside, Node, ValueError, shade_error};
use super::walk::{CutSegment, clip, parts};
use super::{part_nodes, relative};

/// Roundings that `RayFrame::rounding` reckons with at worst; here one of them.
const AT_WORST: f64 = 8.0;
/// Rounding of an 8-bit filter: three steps, half a code each.
const CODES: f64 = 1.5;
/// Roundings of a value between samples: of numbers of the value scale, which are below 4.
const OF_VALUE: f64 = 4.0 / (1u32 << 24) as f64;
/// Roundings of a number of a stored gradient, which is at most 1.
const OF_CODE: f64 = 8.0 / (1u32 << 24) as f64;
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
    let code = |code: &Code| match cause {
        Cause::Positions => 0.0,
        Cause::Filter { sub_texel_bits } => filtered_code(code, sub_texel_bits),
    };
    let (mut bound, mut least_depth) = (0.0, 0.0);
    for part in parts(plan, ray, span) {
        let position = |x: &f64| plan.rays().center + ray.at(part.at(*x));
        let own = part_nodes(field, ray, part);
        let rule = plan.sampling().rule();
        let of = |(x, own): (&f64, Option<Node>)| nodes(field, (part, own), position(x), stray);
        let nodes: Vec<Nodes> = rule.nodes().iter().zip(own).map(of).collect();
        let shade = |x: &f64| shade_off(field, ray, (part, position(x)), delta, stray, code);
        let shade_error = || rule.nodes().iter().map(shade).fold(0.0, f64::max);
        let (change, least) = spread(plan, &nodes, part, shade_error);
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

/// How far filtering may move a number of a stored gradient: as it does a value of 8 bits.
fn filtered_code(code: &Code, bits: u32) -> f64 {
    let by_code = if bits < f32::MANTISSA_DIGITS - 1 { CODES / 255.0 } else { 0.0 };
    (3.0 * (-f64::from(bits)).exp2() * code.widest).min(code.widest) + by_code
}

/// What a node at `p` may be; none where its block is empty. `stray` says how far a number may move, in data values.
fn nodes(
    field: &impl FieldReader,
    (part, own): (CutSegment, Option<Node>),
    p: DVec3,
    stray: impl Fn(&dyn FieldReader, &Patch, DVec3) -> f64,
) -> Nodes {
    let q = field.clamped(p);
    let patch = field.patch_of(part.cell.unwrap_or_else(|| field.cell_at(q)));
    let Some(node) = own else { return vec![None] };
    let means = extremes(field.plan().transfer(), node.values.value(), stray(field, &patch, q));
    let values: Vec<Values> = match (node.values, field.spreads()) {
        (Values::Many(values), Some(spreads)) => {
            let off = stray(spreads, &patch, q);
            let deviations = [0.0, -off, off].map(|off| (values.deviation + off).max(0.0));
            let of = |mean: &f64| deviations.map(|d| Values::Many(ValueSpread { mean: *mean, deviation: d, ..values }));
            means.iter().flat_map(of).collect()
        }
        _ => means.into_iter().map(Values::One).collect(),
    };
    values.into_iter().map(|values| Some(Node { values, ..node })).collect()
}

/// How far the shade of a node at `p` may be off, of the factor and the highlight together; 0 without light.
fn shade_off(
    field: &impl FieldReader,
    ray: &PlanRay,
    (part, p): (CutSegment, DVec3),
    delta: DVec3,
    stray: impl Fn(&dyn FieldReader, &Patch, DVec3) -> f64,
    filtered_code: impl Fn(&Code) -> f64,
) -> f64 {
    let Some(lighting) = field.plan().lighting() else { return 0.0 };
    let patch = field.patch_of(part.cell.unwrap_or_else(|| field.cell_at(p)));
    if patch.is_empty() {
        return 0.0;
    }
    let rounding = OF_VALUE * field.plan().value_scale().unit();
    let error = |b: &Beside| rounding + stray(field, &b.patch, b.at);
    let of_code = |code: &Code| OF_CODE + filtered_code(code);
    let error = ValueError { of_value: error, of_code };
    let off = shade_error(field, lighting, (&patch, p, ray), delta, error);
    off.factor + off.highlight
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
