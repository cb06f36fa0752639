//! A level for every block.

use brickfield_core::glam::UVec3;
use brickfield_core::{BlockLayout, Level, N_BLOCK_LEVELS, ScalarType};

/// The level of every block of a volume.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BlockLevels {
    layout: BlockLayout,
    levels: Vec<Level>,
}

/// Levels that blocks do not have.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum BlockLevelsError {
    #[error("{n_levels} levels for {n_blocks} blocks: each block has one")]
    Number { n_levels: usize, n_blocks: usize },
    #[error("block {block} of level {}: blocks of {side}^3 voxels have levels 0 to {}", level.0, coarsest.0)]
    NoSuchLevel { block: usize, level: Level, side: u32, coarsest: Level },
    #[error("{n_ranks} ranks for {n_blocks} blocks: each block has one")]
    Ranks { n_ranks: usize, n_blocks: usize },
}

impl BlockLevels {
    /// A level for each block, by [`BlockLayout::ordinal`].
    ///
    /// # Errors
    /// Too few or too many levels, or one that no block has.
    pub fn new(layout: BlockLayout, levels: Vec<Level>) -> Result<BlockLevels, BlockLevelsError> {
        let (n_levels, n_blocks) = (levels.len(), layout.n_blocks_total());
        if n_levels != n_blocks {
            return Err(BlockLevelsError::Number { n_levels, n_blocks });
        }
        let (side, coarsest) = (layout.side().n_voxels(), layout.side().one_sample());
        match levels.iter().position(|level| *level > coarsest) {
            Some(block) => Err(BlockLevelsError::NoSuchLevel { block, level: levels[block], side, coarsest }),
            None => Ok(BlockLevels { layout, levels }),
        }
    }

    /// Levels that blocks are known to have, one for each.
    pub(crate) fn of_valid(layout: BlockLayout, levels: Vec<Level>) -> BlockLevels {
        BlockLevels { layout, levels }
    }

    /// The finer level of each block, of two selections of the same blocks.
    pub(crate) fn finer_of(self, other: &BlockLevels) -> BlockLevels {
        let levels = self.levels.iter().zip(&other.levels).map(|(a, b)| *a.min(b)).collect();
        BlockLevels { levels, ..self }
    }

    /// One level for all blocks; levels beyond one sample count as that.
    pub fn uniform(layout: BlockLayout, level: Level) -> BlockLevels {
        let level = level.min(layout.side().one_sample());
        BlockLevels { layout, levels: vec![level; layout.n_blocks_total()] }
    }

    /// Every level as probable as any other, the same for the same seed: neighbours differ by as much as they can.
    pub fn random(layout: BlockLayout, seed: u64) -> BlockLevels {
        let n = u64::from(layout.side().one_sample().0) + 1;
        let level = |block: u64| Level((mixed(seed ^ mixed(block)) % n) as u8);
        BlockLevels { layout, levels: (0..layout.n_blocks_total() as u64).map(level).collect() }
    }

    /// So many blocks of each level, finest first: the blocks of greatest `rank` get the finest levels, all that are left
    /// one sample. Of equal ranks the first block by ordinal comes first.
    ///
    /// # Errors
    /// If there is not one rank for each block.
    pub fn by_counts(layout: BlockLayout, counts: &[usize], ranks: &[f32]) -> Result<BlockLevels, BlockLevelsError> {
        let (n_ranks, n_blocks) = (ranks.len(), layout.n_blocks_total());
        if n_ranks != n_blocks {
            return Err(BlockLevelsError::Ranks { n_ranks, n_blocks });
        }
        let mut order: Vec<usize> = (0..n_blocks).collect();
        order.sort_by(|i, j| ranks[*j].total_cmp(&ranks[*i]));
        let coarsest = layout.side().one_sample();
        let each = layout.side().levels().zip(counts).flat_map(|(level, n)| std::iter::repeat_n(level, *n));
        let mut levels = vec![coarsest; n_blocks];
        order.iter().zip(each).for_each(|(block, level)| levels[*block] = level);
        Ok(BlockLevels { layout, levels })
    }

    /// Which blocks there are.
    pub fn layout(&self) -> &BlockLayout {
        &self.layout
    }

    /// The levels, by [`BlockLayout::ordinal`].
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// The level of a block.
    ///
    /// # Panics
    /// If there is no such block.
    pub fn of(&self, block: UVec3) -> Level {
        self.levels[self.layout.ordinal(block)]
    }

    /// Number of blocks of each level, finest first; 0 for levels that the blocks do not have.
    pub fn n_blocks_per_level(&self) -> [usize; N_BLOCK_LEVELS] {
        let mut n = [0; N_BLOCK_LEVELS];
        self.levels.iter().for_each(|level| n[usize::from(level.0)] += 1);
        n
    }

    /// Bytes of the samples of all blocks, one-sample blocks included.
    pub fn n_bytes(&self, scalar: ScalarType) -> u64 {
        let blocks = self.layout.blocks().zip(&self.levels);
        blocks.map(|(block, level)| self.layout.n_samples_total(block, *level) * scalar.n_bytes() as u64).sum()
    }
}

/// The finaliser of SplitMix64 (Steele, Lea and Flood 2014): every bit of the input turns half of the output's.
fn mixed(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ x >> 31
}
