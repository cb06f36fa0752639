//! Building the octree: finest level first, each level from the one below, bricks in parallel.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use brickfield_core::{BrickId, BrickLayout, BrickSide, Level, Rescale, Volume, with_voxels};
use rayon::prelude::*;

use crate::bins::{BinTable, Histogram};
use crate::downsample::{Dense, downsample};
use crate::fill::{copy_brick, owned_histogram, range_of};
use crate::sample::BrickScalar;
use crate::tree::{TreeId, TreeLevel};
use crate::{Bins, BrickSummary, BrickTree, Downsampling, tree_memory};

/// How to build a tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuildOptions {
    /// Samples along a brick's side.
    pub side: BrickSide,
    /// How each level is computed from the one below.
    pub downsampling: Downsampling,
    /// The most bytes that samples and summaries of all levels may take; `None` is no limit.
    pub max_bytes: Option<u64>,
}

impl Default for BuildOptions {
    /// Bricks of 32^3, subsampling, no limit.
    fn default() -> Self {
        BuildOptions { side: BrickSide::S32, downsampling: Downsampling::default(), max_bytes: None }
    }
}

/// How far a build has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Bricks that are complete.
    pub n_done: usize,
    /// Bricks of all levels.
    pub n_total: usize,
}

/// Why a tree could not be built.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum BuildError {
    #[error("{n_bricks} bricks of {side}^3 samples take {needed_bytes} bytes; the limit is {max_bytes}")]
    TooLarge { n_bricks: u64, side: BrickSide, needed_bytes: u64, max_bytes: u64 },
    #[error("the machine has no {needed_bytes} bytes for level {} of the bricks", level.0)]
    OutOfMemory { level: Level, needed_bytes: u64 },
}

/// The octree of a volume.
///
/// The samples of level 0 are the volume's, bit by bit. Runs on rayon's current thread pool; the result does not depend
/// on the number of threads.
///
/// # Errors
/// If the tree would take more than `options.max_bytes`, or the machine does not have the memory.
pub fn build_tree(volume: &Volume, options: &BuildOptions) -> Result<BrickTree, BuildError> {
    build_tree_observed(volume, options, &|_| ())
}

/// [`build_tree`], telling `observe` after every brick; it is called from several threads at once.
///
/// # Errors
/// As [`build_tree`].
pub fn build_tree_observed(
    volume: &Volume,
    options: &BuildOptions,
    observe: &(dyn Fn(Progress) + Sync),
) -> Result<BrickTree, BuildError> {
    let layout = BrickLayout::new(volume.grid().dims(), options.side);
    let n_total = check_size(&layout, volume, options)?;
    let bins = Bins::new(volume.range());
    let n_done = AtomicUsize::new(0);
    let brick_done = || observe(Progress { n_done: n_done.fetch_add(1, Ordering::Relaxed) + 1, n_total });
    let rescale = volume.rescale();
    let job = Job { layout, downsampling: options.downsampling, bins, rescale, brick_done: &brick_done };
    let levels = with_voxels!(volume.voxels(), v => build_levels(v, &job))?;
    let (grid, scalar) = (*volume.grid(), volume.scalar_type());
    let id = TreeId::new();
    Ok(BrickTree { id, layout, grid, downsampling: options.downsampling, bins, scalar, rescale, levels })
}

/// The layout and options that all levels are built with.
struct Job<'a> {
    layout: BrickLayout,
    downsampling: Downsampling,
    bins: Bins,
    rescale: Rescale,
    brick_done: &'a (dyn Fn() + Sync),
}

/// The number of bricks, if the tree is small enough.
fn check_size(layout: &BrickLayout, volume: &Volume, options: &BuildOptions) -> Result<usize, BuildError> {
    let total = tree_memory(layout, volume.scalar_type()).total;
    let (n_bricks, needed_bytes) = (total.n_bricks, total.bytes());
    let max_bytes = options.max_bytes.unwrap_or(u64::MAX).min(isize::MAX as u64);
    if needed_bytes > max_bytes {
        return Err(BuildError::TooLarge { n_bricks, side: options.side, needed_bytes, max_bytes });
    }
    Ok(n_bricks as usize)
}

fn build_levels<T: BrickScalar>(voxels: &[T], job: &Job<'_>) -> Result<Vec<TreeLevel>, BuildError> {
    let finest = Dense { samples: voxels, dims: job.layout.dims() };
    let mut levels = vec![finest_level(finest, job)?];
    let mut below: Vec<T> = Vec::new();
    for level in (1..job.layout.n_levels()).map(Level) {
        let source = match level {
            Level(1) => finest,
            _ => Dense { samples: &below, dims: job.layout.level_dims(Level(level.0 - 1)) },
        };
        let dims = job.layout.level_dims(level);
        let samples = downsample(source, dims, job.downsampling);
        let children = &levels[usize::from(level.0) - 1].summaries;
        let built = coarse_level(Dense { samples: &samples, dims }, level, children, job)?;
        levels.push(built);
        below = samples;
    }
    Ok(levels)
}

fn finest_level<T: BrickScalar>(source: Dense<'_, T>, job: &Job<'_>) -> Result<TreeLevel, BuildError> {
    let table = BinTable::new(job.bins, T::TYPE, job.rescale);
    fill_level(source, Level(0), job, |id, samples| {
        let stored = range_of(samples);
        let histogram = owned_histogram(samples, &job.layout, id, stored, &table);
        BrickSummary { range: job.rescale.values(stored), histogram }
    })
}

fn coarse_level<T: BrickScalar>(
    source: Dense<'_, T>,
    level: Level,
    below: &[BrickSummary],
    job: &Job<'_>,
) -> Result<TreeLevel, BuildError> {
    fill_level(source, level, job, |id, samples| {
        let mut summary =
            BrickSummary { range: job.rescale.values(range_of(samples)), histogram: Histogram::default() };
        for child in job.layout.children(id).map(|child| &below[job.layout.ordinal(child)]) {
            summary.range = summary.range.union(child.range);
            summary.histogram.add(&child.histogram);
        }
        summary
    })
}

fn fill_level<T: BrickScalar>(
    source: Dense<'_, T>,
    level: Level,
    job: &Job<'_>,
    summarise: impl Fn(BrickId, &[T]) -> BrickSummary + Sync,
) -> Result<TreeLevel, BuildError> {
    let n_brick = job.layout.side().n_samples_total();
    let mut samples = zeroed::<T>(n_brick * job.layout.n_bricks_total(level), level)?;
    let ids: Vec<BrickId> = job.layout.bricks(level).collect();
    let bricks = samples.par_chunks_exact_mut(n_brick).zip(&ids);
    let summaries = bricks.map(|(out, &id)| {
        copy_brick(source, &job.layout, id, out);
        let summary = summarise(id, out);
        (job.brick_done)();
        summary
    });
    let summaries = summaries.collect();
    Ok(TreeLevel { samples: Arc::new(T::wrap(samples)), summaries })
}

fn zeroed<T: BrickScalar>(n: usize, level: Level) -> Result<Vec<T>, BuildError> {
    let needed_bytes = n as u64 * T::TYPE.n_bytes() as u64;
    try_zeroed(n).ok_or(BuildError::OutOfMemory { level, needed_bytes })
}

/// Zeros that the system hands out page by page, so that the threads that fill them also fault them in; `None` if it has no
/// memory.
pub(crate) fn try_zeroed<T: Copy + Default>(n: usize) -> Option<Vec<T>> {
    // Asking first, without touching the memory, turns an abort into an error.
    Vec::<T>::new().try_reserve_exact(n).ok()?;
    Some(vec![T::default(); n])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_that_no_machine_has_is_an_error() {
        let error = zeroed::<u16>(isize::MAX as usize / 2, Level(3)).unwrap_err();
        assert_eq!(error.to_string(), "the machine has no 9223372036854775806 bytes for level 3 of the bricks");
    }
}
