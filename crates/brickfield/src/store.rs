//! Flat blocks from a store on disk.

use std::path::{Path, PathBuf};

use brickfield_bricks::{BlockSource, FetchError, SourceId, average_box, block_summaries};
use brickfield_core::glam::UVec3;
use brickfield_core::{
    BlockLayout, BlockSide, BlockSummary, Grid, Level, Rescale, Scalar, ScalarType, ValueRange, Volume, Voxels,
    with_voxels,
};
use brickfield_io::ome_zarr::ZarrLevels;
use brickfield_io::{Limits, Note, OpenError, OpenOptions, ReadError, VolumeFacts};

use crate::pack::{Survey, finite_for};

/// How much memory a store may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StoreLimits {
    /// Most bytes of unpacked chunks that are kept; of one that is larger, its own.
    pub cache_bytes: u64,
    /// Most bytes of the summaries of all blocks, and most bytes of one unpacked chunk.
    pub max_bytes: u64,
}

impl StoreLimits {
    /// Limits for a store whose blocks and chunks share a budget: a quarter of it is for chunks, at most 64 MiB.
    pub fn of_budget(n_bytes: u64) -> StoreLimits {
        let most = StoreLimits::default();
        StoreLimits { cache_bytes: most.cache_bytes.min(n_bytes / 4), ..most }
    }
}

impl Default for StoreLimits {
    /// 64 MiB each.
    fn default() -> StoreLimits {
        StoreLimits { cache_bytes: 64 << 20, max_bytes: 64 << 20 }
    }
}

/// The flat blocks of an OME-Zarr, of which only the chunks at the fetched resolutions are read.
///
/// A block of level l comes from the level of the store that halves every axis l times, else from the coarsest one that halves none more
/// often: its samples are averaged, each weighted by the voxels that it covers. Levels are taken for averages, whatever their
/// author did; samples of coarse levels are kept within the range of the block's voxels. In a store of [`pack`](crate::pack())
/// all levels and summaries are those of [`build_blocks`](brickfield_bricks::build_blocks).
///
/// Memory: chunks and summaries within [`StoreLimits`]; for each thread that fetches, one chunk more, twice if it is compressed, and the block.
pub struct StoreBlocks {
    id: SourceId,
    path: PathBuf,
    layout: BlockLayout,
    levels: ZarrLevels,
    /// The store's level from which blocks of each level come.
    from: Vec<usize>,
    summaries: Vec<BlockSummary>,
    range: ValueRange,
    /// Whether coarse samples may leave the range of the voxels: those of others, and f64 by its rounding.
    is_clamped: bool,
    /// Of another's floats; least and greatest finite voxel take the place of those that are not finite.
    survey: Survey,
}

/// How far the summaries of a store's blocks are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SummaryProgress {
    /// Slices that are done.
    pub n_done: u32,
    /// Slices of the volume.
    pub n_total: u32,
}

impl StoreBlocks {
    /// Bytes of an [`overview`](Self::overview) that tells materials apart: 256^3 samples of 8 bits.
    pub const OVERVIEW_BYTES: u64 = 16 << 20;

    /// Opens a store; of several images, channels and times `options` choose. The limits of `options` are not asked.
    ///
    /// A store that states no summaries is read once, 32 slices at a time, and twice if its voxels are floats; `progress` is told.
    ///
    /// # Errors
    /// What the reader says; chunks or summaries beyond the limits.
    pub fn open(
        path: &Path,
        side: BlockSide,
        limits: StoreLimits,
        options: &OpenOptions,
        progress: &mut dyn FnMut(SummaryProgress),
    ) -> Result<StoreBlocks, OpenError> {
        let mut options = options.clone();
        options.limits = Limits { max_bytes: limits.max_bytes };
        let levels = ZarrLevels::open(path, &options, limits.cache_bytes)?;
        StoreBlocks::of_levels(path, levels, side, limits, progress)
            .map_err(|fault| OpenError { path: path.to_owned(), fault })
    }

    /// The blocks of a store whose levels are open; `path` is where it is, for messages.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub(crate) fn of_levels(
        path: &Path,
        mut levels: ZarrLevels,
        side: BlockSide,
        limits: StoreLimits,
        progress: &mut dyn FnMut(SummaryProgress),
    ) -> Result<StoreBlocks, ReadError> {
        let layout = BlockLayout::new(levels.facts().grid.dims(), side);
        check_summaries(&layout, limits)?;
        let stated = levels.block_summaries(side)?;
        let is_clamped = stated.is_none() || levels.facts().scalar == ScalarType::F64;
        let (summaries, survey) = match stated {
            Some(summaries) => (summaries, Survey::default()),
            None => summarised(&levels, &layout, progress)?,
        };
        let blocks = StoreBlocks::with_summaries(path, levels, layout, summaries);
        Ok(StoreBlocks { is_clamped, survey, ..blocks })
    }

    /// Blocks of finite voxels, whose coarse samples lie in their range.
    pub(crate) fn with_summaries(
        path: &Path,
        levels: ZarrLevels,
        layout: BlockLayout,
        summaries: Vec<BlockSummary>,
    ) -> StoreBlocks {
        let ranges = summaries.iter().map(|summary| summary.range);
        let range = ranges.reduce(ValueRange::union).unwrap_or(ValueRange { min: 0.0, max: 0.0 });
        let from = layout.side().levels().map(|level| finest_above(&levels, level)).collect();
        let (id, path, survey) = (SourceId::unique(), path.to_owned(), Survey::default());
        StoreBlocks { id, path, layout, levels, from, summaries, range, is_clamped: false, survey }
    }

    /// The levels of the store.
    #[cfg(feature = "fetch")]
    pub(crate) fn stored_levels(&self) -> &ZarrLevels {
        &self.levels
    }

    /// The store's folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// All about the volume but its samples.
    pub fn facts(&self) -> &VolumeFacts {
        self.levels.facts()
    }

    /// Bytes that were read of the store so far, summaries included.
    pub fn n_bytes_read(&self) -> u64 {
        self.levels.n_bytes_read()
    }

    /// Bytes of unpacked chunks that are kept.
    pub fn n_bytes_kept(&self) -> u64 {
        self.levels.n_bytes_kept()
    }

    /// Bytes of the summaries of all blocks.
    pub fn n_summary_bytes(&self) -> u64 {
        size_of_val(&self.summaries[..]) as u64
    }

    /// How often a chunk was asked for that another's store does not have: its voxels have the fill value. A chunk of a packed
    /// store is an error.
    pub fn n_missing_chunks(&self) -> u64 {
        self.levels.n_missing_chunks()
    }

    /// That voxels of another's store are not finite, and what takes their place; `None` if all are.
    pub fn note(&self) -> Option<Note> {
        let ValueRange { min: low, max: high } = self.survey.finite()?;
        Some(Note::NonFinite { counts: self.survey.non_finite, low, high })
    }

    /// The volume at the finest level of the store that takes no more than `max_bytes`; if none does, the voxels' mean in each block.
    ///
    /// # Errors
    /// What the reader says.
    pub fn overview(&self, max_bytes: u64) -> Result<Volume, OpenError> {
        self.coarse(max_bytes).map_err(|fault| OpenError { path: self.path.clone(), fault })
    }

    fn coarse(&self, max_bytes: u64) -> Result<Volume, ReadError> {
        let n_bytes = |dims: UVec3| dims.as_u64vec3().element_product() * self.scalar_type().n_bytes() as u64;
        let level = (0..self.levels.n_levels()).find(|level| n_bytes(self.levels.dims(*level)) <= max_bytes);
        match level {
            Some(level) => self.stored_level(level),
            None => {
                let means = self.summaries.iter().map(|summary| summary.mean).collect();
                self.over_the_box(self.layout.n_blocks(), Voxels::F64(means), Rescale::IDENTITY)
            }
        }
    }

    /// The volume at the level of the store that blocks of a level come from, over the same box.
    #[cfg(feature = "fetch")]
    pub(crate) fn at_level(&self, level: Level) -> Result<Volume, ReadError> {
        self.stored_level(self.from[usize::from(level.0)])
    }

    fn stored_level(&self, level: usize) -> Result<Volume, ReadError> {
        let dims = self.levels.dims(level);
        self.over_the_box(dims, self.levels.box_voxels(level, UVec3::ZERO, dims)?, self.rescale())
    }

    fn over_the_box(&self, dims: UVec3, voxels: Voxels, rescale: Rescale) -> Result<Volume, ReadError> {
        let spacing = self.grid().spacing() * self.layout.dims().as_dvec3() / dims.as_dvec3();
        Ok(Volume::rescaled(Grid::axis_aligned(dims, spacing)?, voxels, rescale)?)
    }

    /// The samples of a block, of a level of the store.
    fn samples(&self, block: UVec3, level: Level) -> Result<Voxels, ReadError> {
        let (first, extent) = (self.layout.first_voxel(block), self.layout.extent(block));
        let from = self.from[usize::from(level.0)];
        let shifts = self.levels.shifts(from).unwrap_or(UVec3::ZERO);
        let n = ((extent - 1) >> shifts) + 1;
        let samples = self.levels.box_voxels(from, first >> shifts, n)?;
        let samples = match self.survey.finite() {
            Some(range) => replaced(&samples, range),
            None => samples,
        };
        if n == self.layout.n_samples(block, level) {
            return Ok(samples);
        }
        Ok(average_box(&samples, extent, shifts, level).expect("a box has its samples"))
    }

    /// Whether the store's samples are those of the block, byte by byte.
    fn is_as_stored(&self, block: UVec3, level: Level) -> bool {
        let shifts = self.levels.shifts(self.from[usize::from(level.0)]).unwrap_or(UVec3::ZERO);
        let n = ((self.layout.extent(block) - 1) >> shifts) + 1;
        let is_in_range = level == Level(0) || !self.is_clamped;
        n == self.layout.n_samples(block, level) && is_in_range && self.survey.finite().is_none()
    }
}

impl BlockSource for StoreBlocks {
    fn id(&self) -> SourceId {
        self.id
    }

    fn layout(&self) -> &BlockLayout {
        &self.layout
    }

    fn grid(&self) -> &Grid {
        &self.levels.facts().grid
    }

    fn scalar_type(&self) -> ScalarType {
        self.levels.facts().scalar
    }

    fn rescale(&self) -> Rescale {
        self.levels.facts().rescale
    }

    fn range(&self) -> ValueRange {
        self.range
    }

    fn summaries(&self) -> &[BlockSummary] {
        &self.summaries
    }

    fn fetch(&self, block: UVec3, level: Level, out: &mut Vec<u8>) -> Result<(), FetchError> {
        FetchError::unless_exists(&self.layout, block, level)?;
        let fault = |fault| FetchError::new(block, level, OpenError { path: self.path.clone(), fault });
        if self.is_as_stored(block, level) {
            let from = self.from[usize::from(level.0)];
            let shifts = self.levels.shifts(from).unwrap_or(UVec3::ZERO);
            let (first, n) = (self.layout.first_voxel(block) >> shifts, self.layout.n_samples(block, level));
            return self.levels.read_box(from, first, n, out).map_err(fault);
        }
        let samples = self.samples(block, level).map_err(fault)?;
        let range = self.summaries[self.layout.ordinal(block)].range;
        write_le_bytes(&samples, range, out);
        Ok(())
    }
}

fn check_summaries(layout: &BlockLayout, limits: StoreLimits) -> Result<(), ReadError> {
    let n_bytes = layout.n_blocks_total() as u128 * size_of::<BlockSummary>() as u128;
    match n_bytes > u128::from(limits.max_bytes) {
        true => Err(ReadError::TooLarge {
            what: format!("summaries of {} blocks of {}^3 voxels", layout.n_blocks_total(), layout.side()),
            n_bytes,
            max_bytes: limits.max_bytes,
        }),
        false => Ok(()),
    }
}

/// The coarsest level of a store that no axis of which is coarser than blocks of a level.
pub(crate) fn finest_above(levels: &ZarrLevels, level: Level) -> usize {
    let fits = |i: &usize| levels.shifts(*i).is_some_and(|s| s.cmple(UVec3::splat(level.0.into())).all());
    let fitting = (0..levels.n_levels()).filter(fits);
    fitting.max_by_key(|i| levels.shifts(*i).map(|s| s.element_sum())).unwrap_or(0)
}

/// Slices that are summarised at once: a layer of the largest blocks.
const SLAB_SLICES: u32 = 32;

/// The summaries of all blocks, from their voxels; and what these are.
fn summarised(
    levels: &ZarrLevels,
    layout: &BlockLayout,
    progress: &mut dyn FnMut(SummaryProgress),
) -> Result<(Vec<BlockSummary>, Survey), ReadError> {
    let dims = layout.dims();
    let is_float = matches!(levels.facts().scalar, ScalarType::F32 | ScalarType::F64);
    let survey = if is_float { surveyed(levels, dims)? } else { Survey::default() };
    let mut summaries = Vec::with_capacity(layout.n_blocks_total());
    for z in (0..dims.z).step_by(SLAB_SLICES as usize) {
        let extent = dims.with_z(SLAB_SLICES.min(dims.z - z));
        let mut slab = levels.box_voxels(0, UVec3::new(0, 0, z), extent)?;
        if let Some(range) = survey.finite() {
            slab = replaced(&slab, range);
        }
        let of_slab = block_summaries(&slab, extent, layout.side(), levels.facts().rescale);
        summaries.extend(of_slab.expect("a box has its samples"));
        progress(SummaryProgress { n_done: z + extent.z, n_total: dims.z });
    }
    Ok((summaries, survey))
}

/// The voxels of floats, which may not be finite.
fn surveyed(levels: &ZarrLevels, dims: UVec3) -> Result<Survey, ReadError> {
    let mut survey = Survey::default();
    for z in (0..dims.z).step_by(SLAB_SLICES as usize) {
        let extent = dims.with_z(SLAB_SLICES.min(dims.z - z));
        let slab = levels.box_voxels(0, UVec3::new(0, 0, z), extent)?;
        with_voxels!(&slab, v => survey.add(v, Rescale::IDENTITY));
    }
    Ok(survey)
}

/// The samples with finite ones in the place of others.
fn replaced(samples: &Voxels, finite: ValueRange) -> Voxels {
    fn of<T: Scalar>(samples: &[T], finite: ValueRange) -> Voxels {
        let sample = |v: T| if v.to_f64().is_finite() { v } else { T::from_f64(finite_for(v.to_f64(), finite)) };
        T::wrap(samples.iter().map(|v| sample(*v)).collect())
    }
    with_voxels!(samples, v => of(v, finite))
}

/// Replaces `out` by the samples, each kept within a range.
fn write_le_bytes(samples: &Voxels, range: ValueRange, out: &mut Vec<u8>) {
    fn kept<T: Scalar>(sample: T, range: ValueRange) -> T {
        match sample.to_f64() {
            number if range.contains(number) => sample,
            number if number.is_nan() => T::from_f64(range.min),
            number => T::from_f64(number.clamp(range.min, range.max)),
        }
    }
    out.clear();
    with_voxels!(samples, v => out.extend(v.iter().flat_map(|sample| kept(*sample, range).to_le_bytes())));
}
