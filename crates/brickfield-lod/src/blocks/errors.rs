//! The visible errors of all blocks, kept from edit to edit.

use brickfield_core::{BlockLayout, BlockSummary, N_BLOCK_LEVELS, TransferFunction, ValueRange};
use rayon::prelude::*;

use super::change::changed_values;
use super::estimate::estimate;
use super::slab::Slab;
use super::table::ColorTable;

/// The error of a block at each level, finest first, in Delta E; see [`BlockErrors`]. Level 0 has none.
pub type LevelErrors = [f32; N_BLOCK_LEVELS];

/// The visible error of every block at every level, estimated from summaries and a transfer function (Ljung, Lundstroem,
/// Ynnerman and Museth 2004; 2006, section 4).
///
/// A voxel of value v is seen as a [`Slab`] of that value, of colour C(v). Averages of a level keep a part r of the variance
/// of the block's voxels about their mean m. If values and averages were normally distributed, a voxel of value v would be
/// shown as
///
/// ```text
/// m + r (v - m) +- sqrt(variance r (1 - r))
/// ```
///
/// From the differences d between C(v) and the colour that is shown, over the block's histogram and both signs, the error is
///
/// ```text
/// sqrt(|mean d|^2 + (mean |d|^2 - |mean d|^2) stride / side)
/// ```
///
/// The mean is seen in full. The rest cancels along a ray: `stride` voxels of `side` differ alike, those of one sample. Without
/// this factor a surface that a level displaces by half a sample would cost more than one that a level swallows.
///
/// Two to 16 values stand for a bin, as many as the narrowest peak of colours asks for, moved and stretched so that mean and
/// variance of the block are kept. A bin without voxels counts for the values between them: a 16th of one voxel in `side`.
/// Departures from the papers: 1. theirs compare the histogram with that of a level, without `r` and the spread; 2. the slab's
/// opacity enters; 3. the factor above; 4. values between voxels.
///
/// A block is transparent, of error 0, if the transfer function is 0 over its range. Colours are taken from a table of 4,096 steps
/// over the range of all blocks, linear between: a peak narrower than a step may be missed, and so may one that is narrower than
/// a 256th of its block's range.
#[derive(Clone, Debug)]
pub struct BlockErrors {
    layout: BlockLayout,
    slab: Slab,
    range: ValueRange,
    transfer: TransferFunction,
    errors: Vec<LevelErrors>,
}

/// Summaries that are not those of the blocks.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{n_summaries} summaries for {n_blocks} blocks: each block has one")]
#[allow(missing_docs)]
pub struct EstimateError {
    pub n_summaries: usize,
    pub n_blocks: usize,
}

impl BlockErrors {
    /// The errors of all blocks; `summaries` are by [`BlockLayout::ordinal`]. Runs on rayon's current thread pool.
    ///
    /// # Errors
    /// If there is not one summary for each block.
    pub fn estimate(
        layout: &BlockLayout,
        summaries: &[BlockSummary],
        transfer: &TransferFunction,
        slab: Slab,
    ) -> Result<BlockErrors, EstimateError> {
        check(layout, summaries)?;
        let nothing = ValueRange { min: f64::INFINITY, max: f64::NEG_INFINITY };
        let range = summaries.iter().fold(nothing, |all, summary| all.union(summary.range));
        let errors = vec![[0.0; N_BLOCK_LEVELS]; summaries.len()];
        let mut all = BlockErrors { layout: *layout, slab, range, transfer: transfer.clone(), errors };
        all.estimate_in(summaries, ValueRange { min: f64::NEG_INFINITY, max: f64::INFINITY });
        Ok(all)
    }

    /// Follows an edit of the transfer function, and returns how many blocks it concerned.
    ///
    /// `summaries` are those from before. Blocks all of whose values are as they were keep their errors. The result is that of
    /// [`estimate`](Self::estimate), bit by bit.
    ///
    /// # Errors
    /// As [`estimate`](Self::estimate).
    pub fn update(&mut self, summaries: &[BlockSummary], transfer: &TransferFunction) -> Result<usize, EstimateError> {
        check(&self.layout, summaries)?;
        let Some(changed) = changed_values(&self.transfer, transfer) else { return Ok(0) };
        self.transfer = transfer.clone();
        Ok(self.estimate_in(summaries, changed))
    }

    /// Errors by [`BlockLayout::ordinal`].
    pub fn levels(&self) -> &[LevelErrors] {
        &self.errors
    }

    /// Which blocks there are.
    pub fn layout(&self) -> &BlockLayout {
        &self.layout
    }

    /// The transfer function of the errors.
    pub fn transfer(&self) -> &TransferFunction {
        &self.transfer
    }

    /// Estimates the blocks that have values in `changed`, and returns their number.
    fn estimate_in(&mut self, summaries: &[BlockSummary], changed: ValueRange) -> usize {
        let table = ColorTable::new(self.range, &self.transfer, &self.slab);
        // Between two values of the table a colour depends on both, and a place is rounded.
        let (min, max) = (changed.min - 2.0 * table.step(), changed.max + 2.0 * table.step());
        let (side, transfer) = (self.layout.side(), &self.transfer);
        let concerned = self.errors.par_iter_mut().zip(summaries).with_min_len(256);
        let concerned = concerned.filter(|(_, summary)| summary.range.min <= max && min <= summary.range.max);
        let estimated = concerned.map(|(errors, summary)| {
            *errors = match transfer.is_transparent(summary.range) {
                true => [0.0; N_BLOCK_LEVELS],
                false => estimate(summary, side, &table),
            };
        });
        estimated.count()
    }
}

fn check(layout: &BlockLayout, summaries: &[BlockSummary]) -> Result<(), EstimateError> {
    let (n_summaries, n_blocks) = (summaries.len(), layout.n_blocks_total());
    match n_summaries == n_blocks {
        true => Ok(()),
        false => Err(EstimateError { n_summaries, n_blocks }),
    }
}
