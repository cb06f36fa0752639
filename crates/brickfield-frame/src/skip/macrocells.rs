//! The ranges of the macrocells of a brick, and which of them are visible under a transfer function.

use brickfield_core::BrickSide;

use super::{DarkRuns, MACROCELL_SIDE, Occupancy};
use crate::{Chunk, SampleFormat};

/// The data values' ranges over the macrocells of a brick, x fastest. A quarter of the brick's bytes.
#[derive(Clone, Debug)]
pub struct MacrocellRanges {
    side: BrickSide,
    stored: StoredRanges,
}

/// The least and the greatest stored number of each macrocell.
#[derive(Clone, Debug)]
enum StoredRanges {
    Unorm8(Ranges<u8>),
    Unorm16(Ranges<u16>),
    Float32(Ranges<f32>),
}

#[derive(Clone, Debug)]
struct Ranges<T> {
    least: Box<[T]>,
    greatest: Box<[T]>,
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

    /// How far each macrocell is from the nearest one of the other kind, visible or dark, where a transfer function is 0 over runs of
    /// stored numbers.
    pub fn distances(&self, dark: &DarkRuns) -> Chunk {
        let visible = match &self.stored {
            StoredRanges::Unorm8(ranges) => ranges.visible(&dark.of(|stored| stored as u8)),
            StoredRanges::Unorm16(ranges) => ranges.visible(&dark.of(|stored| stored as u16)),
            StoredRanges::Float32(ranges) => ranges.visible(&dark.of(|stored| stored as f32)),
        };
        Occupancy::of_brick(self.side, &visible)
    }
}

/// Runs that are compared with each range, one after the other; of more the one that matters is searched.
const FEW_RUNS: usize = 4;

impl<T: Copy + PartialOrd> Ranges<T> {
    /// Which macrocells have a range that is not in one of the runs, which ascend.
    fn visible(&self, runs: &[[T; 2]]) -> Vec<bool> {
        let ranges = || self.least.iter().zip(&self.greatest);
        if runs.len() > FEW_RUNS {
            let last_from = |least: T| runs[..runs.partition_point(|[first, _]| *first <= least)].last();
            return ranges().map(|(min, max)| last_from(*min).is_none_or(|[_, last]| *max > *last)).collect();
        }
        let mut visible = vec![true; self.least.len()];
        for [first, last] in runs {
            for (visible, (min, max)) in visible.iter_mut().zip(ranges()) {
                *visible &= (*min < *first) | (*max > *last);
            }
        }
        visible
    }
}

/// The ranges of a brick whose samples `read` makes of their bytes.
fn ranges<T, const N_BYTES: usize>(side: BrickSide, bytes: &[u8], read: impl Fn([u8; N_BYTES]) -> T) -> Ranges<T>
where
    T: Copy + Default + PartialOrd,
{
    let (samples, _) = bytes.as_chunks();
    match side {
        BrickSide::S16 => of_brick::<T, N_BYTES, 16>(samples, read),
        BrickSide::S32 => of_brick::<T, N_BYTES, 32>(samples, read),
        BrickSide::S64 => of_brick::<T, N_BYTES, 64>(samples, read),
    }
}

/// The ranges of one brick's macrocells. A macrocell has the samples at both ends of its cells: 3 along an axis.
fn of_brick<T, const N_BYTES: usize, const N: usize>(
    samples: &[[u8; N_BYTES]],
    read: impl Fn([u8; N_BYTES]) -> T,
) -> Ranges<T>
where
    T: Copy + Default + PartialOrd,
{
    let side = MACROCELL_SIDE as usize;
    let (n_macrocells, (rows, _)) = (N / side, samples.as_chunks::<N>());
    let within = |macrocell: usize| macrocell * side..=(macrocell * side + side).min(N - 1);
    let new = || vec![T::default(); n_macrocells.pow(3)].into_boxed_slice();
    let (mut least, mut greatest) = (new(), new());
    let out = least.chunks_exact_mut(n_macrocells).zip(greatest.chunks_exact_mut(n_macrocells));
    for (i, (least, greatest)) in out.enumerate() {
        // The range over all rows of samples that this row of macrocells touches, sample by sample.
        let (first_y, first_z) = (i % n_macrocells * side, i / n_macrocells * side);
        let mut min = rows[first_z * N + first_y].map(&read);
        let mut max = min;
        for row in within(i / n_macrocells).flat_map(|z| within(i % n_macrocells).map(move |y| &rows[z * N + y])) {
            for x in 0..N {
                let sample = read(row[x]);
                min[x] = lesser(min[x], sample);
                max[x] = greater(max[x], sample);
            }
        }
        along_row(&min, least, lesser);
        along_row(&max, greatest, greater);
    }
    Ranges { least, greatest }
}

/// What `pick` leaves of the samples of each macrocell of a row.
fn along_row<T: Copy, const N: usize>(row: &[T; N], out: &mut [T], pick: impl Fn(T, T) -> T) {
    let (pairs, _) = row.as_chunks::<{ MACROCELL_SIDE as usize }>();
    let (last, others) = out.split_last_mut().expect("a brick has macrocells");
    for (i, out) in others.iter_mut().enumerate() {
        *out = pick(pick(pairs[i][0], pairs[i][1]), pairs[i + 1][0]);
    }
    let [a, b] = pairs[pairs.len() - 1];
    *last = pick(a, b);
}

#[inline(always)]
fn lesser<T: Copy + PartialOrd>(a: T, b: T) -> T {
    if b < a { b } else { a }
}

#[inline(always)]
fn greater<T: Copy + PartialOrd>(a: T, b: T) -> T {
    if b > a { b } else { a }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_span_the_samples_of_their_cells() {
        let n = 16usize;
        let samples: Vec<u16> = (0..n.pow(3)).map(|i| ((i * 7919) % 4001) as u16).collect();
        let bytes: Vec<[u8; 2]> = samples.iter().map(|s| s.to_le_bytes()).collect();
        let ranges = of_brick::<u16, 2, 16>(&bytes, u16::from_le_bytes);
        for i in 0..512 {
            let first = [i % 8, i / 8 % 8, i / 64].map(|m| 2 * m);
            let near = |j: &usize| {
                let at = [j % n, j / n % n, j / n / n];
                at.into_iter().zip(first).all(|(at, first)| (first..=first + 2).contains(&at))
            };
            let of_cells = || (0..samples.len()).filter(near).map(|j| samples[j]);
            let expected = (of_cells().min().unwrap(), of_cells().max().unwrap());
            assert_eq!((ranges.least[i], ranges.greatest[i]), expected);
        }
    }

    #[test]
    fn few_runs_and_many_hide_the_same_macrocells() {
        let ranges = Ranges { least: (0..90u8).collect(), greatest: (0..90).map(|i| i + i % 4).collect() };
        let runs: Vec<[u8; 2]> = (0..9).map(|i| [10 * i, 10 * i + i]).collect();
        let mut expected = vec![true; 90];
        for few in runs.chunks(FEW_RUNS) {
            ranges.visible(few).into_iter().zip(&mut expected).for_each(|(visible, of_all)| *of_all &= visible);
        }
        assert!(expected.contains(&false) && ranges.visible(&runs) == expected);
        assert_eq!(ranges.visible(&[]), [true; 90]);
    }
}
