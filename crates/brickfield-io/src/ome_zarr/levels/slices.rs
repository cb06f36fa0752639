//! The slices of an OME-Zarr in order: a layer of chunks is kept, so that each chunk is unpacked once.

use std::path::Path;

use brickfield_core::glam::UVec3;
use brickfield_core::{ScalarType, Volume, Voxels};
use zarrs::storage::{ListableStorageTraits, ReadableStorage};

use super::ZarrLevels;
use crate::numbers::{FileScalar, with_room};
use crate::{ByteOrder, Note, OpenOptions, Opened, ReadError, SliceSource, VolumeFacts};

struct ZarrSlices {
    levels: ZarrLevels,
    facts: VolumeFacts,
    n_read: u32,
}

/// The slices of the finest level, or of the level that is wanted; `None` if they are 64-bit integers, whose type depends on all
/// of them.
pub(crate) fn slices(folder: &Path, options: &OpenOptions) -> Result<Option<Box<dyn SliceSource>>, ReadError> {
    let open = |cache_bytes| ZarrLevels::open(folder, options, cache_bytes).map_err(|e| e.fault);
    let levels = open(0)?;
    if levels.is_wide() {
        return Ok(None);
    }
    // A layer of chunks, and one more for those that begin in the same slices.
    let levels = open(2 * levels.layer_bytes())?;
    let facts = levels.facts().clone();
    Ok(Some(Box::new(ZarrSlices { levels, facts, n_read: 0 })))
}

/// The whole volume, of a store whose finest level is stored as details.
pub(in super::super) fn read_details(
    store: &ReadableStorage,
    list: &dyn ListableStorageTraits,
    options: &OpenOptions,
) -> Result<Opened, ReadError> {
    // Rows of chunks share those of the next level.
    let levels = ZarrLevels::of_store(store.clone(), list, options, DETAILS_CACHE_BYTES)?;
    let facts = levels.facts().clone();
    let voxels = levels.box_voxels(0, UVec3::ZERO, facts.grid.dims())?;
    let VolumeFacts { grid, rescale, format, frame, unit, notes, choices, .. } = facts;
    Ok(Opened { volume: Volume::rescaled(grid, voxels, rescale)?, format, frame, unit, notes, choices })
}

const DETAILS_CACHE_BYTES: u64 = 16 << 20;

impl SliceSource for ZarrSlices {
    fn facts(&self) -> &VolumeFacts {
        &self.facts
    }

    fn next_slices(&mut self, n: u32) -> Result<Voxels, ReadError> {
        let dims = self.facts.grid.dims();
        let (first, extent) = (UVec3::new(0, 0, self.n_read), dims.with_z(n.min(dims.z - self.n_read)));
        let mut bytes = Vec::new();
        if extent.z > 0 {
            self.levels.read_box(0, first, extent, &mut bytes)?;
        }
        self.n_read += extent.z;
        let (n_missing, n_chunks) = (self.levels.n_missing_chunks(), self.levels.n_chunks());
        self.facts.notes.retain(|note| !matches!(note, Note::MissingChunks { .. }));
        if n_missing > 0 {
            self.facts.notes.push(Note::MissingChunks { n_missing, n_chunks });
        }
        voxels_of(self.facts.scalar, &bytes)
    }
}

/// The samples of little-endian bytes.
pub(super) fn voxels_of(scalar: ScalarType, bytes: &[u8]) -> Result<Voxels, ReadError> {
    fn of<T: FileScalar>(bytes: &[u8]) -> Result<Voxels, ReadError> {
        let mut samples = with_room::<T>(bytes.len() / size_of::<T>())?;
        T::append(bytes, ByteOrder::Little, &mut samples);
        Ok(T::wrap(samples))
    }
    match scalar {
        ScalarType::U8 => of::<u8>(bytes),
        ScalarType::I8 => of::<i8>(bytes),
        ScalarType::U16 => of::<u16>(bytes),
        ScalarType::I16 => of::<i16>(bytes),
        ScalarType::U32 => of::<u32>(bytes),
        ScalarType::I32 => of::<i32>(bytes),
        ScalarType::F32 => of::<f32>(bytes),
        ScalarType::F64 => of::<f64>(bytes),
    }
}
