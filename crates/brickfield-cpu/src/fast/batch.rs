//! Batches of segments: classified and composited front to back.
//!
//! Most batches see one stretch of the transfer function, or a few neighbouring ones: then nothing is looked up segment by segment, and a dark
//! stretch is passed over.

use std::ops::RangeInclusive;

use brickfield_optics::QuadratureRule;

use super::brick::{LANES, Lanes};
use super::classify::{Classifier, Stretch};
use super::scalar::{THIN, alpha, alpha_thin};
use super::segment::{Ray32, segment};

/// Most further stretches, beside that of the least value, that a batch is looked at in as a whole.
const FEW_STRETCHES: usize = 6;

/// The first `n` segments of a rule with one node, from the values there (the last of them in the lanes behind).
#[inline(always)]
pub(super) fn one_node(
    rule: QuadratureRule,
    transfer: &Classifier,
    values: &Lanes,
    n: usize,
    length: f32,
    state: &mut Ray32,
) {
    let (low, high) = extent(values);
    let first = transfer.stretch(low);
    let mut last = first;
    while last < first + FEW_STRETCHES && high >= transfer.end(last) && transfer.end(last) < f32::INFINITY {
        last += 1;
    }
    if high >= transfer.end(last) {
        return mixed(rule, transfer, values, n, length, state);
    }
    match (last - first, transfer.is_dark(first)) {
        (0, true) => {}
        (0, false) => linear(rule, transfer.linear(first), values, n, length, state),
        _ => neighbours(rule, transfer, first..=last, values, n, length, state),
    }
}

/// The first `n` segments of a rule with two nodes, from the values there (the last of them in the lanes behind).
#[inline(always)]
pub(super) fn two_nodes(
    rule: QuadratureRule,
    transfer: &Classifier,
    (near, far): (&Lanes, &Lanes),
    n: usize,
    length: f32,
    state: &mut Ray32,
) {
    let ((a, b), (c, d)) = (extent(near), extent(far));
    let stretch = transfer.stretch(a.min(c));
    if b.max(d) < transfer.end(stretch) && transfer.is_dark(stretch) {
        return;
    }
    for (a, b) in near.iter().zip(far).take(n) {
        state.push(segment(rule, transfer, [Some(*a), Some(*b)], length));
    }
}

/// Segments whose values all lie in one stretch of the transfer function.
///
/// The colours' sum needs two sums only: of the weights of the stretch's lower end and of its upper.
#[inline(always)]
fn linear(rule: QuadratureRule, stretch: &Stretch, values: &Lanes, n: usize, length: f32, state: &mut Ray32) {
    let (mut place, mut opacity) = ([0f32; LANES], [0f32; LANES]);
    for l in 0..LANES {
        place[l] = stretch.place(values[l]);
        opacity[l] = stretch.extinction(place[l]) * length;
    }
    let thickest = extent(&opacity).1;
    opacities(rule, &mut opacity, thickest);
    let weight = weights(&opacity[..n], state);
    let (low, high) = sums(&weight, &place);
    add(state, stretch.rgba(low, high));
}

/// Segments whose values lie in some neighbouring stretches: all of them are looked at in each.
#[inline(always)]
fn neighbours(
    rule: QuadratureRule,
    transfer: &Classifier,
    stretches: RangeInclusive<usize>,
    values: &Lanes,
    n: usize,
    length: f32,
    state: &mut Ray32,
) {
    let (mut place, mut opacity) = ([0f32; LANES], [0f32; LANES]);
    for i in stretches.clone() {
        let stretch = transfer.linear(i);
        // Those beyond it are overwritten by its successor.
        let begin = if i == *stretches.start() { f32::NEG_INFINITY } else { transfer.end(i - 1) };
        for l in 0..LANES {
            let there = stretch.place(values[l]);
            let thick = stretch.extinction(there) * length;
            let is_there = values[l] >= begin;
            place[l] = if is_there { there } else { place[l] };
            opacity[l] = if is_there { thick } else { opacity[l] };
        }
    }
    let thickest = extent(&opacity).1;
    opacities(rule, &mut opacity, thickest);
    let weight = weights(&opacity[..n], state);
    let mut sum = [0f32; 4];
    for i in stretches.clone() {
        let end = transfer.end(i);
        let begin = if i == *stretches.start() { f32::NEG_INFINITY } else { transfer.end(i - 1) };
        let mut own = [0f32; LANES];
        for l in 0..LANES {
            own[l] = if values[l] >= begin && values[l] < end { weight[l] } else { 0.0 };
        }
        let (low, high) = sums(&own, &place);
        for (sum, x) in sum.iter_mut().zip(transfer.linear(i).rgba(low, high)) {
            *sum += x;
        }
    }
    add(state, sum);
}

/// Segments whose values lie anywhere.
#[inline(always)]
fn mixed(rule: QuadratureRule, transfer: &Classifier, values: &Lanes, n: usize, length: f32, state: &mut Ray32) {
    let (mut stretches, mut place, mut opacity) = ([0usize; LANES], [0f32; LANES], [0f32; LANES]);
    for l in 0..LANES {
        stretches[l] = transfer.stretch(values[l]);
        let stretch = transfer.linear(stretches[l]);
        place[l] = stretch.place(values[l]);
        opacity[l] = stretch.extinction(place[l]) * length;
    }
    let thickest = extent(&opacity).1;
    opacities(rule, &mut opacity, thickest);
    let weight = weights(&opacity[..n], state);
    let mut sum = [0f32; 4];
    for l in 0..n {
        let stretch = transfer.linear(stretches[l]);
        let seen = stretch.rgba(weight[l] * (1.0 - place[l]), weight[l] * place[l]);
        for (sum, x) in sum.iter_mut().zip(seen) {
            *sum += x;
        }
    }
    add(state, sum);
}

/// Adds what was seen of some segments.
#[inline(always)]
fn add(state: &mut Ray32, seen: [f32; 4]) {
    for (sum, x) in state.rgba.iter_mut().zip(seen) {
        *sum += f64::from(x);
    }
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

/// Sums of weight (1 - place) and of weight place.
#[inline(always)]
fn sums(weight: &Lanes, place: &Lanes) -> (f32, f32) {
    let (mut low, mut high) = ([0f32; 8], [0f32; 8]);
    for l in 0..LANES {
        low[l % 8] += weight[l] * (1.0 - place[l]);
        high[l % 8] += weight[l] * place[l];
    }
    (total(low), total(high))
}

#[inline(always)]
fn total(x: [f32; 8]) -> f32 {
    ((x[0] + x[4]) + (x[1] + x[5])) + ((x[2] + x[6]) + (x[3] + x[7]))
}

/// Least and greatest number.
#[inline(always)]
fn extent(values: &Lanes) -> (f32, f32) {
    let (mut low, mut high) = ([f32::MAX; 8], [f32::MIN; 8]);
    for l in 0..LANES {
        let v = values[l];
        low[l % 8] = if v < low[l % 8] { v } else { low[l % 8] };
        high[l % 8] = if v > high[l % 8] { v } else { high[l % 8] };
    }
    let less = |a: f32, b: f32| if b < a { b } else { a };
    let more = |a: f32, b: f32| if b > a { b } else { a };
    (low.into_iter().fold(f32::MAX, less), high.into_iter().fold(f32::MIN, more))
}
