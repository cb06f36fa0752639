//! Counting the values of a brick, fast.

use crate::bins::{BinTable, Histogram, N_BINS};
use crate::sample::BrickScalar;

const LANES: usize = 4;

/// Counts of one brick, spread over lanes so that equal neighbours do not wait for each other.
#[derive(Default)]
pub(crate) struct Tally([[u32; N_BINS]; LANES]);

impl Tally {
    #[inline]
    pub(crate) fn count<T: BrickScalar>(&mut self, row: &[T], table: &BinTable) {
        let (groups, rest) = row.as_chunks::<LANES>();
        for group in groups {
            for (lane, v) in self.0.iter_mut().zip(group) {
                lane[v.bin(table) % N_BINS] += 1;
            }
        }
        for v in rest {
            self.0[0][v.bin(table) % N_BINS] += 1;
        }
    }

    pub(crate) fn histogram(&self) -> Histogram {
        Histogram { counts: std::array::from_fn(|bin| self.0.iter().map(|lane| u64::from(lane[bin])).sum()) }
    }
}
