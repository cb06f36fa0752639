//! A volume in memory as flat blocks.

use std::sync::Arc;

use brickfield_core::glam::UVec3;
use brickfield_core::{
    BlockLayout, BlockSummary, Companion, Grid, Level, Rescale, Scalar, ScalarType, ValueRange, Volume, with_voxels,
};

use super::gradient::{Around, Voxels, gradient_codes};
use super::shrink::BlockVoxels;
use super::source::{BlockSource, FetchError, NoCompanion, SourceId, greatest_gradient};
use super::spread::spread_codes;

/// A volume as flat blocks of every resolution (Ljung, Lundstroem and Ynnerman 2006, section 3.1).
///
/// Level 0 is read from the volume, which is shared, not copied. A sample of level l is the mean of the up to 2^l voxels a
/// side of its block that it covers. Made by [`build_blocks`](crate::build_blocks); it does not change afterwards, a
/// clone is the same source. [`BlockSource::fetch`] fails only for blocks and levels that do not exist.
#[derive(Clone, Debug)]
pub struct BlockVolume {
    pub(crate) id: SourceId,
    pub(crate) layout: BlockLayout,
    pub(crate) volume: Arc<Volume>,
    /// Block after block by ordinal: its averages of level 1, then 2, ... to one sample.
    pub(crate) averages: brickfield_core::Voxels,
    pub(crate) summaries: Arc<[BlockSummary]>,
    pub(crate) greatest_spread: f64,
}

impl BlockVolume {
    /// The volume that is cut into blocks.
    pub fn volume(&self) -> &Arc<Volume> {
        &self.volume
    }

    /// Bytes of averages and summaries, the volume not counted.
    pub fn n_bytes(&self) -> u64 {
        let averages = self.averages.len() * self.scalar_type().n_bytes();
        (averages + size_of_val(&self.summaries[..])) as u64
    }

    fn copy_voxels(&self, block: UVec3, out: &mut [u8]) {
        with_voxels!(self.volume.voxels(), v => {
            let rows = BlockVoxels::new(v, &self.layout, block).rows();
            let n_row_bytes = self.layout.extent(block).x as usize * self.scalar_type().n_bytes();
            for (row, out) in rows.zip(out.chunks_exact_mut(n_row_bytes)) {
                Scalar::copy_le_bytes(row, out);
            }
        });
    }

    fn spreads(&self, block: UVec3, level: Level) -> Result<Vec<u8>, FetchError> {
        FetchError::unless_exists(&self.layout, block, level)?;
        let values = (self.summaries[self.layout.ordinal(block)].range, self.rescale());
        Ok(with_voxels!(self.volume.voxels(), v => {
            spread_codes(BlockVoxels::new(v, &self.layout, block), level, values, self.greatest_spread)
        }))
    }

    fn gradients(&self, block: UVec3, level: Level) -> Result<Vec<u8>, FetchError> {
        FetchError::unless_exists(&self.layout, block, level)?;
        let (grid, rescale) = (self.volume.grid(), self.rescale());
        Ok(with_voxels!(self.volume.voxels(), voxels => {
            gradient_codes(Voxels { voxels, grid, rescale }, &self.layout, (block, level), greatest_gradient(self))
        }))
    }

    fn copy_averages(&self, block: UVec3, level: Level, n: usize, out: &mut [u8]) {
        let below: usize = (1..level.0).map(|l| self.layout.n_samples_total(block, Level(l)) as usize).sum();
        let start = n_before(&self.layout, block) + below;
        with_voxels!(&self.averages, v => Scalar::copy_le_bytes(&v[start..start + n], out));
    }
}

impl BlockSource for BlockVolume {
    fn id(&self) -> SourceId {
        self.id
    }

    fn layout(&self) -> &BlockLayout {
        &self.layout
    }

    fn grid(&self) -> &Grid {
        self.volume.grid()
    }

    fn scalar_type(&self) -> ScalarType {
        self.volume.scalar_type()
    }

    fn rescale(&self) -> Rescale {
        self.volume.rescale()
    }

    fn range(&self) -> ValueRange {
        self.volume.range()
    }

    fn summaries(&self) -> &[BlockSummary] {
        &self.summaries
    }

    fn fetch(&self, block: UVec3, level: Level, out: &mut Vec<u8>) -> Result<(), FetchError> {
        FetchError::unless_exists(&self.layout, block, level)?;
        let n = self.layout.n_samples_total(block, level) as usize;
        out.clear();
        out.resize(n * self.scalar_type().n_bytes(), 0);
        match level {
            Level(0) => self.copy_voxels(block, out),
            _ => self.copy_averages(block, level, n, out),
        }
        Ok(())
    }

    /// Computed from the voxels: a volume keeps no companions. For 16^3 voxels about 30 us of spreads, 300 us of gradients.
    fn fetch_companion(
        &self,
        companion: Companion,
        block: UVec3,
        level: Level,
        out: &mut Vec<u8>,
    ) -> Result<(), FetchError> {
        *out = match companion {
            Companion::Spread => self.spreads(block, level)?,
            Companion::Gradient => self.gradients(block, level)?,
            Companion::SurfaceNormal => return Err(FetchError::new(block, level, NoCompanion { companion })),
        };
        Ok(())
    }

    fn fetch_around(&self, block: UVec3, out: &mut Vec<f64>) -> Result<(), FetchError> {
        FetchError::unless_exists(&self.layout, block, Level(0))?;
        let (first, extent) = (self.layout.first_voxel(block), self.layout.extent(block));
        let (grid, rescale) = (self.volume.grid(), self.rescale());
        *out = with_voxels!(self.volume.voxels(), voxels => {
            Around::of(Voxels { voxels, grid, rescale }, first, extent).values
        });
        Ok(())
    }
}

/// Averages of a block, of all levels above 0.
pub(crate) fn n_averages(layout: &BlockLayout, block: UVec3) -> usize {
    (1..=layout.side().one_sample().0).map(|l| layout.n_samples_total(block, Level(l)) as usize).sum()
}

/// Averages of all blocks before one, by ordinal.
///
/// Along an axis all blocks but the last have side / 2^l samples, so that the blocks before take, at each level,
///
/// ```text
/// whole slabs of blocks     z side/2^l * Sy * Sx            Sx, Sy: samples of all blocks along x and y
/// rows of this slab         nz * (y side/2^l) * Sx          ny, nz: samples of this block
/// blocks of this row        nz * ny * (x side/2^l)
/// ```
pub(crate) fn n_before(layout: &BlockLayout, block: UVec3) -> usize {
    let end = layout.n_blocks() - 1;
    let before = |level: Level| {
        let full = (layout.side().n_voxels() >> level.0) as usize;
        let [_, ny, nz] = layout.n_samples(block, level).to_array().map(|n| n as usize);
        let [last_x, last_y, _] = layout.n_samples(end, level).to_array().map(|n| n as usize);
        let [x, y, z] = block.to_array().map(|i| i as usize * full);
        let (sum_x, sum_y) = (end.x as usize * full + last_x, end.y as usize * full + last_y);
        z * sum_y * sum_x + nz * (y * sum_x + ny * x)
    };
    (1..=layout.side().one_sample().0).map(|l| before(Level(l))).sum()
}
