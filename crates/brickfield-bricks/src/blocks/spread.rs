//! Spreads: the uniform distributions that stand for the voxels of samples, from level to level.

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{BlockSummary, Level, Rescale, ValueRange};

use super::positions;
use super::shrink::{BlockScalar, BlockVoxels};
use super::summary::Parts;

/// The code of the greatest spread.
const UNIT: f64 = 255.0;

/// Half of the widest range of a block.
pub(super) fn greatest_of(summaries: &[BlockSummary]) -> f64 {
    let half = |range: ValueRange| 0.5 * range.max - 0.5 * range.min;
    summaries.iter().map(|summary| half(summary.range)).fold(0.0, f64::max)
}

/// The spreads of a block's samples of a level, x fastest, in 255ths of `greatest`; see [`brickfield_core::Companion::Spread`].
///
/// `range` is that of the block's data values; `values` are the samples' data values, as they are stored.
pub(super) fn spread_codes<T: BlockScalar>(
    block: BlockVoxels<'_, T>,
    level: Level,
    (range, rescale): (ValueRange, Rescale),
    values: &[f64],
    greatest: f64,
) -> Vec<u8> {
    if level == Level(0) || range.min == range.max {
        return vec![0; values.len()];
    }
    let parts = Parts::new(range, rescale);
    let mut level_0 = Distributions::of_voxels(block, &parts);
    while level_0.level < level {
        level_0 = level_0.next();
    }
    let codes = |spread: f64| parts.width_of(spread) / greatest * UNIT;
    let code = |(voxels, value): (&Distribution, &f64)| {
        let value = parts.of_value(*value);
        let room = (value - voxels.least).min(voxels.greatest - value).max(0.0);
        let wanted = codes((3.0 * voxels.variance).sqrt()).round();
        wanted.min(codes(room).floor()).min(UNIT) as u8
    };
    level_0.all.iter().zip(values).map(code).collect()
}

/// The voxels of a sample, in parts of the block's range.
#[derive(Clone, Copy, Debug)]
struct Distribution {
    mean: f64,
    variance: f64,
    least: f64,
    greatest: f64,
}

/// The voxels of every sample of a level, x fastest.
struct Distributions {
    level: Level,
    extent: UVec3,
    all: Vec<Distribution>,
}

impl Distributions {
    fn of_voxels<T: BlockScalar>(block: BlockVoxels<'_, T>, parts: &Parts) -> Distributions {
        let one = |voxel: &T| {
            let part = parts.of(voxel.to_f64());
            Distribution { mean: part, variance: 0.0, least: part, greatest: part }
        };
        Distributions { level: Level(0), extent: block.extent(), all: block.rows().flatten().map(one).collect() }
    }

    fn next(&self) -> Distributions {
        let level = Level(self.level.0 + 1);
        let n = level.dims_of(self.extent);
        let all = positions(n).map(|sample| Distribution::of(self.parts_of(sample))).collect();
        Distributions { level, extent: self.extent, all }
    }

    /// The samples of which a sample of the next level is made, and the voxels of each.
    fn parts_of(&self, sample: UVec3) -> impl Iterator<Item = (Distribution, f64)> + Clone {
        let (n, stride, extent) = (self.level.dims_of(self.extent), self.level.stride(), self.extent);
        let corner = move |c: u32| 2 * sample + UVec3::new(c & 1, c >> 1 & 1, c >> 2);
        (0..8).map(corner).filter(move |p| p.cmplt(n).all()).map(move |p| {
            let covered: DVec3 = (extent - p * stride).min(UVec3::splat(stride)).as_dvec3();
            (self.all[(p.x + n.x * (p.y + n.y * p.z)) as usize], covered.element_product())
        })
    }
}

impl Distribution {
    /// Of weighted parts. The variance is the mean of the parts' variances and the variance of their means: all terms are positive, so
    /// that nothing cancels.
    fn of(parts: impl Iterator<Item = (Distribution, f64)> + Clone) -> Distribution {
        let weight: f64 = parts.clone().map(|(_, weight)| weight).sum();
        let mean = parts.clone().map(|(part, weight)| weight * part.mean).sum::<f64>() / weight;
        let none = Distribution { mean, variance: 0.0, least: f64::INFINITY, greatest: f64::NEG_INFINITY };
        parts.fold(none, |sum, (part, part_weight)| Distribution {
            variance: sum.variance + part_weight / weight * (part.variance + (part.mean - mean).powi(2)),
            least: sum.least.min(part.least),
            greatest: sum.greatest.max(part.greatest),
            ..sum
        })
    }
}
