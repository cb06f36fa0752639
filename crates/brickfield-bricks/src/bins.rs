//! Value histograms: the bins and their law.

use brickfield_core::{Rescale, ScalarType, ValueRange};

/// Bins of a histogram.
pub const N_BINS: usize = 32;

/// How many voxels fall into each of a volume's value bins.
///
/// Counts are 64 bits wide: the root of a volume of more than 2^32 voxels must not saturate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Histogram {
    /// Number of voxels per bin.
    pub counts: [u64; N_BINS],
}

impl Histogram {
    /// Number of voxels counted.
    pub fn total(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// Adds the counts of `other`.
    pub fn add(&mut self, other: &Histogram) {
        for (n, m) in self.counts.iter_mut().zip(other.counts) {
            *n += m;
        }
    }
}

/// The value bins that all histograms of a tree share: [`N_BINS`] of equal width over the volume's range.
///
/// The bin of value v is floor(32 (v - min) / (max - min)) in f64, the greatest value in the last bin; where
/// min = max everything is in bin 0. Monotone in v.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bins {
    range: ValueRange,
    scale: f64,
}

impl Bins {
    /// Bins over `range`.
    pub fn new(range: ValueRange) -> Bins {
        // Halving keeps the width finite for f64 volumes that span more than f64::MAX.
        let scale = if (range.max - range.min).is_finite() { 1.0 } else { 0.5 };
        Bins { range, scale }
    }

    /// The range that the bins divide.
    pub fn range(&self) -> ValueRange {
        self.range
    }

    /// The bin of `value`; values outside the range are in the first or last bin.
    #[inline]
    pub fn of(&self, value: f64) -> usize {
        let min = self.range.min * self.scale;
        let width = self.range.max * self.scale - min;
        (((value * self.scale - min) / width * N_BINS as f64) as usize).min(N_BINS - 1)
    }

    /// The values of bin `bin`, to f64 rounding of its ends.
    pub fn bin_range(&self, bin: usize) -> ValueRange {
        let at = |i: usize| {
            let t = i.min(N_BINS) as f64 / N_BINS as f64;
            self.range.min * (1.0 - t) + self.range.max * t
        };
        ValueRange { min: at(bin), max: at(bin + 1) }
    }
}

/// The bins of stored samples, and a table for every sample of an 8- or 16-bit type.
pub(crate) struct BinTable {
    bins: Bins,
    rescale: Rescale,
    table: Box<[u8; 1 << 16]>,
}

impl BinTable {
    pub(crate) fn new(bins: Bins, scalar: ScalarType, rescale: Rescale) -> BinTable {
        let mut table = Box::new([0; 1 << 16]);
        let n_values = 1usize << (8 * scalar.n_bytes().min(4));
        if n_values <= table.len() {
            for (pattern, bin) in table[..n_values].iter_mut().enumerate() {
                *bin = bins.of(rescale.value(number_of_pattern(pattern as u16, scalar))) as u8;
            }
        }
        BinTable { bins, rescale, table }
    }

    /// The bin of a stored number.
    #[inline]
    pub(crate) fn of(&self, stored: f64) -> usize {
        self.bins.of(self.rescale.value(stored))
    }

    /// The bin of the sample with these bits, for 8- and 16-bit types.
    #[inline]
    pub(crate) fn at(&self, pattern: u16) -> usize {
        usize::from(self.table[usize::from(pattern)])
    }
}

fn number_of_pattern(pattern: u16, scalar: ScalarType) -> f64 {
    match scalar {
        ScalarType::I8 => f64::from(pattern as u8 as i8),
        ScalarType::I16 => f64::from(pattern as i16),
        _ => f64::from(pattern),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bins(min: f64, max: f64) -> Bins {
        Bins::new(ValueRange { min, max })
    }

    #[test]
    fn ends_and_extremes_have_bins() {
        for (min, max) in [(0.0, 255.0), (-1.0, 1e-3), (-f64::MAX, f64::MAX), (0.0, 5e-324), (3.0, 3.0)] {
            let b = bins(min, max);
            assert_eq!(b.of(min), 0);
            assert_eq!(b.of(max), if min == max { 0 } else { N_BINS - 1 });
            assert_eq!((b.bin_range(0).min, b.bin_range(N_BINS - 1).max), (min, max));
        }
    }

    #[test]
    fn a_bin_holds_what_its_range_says() {
        let b = bins(-7.0, 1234.5);
        for bin in 0..N_BINS {
            let r = b.bin_range(bin);
            assert_eq!(b.of(0.5 * (r.min + r.max)), bin);
        }
    }
}
