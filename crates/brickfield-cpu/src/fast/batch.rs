//! Batches of L segments, a multiple of eight: classified and composited front to back.
//!
//! Most batches see one stretch of the transfer function, or a few neighbouring ones: then nothing is looked up segment by segment, and a dark
//! stretch is passed over.

use std::ops::RangeInclusive;

use brickfield_optics::QuadratureRule;

use super::classify::{Classifier, Stretch};
use super::scalar::{THIN, alpha, alpha_thin};
use super::segment::{Ray32, segment};

/// Most further stretches, beside that of the least value, that a batch is looked at in as a whole.
const FEW_STRETCHES: usize = 6;

/// The first `n` segments of some, and the values at their nodes (in the lanes behind, the last segment's).
pub(super) struct Batch<'a, const L: usize> {
    pub(super) rule: QuadratureRule,
    pub(super) transfer: &'a Classifier,
    pub(super) near: &'a [f32; L],
    /// Of a rule with two nodes.
    pub(super) far: Option<&'a [f32; L]>,
    pub(super) n: usize,
    pub(super) length: f32,
}

impl<const L: usize> Batch<'_, L> {
    /// Puts the segments behind the ray's sums. Compiled once for bricks of all kinds: inlined into each, the functions below would take minutes
    /// to compile.
    #[inline(never)]
    pub(super) fn push(self, simd: pulp::Arch, state: &mut Ray32) {
        simd.dispatch(
            #[inline(always)]
            || match self.far {
                None => self.one_node(state),
                Some(far) => self.two_nodes(far, state),
            },
        );
    }

    #[inline(always)]
    fn one_node(&self, state: &mut Ray32) {
        let transfer = self.transfer;
        let (low, high) = extent(self.near);
        let first = transfer.stretch(low);
        let mut last = first;
        while last < first + FEW_STRETCHES && high >= transfer.end(last) && transfer.end(last) < f32::INFINITY {
            last += 1;
        }
        if high >= transfer.end(last) {
            return self.mixed(state);
        }
        match (last - first, transfer.is_dark(first)) {
            (0, true) => {}
            (0, false) => self.linear(transfer.linear(first), state),
            _ => self.neighbours(first..=last, state),
        }
    }

    #[inline(always)]
    fn two_nodes(&self, far: &[f32; L], state: &mut Ray32) {
        let ((a, b), (c, d)) = (extent(self.near), extent(far));
        let stretch = self.transfer.stretch(a.min(c));
        if b.max(d) < self.transfer.end(stretch) && self.transfer.is_dark(stretch) {
            return;
        }
        for (a, b) in self.near.iter().zip(far).take(self.n) {
            state.push(segment(self.rule, self.transfer, [Some(*a), Some(*b)], self.length));
        }
    }

    /// Segments whose values all lie in one stretch of the transfer function.
    ///
    /// The colours' sum needs two sums only: of the weights of the stretch's lower end and of its upper.
    #[inline(always)]
    fn linear(&self, stretch: &Stretch, state: &mut Ray32) {
        let (mut place, mut depth) = ([0f32; L], [0f32; L]);
        for l in 0..L {
            place[l] = stretch.place(self.near[l]);
            depth[l] = stretch.extinction(place[l]) * self.length;
        }
        let weight = self.weights(depth, state);
        let (low, high) = sums(&weight, &place);
        add(state, stretch.rgba(low, high));
    }

    /// Segments whose values lie in some neighbouring stretches: all of them are looked at in each.
    #[inline(always)]
    fn neighbours(&self, stretches: RangeInclusive<usize>, state: &mut Ray32) {
        // Red, green, blue, extinction.
        let mut optics = [[0f32; L]; 4];
        for i in stretches.clone() {
            let stretch = self.transfer.linear(i);
            // Those beyond it are overwritten by its successor.
            let begin = if i == *stretches.start() { f32::NEG_INFINITY } else { self.transfer.end(i - 1) };
            let (mut place, mut is_there) = ([0f32; L], [0u32; L]);
            for l in 0..L {
                place[l] = stretch.place(self.near[l]);
                is_there[l] = mask(self.near[l] >= begin);
            }
            for (channel, optics) in optics.iter_mut().enumerate() {
                for l in 0..L {
                    optics[l] = either(is_there[l], stretch.channel(channel, place[l]), optics[l]);
                }
            }
        }
        let [red, green, blue, extinction] = optics;
        let weight = self.weights(extinction.map(|x| x * self.length), state);
        add(state, [sum(&weight, &red), sum(&weight, &green), sum(&weight, &blue), sum(&weight, &[1.0; L])]);
    }

    /// Segments whose values lie anywhere.
    #[inline(always)]
    fn mixed(&self, state: &mut Ray32) {
        let (mut stretches, mut place, mut depth) = ([0usize; L], [0f32; L], [0f32; L]);
        for l in 0..L {
            stretches[l] = self.transfer.stretch(self.near[l]);
            let stretch = self.transfer.linear(stretches[l]);
            place[l] = stretch.place(self.near[l]);
            depth[l] = stretch.extinction(place[l]) * self.length;
        }
        let weight = self.weights(depth, state);
        let mut sum = [0f32; 4];
        for l in 0..self.n {
            let stretch = self.transfer.linear(stretches[l]);
            let seen = stretch.rgba(weight[l] * (1.0 - place[l]), weight[l] * place[l]);
            for (sum, x) in sum.iter_mut().zip(seen) {
                *sum += x;
            }
        }
        add(state, sum);
    }

    /// How much of the colour of each segment is seen, by their depths; the state keeps the light that passes the batch.
    #[inline(always)]
    fn weights(&self, depth: [f32; L], state: &mut Ray32) -> [f32; L] {
        let mut weight = [0f32; L];
        for (w, a) in weight.iter_mut().zip(opacities(self.rule, depth)).take(self.n) {
            *w = state.transmittance as f32 * a;
            state.transmittance *= 1.0 - f64::from(a);
        }
        weight
    }
}

/// All bits of a word, or none: the compiler makes vectors of it, where it makes branches of `if`.
#[inline(always)]
fn mask(is: bool) -> u32 {
    u32::from(is).wrapping_neg()
}

/// The first number under a full mask, else the second.
#[inline(always)]
fn either(mask: u32, a: f32, b: f32) -> f32 {
    f32::from_bits((a.to_bits() & mask) | (b.to_bits() & !mask))
}

/// Adds what was seen of some segments.
#[inline(always)]
fn add(state: &mut Ray32, seen: [f32; 4]) {
    for (sum, x) in state.rgba.iter_mut().zip(seen) {
        *sum += f64::from(x);
    }
}

#[inline(always)]
fn opacities<const L: usize>(rule: QuadratureRule, mut depth: [f32; L]) -> [f32; L] {
    let thickest = extent(&depth).1;
    match rule {
        QuadratureRule::LeftRiemann => depth.iter_mut().for_each(|d| *d = if *d < 1.0 { *d } else { 1.0 }),
        _ if thickest < THIN => depth.iter_mut().for_each(|d| *d = alpha_thin(*d)),
        _ => depth.iter_mut().for_each(|d| *d = alpha(*d)),
    }
    depth
}

/// Sums of weight (1 - place) and of weight place.
#[inline(always)]
fn sums<const L: usize>(weight: &[f32; L], place: &[f32; L]) -> (f32, f32) {
    let (mut low, mut high) = ([0f32; 8], [0f32; 8]);
    for l in 0..L {
        low[l % 8] += weight[l] * (1.0 - place[l]);
        high[l % 8] += weight[l] * place[l];
    }
    (total(low), total(high))
}

/// Sum of weight x.
#[inline(always)]
fn sum<const L: usize>(weight: &[f32; L], x: &[f32; L]) -> f32 {
    let mut sum = [0f32; 8];
    for l in 0..L {
        sum[l % 8] += weight[l] * x[l];
    }
    total(sum)
}

#[inline(always)]
fn total(x: [f32; 8]) -> f32 {
    ((x[0] + x[4]) + (x[1] + x[5])) + ((x[2] + x[6]) + (x[3] + x[7]))
}

/// Least and greatest number.
#[inline(always)]
fn extent<const L: usize>(values: &[f32; L]) -> (f32, f32) {
    let (mut low, mut high) = ([f32::MAX; 8], [f32::MIN; 8]);
    for l in 0..L {
        let v = values[l];
        low[l % 8] = if v < low[l % 8] { v } else { low[l % 8] };
        high[l % 8] = if v > high[l % 8] { v } else { high[l % 8] };
    }
    for half in [4, 2, 1] {
        for l in 0..half {
            let (a, b) = (low[l + half], high[l + half]);
            low[l] = if a < low[l] { a } else { low[l] };
            high[l] = if b > high[l] { b } else { high[l] };
        }
    }
    (low[0], high[0])
}
