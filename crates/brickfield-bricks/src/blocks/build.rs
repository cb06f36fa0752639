//! Cutting a volume into blocks: each block by itself, in parallel.

use std::sync::Arc;

use brickfield_core::glam::UVec3;
use brickfield_core::{BlockLayout, BlockSide, BlockSummary, Rescale, ScalarType, Volume, Voxels, with_voxels};
use rayon::prelude::*;

use super::shrink::{BlockScalar, BlockVoxels, Totals};
use super::source::SourceId;
use super::spread::greatest_of;
use super::summary::{Summing, constant_summary};
use super::volume::{BlockVolume, n_averages, n_before};
use crate::SliceError;
use crate::build::try_zeroed;

/// How to cut a volume into blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockOptions {
    /// Voxels along a block's side.
    pub side: BlockSide,
    /// The most bytes that averages and summaries may take, the volume not counted; `None` is no limit.
    pub max_bytes: Option<u64>,
}

impl Default for BlockOptions {
    /// Blocks of 16^3, no limit.
    fn default() -> Self {
        BlockOptions { side: BlockSide::V16, max_bytes: None }
    }
}

/// Why a volume could not be cut into blocks.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum BlockBuildError {
    #[error(
        "averages and summaries of {n_blocks} blocks of {side}^3 voxels take {needed_bytes} bytes; the limit is {max_bytes}"
    )]
    TooLarge { n_blocks: u64, side: BlockSide, needed_bytes: u64, max_bytes: u64 },
    #[error("the machine has no {needed_bytes} bytes for the averages of the blocks")]
    OutOfMemory { needed_bytes: u64 },
}

/// The flat blocks of a volume, with their averages and summaries.
///
/// Every block is built from its own voxels, without its neighbours. Means of integers are exact, rounded once, halves up;
/// means of f32 are summed in f64 and rounded once; means of f64 are within 1e-14 of the greatest magnitude that they sum
/// (above 1e-290), never overflow, and lie in the range of the voxels. Runs on rayon's current thread pool; the result does
/// not depend on the number of threads.
///
/// # Errors
/// If averages and summaries would take more than `options.max_bytes`, or the machine does not have the memory.
pub fn build_blocks(volume: Arc<Volume>, options: &BlockOptions) -> Result<BlockVolume, BlockBuildError> {
    let layout = BlockLayout::new(volume.grid().dims(), options.side);
    let n = check_size(&layout, volume.scalar_type(), options)?;
    let (averages, summaries) = with_voxels!(volume.voxels(), v => {
        let mut averages = allocated(v, n)?;
        let summaries = fill(v, &layout, volume.rescale(), &mut averages);
        (averages.into(), summaries)
    });
    let (id, greatest_spread) = (SourceId::unique(), greatest_of(&summaries));
    Ok(BlockVolume { id, layout, volume, averages, summaries: summaries.into(), greatest_spread })
}

/// The number of averages, if they are few enough.
fn check_size(layout: &BlockLayout, scalar: ScalarType, options: &BlockOptions) -> Result<usize, BlockBuildError> {
    let end = layout.n_blocks() - 1;
    let n = n_before(layout, end) + n_averages(layout, end);
    let (n_blocks, side) = (layout.n_blocks_total() as u64, options.side);
    let needed_bytes = n as u64 * scalar.n_bytes() as u64 + n_blocks * size_of::<BlockSummary>() as u64;
    let max_bytes = options.max_bytes.unwrap_or(u64::MAX).min(isize::MAX as u64);
    match needed_bytes > max_bytes {
        true => Err(BlockBuildError::TooLarge { n_blocks, side, needed_bytes, max_bytes }),
        false => Ok(n),
    }
}

/// Zeros for `n` averages of the type of `voxels`.
fn allocated<T: BlockScalar>(_voxels: &[T], n: usize) -> Result<Vec<T>, BlockBuildError> {
    let needed_bytes = n as u64 * T::TYPE.n_bytes() as u64;
    try_zeroed(n).ok_or(BlockBuildError::OutOfMemory { needed_bytes })
}

/// Writes the averages of all blocks, and returns their summaries.
fn fill<T: BlockScalar>(voxels: &[T], layout: &BlockLayout, rescale: Rescale, averages: &mut [T]) -> Vec<BlockSummary> {
    let mut rest = averages;
    let mut jobs = Vec::with_capacity(layout.n_blocks_total());
    for block in layout.blocks() {
        let (own, others) = rest.split_at_mut(n_averages(layout, block));
        jobs.push((block, own));
        rest = others;
    }
    let built = jobs
        .into_par_iter()
        .map(|(block, out)| fill_block(BlockVoxels::new(voxels, layout, block), layout, rescale, out));
    built.collect()
}

/// Writes the averages of one block, level after level, and returns its summary.
fn fill_block<T: BlockScalar>(
    block: BlockVoxels<'_, T>,
    layout: &BlockLayout,
    rescale: Rescale,
    out: &mut [T],
) -> BlockSummary {
    let (least, greatest) = block.ends();
    if least == greatest {
        out.fill(least);
        return constant_summary(rescale.value(least.to_f64()));
    }
    let mut rest = out;
    summarized(block, layout, rescale, (least, greatest), |totals| {
        rest = totals.write_means(least, greatest, std::mem::take(&mut rest));
    })
}

/// The summary of a block with several values; shows the sums of each of its levels.
fn summarized<T: BlockScalar>(
    block: BlockVoxels<'_, T>,
    layout: &BlockLayout,
    rescale: Rescale,
    (least, greatest): (T, T),
    mut show: impl FnMut(&Totals<T>),
) -> BlockSummary {
    let mut summing = Summing::new(block, least, greatest, rescale);
    let mut totals = Totals::of_voxels(block);
    loop {
        show(&totals);
        summing.add_level(&totals);
        if totals.level() == layout.side().one_sample() {
            return summing.with_mean(totals.mean());
        }
        totals = totals.next();
    }
}

/// The summaries of the blocks of some slices, by [`BlockLayout::ordinal`] in a layout of those slices.
///
/// If the first slice begins a layer of blocks of the volume, they are the blocks of the volume, and the summaries are those that
/// [`build_blocks`] makes, bit by bit. `voxels` are the stored numbers of `dims`, x fastest.
///
/// # Errors
/// If the voxels do not fill the slices.
pub fn block_summaries(
    voxels: &Voxels,
    dims: UVec3,
    side: BlockSide,
    rescale: Rescale,
) -> Result<Vec<BlockSummary>, SliceError> {
    let (layout, n_samples) = (BlockLayout::new(dims, side), voxels.len());
    if n_samples != dims.to_array().into_iter().map(|n| n as usize).product() {
        return Err(SliceError::Ragged { n_samples, dims });
    }
    fn of<T: BlockScalar>(block: BlockVoxels<'_, T>, layout: &BlockLayout, rescale: Rescale) -> BlockSummary {
        match block.ends() {
            (least, greatest) if least == greatest => constant_summary(rescale.value(least.to_f64())),
            ends => summarized(block, layout, rescale, ends, |_| {}),
        }
    }
    let blocks = (0..layout.n_blocks_total()).into_par_iter().map(|i| layout.block(i));
    Ok(with_voxels!(voxels, v => {
        blocks.map(|block| of(BlockVoxels::new(v, &layout, block), &layout, rescale)).collect()
    }))
}
