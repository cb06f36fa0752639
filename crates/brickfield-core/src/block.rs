//! Flat blocks: a volume cut into parts of one extent, each at a resolution of its own.

use std::fmt;

use glam::{DVec3, UVec3};

use crate::{Level, ValueRange};

/// Voxels along one side of a block: 8, 16 or 32.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs)]
pub enum BlockSide {
    V8,
    V16,
    V32,
}

/// A block side that is not offered.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("a block side of {n_voxels} voxels is not offered: choose 8, 16 or 32")]
#[allow(missing_docs)]
pub struct BlockSideError {
    pub n_voxels: u32,
}

impl BlockSide {
    /// All sides, ascending.
    pub const ALL: [BlockSide; 3] = [BlockSide::V8, BlockSide::V16, BlockSide::V32];

    /// The side of `n_voxels` voxels.
    ///
    /// # Errors
    /// If `n_voxels` is not 8, 16 or 32.
    pub fn new(n_voxels: u32) -> Result<BlockSide, BlockSideError> {
        BlockSide::ALL.into_iter().find(|s| s.n_voxels() == n_voxels).ok_or(BlockSideError { n_voxels })
    }

    /// Voxels along a side.
    #[inline]
    pub const fn n_voxels(self) -> u32 {
        self.one_sample().stride()
    }

    /// The level at which a block is one sample.
    #[inline]
    pub const fn one_sample(self) -> Level {
        match self {
            BlockSide::V8 => Level(3),
            BlockSide::V16 => Level(4),
            BlockSide::V32 => Level(5),
        }
    }

    /// The levels that a block may have, the finest first.
    pub fn levels(self) -> impl DoubleEndedIterator<Item = Level> {
        (0..=self.one_sample().0).map(Level)
    }
}

impl fmt::Display for BlockSide {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.n_voxels().fmt(f)
    }
}

/// The flat blocks of a volume (Ljung, Lundstroem and Ynnerman 2006, section 3.1): which there are, and where their samples lie.
///
/// Blocks share no samples. A sample of level l lies in the middle of the 2^l voxels a side that it averages. Blocks at the upper
/// ends of the volume have a smaller extent; the last sample of such a block averages the voxels that are there, and lies
/// in their middle:
///
/// ```text
/// 11 voxels, blocks of 8            | 0  1  2  3  4  5  6  7 | 8  9 10 |
/// block 0 at level 1, block 1 too   |  o     o     o     o   |  o    o |     the last one is voxel 10
/// block 1 at level 3                                         |    o    |     one sample of three voxels
/// ```
///
/// The paper counts resolutions the other way: its l has 2^l samples a side.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BlockLayout {
    dims: UVec3,
    side: BlockSide,
}

impl BlockLayout {
    /// The blocks over a volume of `dims` voxels. A zero dimension counts as one.
    pub fn new(dims: UVec3, side: BlockSide) -> BlockLayout {
        BlockLayout { dims: dims.max(UVec3::ONE), side }
    }

    /// Voxels of the volume along x, y, z.
    #[inline]
    pub fn dims(&self) -> UVec3 {
        self.dims
    }

    /// Voxels along a block's side.
    #[inline]
    pub fn side(&self) -> BlockSide {
        self.side
    }

    /// Blocks along x, y, z.
    #[inline]
    pub fn n_blocks(&self) -> UVec3 {
        ((self.dims - 1) >> u32::from(self.side.one_sample().0)) + 1
    }

    /// Number of blocks.
    pub fn n_blocks_total(&self) -> usize {
        self.n_blocks().to_array().into_iter().map(|n| n as usize).product()
    }

    /// The number of a block, x fastest.
    #[inline]
    pub fn ordinal(&self, block: UVec3) -> usize {
        let n = self.n_blocks();
        block.x as usize + n.x as usize * (block.y as usize + n.y as usize * block.z as usize)
    }

    /// The block of a number.
    #[inline]
    pub fn block(&self, ordinal: usize) -> UVec3 {
        let [nx, ny, _] = self.n_blocks().to_array().map(|n| n as usize);
        UVec3::new((ordinal % nx) as u32, (ordinal / nx % ny) as u32, (ordinal / (nx * ny)) as u32)
    }

    /// All blocks, by number.
    pub fn blocks(&self) -> impl Iterator<Item = UVec3> + use<> {
        let layout = *self;
        (0..self.n_blocks_total()).map(move |ordinal| layout.block(ordinal))
    }

    /// The first voxel of a block.
    #[inline]
    pub fn first_voxel(&self, block: UVec3) -> UVec3 {
        block << u32::from(self.side.one_sample().0)
    }

    /// Voxels of a block along x, y, z: a side, or less at the upper ends of the volume.
    #[inline]
    pub fn extent(&self, block: UVec3) -> UVec3 {
        (self.dims - self.first_voxel(block)).min(UVec3::splat(self.side.n_voxels()))
    }

    /// Samples of a block along x, y, z: ceil(extent / 2^level).
    #[inline]
    pub fn n_samples(&self, block: UVec3, level: Level) -> UVec3 {
        level.dims_of(self.extent(block))
    }

    /// Number of samples of a block.
    #[inline]
    pub fn n_samples_total(&self, block: UVec3, level: Level) -> u64 {
        self.n_samples(block, level).as_u64vec3().element_product()
    }

    /// Where the samples of a block lie, in sample space: the first one, and the last one.
    #[inline]
    pub fn sample_ends(&self, block: UVec3, level: Level) -> (DVec3, DVec3) {
        let (corner, extent, stride) = (self.first_voxel(block), self.extent(block), level.stride());
        let before_last = (self.n_samples(block, level) - 1) * stride;
        let middle = |first: UVec3, n_voxels: UVec3| first.as_dvec3() + 0.5 * (n_voxels.as_dvec3() - 1.0);
        let first = middle(corner, extent.min(UVec3::splat(stride)));
        (first, middle(corner + before_last, extent - before_last))
    }

    /// How far the samples of a block keep away from its faces towards other blocks, in voxels (the paper's equation 1): half
    /// of the voxels that its outer samples average.
    #[inline]
    pub fn inset(&self, block: UVec3, level: Level) -> DVec3 {
        0.5 * self.extent(block).min(UVec3::splat(level.stride())).as_dvec3()
    }
}

/// How values between blocks come about (Ljung, Lundstroem and Ynnerman 2006, section 3.2): by the weights of the edges between
/// two blocks each, along the way from one block's outer samples to the other's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Interblock {
    /// Equation 8: a sample has no influence beyond the voxels that it averages.
    MinimumDistance,
    /// Equation 9: two linear pieces, which meet at the blocks' common face.
    BoundarySplit,
    /// Equation 10: one linear piece. The smoothest.
    #[default]
    MaximumDistance,
}

impl Interblock {
    /// All schemes.
    pub const ALL: [Interblock; 3] =
        [Interblock::MinimumDistance, Interblock::BoundarySplit, Interblock::MaximumDistance];

    /// The scheme's name in options and reports.
    pub const fn name(self) -> &'static str {
        match self {
            Interblock::MinimumDistance => "minimum-distance",
            Interblock::BoundarySplit => "boundary-split",
            Interblock::MaximumDistance => "maximum-distance",
        }
    }
}

/// Levels that a block may have: those of the largest side.
pub const N_BLOCK_LEVELS: usize = BlockSide::V32.one_sample().0 as usize + 1;
/// Bins of a [`BlockSummary`].
pub const N_BLOCK_BINS: usize = 16;

/// The values of a block, known without its samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockSummary {
    /// Least and greatest value of its voxels. Samples of any level are averages, and lie in it.
    pub range: ValueRange,
    /// The mean of its voxels.
    pub mean: f64,
    /// Voxels by value: bins of equal width over `range`, as parts of 65,535 of the block's voxels.
    pub counts: [u16; N_BLOCK_BINS],
    /// For each level, the variance that averages of its samples keep, as a part of the voxels' variance: 1 at level 0, 0 at
    /// one sample.
    pub kept_variance: [f32; N_BLOCK_LEVELS],
    /// The variance of its voxels.
    pub variance: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_lie_in_the_middle_of_their_voxels() {
        let layout = BlockLayout::new(UVec3::new(11, 8, 9), BlockSide::V8);
        assert_eq!((layout.n_blocks(), layout.n_blocks_total()), (UVec3::new(2, 1, 2), 4));
        let end = UVec3::new(1, 0, 1);
        assert_eq!((layout.extent(end), layout.ordinal(end)), (UVec3::new(3, 8, 1), 3));
        assert_eq!(layout.n_samples(end, Level(1)), UVec3::new(2, 4, 1));
        let (first, last) = layout.sample_ends(end, Level(1));
        assert_eq!((first, last), (DVec3::new(8.5, 0.5, 8.0), DVec3::new(10.0, 6.5, 8.0)));
        assert_eq!(layout.sample_ends(end, Level(3)).0, DVec3::new(9.0, 3.5, 8.0));
        assert_eq!(layout.inset(end, Level(1)), DVec3::new(1.0, 1.0, 0.5));
        assert_eq!(layout.inset(end, Level(3)), DVec3::new(1.5, 4.0, 0.5));
        assert!(layout.blocks().enumerate().all(|(i, block)| layout.ordinal(block) == i && layout.block(i) == block));
    }

    #[test]
    fn sides_have_a_level_of_one_sample() {
        assert!(BlockSide::ALL.into_iter().all(|side| BlockSide::new(side.n_voxels()) == Ok(side)));
        assert_eq!(BlockSide::V16.levels().last(), Some(Level(4)));
        assert!(BlockSide::new(12).unwrap_err().to_string().contains("12 voxels"));
    }
}
