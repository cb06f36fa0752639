//! Batches of segments: classified and composited front to back.
//!
//! Most batches see one stretch of the transfer function: then there is nothing to look up, and a dark one is passed over.

use brickfield_optics::QuadratureRule;

use super::brick::{LANES, Lanes};
use super::classify::Classifier;
use super::scalar::{THIN, alpha, alpha_thin};
use super::segment::{Ray32, segment};

/// Segments of a rule with one node, from the values there.
#[inline(always)]
pub(super) fn one_node(rule: QuadratureRule, transfer: &Classifier, values: &[f32], length: f32, state: &mut Ray32) {
    let (low, high) = extent(values);
    let stretch = transfer.stretch(low);
    if high < transfer.end(stretch) {
        if !transfer.is_dark(stretch) {
            linear(rule, transfer, stretch, values, length, state);
        }
        return;
    }
    for value in values {
        let i = transfer.stretch(*value);
        if !transfer.is_dark(i) {
            state.push(segment(rule, transfer, [Some(*value), None], length));
        }
    }
}

/// Segments of a rule with two nodes.
#[inline(always)]
pub(super) fn two_nodes(
    rule: QuadratureRule,
    transfer: &Classifier,
    (near, far): (&[f32], &[f32]),
    length: f32,
    state: &mut Ray32,
) {
    let ((a, b), (c, d)) = (extent(near), extent(far));
    let stretch = transfer.stretch(a.min(c));
    if b.max(d) < transfer.end(stretch) && transfer.is_dark(stretch) {
        return;
    }
    for (a, b) in near.iter().zip(far) {
        state.push(segment(rule, transfer, [Some(*a), Some(*b)], length));
    }
}

/// Segments whose values all lie in one stretch of the transfer function.
#[inline(always)]
fn linear(rule: QuadratureRule, transfer: &Classifier, stretch: usize, values: &[f32], length: f32, state: &mut Ray32) {
    let mut v: Lanes = [values[0]; LANES];
    v[..values.len()].copy_from_slice(values);
    let (mut color, mut opacity) = ([[0f32; LANES]; 3], [0f32; LANES]);
    let mut thickest = 0f32;
    for l in 0..LANES {
        let o = transfer.on(stretch, v[l]);
        for (to, from) in color.iter_mut().zip(o.color) {
            to[l] = from;
        }
        opacity[l] = o.extinction * length;
        thickest = if opacity[l] > thickest { opacity[l] } else { thickest };
    }
    opacities(rule, &mut opacity, thickest);
    let weight = weights(&opacity[..values.len()], state);
    for (c, color) in color.iter().enumerate() {
        state.rgba[c] += f64::from(dot(&weight, color));
    }
    state.rgba[3] += f64::from(dot(&weight, &[1.0; LANES]));
}

/// Turns depths into opacities.
#[inline(always)]
fn opacities(rule: QuadratureRule, depth: &mut Lanes, thickest: f32) {
    match rule {
        QuadratureRule::LeftRiemann => depth.iter_mut().for_each(|d| *d = if *d < 1.0 { *d } else { 1.0 }),
        _ if thickest < THIN => depth.iter_mut().for_each(|d| *d = alpha_thin(*d)),
        _ => depth.iter_mut().for_each(|d| *d = alpha(*d)),
    }
}

/// How much of each segment's colour is seen; what shines through the batch is left in the state.
#[inline(always)]
fn weights(opacity: &[f32], state: &mut Ray32) -> Lanes {
    let mut weight = [0f32; LANES];
    for (w, a) in weight.iter_mut().zip(opacity) {
        *w = state.transmittance as f32 * a;
        state.transmittance *= 1.0 - f64::from(*a);
    }
    weight
}

#[inline(always)]
fn dot(a: &Lanes, b: &Lanes) -> f32 {
    let mut sums = [0f32; 4];
    for l in 0..LANES {
        sums[l % 4] += a[l] * b[l];
    }
    (sums[0] + sums[2]) + (sums[1] + sums[3])
}

#[inline(always)]
fn extent(values: &[f32]) -> (f32, f32) {
    let (mut low, mut high) = (values[0], values[0]);
    for v in values {
        low = if *v < low { *v } else { low };
        high = if *v > high { *v } else { high };
    }
    (low, high)
}
