//! Spreads: the standard deviations of the voxels of samples, from level to level.

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

/// The spreads of a block's samples of a level, x fastest: the nearest 255ths of `greatest`, halves up.
///
/// `range` is that of the block's data values.
pub(super) fn spread_codes<T: BlockScalar>(
    block: BlockVoxels<'_, T>,
    level: Level,
    (range, rescale): (ValueRange, Rescale),
    greatest: f64,
) -> Vec<u8> {
    if level == Level(0) || range.min == range.max {
        return vec![0; level.dims_of(block.extent()).element_product() as usize];
    }
    let parts = Parts::new(range, rescale);
    let mut moments = Moments::of_voxels(block, &parts);
    while moments.level < level {
        moments = moments.next();
    }
    let code = |of: &MeanVariance| (parts.width_of(of.variance.sqrt()) / greatest * UNIT).round().min(UNIT) as u8;
    moments.all.iter().map(code).collect()
}

/// Of the voxels of a sample, in parts of the block's range.
#[derive(Clone, Copy, Debug)]
struct MeanVariance {
    mean: f64,
    variance: f64,
}

/// The voxels of every sample of a level, x fastest.
struct Moments {
    level: Level,
    extent: UVec3,
    all: Vec<MeanVariance>,
}

impl Moments {
    fn of_voxels<T: BlockScalar>(block: BlockVoxels<'_, T>, parts: &Parts) -> Moments {
        let one = |voxel: &T| MeanVariance { mean: parts.of(voxel.to_f64()), variance: 0.0 };
        Moments { level: Level(0), extent: block.extent(), all: block.rows().flatten().map(one).collect() }
    }

    fn next(&self) -> Moments {
        let level = Level(self.level.0 + 1);
        let n = level.dims_of(self.extent);
        let all = positions(n).map(|sample| MeanVariance::of(self.parts_of(sample))).collect();
        Moments { level, extent: self.extent, all }
    }

    /// The samples of which a sample of the next level is made, and the voxels of each.
    fn parts_of(&self, sample: UVec3) -> impl Iterator<Item = (MeanVariance, f64)> + Clone {
        let (n, stride, extent) = (self.level.dims_of(self.extent), self.level.stride(), self.extent);
        let corner = move |c: u32| 2 * sample + UVec3::new(c & 1, c >> 1 & 1, c >> 2);
        (0..8).map(corner).filter(move |p| p.cmplt(n).all()).map(move |p| {
            let covered: DVec3 = (extent - p * stride).min(UVec3::splat(stride)).as_dvec3();
            (self.all[(p.x + n.x * (p.y + n.y * p.z)) as usize], covered.element_product())
        })
    }
}

impl MeanVariance {
    /// Of weighted parts. The variance is the mean of the parts' variances and the variance of their means: all terms are positive, so
    /// that nothing cancels.
    fn of(parts: impl Iterator<Item = (MeanVariance, f64)> + Clone) -> MeanVariance {
        let weight: f64 = parts.clone().map(|(_, weight)| weight).sum();
        let mean = parts.clone().map(|(part, weight)| weight * part.mean).sum::<f64>() / weight;
        let around = |(part, weight): (MeanVariance, f64)| weight * (part.variance + (part.mean - mean).powi(2));
        MeanVariance { mean, variance: parts.map(around).sum::<f64>() / weight }
    }
}
