//! The ranges of the macrocells of bricks, and what a transfer function shows of them.

use std::sync::Arc;

use brickfield_core::{BrickSide, TransferFunction, ValueRange};
use rayon::prelude::*;

use crate::{BrickSet, Decode, MACROCELL_SIDE, Occupancy, SampleFormat};

/// The data values' ranges over the macrocells of a brick set: macrocell after macrocell, x fastest, brick after brick.
///
/// A quarter of the set's bytes.
#[derive(Clone, Debug)]
pub struct MacrocellRanges {
    side: BrickSide,
    /// Stored numbers per unit of a texture read.
    unit: f64,
    decode: Decode,
    stored: StoredRanges,
}

/// The least and the greatest stored number of each macrocell.
#[derive(Clone, Debug)]
enum StoredRanges {
    Unorm8(Vec<[u8; 2]>),
    Unorm16(Vec<[u16; 2]>),
    Float32(Vec<[f32; 2]>),
}

impl MacrocellRanges {
    /// The ranges of a set; one pass over its samples.
    pub fn of(set: &BrickSet) -> MacrocellRanges {
        let stored = match set.format() {
            SampleFormat::Unorm8 => StoredRanges::Unorm8(ranges(set, |[b]| b)),
            SampleFormat::Unorm16 => StoredRanges::Unorm16(ranges(set, u16::from_le_bytes)),
            SampleFormat::Float32 => StoredRanges::Float32(ranges(set, f32::from_le_bytes)),
        };
        MacrocellRanges { side: set.side(), unit: set.format().unit(), decode: set.decode(), stored }
    }

    /// What a transfer function shows of them; `None` if that is everything.
    pub fn occupancy(&self, transfer: &TransferFunction) -> Option<Arc<Occupancy>> {
        let visible = match &self.stored {
            StoredRanges::Unorm8(ranges) => self.visible(ranges, transfer),
            StoredRanges::Unorm16(ranges) => self.visible(ranges, transfer),
            StoredRanges::Float32(ranges) => self.visible(ranges, transfer),
        };
        Occupancy::new(self.side, &visible)
    }

    fn visible<T: Copy + Into<f64> + Sync>(&self, ranges: &[[T; 2]], transfer: &TransferFunction) -> Vec<bool> {
        let value = |stored: T| self.decode.value(stored.into() / self.unit);
        let is_visible = |[min, max]: &[T; 2]| {
            // A decoding's scale may be negative.
            let (a, b) = (value(*min), value(*max));
            !transfer.is_transparent(ValueRange { min: a.min(b), max: a.max(b) })
        };
        ranges.par_iter().map(is_visible).collect()
    }
}

/// The ranges of all bricks of a set, whose samples `read` makes of their bytes.
fn ranges<T, const N_BYTES: usize>(set: &BrickSet, read: impl Fn([u8; N_BYTES]) -> T + Sync) -> Vec<[T; 2]>
where
    T: Copy + Default + PartialOrd + Send,
{
    let n = set.side().n_samples() as usize;
    let per_brick = (Occupancy::n_macrocells(set.side()) as usize).pow(3);
    let mut out = vec![[T::default(); 2]; set.n_bricks() as usize * per_brick];
    let bricks = out.par_chunks_exact_mut(per_brick).zip(set.bytes().par_chunks_exact(set.brick_bytes()));
    bricks.for_each(|(out, bytes)| {
        let (chunks, _) = bytes.as_chunks();
        let samples: Vec<T> = chunks.iter().map(|b| read(*b)).collect();
        of_brick(&samples, n, out);
    });
    out
}

/// The ranges of one brick's macrocells. A macrocell has the samples at both ends of its cells: 3 along an axis.
fn of_brick<T: Copy + PartialOrd>(samples: &[T], n: usize, out: &mut [[T; 2]]) {
    let side = MACROCELL_SIDE as usize;
    let within = |macrocell: usize| macrocell * side..=(macrocell * side + side).min(n - 1);
    let n_macrocells = n / side;
    let mut row = Vec::with_capacity(n);
    for (i, out) in out.chunks_exact_mut(n_macrocells).enumerate() {
        // What all rows of samples that this row of macrocells touches hold, place by place.
        let rows = within(i / n_macrocells).flat_map(|z| within(i % n_macrocells).map(move |y| (z * n + y) * n));
        let rows = rows.map(|first| &samples[first..first + n]);
        row.clear();
        for samples in rows {
            if row.is_empty() {
                row.extend(samples.iter().map(|s| [*s; 2]));
            }
            row.iter_mut().zip(samples).for_each(|(range, s)| *range = widened(*range, [*s; 2]));
        }
        for (x, out) in out.iter_mut().enumerate() {
            let samples = &row[within(x)];
            *out = samples[1..].iter().fold(samples[0], |range, s| widened(range, *s));
        }
    }
}

fn widened<T: Copy + PartialOrd>([min, max]: [T; 2], [a, b]: [T; 2]) -> [T; 2] {
    [if a < min { a } else { min }, if b > max { b } else { max }]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_span_the_samples_of_their_cells() {
        let n = 16usize;
        let samples: Vec<u16> = (0..n.pow(3)).map(|i| ((i * 7919) % 4001) as u16).collect();
        let mut ranges = vec![[0; 2]; 512];
        of_brick(&samples, n, &mut ranges);
        for (i, range) in ranges.into_iter().enumerate() {
            let first = [i % 8, i / 8 % 8, i / 64].map(|m| 2 * m);
            let near = |j: &usize| {
                let at = [j % n, j / n % n, j / n / n];
                at.into_iter().zip(first).all(|(at, first)| (first..=first + 2).contains(&at))
            };
            let of_cells = || (0..samples.len()).filter(near).map(|j| samples[j]);
            assert_eq!(range, [of_cells().min().unwrap(), of_cells().max().unwrap()]);
        }
    }
}
