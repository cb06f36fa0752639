//! Where the samples of flat blocks lie.

use brickfield_core::glam::UVec3;
use brickfield_core::{BlockLayout, Interblock, Level, Place};

use super::SlotsError;
use super::slots::check_inside;
use crate::Chunked;
use crate::content::Pages;

/// Flat blocks in a texture: for each block its level and its first texel, the rest is arithmetic (Ljung, Lundstroem and Ynnerman
/// 2006, section 4, equation 12).
#[derive(Clone, Debug, PartialEq)]
pub struct BlockPlaces {
    layout: BlockLayout,
    texels: UVec3,
    rows: Vec<BlockRow>,
    /// The level of all blocks, if they have one and lie in the texture as in the volume.
    natural_level: Option<Level>,
}

/// The level of a block, and its samples.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct BlockRow {
    pub level: Level,
    pub samples: BlockSamples,
}

/// Where the samples of a flat block are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BlockSamples {
    /// The block is one sample, and takes no texel: here is the number that a texture read would return.
    One(f32),
    /// In the texture, from this texel on.
    Texture(UVec3),
}

/// Bits of a texel's coordinates in a row: x, y, z.
const TEXEL_BITS: [u32; 3] = [11, 11, 10];
/// Bits of a level in a row.
const LEVEL_BITS: u32 = 3;
/// In a row's first word: the block is one sample.
const ONE_SAMPLE: u32 = 1 << 31;

/// The least and the greatest voxel of every block, as texture reads would return them: whatever its level is.
#[derive(Clone, Debug)]
pub struct BlockRanges {
    reads: Vec<[f32; 2]>,
    table: Pages,
}

impl BlockRanges {
    /// The ranges of blocks, by number.
    pub fn new(reads: Vec<[f32; 2]>) -> BlockRanges {
        BlockRanges { table: Pages::new(bytemuck::cast_slice(&reads)), reads }
    }

    /// Least and greatest, by the blocks' numbers.
    #[inline]
    pub fn reads(&self) -> &[[f32; 2]] {
        &self.reads
    }

    /// The same as shaders read it.
    pub fn table(&self) -> &dyn Chunked {
        &self.table
    }
}

impl PartialEq for BlockRanges {
    fn eq(&self, other: &BlockRanges) -> bool {
        self.reads == other.reads
    }
}

impl BlockPlaces {
    /// The blocks of a layout, by number, in a texture of so many texels.
    pub fn new(layout: BlockLayout, texels: UVec3, rows: Vec<BlockRow>) -> BlockPlaces {
        let natural_level = natural_level(&layout, &rows);
        BlockPlaces { layout, texels, rows, natural_level }
    }

    /// Which blocks there are.
    #[inline]
    pub fn layout(&self) -> &BlockLayout {
        &self.layout
    }

    /// The texture's size.
    pub fn texels(&self) -> UVec3 {
        self.texels
    }

    /// The rows of all blocks, by number.
    #[inline]
    pub fn rows(&self) -> &[BlockRow] {
        &self.rows
    }

    /// The row of a block.
    #[inline]
    pub fn row(&self, block: UVec3) -> &BlockRow {
        &self.rows[self.layout.ordinal(block)]
    }

    /// Where the samples of a block lie; the texel of a block that is one sample is 0.
    #[inline]
    pub fn place(&self, block: UVec3) -> Place {
        let BlockRow { level, samples } = *self.row(block);
        let (first, last) = self.layout.sample_ends(block, level);
        let texel = match samples {
            BlockSamples::One(_) => UVec3::ZERO,
            BlockSamples::Texture(texel) => texel,
        };
        Place { texel, n: self.layout.n_samples(block, level), level, first, last, axes: Default::default() }
    }

    /// Texels of a slot.
    pub(super) fn n_texels(&self, slot: usize) -> usize {
        match self.rows[slot].samples {
            BlockSamples::One(_) => 0,
            BlockSamples::Texture(_) => self.place(self.layout.block(slot)).n_samples(),
        }
    }

    /// Whether blocks at the volume's upper ends have a smaller extent.
    pub(super) fn has_short_blocks(&self) -> bool {
        let side = self.layout.side().n_voxels();
        self.layout.dims().to_array().into_iter().any(|n| n % side != 0)
    }

    /// The level of all blocks, if they have one and lie in the texture as in the volume: then they are one array of samples, and
    /// values between blocks are between neighbouring texels.
    ///
    /// Not so where a block at an upper end has fewer voxels than a sample averages, and the scheme is not
    /// [`Interblock::MaximumDistance`]: the others are linear only between samples that are as far from the face.
    pub(super) fn dense_level(&self, scheme: Interblock) -> Option<Level> {
        let (level, end) = (self.natural_level?, self.layout.n_blocks() - 1);
        let is_short = self.layout.extent(end).cmplt(UVec3::splat(level.stride())) & end.cmpgt(UVec3::ZERO);
        (!is_short.any() || scheme == Interblock::MaximumDistance).then_some(level)
    }

    /// The rows as shaders read them, four words each.
    ///
    /// The first three have the levels of the block and its 26 neighbours, one word for each layer of nine along z, x fastest, three
    /// bits each from the lowest; a neighbour that is missing has the block's own. The last word is its first texel
    /// ([`TEXEL_BITS`] from the lowest), or the sample, if the first word says that it is one.
    pub(super) fn packed(&self) -> Vec<[u32; 4]> {
        let pack = |(block, row): (UVec3, &BlockRow)| {
            let [a, b, c] = self.levels_around(block);
            match row.samples {
                BlockSamples::One(read) => [a | ONE_SAMPLE, b, c, read.to_bits()],
                BlockSamples::Texture(texel) => [a, b, c, packed_texel(texel)],
            }
        };
        self.layout.blocks().zip(&self.rows).map(pack).collect()
    }

    fn levels_around(&self, block: UVec3) -> [u32; 3] {
        let last = self.layout.n_blocks() - 1;
        let level = |offset: UVec3| {
            // One more, so that the one before the first is not negative.
            let at = block + offset;
            let is_there = at.cmpge(UVec3::ONE).all() && at.cmple(last + 1).all();
            u32::from(self.row(if is_there { at - 1 } else { block }).level.0)
        };
        [0, 1, 2].map(|z| {
            let layer = (0..9).map(|i| level(UVec3::new(i % 3, i / 3, z)) << (LEVEL_BITS * i));
            layer.fold(0, |word, level| word | level)
        })
    }

    /// Whether all rows are of the layout's blocks, and in the texture.
    pub(super) fn check(&self) -> Result<(), SlotsError> {
        let (n_places, n_slots) = (self.rows.len(), self.layout.n_blocks_total());
        if n_places != n_slots {
            return Err(SlotsError::Places { n_places, n_slots });
        }
        let most = UVec3::from(TEXEL_BITS.map(|bits| 1 << bits));
        if self.texels.cmpgt(most).any() {
            return Err(SlotsError::Rows { texels: self.texels, most });
        }
        for (slot, row) in self.rows.iter().enumerate() {
            let place = self.place(self.layout.block(slot));
            let (n_samples, is_in_row) = (place.n_samples(), matches!(row.samples, BlockSamples::One(_)));
            if row.level > self.layout.side().one_sample() || (is_in_row && n_samples > 1) {
                return Err(SlotsError::OneSample { slot, level: row.level, is_in_row, n_samples });
            }
            if !is_in_row {
                check_inside(slot, &place, self.texels)?;
            }
        }
        Ok(())
    }
}

fn natural_level(layout: &BlockLayout, rows: &[BlockRow]) -> Option<Level> {
    let level = rows.first()?.level;
    let side = layout.side().n_voxels() >> level.0;
    let is_natural =
        |(block, row): (UVec3, &BlockRow)| row.level == level && row.samples == BlockSamples::Texture(block * side);
    layout.blocks().zip(rows).all(is_natural).then_some(level)
}

fn packed_texel(texel: UVec3) -> u32 {
    let [x, y, _] = TEXEL_BITS;
    texel.x | texel.y << x | texel.z << (x + y)
}
