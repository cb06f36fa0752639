//! The memory of blocks at chosen levels, and of bricks with ghost layers in their place.

use brickfield_core::glam::U64Vec3;
use brickfield_core::{BlockLayout, Level, ScalarType};

use crate::memory::product;

/// Samples and bytes of blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BlockTally {
    /// Number of blocks.
    pub n_blocks: u64,
    /// Their samples.
    pub n_samples: u64,
    /// Bytes of their samples.
    pub bytes: u64,
    /// Bytes of bricks of as many samples that also hold one layer of a neighbour's along each axis: (n + 1)^3.
    pub single_sided_bytes: u64,
    /// Bytes of bricks of as many samples with a layer of neighbours' on each side: (n + 2)^3.
    pub double_sided_bytes: u64,
}

/// The memory of a volume's blocks, each at a level of its own.
///
/// Blocks of one sample are apart: they need no place in a texture if they are invisible, or if the value stands in an index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockMemory {
    /// Blocks of several samples.
    pub larger: BlockTally,
    /// Blocks of one sample.
    pub one_sample: BlockTally,
    /// Bytes of all voxels.
    pub volume_bytes: u64,
}

/// The memory of the blocks of a volume at `levels`, by [`BlockLayout::ordinal`]; blocks beyond the end of `levels` are left out.
pub fn block_memory(layout: &BlockLayout, scalar: ScalarType, levels: &[Level]) -> BlockMemory {
    let bytes = |n: U64Vec3| product(n).saturating_mul(scalar.n_bytes() as u64);
    let (mut larger, mut one_sample) = (BlockTally::default(), BlockTally::default());
    for (block, level) in layout.blocks().zip(levels) {
        let n = layout.n_samples(block, *level).as_u64vec3();
        let tally = if product(n) == 1 { &mut one_sample } else { &mut larger };
        tally.n_blocks += 1;
        tally.n_samples += product(n);
        tally.bytes += bytes(n);
        tally.single_sided_bytes += bytes(n + 1);
        tally.double_sided_bytes += bytes(n + 2);
    }
    BlockMemory { larger, one_sample, volume_bytes: bytes(layout.dims().as_u64vec3()) }
}

impl BlockMemory {
    /// Bytes of the volume for each byte of the larger blocks; infinite if there are none.
    pub fn ratio(&self) -> f64 {
        self.volume_bytes as f64 / self.larger.bytes as f64
    }

    /// Bytes of the volume for each byte of all blocks; infinite if there are none.
    pub fn ratio_of_all(&self) -> f64 {
        self.volume_bytes as f64 / (self.larger.bytes + self.one_sample.bytes) as f64
    }
}
