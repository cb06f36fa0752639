//! The ranges of the macrocells of bricks, and what a transfer function shows of them.

use std::sync::Arc;

use brickfield_core::{BrickSide, TransferFunction, ValueRange};
use rayon::prelude::*;

use crate::{BrickSet, MACROCELL_SIDE, Occupancy, SampleFormat};

/// The data values' ranges over the macrocells of a brick set: macrocell after macrocell, x fastest, brick after brick.
#[derive(Clone, Debug)]
pub struct MacrocellRanges {
    side: BrickSide,
    ranges: Vec<ValueRange>,
}

impl MacrocellRanges {
    /// The ranges of a set; one pass over its samples.
    pub fn of(set: &BrickSet) -> MacrocellRanges {
        let n = Occupancy::n_macrocells(set.side()) as usize;
        let mut ranges = vec![ValueRange { min: 0.0, max: 0.0 }; set.n_bricks() as usize * n.pow(3)];
        ranges.par_chunks_exact_mut(n.pow(3)).enumerate().for_each(|(slot, out)| of_brick(set, slot, out));
        MacrocellRanges { side: set.side(), ranges }
    }

    /// What a transfer function shows of them; `None` if that is everything.
    pub fn occupancy(&self, transfer: &TransferFunction) -> Option<Arc<Occupancy>> {
        let visible: Vec<bool> = self.ranges.par_iter().map(|range| !transfer.is_transparent(*range)).collect();
        Occupancy::new(self.side, &visible)
    }
}

/// The ranges of one brick's macrocells. A macrocell has the samples at both ends of its cells: 5 along an axis.
fn of_brick(set: &BrickSet, slot: usize, out: &mut [ValueRange]) {
    let bytes = &set.bytes()[slot * set.brick_bytes()..][..set.brick_bytes()];
    let (unit, decode) = (set.format().unit(), set.decode());
    let value = |stored: f32| decode.value(f64::from(stored) / unit);
    let extents = |i: usize| match set.format() {
        SampleFormat::Unorm8 => extent(set.side(), i, |s| f32::from(bytes[s])),
        SampleFormat::Unorm16 => {
            extent(set.side(), i, |s| f32::from(u16::from_le_bytes([bytes[2 * s], bytes[2 * s + 1]])))
        }
        SampleFormat::Float32 => extent(set.side(), i, |s| {
            let b = &bytes[4 * s..4 * s + 4];
            f32::from_le_bytes([b[0], b[1], b[2], b[3]])
        }),
    };
    for (i, range) in out.iter_mut().enumerate() {
        let (min, max) = extents(i);
        // A decoding's scale may be negative.
        let (a, b) = (value(min), value(max));
        *range = ValueRange { min: a.min(b), max: a.max(b) };
    }
}

/// The least and the greatest stored number of macrocell `i` of a brick.
#[inline(always)]
fn extent(side: BrickSide, i: usize, stored: impl Fn(usize) -> f32) -> (f32, f32) {
    let (n, n_macrocells) = (side.n_samples() as usize, Occupancy::n_macrocells(side) as usize);
    let samples = |macrocell: usize| {
        let first = macrocell * MACROCELL_SIDE as usize;
        first..=(first + MACROCELL_SIDE as usize).min(n - 1)
    };
    let (mut min, mut max) = (f32::INFINITY, f32::NEG_INFINITY);
    for z in samples(i / (n_macrocells * n_macrocells)) {
        for y in samples(i / n_macrocells % n_macrocells) {
            for x in samples(i % n_macrocells) {
                let s = stored(x + n * (y + n * z));
                (min, max) = (min.min(s), max.max(s));
            }
        }
    }
    (min, max)
}
