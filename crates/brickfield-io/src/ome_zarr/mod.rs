//! OME-Zarr 0.4 (Zarr v2) and 0.5 (Zarr v3): the first image of a folder at its finest level. Arrays by `zarrs`.
//!
//! The OME metadata are read here and not by `ome_zarr_metadata`, which keeps scales and translations in 32 bits.
//! Not: labels, plates, transforms by path, nested shards, two compressors in a row.

mod bounds;
mod chunks;
mod image;
mod json;
mod metadata;
mod write;

pub use write::save;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use zarrs::filesystem::FilesystemStore;
use zarrs::storage::store::MemoryStore;
use zarrs::storage::{ReadableStorage, StoreKey, WritableStorageTraits};

use crate::guard::guarded;
use crate::limits::CheckedShape;
use crate::opened::FileFacts;
use crate::{Format, OpenOptions, Opened, ReadError};
use image::ZarrImage;
use metadata::ArrayMetadata;

/// Reads an OME-Zarr folder.
///
/// Axes are found by name (x, y, z); of any other axis the first entry is read. The world is the file's own: the scale
/// is the spacing, the translation is the first sample's centre. Chunks that are not stored have the fill value.
///
/// # Errors
/// As [`ReadError`] lists them: metadata that are wrong, unsupported or beyond the limits; chunks that cannot be decoded.
pub fn read(folder: &Path, options: &OpenOptions) -> Result<Opened, ReadError> {
    let store = FilesystemStore::new(folder).map_err(|e| ReadError::decoder("the folder", e))?;
    read_store(Arc::new(store), options)
}

/// Reads an OME-Zarr whose files are in memory, by their names relative to the folder.
///
/// # Errors
/// As [`read`].
pub fn read_entries(entries: &BTreeMap<String, Vec<u8>>, options: &OpenOptions) -> Result<Opened, ReadError> {
    let store = MemoryStore::new();
    for (name, bytes) in entries {
        let key = StoreKey::new(name.as_str()).map_err(|e| ReadError::decoder("an entry", e))?;
        store.set(&key, bytes.clone().into()).map_err(|e| ReadError::decoder("an entry", e))?;
    }
    read_store(Arc::new(store), options)
}

fn read_store(store: ReadableStorage, options: &OpenOptions) -> Result<Opened, ReadError> {
    let mut found = FileFacts::pictures(Format::OmeZarr, options);
    let image = ZarrImage::read(&store, &mut found)?;
    let array = ArrayMetadata::read(&store, &image.path)?;
    let volume_axes = image.volume_axes(&array.shape, &mut found.notes)?;
    let dims = volume_axes.map(|axis| axis.map_or(1, |axis| array.shape[axis]));
    let shape = CheckedShape::claim(dims, array.scalar, &options.limits)?;
    let grid = image.placement(volume_axes).grid(shape.dims)?;
    array.check_chunks(&options.limits)?;
    let (voxels, note) = guarded("Zarr", || chunks::read(&store, &image.path, &array, volume_axes, &shape))?;
    found.notes.extend(note);
    found.unit = image.unit(volume_axes);
    found.finish(grid, voxels)
}
