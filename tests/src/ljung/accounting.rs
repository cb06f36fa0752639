//! Figure 9: the bytes of blocks at given levels.

use brickfield::bricks::block_memory;
use brickfield_core::glam::UVec3;
use brickfield_core::{BlockLayout, BlockSide, Level, ScalarType};

use crate::paper::{Missed, PaperError, print};

/// Blocks of 16, 8, 4, 2 and 1 samples a side.
const COUNTS: [usize; 5] = [0, 2551, 5128, 23041, 32768];

pub(super) fn run() -> Result<Vec<Missed>, PaperError> {
    let layout = BlockLayout::new(UVec3::new(512, 512, 990), BlockSide::V16);
    let levels: Vec<Level> =
        COUNTS.iter().enumerate().flat_map(|(level, n)| std::iter::repeat_n(Level(level as u8), *n)).collect();
    // Of the last layer of blocks only 14 of 16 slices are in the volume; the paper counts whole blocks.
    let n_samples: usize = COUNTS.iter().enumerate().map(|(level, n)| n * (16usize >> level).pow(3)).sum();
    let n_voxels = 512 * 512 * 990;
    let (without, with) = (n_voxels as f64 / (n_samples - COUNTS[4]) as f64, n_voxels as f64 / n_samples as f64);
    let memory = block_memory(&layout, ScalarType::U8, &levels);
    print(&format!(
        "512 x 512 x 990 voxels, blocks of 16: {COUNTS:?} of 16 to 1 samples a side.\n\
         whole blocks: {without:.1}:1, with the one-sample blocks {with:.1}:1 (the paper: 143:1)\n\
         as stored, the last layer of blocks short: {:.1}:1, {:.1}:1\n\
         with a ghost layer on one side: {:.1}:1, on both: {:.1}:1",
        memory.ratio(),
        memory.ratio_of_all(),
        memory.volume_bytes as f64 / memory.larger.single_sided_bytes as f64,
        memory.volume_bytes as f64 / memory.larger.double_sided_bytes as f64,
    ))?;
    let is_kept = format!("{without:.1} {with:.1}") == "142.7 140.2";
    let missed = (!is_kept).then(|| format!("figure 9: {without:.1}:1 and {with:.1}:1 instead of 142.7:1 and 140.2:1"));
    Ok(missed.into_iter().map(Missed::of_pictures).collect())
}
