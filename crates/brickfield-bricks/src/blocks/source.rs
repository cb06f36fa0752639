//! Where the samples of blocks come from: memory, a disk, a network.

use std::error::Error;
use std::sync::atomic::{AtomicU64, Ordering};

use brickfield_core::glam::UVec3;
use brickfield_core::{BlockLayout, BlockSummary, Companion, Grid, Level, Rescale, ScalarType, ValueRange};

use super::{gradient, spread};

/// The flat blocks of a volume, wherever their samples are kept.
///
/// All but the samples is known at once: layout, grid, types, and a summary of every block. Samples are fetched block by
/// block, from several threads at once.
pub trait BlockSource: Sync {
    /// Its identity: time steps of one layout have several.
    fn id(&self) -> SourceId;

    /// Which blocks there are, and where their samples lie.
    fn layout(&self) -> &BlockLayout;

    /// Where the volume's voxels lie.
    fn grid(&self) -> &Grid;

    /// The type that samples of all levels are stored in.
    fn scalar_type(&self) -> ScalarType;

    /// The map from stored samples to data values.
    fn rescale(&self) -> Rescale;

    /// Least and greatest data value of all voxels.
    fn range(&self) -> ValueRange;

    /// The values of every block, by [`BlockLayout::ordinal`]; in data values.
    fn summaries(&self) -> &[BlockSummary];

    /// Replaces `out` with a block's samples: [`BlockLayout::n_samples`] of them, x fastest, as they are stored, little-endian.
    ///
    /// # Errors
    /// If the layout has no such block or level, or the samples cannot be had.
    fn fetch(&self, block: UVec3, level: Level, out: &mut Vec<u8>) -> Result<(), FetchError>;

    /// Replaces `out` with the companions of a block's samples, in the order of [`fetch`](Self::fetch): [`Companion::n_bytes`] each.
    ///
    /// # Errors
    /// As `fetch`; a source that has no such companions, which is what this method says of every source that does not define it; surface
    /// normals, which belong to a transfer function, too ([`SurfaceNormals`](crate::SurfaceNormals)).
    fn fetch_companion(
        &self,
        companion: Companion,
        block: UVec3,
        level: Level,
        _out: &mut Vec<u8>,
    ) -> Result<(), FetchError> {
        FetchError::unless_exists(self.layout(), block, level)?;
        Err(FetchError::new(block, level, NoCompanion { companion }))
    }

    /// Replaces `out` with the data values of a block's voxels and of those around it, one beyond on every side: extent + 2 along each axis,
    /// x fastest. Beyond the volume's faces its outer voxels are repeated. [`SurfaceNormals`](crate::SurfaceNormals) are made of them.
    ///
    /// # Errors
    /// As `fetch`; a source of values alone, which is what this method says of every source that does not define it: it would be asked
    /// for the whole volume at full resolution.
    fn fetch_around(&self, block: UVec3, _out: &mut Vec<f64>) -> Result<(), FetchError> {
        FetchError::unless_exists(self.layout(), block, Level(0))?;
        Err(FetchError::new(block, Level(0), NoCompanion { companion: Companion::SurfaceNormal }))
    }
}

/// The identity of a source of blocks: equal samples elsewhere are another source.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SourceId(u64);

impl SourceId {
    /// An identity that no other source of this process has.
    pub fn unique() -> SourceId {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        SourceId(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}

/// The samples of a block that could not be fetched.
#[derive(Debug, thiserror::Error)]
#[error("block ({}, {}, {}) of level {} cannot be fetched: {cause}", block.x, block.y, block.z, level.0)]
#[allow(missing_docs)]
pub struct FetchError {
    pub block: UVec3,
    pub level: Level,
    #[source]
    pub cause: Box<dyn Error + Send + Sync>,
}

/// A source whose samples have no such companions: the cause of a [`FetchError`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the source has values alone, and no {companion}: take the blocks of a volume in memory")]
#[allow(missing_docs)]
pub struct NoCompanion {
    pub companion: Companion,
}

/// A block or level that a layout does not have: the cause of a [`FetchError`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there are {} x {} x {} blocks, of levels 0 to {}", n_blocks.x, n_blocks.y, n_blocks.z, coarsest.0)]
#[allow(missing_docs)]
pub struct NoSuchBlock {
    pub n_blocks: UVec3,
    pub coarsest: Level,
}

impl FetchError {
    /// That a block of a level cannot be fetched, and why.
    pub fn new(block: UVec3, level: Level, cause: impl Into<Box<dyn Error + Send + Sync>>) -> FetchError {
        FetchError { block, level, cause: cause.into() }
    }

    /// Whether a layout has a block and a level: what every source asks first.
    ///
    /// # Errors
    /// If it does not; the cause is a [`NoSuchBlock`].
    pub fn unless_exists(layout: &BlockLayout, block: UVec3, level: Level) -> Result<(), FetchError> {
        let (n_blocks, coarsest) = (layout.n_blocks(), layout.side().one_sample());
        match block.cmplt(n_blocks).all() && level <= coarsest {
            true => Ok(()),
            false => Err(FetchError::new(block, level, NoSuchBlock { n_blocks, coarsest })),
        }
    }
}

/// The standard deviation that a [`Companion::Spread`] of 255 stands for, in data values: half of the widest range of a block.
///
/// No spread is greater: at most half of the values lie at each end. 0 if all blocks are constant.
pub fn greatest_spread(source: &dyn BlockSource) -> f64 {
    spread::greatest_of(source.summaries())
}

/// The length that a [`Companion::Gradient`] of 255 stands for, in data values per world unit: the range of values in every spacing.
pub fn greatest_gradient(source: &dyn BlockSource) -> f64 {
    gradient::greatest_of(source.range(), source.grid())
}

/// The data values of a block's samples, x fastest.
///
/// # Errors
/// As [`BlockSource::fetch`].
pub fn fetch_values(source: &dyn BlockSource, block: UVec3, level: Level) -> Result<Vec<f64>, FetchError> {
    let mut bytes = Vec::new();
    source.fetch(block, level, &mut bytes)?;
    let rescale = source.rescale();
    let samples = bytes.chunks_exact(source.scalar_type().n_bytes());
    Ok(samples.map(|sample| rescale.value(stored_number(source.scalar_type(), sample))).collect())
}

/// The number that `bytes`, as many as the type has, stand for.
fn stored_number(scalar: ScalarType, bytes: &[u8]) -> f64 {
    fn array<const N: usize>(bytes: &[u8]) -> [u8; N] {
        std::array::from_fn(|i| bytes[i])
    }
    match scalar {
        ScalarType::U8 => f64::from(bytes[0]),
        ScalarType::I8 => f64::from(bytes[0] as i8),
        ScalarType::U16 => f64::from(u16::from_le_bytes(array(bytes))),
        ScalarType::I16 => f64::from(i16::from_le_bytes(array(bytes))),
        ScalarType::U32 => f64::from(u32::from_le_bytes(array(bytes))),
        ScalarType::I32 => f64::from(i32::from_le_bytes(array(bytes))),
        ScalarType::F32 => f64::from(f32::from_le_bytes(array(bytes))),
        ScalarType::F64 => f64::from_le_bytes(array(bytes)),
    }
}
