//! The ranges of the macrocells of a brick, and which of them are visible under a transfer function.

use brickfield_core::{BrickSide, TransferFunction, ValueRange};

use super::{MACROCELL_SIDE, Occupancy};
use crate::{Chunk, Decode, SampleFormat};

/// The data values' ranges over the macrocells of a brick, x fastest. A quarter of the brick's bytes.
#[derive(Clone, Debug)]
pub struct MacrocellRanges {
    side: BrickSide,
    stored: StoredRanges,
}

/// The least and the greatest stored number of each macrocell.
#[derive(Clone, Debug)]
enum StoredRanges {
    Unorm8(Box<[[u8; 2]]>),
    Unorm16(Box<[[u16; 2]]>),
    Float32(Box<[[f32; 2]]>),
}

impl MacrocellRanges {
    /// The ranges of a brick, by its bytes.
    ///
    /// # Panics
    /// If the bytes are not one brick.
    pub fn of(side: BrickSide, format: SampleFormat, bytes: &[u8]) -> MacrocellRanges {
        assert_eq!(bytes.len(), side.n_samples_total() * format.n_bytes(), "bytes of a brick of {side}");
        let stored = match format {
            SampleFormat::Unorm8 => StoredRanges::Unorm8(ranges(side, bytes, |[b]| b)),
            SampleFormat::Unorm8x4 => StoredRanges::Unorm8(ranges(side, bytes, |[b, _, _, _]| b)),
            SampleFormat::Unorm16 => StoredRanges::Unorm16(ranges(side, bytes, u16::from_le_bytes)),
            SampleFormat::Float32 => StoredRanges::Float32(ranges(side, bytes, f32::from_le_bytes)),
        };
        MacrocellRanges { side, stored }
    }

    /// How far each macrocell is from the nearest one of the other kind, visible or dark, under a transfer function.
    pub fn distances(&self, decode: Decode, transfer: &TransferFunction) -> Chunk {
        let visible = match &self.stored {
            StoredRanges::Unorm8(ranges) => visible(ranges, SampleFormat::Unorm8, decode, transfer),
            StoredRanges::Unorm16(ranges) => visible(ranges, SampleFormat::Unorm16, decode, transfer),
            StoredRanges::Float32(ranges) => visible(ranges, SampleFormat::Float32, decode, transfer),
        };
        Occupancy::of_brick(self.side, &visible)
    }
}

fn visible<T: Copy + Into<f64>>(
    ranges: &[[T; 2]],
    format: SampleFormat,
    decode: Decode,
    transfer: &TransferFunction,
) -> Vec<bool> {
    let value = |stored: T| decode.value(stored.into() / format.unit());
    let is_visible = |[min, max]: &[T; 2]| {
        // A decoding's scale may be negative.
        let (a, b) = (value(*min), value(*max));
        !transfer.is_transparent(ValueRange { min: a.min(b), max: a.max(b) })
    };
    ranges.iter().map(is_visible).collect()
}

/// The ranges of a brick whose samples `read` makes of their bytes.
fn ranges<T, const N_BYTES: usize>(side: BrickSide, bytes: &[u8], read: impl Fn([u8; N_BYTES]) -> T) -> Box<[[T; 2]]>
where
    T: Copy + Default + PartialOrd,
{
    let (chunks, _) = bytes.as_chunks();
    let samples: Vec<T> = chunks.iter().map(|b| read(*b)).collect();
    let mut out = vec![[T::default(); 2]; Occupancy::n_macrocells_total(side)];
    of_brick(&samples, side.n_samples() as usize, &mut out);
    out.into()
}

/// The ranges of one brick's macrocells. A macrocell has the samples at both ends of its cells: 3 along an axis.
fn of_brick<T: Copy + PartialOrd>(samples: &[T], n: usize, out: &mut [[T; 2]]) {
    let side = MACROCELL_SIDE as usize;
    let within = |macrocell: usize| macrocell * side..=(macrocell * side + side).min(n - 1);
    let n_macrocells = n / side;
    let mut row = Vec::with_capacity(n);
    for (i, out) in out.chunks_exact_mut(n_macrocells).enumerate() {
        // The range over all rows of samples that this row of macrocells touches, sample by sample.
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
