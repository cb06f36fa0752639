//! How much of the differences inside a block a picture shows.

use brickfield_core::{BlockSide, Level};

/// Differences in L*, u*, v* between the voxels of a block and what is shown in their place, over all voxels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Differences {
    /// The mean of the squares: that of Delta E.
    pub(crate) mean_square: f64,
    /// The square of the mean.
    pub(crate) square_of_mean: f64,
}

impl Differences {
    /// The root mean square, seen along a ray through the block, in Delta E.
    ///
    /// The mean difference is seen in full. The rest cancels between the voxels of one sample and those of the next, for a level
    /// keeps the sum of values: of `side` voxels on a ray `stride` at a time differ alike, so that `stride / side` of the
    /// squares remain. A surface that a level displaces within its samples is nearly right; one that it swallows is missing.
    pub(crate) fn seen(self, side: BlockSide, level: Level) -> f64 {
        let remains = f64::from(level.stride()) / f64::from(side.n_voxels());
        let rest = (self.mean_square - self.square_of_mean).max(0.0);
        (self.square_of_mean + remains * rest).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_difference_is_seen_in_full_and_what_cancels_in_part() {
        let seen = |mean_square, square_of_mean, level| {
            Differences { mean_square, square_of_mean }.seen(BlockSide::V16, Level(level))
        };
        assert_eq!([1, 4].map(|level| seen(9.0, 9.0, level)), [3.0; 2]);
        assert_eq!([1, 2, 3, 4].map(|level| seen(16.0, 0.0, level).powi(2).round()), [2.0, 4.0, 8.0, 16.0]);
    }
}
