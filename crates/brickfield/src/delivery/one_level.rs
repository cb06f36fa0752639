//! The blocks of a store of which one level has arrived.

use std::path::Path;

use brickfield_core::glam::UVec3;
use brickfield_core::{
    BlockLayout, BlockSide, BlockSummary, Level, N_BLOCK_BINS, N_BLOCK_LEVELS, Rescale, Scalar, ValueRange, with_voxels,
};
use brickfield_io::ReadError;
use brickfield_io::ome_zarr::ZarrLevels;

use crate::StoreBlocks;
use crate::store::finest_above;

/// The blocks of a store of which one level is there: their summaries are those of its samples.
pub(super) fn of_one_level(
    path: &Path,
    levels: ZarrLevels,
    side: BlockSide,
    level: Level,
) -> Result<StoreBlocks, ReadError> {
    let layout = BlockLayout::new(levels.facts().grid.dims(), side);
    let (from, rescale) = (finest_above(&levels, level), levels.facts().rescale);
    let (dims, shifts) = (levels.dims(from), levels.shifts(from).unwrap_or(UVec3::ZERO));
    let samples = levels.box_voxels(from, UVec3::ZERO, dims)?;
    let summary = |block: UVec3| {
        let first = layout.first_voxel(block) >> shifts;
        let end = ((layout.first_voxel(block) + layout.extent(block) - 1) >> shifts) + 1;
        with_voxels!(&samples, v => summary_of_box(v, dims, (first, end), rescale))
    };
    let summaries = layout.blocks().map(summary).collect();
    Ok(StoreBlocks::with_summaries(path, levels, layout, summaries))
}

/// The range and the mean of a box of samples; nothing is known of the voxels that they average.
fn summary_of_box<T: Scalar>(
    samples: &[T],
    dims: UVec3,
    (first, end): (UVec3, UVec3),
    rescale: Rescale,
) -> BlockSummary {
    let (mut least, mut greatest, mut sum) = (f64::INFINITY, f64::NEG_INFINITY, 0.0);
    for z in first.z..end.z {
        for y in first.y..end.y {
            let row = dims.x as usize * (y as usize + dims.y as usize * z as usize);
            for sample in &samples[row + first.x as usize..row + end.x as usize] {
                let stored = sample.to_f64();
                (least, greatest, sum) = (least.min(stored), greatest.max(stored), sum + stored);
            }
        }
    }
    let range = rescale.values(ValueRange { min: least, max: greatest });
    let mean = rescale.value(sum / (end - first).as_dvec3().element_product());
    BlockSummary { range, mean, counts: [0; N_BLOCK_BINS], kept_variance: [1.0; N_BLOCK_LEVELS], variance: 0.0 }
}
