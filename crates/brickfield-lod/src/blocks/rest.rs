//! What a budget has left, for transparent blocks beside visible ones.

use brickfield_core::glam::{IVec3, UVec3};
use brickfield_core::{BlockLayout, BlockSummary, N_BLOCK_LEVELS, TransferFunction};
use rayon::prelude::*;

use super::errors::LevelErrors;
use super::spend::{BlockBudget, BlockSelection, BudgetError, BudgetSize, OneSampleBlocks, select_block_levels};

/// Spends what a selection leaves of its budget on transparent blocks that lie beside visible ones.
///
/// A transparent block shows nothing itself, so that [`select_block_levels`] keeps it at one sample. Where values between blocks are
/// blended, its visible neighbour's outermost half voxel is a blend with that sample: a surface there has holes that no budget closes. The
/// error of a level is here the root of the variance that it does not keep; the rest is spent greedily, with the same weights as the budget
/// before. Blocks of one value need nothing.
///
/// # Errors
/// Summaries or weights that are not one for each block.
pub fn spend_rest(
    layout: &BlockLayout,
    summaries: &[BlockSummary],
    transfer: &TransferFunction,
    weights: Option<&[f32]>,
    budget: &BlockBudget,
    selection: BlockSelection,
) -> Result<BlockSelection, BudgetError> {
    let n_blocks = layout.n_blocks_total();
    if summaries.len() != n_blocks {
        return Err(BudgetError::Errors { n_errors: summaries.len(), n_blocks });
    }
    let shows: Vec<bool> = summaries.par_iter().map(|summary| !transfer.is_transparent(summary.range)).collect();
    let error = |(ordinal, summary): (usize, &BlockSummary)| match !shows[ordinal] && is_beside(layout, ordinal, &shows)
    {
        true => deviations(summary),
        false => [0.0; N_BLOCK_LEVELS],
    };
    let errors: Vec<LevelErrors> = summaries.par_iter().enumerate().map(error).collect();
    let of_one_sample = match budget.one_sample {
        OneSampleBlocks::Free => 0,
        OneSampleBlocks::Stored => n_blocks as u64 * u64::from(budget.sample_bytes),
    };
    let rest = budget.bytes(layout)?.saturating_sub(selection.n_bytes);
    let beside = BlockBudget { size: BudgetSize::Bytes(rest + of_one_sample), ..*budget };
    let finer = select_block_levels(layout, &errors, weights, &beside)?;
    let n_bytes = selection.n_bytes + finer.n_bytes - of_one_sample;
    Ok(BlockSelection { levels: selection.levels.finer_of(&finer.levels), n_bytes, ..selection })
}

/// The standard deviation of the voxels from what each level keeps of them.
fn deviations(summary: &BlockSummary) -> LevelErrors {
    summary.kept_variance.map(|kept| (summary.variance * f64::from(1.0 - kept).max(0.0)).sqrt() as f32)
}

/// Whether one of the blocks around a block shows something.
fn is_beside(layout: &BlockLayout, ordinal: usize, shows: &[bool]) -> bool {
    let (block, n) = (layout.block(ordinal).as_ivec3(), layout.n_blocks().as_ivec3());
    let (low, high) = ((block - 1).max(IVec3::ZERO), (block + 1).min(n - 1));
    let along = |axis: usize| low[axis]..=high[axis];
    let around = along(2).flat_map(|z| along(1).flat_map(move |y| along(0).map(move |x| IVec3::new(x, y, z))));
    around.map(IVec3::as_uvec3).any(|around: UVec3| shows[layout.ordinal(around)])
}
