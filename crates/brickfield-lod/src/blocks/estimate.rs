//! The visible error of one block's levels, from its summary.

use brickfield_core::glam::Vec4;
use brickfield_core::{BlockSide, BlockSummary, N_BLOCK_BINS, N_BLOCK_LEVELS};

use super::differences::Differences;
use super::errors::LevelErrors;
use super::table::ColorTable;

/// What each level's samples show amiss; see [`BlockErrors`](super::BlockErrors).
pub(crate) fn estimate(summary: &BlockSummary, side: BlockSide, table: &ColorTable) -> LevelErrors {
    if summary.range.max <= summary.range.min || summary.variance <= 0.0 {
        return [0.0; N_BLOCK_LEVELS];
    }
    let moments = Moments::new(summary, table);
    // Values half as far apart as the narrowest peak is wide do not step over it.
    let misses = |n_per_bin: usize| {
        let spacing = (moments.greatest - moments.least) / (n_per_bin * N_BLOCK_BINS) as f32;
        table.has_bump(moments.least, moments.greatest, 2.0 * spacing)
    };
    let [misses_2, misses_4, misses_8] = [2, 4, 8].map(misses);
    match () {
        () if misses_8 => estimate_by::<16>(summary, side, &moments, table),
        () if misses_4 => estimate_by::<8>(summary, side, &moments, table),
        () if misses_2 => estimate_by::<4>(summary, side, &moments, table),
        () => estimate_by::<2>(summary, side, &moments, table),
    }
}

/// By so many values for each bin.
fn estimate_by<const N: usize>(
    summary: &BlockSummary,
    side: BlockSide,
    moments: &Moments,
    table: &ColorTable,
) -> LevelErrors {
    let mut errors = [0.0; N_BLOCK_LEVELS];
    let voxels = Voxels::new(&Values::<N>::of_bins(summary, side, moments), table);
    for level in side.levels().skip(1) {
        let i = usize::from(level.0);
        errors[i] =
            voxels.differences(summary.kept_variance[i].clamp(0.0, 1.0), moments, table).seen(side, level) as f32;
    }
    errors
}

/// Range, mean and standard deviation of a block, as places in a table.
struct Moments {
    least: f32,
    greatest: f32,
    mean: f32,
    deviation: f32,
}

impl Moments {
    fn new(summary: &BlockSummary, table: &ColorTable) -> Moments {
        Moments {
            least: table.place(summary.range.min),
            greatest: table.place(summary.range.max),
            mean: table.place(summary.mean),
            deviation: (summary.variance.sqrt() * table.scale()) as f32,
        }
    }

    /// The place in the range that is nearest.
    #[inline]
    fn within(&self, place: f32) -> f32 {
        let place = if place > self.least { place } else { self.least };
        if place < self.greatest { place } else { self.greatest }
    }
}

/// Values that stand for the bins of a block, `N` for each, with weights that sum to 1; four at a time.
struct Values<const N: usize> {
    places: [[Vec4; N_BLOCK_BINS / 4]; N],
    weights: [[Vec4; N_BLOCK_BINS / 4]; N],
}

impl<const N: usize> Values<N> {
    /// Evenly spaced, then moved to the moments.
    ///
    /// Between its voxels a block has every value of its range. A surface of one value passes through one of `side` cells, and
    /// there a bin holds a 16th of the values: no bin counts for less.
    fn of_bins(summary: &BlockSummary, side: BlockSide, moments: &Moments) -> Values<N> {
        let least_count = f32::from(u16::MAX) / (side.n_voxels() as usize * N_BLOCK_BINS) as f32;
        let counts = summary.counts.map(|count| f32::from(count).max(least_count));
        let part = 1.0 / (counts.iter().sum::<f32>() * N as f32);
        let step = (moments.greatest - moments.least) / (N * N_BLOCK_BINS) as f32;
        let place = |point: usize| match point {
            // Voxels have both ends of the range.
            0 => moments.least,
            point if point == N * N_BLOCK_BINS - 1 => moments.greatest,
            point => moments.least + (point as f32 + 0.5) * step,
        };
        let fours = |of: &dyn Fn(usize) -> f32| {
            let four = |first: usize| Vec4::from_array(std::array::from_fn(|i| of(first + i)));
            std::array::from_fn(|i| std::array::from_fn(|j| four(N_BLOCK_BINS * i + 4 * j)))
        };
        let values = Values { places: fours(&place), weights: fours(&|point| counts[point / N] * part) };
        // What the first round loses at the ends of the range, the second makes good.
        values.matched(moments).matched(moments)
    }

    /// Moved and stretched to the mean and the standard deviation, but not out of the range.
    fn matched(mut self, moments: &Moments) -> Values<N> {
        let mean = Vec4::splat(self.sum(|place| place));
        let variance = self.sum(|place| square(place - mean));
        let stretch = if variance > 0.0 { moments.deviation / variance.sqrt() } else { 0.0 };
        let [least, greatest, middle] = [moments.least, moments.greatest, moments.mean].map(Vec4::splat);
        for place in self.places.as_flattened_mut() {
            *place = (middle + (*place - mean) * stretch).max(least).min(greatest);
        }
        self
    }

    #[inline]
    fn sum(&self, of: impl Fn(Vec4) -> Vec4) -> f32 {
        let weighted = self.places.as_flattened().iter().zip(self.weights.as_flattened());
        weighted.map(|(place, weight)| of(*place) * *weight).sum::<Vec4>().element_sum()
    }
}

/// The voxels of a block as weighted values: their places in a table, and their colours.
struct Voxels<const N: usize> {
    places: [[f32; N_BLOCK_BINS]; N],
    weights: [[f32; N_BLOCK_BINS]; N],
    colors: [[Vec4; N_BLOCK_BINS]; N],
}

impl<const N: usize> Voxels<N> {
    fn new(values: &Values<N>, table: &ColorTable) -> Voxels<N> {
        let numbers = |fours: [Vec4; N_BLOCK_BINS / 4]| std::array::from_fn(|i| fours[i / 4][i % 4]);
        let places = values.places.map(numbers);
        let colors = places.map(|row: [f32; N_BLOCK_BINS]| row.map(|place| table.at(place)));
        Voxels { places, weights: values.weights.map(numbers), colors }
    }

    /// What averages that keep a part of the variance show less than the voxels.
    fn differences(&self, kept: f32, moments: &Moments, table: &ColorTable) -> Differences {
        let (mut squares, mut sum) = (Vec4::ZERO, Vec4::ZERO);
        if kept == 0.0 {
            let mean = table.at(moments.within(moments.mean));
            for (color, weight) in self.colored() {
                squares += square(color - mean) * weight;
                sum += (color - mean) * weight;
            }
            return differences(squares, sum);
        }
        let spread = moments.deviation * (kept * (1.0 - kept)).sqrt();
        let shown = |place: f32| table.at(moments.within(place));
        for ((color, weight), place) in self.colored().zip(self.places.as_flattened()) {
            let expected = moments.mean + kept * (place - moments.mean);
            let (low, high) = (color - shown(expected - spread), color - shown(expected + spread));
            squares += (square(low) + square(high)) * (0.5 * weight);
            sum += (low + high) * (0.5 * weight);
        }
        differences(squares, sum)
    }

    #[inline]
    fn colored(&self) -> impl Iterator<Item = (Vec4, f32)> {
        self.colors.as_flattened().iter().copied().zip(self.weights.as_flattened().iter().copied())
    }
}

/// L*, u* and v*, in sums of weights 1.
fn differences(squares: Vec4, sum: Vec4) -> Differences {
    Differences { mean_square: squares.element_sum().into(), square_of_mean: sum.length_squared().into() }
}

#[inline]
fn square(v: Vec4) -> Vec4 {
    v * v
}
