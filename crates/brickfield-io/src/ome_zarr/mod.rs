//! OME-Zarr 0.1 to 0.5, and plain Zarr arrays, v2 and v3. Arrays by `zarrs`.
//!
//! The OME metadata are read here and not by `ome_zarr_metadata`, which keeps scales and translations in 32 bits.
//! Not: whole plates, transforms by path, nested shards, filters, two compressors in a row.

mod axes;
mod bounds;
mod chunks;
mod find;
mod image;
mod json;
mod levels;
mod metadata;
mod node;
mod objects;
mod pack;
mod write;

pub(crate) use levels::slices;
pub use levels::{ObjectRange, ROOT_DOCUMENT, StatedDocuments, StoredChunk, ZarrLevels, stated_documents};
pub use pack::{Finest, PyramidOptions, PyramidWriter};
pub use write::save;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use brickfield_core::glam::UVec3;
use zarrs::filesystem::FilesystemStore;
use zarrs::storage::store::MemoryStore;
use zarrs::storage::{ListableStorageTraits, ReadableStorage, ReadableStorageTraits, StoreKey, WritableStorageTraits};

use crate::guard::guarded;
use crate::limits::CheckedShape;
use crate::opened::FileFacts;
use crate::{Format, OpenOptions, Opened, ReadError};
use chunks::Part;

/// Reads an OME-Zarr folder.
///
/// Axes are found by name (x, y, z), or are the last ones of a plain array (z, y, x). Channels and times are choices; of
/// any other axis the first entry is read. The world is the file's own: the scale is the spacing, the translation is the
/// first sample's centre; its frame is that of pictures, unless an attribute of our own (`brickfield_frame`) says otherwise. Chunks that are not stored have the fill value.
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

fn read_store<S>(store: Arc<S>, options: &OpenOptions) -> Result<Opened, ReadError>
where
    S: ReadableStorageTraits + ListableStorageTraits + 'static,
{
    let readable: ReadableStorage = store.clone();
    guarded("Zarr", || read_from(&readable, &*store, options))
}

fn read_from(
    store: &ReadableStorage,
    list: &dyn ListableStorageTraits,
    options: &OpenOptions,
) -> Result<Opened, ReadError> {
    let mut found = FileFacts::pictures(Format::OmeZarr, options);
    let (image, array) = find::find(store, list, &mut found)?;
    let (volume_axes, entries) = image.choose(&array.shape, &mut found)?;
    let dims = volume_axes.map(|axis| axis.map_or(1, |axis| array.shape[axis]));
    let shape = CheckedShape::claim(dims, array.stored, &options.limits)?;
    let grid = image.placement(volume_axes, options.spacing.is_some(), &mut found).grid(shape.dims)?;
    array.check_chunks(&options.limits)?;
    if array.packing.has_details() {
        return levels::read_details(store, list, options);
    }
    let part = Part { path: &image.path, volume_axes, entries: &entries, is_packed: image.is_packed };
    let (voxels, note) = chunks::read(store, part, &array, &shape)?;
    found.notes.extend(note);
    let voxels = shape.converted(voxels, &mut found.notes)?;
    found.finish_rescaled(grid, voxels, image.rescale)
}

/// The positions of a box from 0 on, x fastest.
fn positions(n: UVec3) -> impl Iterator<Item = UVec3> {
    (0..n.z).flat_map(move |z| (0..n.y).flat_map(move |y| (0..n.x).map(move |x| UVec3::new(x, y, z))))
}
