//! The levels of an OME-Zarr, read box by box.

mod cache;
mod parts;
mod slices;
mod stored;

pub(super) use slices::read_details;
pub(crate) use slices::slices;
pub use stored::{ObjectRange, ROOT_DOCUMENT, StatedDocuments, StoredChunk, stated_documents};

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use brickfield_core::Level;
use brickfield_core::glam::{U64Vec3, UVec3};
use brickfield_core::{BlockLayout, BlockSide, BlockSummary, Objects, ScalarType, Voxels};
use zarrs::filesystem::FilesystemStore;
use zarrs::storage::{ListableStorageTraits, ReadableStorage};

use super::axes::VolumeAxes;
use super::find::{Depth, ImageArray, find_levels};
use super::metadata::ArrayMetadata;
use super::node::{Node, joined};
use super::objects::ObjectStorage;
use super::pack::{FOLDER, N_COLUMNS, digest, summary_of};
use crate::guard::guarded;
use crate::limits::{CheckedShape, check_bytes};
use crate::opened::FileFacts;
use crate::{Format, Limits, Note, OpenError, OpenOptions, ReadError, VolumeFacts};
use cache::{Cache, Key, Kind};
use parts::{Kept, Parts, ShardIndex, StoredPart};

/// An OME-Zarr image at all its levels, of which boxes are read: the smallest parts of chunks or shards that hold them, and no more.
///
/// OME-Zarr and plain arrays as [`read`](super::read) has them; which image, channel and time is chosen as there, and a wanted level is the
/// finest one. Several threads may read at once. Samples that are not stored have the fill value, and are counted; in a store
/// that [`PyramidWriter`](super::PyramidWriter) wrote they are an error.
///
/// Memory: unpacked parts within a bound, the least recently used leave, the last one stays; for each thread that reads, one part more, twice if it is
/// compressed.
pub struct ZarrLevels {
    facts: VolumeFacts,
    levels: Vec<LevelArray>,
    /// Path of the group of the image.
    group: String,
    is_packed: bool,
    store: ReadableStorage,
    limits: Limits,
    cache: Cache,
    n_bytes_read: AtomicU64,
    n_missing: AtomicU64,
}

/// One level.
struct LevelArray {
    parts: Parts,
    volume_axes: VolumeAxes,
    /// The entry along each axis that is none of the volume's.
    entries: Vec<u64>,
    dims: UVec3,
    shifts: Option<UVec3>,
    fill: Vec<u8>,
}

impl ZarrLevels {
    /// Opens a folder; `cache_bytes` of unpacked parts are kept. `options.limits` bound a part, not the volume.
    ///
    /// # Errors
    /// As [`read`](super::read), and if a part is beyond the limits.
    pub fn open(folder: &Path, options: &OpenOptions, cache_bytes: u64) -> Result<ZarrLevels, OpenError> {
        let opened = FilesystemStore::new(folder).map_err(|e| ReadError::decoder("the folder", e)).and_then(|store| {
            let store = Arc::new(store);
            guarded("Zarr", || ZarrLevels::of_store(store.clone(), &*store, options, cache_bytes))
        });
        opened.map_err(|fault| OpenError::new(folder, fault))
    }

    /// Opens a store whose objects are found by their keys; `location` is where they are, for messages.
    ///
    /// # Errors
    /// As [`open`](Self::open); a store that is no image of OME-Zarr, because objects are not listed.
    pub fn of_objects(
        objects: Arc<dyn Objects>,
        location: &Path,
        options: &OpenOptions,
        cache_bytes: u64,
    ) -> Result<ZarrLevels, OpenError> {
        let store = Arc::new(ObjectStorage(objects));
        let opened = guarded("Zarr", || ZarrLevels::of_store(store.clone(), &*store, options, cache_bytes));
        opened.map_err(|fault| OpenError::new(location, fault))
    }

    fn of_store(
        store: ReadableStorage,
        list: &dyn ListableStorageTraits,
        options: &OpenOptions,
        cache_bytes: u64,
    ) -> Result<ZarrLevels, ReadError> {
        let mut found = FileFacts::pictures(Format::OmeZarr, options);
        let images = find_levels(&store, list, Depth::AllCoarser, &mut found)?;
        let (image, array) = &images[0];
        let (volume_axes, entries) = image.choose(&array.shape, &mut found)?;
        let dims = volume_axes.map(|axis| axis.map_or(1, |axis| array.shape[axis]));
        let shape = CheckedShape::claim(dims, array.stored, &Limits::UNBOUNDED)?;
        let grid = image.placement(volume_axes, options.spacing.is_some(), &mut found).grid(shape.dims)?;
        if let Some(from) = array.stored.other_than(shape.scalar) {
            found.notes.push(Note::Converted { from, to: shape.scalar });
        }
        let levels = images.iter().map(|level| LevelArray::new(&store, level, &images[0], volume_axes, &entries));
        let levels = levels.collect::<Result<Vec<_>, _>>()?;
        check_details(&levels)?;
        for level in &levels {
            let what = || format!("a chunk of shape {:?}", level.parts.part_shape);
            check_bytes(level.parts.n_bytes(), &options.limits, what)?;
        }
        // Details lie in a group of their own.
        let coarsest = images.last().map_or("", |(image, _)| image.path.as_str());
        let group = coarsest.rsplit_once('/').map_or("", |(group, _)| group).to_owned();
        Ok(ZarrLevels {
            facts: found.described(grid, shape.scalar, image.rescale)?,
            levels,
            group,
            is_packed: image.is_packed,
            store,
            limits: options.limits,
            cache: Cache::new(cache_bytes),
            n_bytes_read: AtomicU64::new(0),
            n_missing: AtomicU64::new(0),
        })
    }

    /// All about the volume at the finest level but its samples.
    pub fn facts(&self) -> &VolumeFacts {
        &self.facts
    }

    /// Number of levels, at least 1.
    pub fn n_levels(&self) -> usize {
        self.levels.len()
    }

    /// Samples of a level along x, y, z.
    ///
    /// # Panics
    /// If there is no such level; the other functions of levels alike.
    pub fn dims(&self, level: usize) -> UVec3 {
        self.levels[level].dims
    }

    /// How a level follows from the finest: along axis i, a sample covers 2^`shifts[i]` voxels, and the last one what is left; where
    /// there is one sample, it covers all. `None` if the level has other samples, or another type.
    pub fn shifts(&self, level: usize) -> Option<UVec3> {
        self.levels[level].shifts
    }

    /// Whether a level is stored as details of the next one.
    pub fn has_details(&self, level: usize) -> bool {
        self.levels[level].parts.has_details()
    }

    /// Whether [`PyramidWriter`](super::PyramidWriter) wrote the store.
    pub fn is_packed(&self) -> bool {
        self.is_packed
    }

    /// Bytes that were read of chunks, shards and their indices so far.
    pub fn n_bytes_read(&self) -> u64 {
        self.n_bytes_read.load(Ordering::Relaxed)
    }

    /// Bytes of unpacked parts that are kept.
    pub fn n_bytes_kept(&self) -> u64 {
        self.cache.n_bytes()
    }

    /// How often a chunk was asked for that is not stored; its samples have the fill value.
    pub fn n_missing_chunks(&self) -> u64 {
        self.n_missing.load(Ordering::Relaxed)
    }

    /// Chunks of the finest level, or parts of shards, that the volume lies in.
    pub fn n_chunks(&self) -> u64 {
        let level = &self.levels[0];
        let n = level.dims.to_array().into_iter().zip(level.along_volume(&level.parts.part_shape));
        n.map(|(n, part)| u64::from(n).div_ceil(part)).product()
    }

    /// Bytes of all unpacked chunks that a slice of the finest level lies in.
    fn layer_bytes(&self) -> u64 {
        let level = &self.levels[0];
        let [x, y, _] = level.along_volume(&level.parts.part_shape);
        let n_parts = u64::from(level.dims.x).div_ceil(x) * u64::from(level.dims.y).div_ceil(y);
        u64::try_from(level.parts.n_bytes() + 1024).unwrap_or(u64::MAX).saturating_mul(n_parts)
    }

    /// Whether samples are 64-bit integers.
    fn is_wide(&self) -> bool {
        self.levels[0].parts.is_wide()
    }

    /// The samples of a box of a level, as [`read_box`](Self::read_box) has them.
    ///
    /// # Errors
    /// As [`read_box`](Self::read_box).
    pub fn box_voxels(&self, level: usize, first: UVec3, extent: UVec3) -> Result<Voxels, ReadError> {
        let mut bytes = Vec::new();
        self.read_box(level, first, extent, &mut bytes)?;
        slices::voxels_of(self.facts.scalar, &bytes)
    }

    /// Replaces `out` by the samples of a box of a level: x fastest, little-endian, in the type of the [facts](Self::facts).
    ///
    /// # Errors
    /// A box that is empty or goes beyond the level; chunks that are damaged, or lost from a packed store.
    pub fn read_box(&self, level: usize, first: UVec3, extent: UVec3, out: &mut Vec<u8>) -> Result<(), ReadError> {
        let array = &self.levels[level];
        let end = first.as_u64vec3() + extent.as_u64vec3();
        if extent.min_element() == 0 || end.cmpgt(array.dims.as_u64vec3()).any() {
            let expected = format!("a box within {} samples", array.dims);
            return Err(ReadError::field(format!("the box of level {level}"), format!("{first} to {end}"), expected));
        }
        let n_bytes = extent.as_u64vec3().element_product() * self.facts.scalar.n_bytes() as u64;
        out.clear();
        let room = out.try_reserve_exact(n_bytes as usize);
        room.map_err(|_| ReadError::OutOfMemory { n_bytes: n_bytes.into() })?;
        out.resize(n_bytes as usize, 0);
        guarded("Zarr", || self.fill_box(level, first, extent, out))
    }

    fn fill_box(&self, level: usize, first: UVec3, extent: UVec3, out: &mut [u8]) -> Result<(), ReadError> {
        let array = &self.levels[level];
        let part = U64Vec3::from(array.along_volume(&array.parts.part_shape));
        let (low, high) = (first.as_u64vec3(), (first + extent).as_u64vec3());
        let (begin, end) = (low / part, (high - 1) / part);
        for z in begin.z..=end.z {
            for y in begin.y..=end.y {
                for x in begin.x..=end.x {
                    let at = U64Vec3::new(x, y, z);
                    let samples = self.samples(level, array.part_at(at))?;
                    array.place(samples.as_deref(), at * part, part, (low, high), out);
                }
            }
        }
        Ok(())
    }

    /// The samples of a part; `None` if all are the fill value.
    fn samples(&self, level: usize, part: Vec<u64>) -> Result<Option<Arc<Vec<u8>>>, ReadError> {
        let parts = &self.levels[level].parts;
        let has_details = parts.has_details();
        let kind = if has_details { Kind::Refined } else { Kind::Samples };
        let kept = self.cache.get_or(Key { array: level, kind, at: part.clone() }, || {
            let index = self.index_of(parts, level, parts.chunk_of(&part))?;
            match parts.stored(&part, index.as_deref(), &|n| self.count_bytes(n))? {
                StoredPart::Bytes(stored) => {
                    let samples = match has_details {
                        true => self.refined(level, &part, &stored)?,
                        false => parts.unpacked(&part, stored)?,
                    };
                    Ok(Kept::Samples(Some(Arc::new(samples))))
                }
                StoredPart::Missing if self.is_packed => Err(ReadError::LostChunk { what: parts.named(&part) }),
                StoredPart::Missing => {
                    self.n_missing.fetch_add(1, Ordering::Relaxed);
                    Ok(Kept::Samples(None))
                }
                StoredPart::Fill => Ok(Kept::Samples(None)),
            }
        })?;
        match kept {
            Kept::Samples(samples) => Ok(samples),
            Kept::Index(_) => Ok(None),
        }
    }

    /// The samples of a part that is stored as details of the next level.
    fn refined(&self, level: usize, part: &[u64], stored: &[u8]) -> Result<Vec<u8>, ReadError> {
        let array = &self.levels[level];
        let side = U64Vec3::from(array.along_volume(&array.parts.part_shape)).as_uvec3();
        let first = U64Vec3::from(array.along_volume(part)).as_uvec3() * side;
        let extent = side.min(array.dims.saturating_sub(first));
        let mut low = Vec::new();
        self.read_box(level + 1, first / 2, Level(1).dims_of(extent), &mut low)?;
        array.parts.refined(part, stored, extent, &low)
    }

    /// The index of a shard; `None` if it is not there, or if chunks are no shards.
    fn index_of(&self, parts: &Parts, array: usize, at: Vec<u64>) -> Result<Option<Arc<ShardIndex>>, ReadError> {
        if !parts.is_sharded() {
            return Ok(None);
        }
        let read = |chunk: &[u64]| parts.index(chunk, &|n| self.count_bytes(n));
        let kept = self.cache.get_or(Key { array, kind: Kind::Index, at: at.clone() }, || {
            Ok::<_, ReadError>(Kept::Index(read(&at)?.map(Arc::new)))
        })?;
        match kept {
            Kept::Index(index) => Ok(index),
            Kept::Samples(_) => Ok(None),
        }
    }

    fn count_bytes(&self, n: u64) {
        self.n_bytes_read.fetch_add(n, Ordering::Relaxed);
    }

    /// The summaries of all blocks of a side, if [`PyramidWriter`](super::PyramidWriter) stored them, the finest level was asked for, and nobody
    /// has changed the samples since: the facts have [`Note::ChangedStore`] then.
    ///
    /// # Errors
    /// Arrays that do not fit the volume or are damaged; more bytes than the limits.
    pub fn block_summaries(&mut self, side: BlockSide) -> Result<Option<Vec<BlockSummary>>, ReadError> {
        let path = joined(&self.group, &format!("{FOLDER}/{side}"));
        let is_finest = self.facts.choices.iter().all(|choice| choice.read == 0);
        if !self.is_packed || !is_finest || Node::read(&self.store, &path)?.is_none() {
            return Ok(None);
        }
        if !self.is_as_packed()? {
            if !self.facts.notes.contains(&Note::ChangedStore) {
                self.facts.notes.push(Note::ChangedStore);
            }
            return Ok(None);
        }
        let n = BlockLayout::new(self.facts.grid.dims(), side).n_blocks();
        let metadata = ArrayMetadata::read(&self.store, &path)?;
        let shape = [u64::from(n.z), u64::from(n.y), u64::from(n.x), N_COLUMNS as u64];
        let layer = [1, shape[1], shape[2], shape[3]];
        if metadata.shape != shape || metadata.chunk_shape != layer || metadata.stored != ScalarType::F64.into() {
            let value = format!("{:?} of {}", metadata.shape, metadata.stored);
            return Err(ReadError::field(format!("shape of array {path:?}"), value, format!("{shape:?} of f64")));
        }
        let n_blocks: u64 = shape[..3].iter().product();
        let n_bytes = u128::from(n_blocks) * size_of::<BlockSummary>() as u128;
        check_bytes(n_bytes, &self.limits, || format!("summaries of {n_blocks} blocks of {side}^3 voxels"))?;
        let parts = Parts::new(&self.store, &path, &metadata)?;
        guarded("Zarr", || self.read_summaries(&parts, n.z)).map(Some)
    }

    /// Whether the samples of a packed store, whose finest level was asked for, are those that were packed.
    fn is_as_packed(&self) -> Result<bool, ReadError> {
        let stated = Node::read(&self.store, &self.group)?.and_then(|node| node.stated_digest());
        let shards: Vec<_> = self.levels.iter().map(|level| level.parts.chunk_keys()).collect();
        let found = digest(&*self.store, &shards).map_err(|e| ReadError::decoder("the digest of the store", e))?;
        Ok(stated == Some(found.into()))
    }

    fn read_summaries(&self, parts: &Parts, n_layers: u32) -> Result<Vec<BlockSummary>, ReadError> {
        let mut summaries = Vec::new();
        for z in 0..n_layers {
            let part = [u64::from(z), 0, 0, 0];
            let StoredPart::Bytes(stored) = parts.stored(&part, None, &|n| self.count_bytes(n))? else {
                return Err(ReadError::LostChunk { what: parts.named(&part) });
            };
            let bytes = parts.unpacked(&part, stored)?;
            let (numbers, _) = bytes.as_chunks::<8>();
            let (rows, _) = numbers.as_chunks::<N_COLUMNS>();
            summaries.extend(rows.iter().map(|row| summary_of(&row.map(f64::from_le_bytes))));
        }
        Ok(summaries)
    }
}

impl LevelArray {
    fn new(
        store: &ReadableStorage,
        (image, metadata): &ImageArray,
        finest: &ImageArray,
        volume_axes: VolumeAxes,
        entries: &[u64],
    ) -> Result<LevelArray, ReadError> {
        let dims = dims_of(metadata, volume_axes)?;
        let parts = Parts::new(store, &image.path, metadata)?;
        let ratio = image.scale(volume_axes) / finest.0.scale(volume_axes);
        let is_alike = metadata.stored == finest.1.stored;
        let finest_dims = dims_of(&finest.1, volume_axes)?;
        let shift = |axis: usize| shift(finest_dims[axis], dims[axis], ratio[axis]);
        let shifts = match [shift(0), shift(1), shift(2)] {
            [Some(x), Some(y), Some(z)] if is_alike => Some(UVec3::new(x, y, z)),
            _ => None,
        };
        let fill = parts.fill_value()?;
        Ok(LevelArray { parts, volume_axes, entries: entries.to_vec(), dims, shifts, fill })
    }

    /// Sizes along x, y, z; 1 where the array has no such axis.
    fn along_volume(&self, sizes: &[u64]) -> [u64; 3] {
        self.volume_axes.map(|axis| axis.map_or(1, |a| sizes[a]))
    }

    /// The indices of a part of the volume.
    fn part_at(&self, at: U64Vec3) -> Vec<u64> {
        let mut part: Vec<u64> = self.entries.iter().zip(&self.parts.part_shape).map(|(entry, n)| entry / n).collect();
        for (axis, i) in self.volume_axes.into_iter().zip(at.to_array()) {
            if let Some(axis) = axis {
                part[axis] = i;
            }
        }
        part
    }

    /// Copies what a part has of a box; `start` is the part's first sample, the box goes from its low end to its high end.
    fn place(
        &self,
        samples: Option<&Vec<u8>>,
        start: U64Vec3,
        part: U64Vec3,
        (low, high): (U64Vec3, U64Vec3),
        out: &mut [u8],
    ) {
        let n_bytes = self.fill.len() as u64;
        let all_strides = super::chunks::strides(&self.parts.part_shape);
        let strides = self.along_volume(&all_strides);
        let inner = self.entries.iter().zip(&self.parts.part_shape).zip(&all_strides);
        let base: u64 = inner.map(|((i, n), stride)| i % n * stride).sum();
        let (from, to) = (start.max(low), (start + part).min(high));
        let n = high - low;
        for z in from.z..to.z {
            for y in from.y..to.y {
                let row = ((z - low.z) * n.y + y - low.y) * n.x + from.x - low.x;
                let out = &mut out[(row * n_bytes) as usize..((row + to.x - from.x) * n_bytes) as usize];
                let at =
                    base + (z - start.z) * strides[2] + (y - start.y) * strides[1] + (from.x - start.x) * strides[0];
                match samples {
                    Some(samples) => copy_row(&samples[(at * n_bytes) as usize..], strides[0], n_bytes as usize, out),
                    None => out.chunks_exact_mut(n_bytes as usize).for_each(|o| o.copy_from_slice(&self.fill)),
                }
            }
        }
    }
}

/// Copies samples that lie `stride` samples apart.
fn copy_row(samples: &[u8], stride: u64, n_bytes: usize, out: &mut [u8]) {
    match stride {
        1 => out.copy_from_slice(&samples[..out.len()]),
        _ => {
            let column = samples.chunks(n_bytes).step_by(stride as usize);
            out.chunks_exact_mut(n_bytes).zip(column).for_each(|(o, s)| o.copy_from_slice(s));
        }
    }
}

/// Details are those of the finest level, along the axes of the volume alone, and refine a level of half as many samples.
fn check_details(levels: &[LevelArray]) -> Result<(), ReadError> {
    let fault = |found: String, expected: &str| Err(ReadError::field("level of details", found, expected));
    for (i, level) in levels.iter().enumerate().filter(|(_, level)| level.parts.has_details()) {
        let (n, is_even) = (level.parts.part_shape.len(), level.parts.part_shape.iter().all(|n| n.is_multiple_of(2)));
        if i > 0 || n != 3 || !is_even || level.volume_axes != [Some(2), Some(1), Some(0)] {
            return fault(format!("{i}, of {n} axes"), "0, with axes z, y, x and an even number of samples in chunks");
        }
        let next = levels.get(1).map(|next| (next.dims, next.parts.scalar()));
        if next != Some((Level(1).dims_of(level.dims), level.parts.scalar())) {
            return fault(
                format!("of {} samples", level.dims),
                "that of a level 1 of half as many along each axis, of their type",
            );
        }
    }
    Ok(())
}

fn dims_of(metadata: &ArrayMetadata, volume_axes: VolumeAxes) -> Result<UVec3, ReadError> {
    let dims = volume_axes.map(|axis| axis.map_or(Some(1), |axis| metadata.shape.get(axis).copied()));
    let [Some(x), Some(y), Some(z)] = dims else {
        return Err(ReadError::field("number of array dimensions", metadata.shape.len(), "that of the finest level"));
    };
    Ok(CheckedShape::claim([x, y, z], metadata.stored, &Limits::UNBOUNDED)?.dims)
}

/// Scales may differ from powers of two by this part.
const SCALE_TOLERANCE: f64 = 0.01;

/// The shift by which `n` samples, `ratio` times as far apart, follow from `n_finest`.
fn shift(n_finest: u32, n: u32, ratio: f64) -> Option<u32> {
    let covered = |shift: u32| u64::from(n_finest).div_ceil(1 << shift);
    if n == 1 {
        return (0..=32).find(|shift| covered(*shift) == 1);
    }
    let shift = ratio.log2().round();
    let is_power = (0.0..32.0).contains(&shift) && (ratio / shift.exp2() - 1.0).abs() <= SCALE_TOLERANCE;
    (is_power && covered(shift as u32) == u64::from(n)).then_some(shift as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_follows_from_the_finest_by_powers_of_two() {
        assert_eq!([shift(100, 100, 1.0), shift(101, 51, 2.0), shift(101, 26, 4.001)], [Some(0), Some(1), Some(2)]);
        // Rounded down, or by another factor.
        assert_eq!([shift(101, 50, 2.0), shift(99, 33, 3.0), shift(100, 50, 1.5)], [None, None, None]);
        // One sample covers all.
        assert_eq!([shift(1, 1, 8.0), shift(5, 1, 5.0), shift(8, 1, 8.0)], [Some(0), Some(3), Some(3)]);
    }
}
