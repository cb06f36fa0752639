//! The summary of one block: range, mean, histogram, and the variance that each level keeps.

use brickfield_core::{BlockSummary, Level, N_BLOCK_BINS, Rescale, ValueRange};

use super::shrink::{BlockScalar, BlockVoxels, Totals};

/// Independent sums, so that an addition does not wait for the one before.
const LANES: usize = 4;

/// A summary in the making: voxels first, then level after level.
pub(crate) struct Summing {
    summary: BlockSummary,
    parts: Parts,
    /// Of the voxels, in parts of the range.
    variance: f64,
}

impl Summing {
    /// Range, histogram and variance of voxels between `least` and `greatest`; the mean is that of the range.
    pub(crate) fn new<T: BlockScalar>(block: BlockVoxels<'_, T>, least: T, greatest: T, rescale: Rescale) -> Summing {
        let range = rescale.values(ValueRange { min: least.to_f64(), max: greatest.to_f64() });
        let parts = Parts::new(range, rescale);
        let (moments, counts) = match range.min < range.max {
            true => count(block, &parts),
            false => (Moments::default(), all_in_the_first(block.n_voxels())),
        };
        let n = block.n_voxels();
        let variance = moments.variance(f64::from(n));
        let summary = BlockSummary {
            range,
            mean: 0.5 * range.min + 0.5 * range.max,
            counts: counts.map(|count| of_65_535(count, n)),
            kept_variance: [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            variance: parts.variance(variance),
        };
        Summing { summary, parts, variance }
    }

    /// Enters the variance that the averages of a level keep.
    ///
    /// They are not rounded to the scalar type: each level keeps at most what the one below keeps.
    pub(crate) fn add_level<T: BlockScalar>(&mut self, totals: &Totals<T>) {
        if self.variance == 0.0 {
            return;
        }
        let (mut moments, mut n_voxels) = (Moments::default(), 0);
        totals.each(|total, n| {
            moments.add(self.parts.of(T::mean(total, n)), f64::from(n));
            n_voxels += n;
        });
        let Level(level) = totals.level();
        self.summary.kept_variance[usize::from(level)] = (moments.variance(f64::from(n_voxels)) / self.variance) as f32;
    }

    /// The summary, once the mean of the stored numbers is known.
    pub(crate) fn with_mean(self, stored: f64) -> BlockSummary {
        let ValueRange { min, max } = self.summary.range;
        BlockSummary { mean: self.parts.rescale.value(stored).clamp(min, max), ..self.summary }
    }
}

/// The summary of a block of one value.
pub(crate) fn constant_summary(value: f64) -> BlockSummary {
    BlockSummary {
        range: ValueRange { min: value, max: value },
        mean: value,
        counts: all_in_the_first(u16::MAX),
        kept_variance: [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        variance: 0.0,
    }
}

/// Data values as parts of a block's range: its least is 0, its greatest 1.
#[derive(Clone, Copy)]
pub(super) struct Parts {
    rescale: Rescale,
    /// A half where the range is wider than the greatest f64, else 1.
    scale: f64,
    min: f64,
    width: f64,
}

impl Parts {
    pub(super) fn new(range: ValueRange, rescale: Rescale) -> Parts {
        let scale = if (range.max - range.min).is_finite() { 1.0 } else { 0.5 };
        let min = range.min * scale;
        Parts { rescale, scale, min, width: range.max * scale - min }
    }

    #[inline]
    pub(super) fn of(&self, stored: f64) -> f64 {
        self.of_value(self.rescale.value(stored))
    }

    #[inline]
    pub(super) fn of_value(&self, value: f64) -> f64 {
        (value * self.scale - self.min) / self.width
    }

    /// In units of the data, squared; at most the greatest f64.
    fn variance(&self, of_parts: f64) -> f64 {
        self.width_of(of_parts.sqrt()).powi(2).min(f64::MAX)
    }

    /// A difference of parts, in units of the data.
    pub(super) fn width_of(&self, parts: f64) -> f64 {
        parts * self.width / self.scale
    }
}

/// Weighted sums of parts and of their squares.
#[derive(Clone, Copy, Default)]
struct Moments {
    first: f64,
    second: f64,
}

impl Moments {
    #[inline]
    fn add(&mut self, part: f64, weight: f64) {
        self.first += weight * part;
        self.second += weight * part * part;
    }

    /// Both ends of 0 to 1 are taken by voxels: of the variance, at least 1 / 2n, little is lost in the difference.
    fn variance(self, n: f64) -> f64 {
        (self.second / n - (self.first / n).powi(2)).max(0.0)
    }
}

fn count<T: BlockScalar>(block: BlockVoxels<'_, T>, parts: &Parts) -> (Moments, [u32; N_BLOCK_BINS]) {
    let (mut moments, mut counts) = ([Moments::default(); LANES], [[0u32; N_BLOCK_BINS]; LANES]);
    for row in block.rows() {
        for (i, voxel) in row.iter().enumerate() {
            let (lane, part) = (i % LANES, parts.of(voxel.to_f64()));
            moments[lane].add(part, 1.0);
            counts[lane][((part * N_BLOCK_BINS as f64) as usize).min(N_BLOCK_BINS - 1)] += 1;
        }
    }
    let sum = |of: fn(&Moments) -> f64| moments.iter().map(of).sum();
    let moments = Moments { first: sum(|m| m.first), second: sum(|m| m.second) };
    (moments, std::array::from_fn(|bin| counts.iter().map(|lane| lane[bin]).sum()))
}

fn all_in_the_first<N: Default + Copy>(n: N) -> [N; N_BLOCK_BINS] {
    let mut counts = [N::default(); N_BLOCK_BINS];
    counts[0] = n;
    counts
}

/// `count` of `n` as parts of 65,535, to nearest: no bin that holds a voxel is 0.
fn of_65_535(count: u32, n: u32) -> u16 {
    let parts = u64::from(u16::MAX) * u64::from(count);
    ((2 * parts + u64::from(n)) / (2 * u64::from(n))) as u16
}
