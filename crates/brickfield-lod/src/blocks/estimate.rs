//! The visible error of one block's levels, from its summary.

use brickfield_core::glam::Vec4;
use brickfield_core::{BlockSide, BlockSummary, N_BLOCK_BINS};

use super::errors::{LevelErrors, N_LEVELS};
use super::table::ColorTable;

/// Values that stand for a bin.
const N_PER_BIN: usize = 2;

const N_POINTS: usize = N_PER_BIN * N_BLOCK_BINS;

/// The root mean square of Delta E between voxels and what each level shows in their place; see [`BlockErrors`](super::BlockErrors).
pub(crate) fn estimate(summary: &BlockSummary, side: BlockSide, table: &ColorTable) -> LevelErrors {
    let mut errors = [0.0; N_LEVELS];
    let width = summary.range.max - summary.range.min;
    if width > 0.0 && summary.variance > 0.0 {
        let moments = Moments::new(summary, table);
        let voxels = Voxels::new(&Values::of_bins(summary, &moments), table);
        for (error, kept) in errors.iter_mut().zip(summary.kept_variance).skip(1).take(usize::from(side.one_sample().0))
        {
            *error = voxels.mean_square(kept.clamp(0.0, 1.0), &moments, table).sqrt();
        }
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

/// Values that stand for the bins of a block, with weights that sum to 1; four at a time.
struct Values {
    places: [Vec4; N_POINTS / 4],
    weights: [Vec4; N_POINTS / 4],
}

impl Values {
    /// Evenly spaced, then moved to the moments.
    fn of_bins(summary: &BlockSummary, moments: &Moments) -> Values {
        let total: u32 = summary.counts.iter().map(|count| u32::from(*count)).sum();
        let part = 1.0 / (total * N_PER_BIN as u32) as f32;
        let weight = |point: usize| f32::from(summary.counts[point / N_PER_BIN]) * part;
        let step = (moments.greatest - moments.least) / N_POINTS as f32;
        let place = |point: usize| match point {
            // Voxels have both ends of the range.
            0 => moments.least,
            point if point == N_POINTS - 1 => moments.greatest,
            point => moments.least + (point as f32 + 0.5) * step,
        };
        let four = |of: &dyn Fn(usize) -> f32, i: usize| Vec4::from_array(std::array::from_fn(|j| of(4 * i + j)));
        let values = Values {
            places: std::array::from_fn(|i| four(&place, i)),
            weights: std::array::from_fn(|i| four(&weight, i)),
        };
        // What the first round loses at the ends of the range, the second makes good.
        values.matched(moments).matched(moments)
    }

    /// Moved and stretched to the mean and the standard deviation, but not out of the range.
    fn matched(self, moments: &Moments) -> Values {
        let mean = Vec4::splat(self.sum(|place| place));
        let variance = self.sum(|place| square(place - mean));
        let stretch = if variance > 0.0 { moments.deviation / variance.sqrt() } else { 0.0 };
        let [least, greatest, middle] = [moments.least, moments.greatest, moments.mean].map(Vec4::splat);
        let places = self.places.map(|place| (middle + (place - mean) * stretch).max(least).min(greatest));
        Values { places, ..self }
    }

    #[inline]
    fn sum(&self, of: impl Fn(Vec4) -> Vec4) -> f32 {
        let terms = self.places.iter().zip(self.weights).map(|(place, weight)| of(*place) * weight);
        terms.sum::<Vec4>().element_sum()
    }
}

/// The voxels of a block as weighted values that are not none: their places in a table, and their colours.
struct Voxels {
    n: usize,
    places: [f32; N_POINTS],
    weights: [f32; N_POINTS],
    colors: [Vec4; N_POINTS],
}

impl Voxels {
    fn new(values: &Values, table: &ColorTable) -> Voxels {
        let (places, weights, colors) = ([0.0; N_POINTS], [0.0; N_POINTS], [Vec4::ZERO; N_POINTS]);
        let mut voxels = Voxels { n: 0, places, weights, colors };
        for (four_places, four_weights) in values.places.iter().zip(values.weights) {
            for (place, weight) in four_places.to_array().into_iter().zip(four_weights.to_array()) {
                if weight > 0.0 {
                    let i = voxels.n;
                    (voxels.places[i], voxels.weights[i], voxels.colors[i]) = (place, weight, table.at(place));
                    voxels.n += 1;
                }
            }
        }
        voxels
    }

    /// The mean square of Delta E for averages that keep a part of the variance.
    fn mean_square(&self, kept: f32, moments: &Moments, table: &ColorTable) -> f32 {
        let mut sum = Vec4::ZERO;
        if kept == 0.0 {
            let mean = table.at(moments.within(moments.mean));
            for (color, weight) in self.colored() {
                sum += square(color - mean) * weight;
            }
            return sum.element_sum();
        }
        let spread = moments.deviation * (kept * (1.0 - kept)).sqrt();
        let shown = |place: f32| table.at(moments.within(place));
        for ((color, weight), place) in self.colored().zip(&self.places) {
            let expected = moments.mean + kept * (place - moments.mean);
            let (low, high) = (color - shown(expected - spread), color - shown(expected + spread));
            sum += (square(low) + square(high)) * (0.5 * weight);
        }
        sum.element_sum()
    }

    #[inline]
    fn colored(&self) -> impl Iterator<Item = (Vec4, f32)> {
        self.colors.iter().copied().zip(self.weights).take(self.n)
    }
}

#[inline]
fn square(v: Vec4) -> Vec4 {
    v * v
}
