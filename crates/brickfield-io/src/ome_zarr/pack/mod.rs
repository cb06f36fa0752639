//! Writing all levels of a volume as OME-Zarr 0.5, slice by slice.

mod details;
mod digest;
mod layer;
mod level;
mod summaries;

pub(super) use details::{DETAILS_CODEC, decode_details};
pub(super) use digest::{digest, keys};
pub(super) use summaries::{FOLDER, N_COLUMNS, summary_of};

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use brickfield_core::glam::UVec3;
use brickfield_core::{BlockSide, BlockSummary, Grid, Level, Rescale, ScalarType, Voxels};
use serde_json::{Map, Value, json};
use zarrs::filesystem::FilesystemStore;
use zarrs::storage::{ReadableWritableStorage, StoreKey, WritableStorage};

use super::levels::ROOT_DOCUMENT;
use super::write::{dataset, group};
use crate::placement::is_turned;
use crate::saved::{UNFINISHED, folder_of};
use crate::{Format, SaveError, SaveNote, SaveOptions};
use level::LevelWriter;
use summaries::SummaryWriter;

/// The attribute by which a store says that this crate packed it: all its shards are there.
pub(super) const PACKED_KEY: &str = "brickfield_pack";
/// The attribute with the world steps along x, y and z of a volume whose axes are not the world's.
pub(super) const STEPS_KEY: &str = "brickfield_steps";
const PACKED_VERSION: u64 = 2;
/// The attribute with the dataset of level 0, if that is stored as details: path and transformations, as datasets of OME-Zarr have them.
pub(super) const DETAILS_KEY: &str = "brickfield_details";
/// The array of details.
const DETAILS_PATH: &str = "brickfield_details/0";
/// The attribute with slope and intercept of values whose stored numbers are samples.
pub(super) const RESCALE_KEY: &str = "brickfield_rescale";

pub(super) type Fault = Box<dyn std::error::Error + Send + Sync>;

/// Writes a volume and its coarser levels as OME-Zarr 0.5 (Zarr v3), slice by slice, whole or not at all.
///
/// Chunks are 32^3 samples, packed by zstd, each with a checksum (CRC-32C), in shards of 32 x 512 x 512 (z, y, x) that begin with their
/// index. The arrays are `0`, the finest, `1`, ... Metadata are written last, into a folder of a temporary name beside the store, which
/// is renamed when all is there: an interrupted run leaves no store that looks complete.
///
/// With [`Finest::Details`] there is no array `0`: `brickfield_details/0` has in its place the details by which level 0 differs from level 1
/// (the codec `brickfield.haar_details`), 7/8 of its samples. Other programs open levels 1 and coarser.
///
/// Summaries of blocks (Ljung, Lundstroem and Ynnerman 2006) are arrays of their own, `brickfield_blocks/8`, `/16` and `/32`, of 64-bit
/// floats: axes z, y, x of the blocks, and columns. These are least, greatest, mean and variance of the voxels, the parts of the
/// variance that the averages of levels 0 to 5 keep, and the voxels in 16 bins of equal width, as parts of 65,535. Other programs need
/// not know of them. The store states a digest of its samples: where they were changed since, the summaries are not taken.
///
/// Memory: 32 slices of each level, together 4/3 of 32 slices of level 0; and two copies of a shard.
pub struct PyramidWriter {
    path: PathBuf,
    /// Where the store is made; removed with all in it if it is not finished.
    unfinished: Option<tempfile::TempDir>,
    store: ReadableWritableStorage,
    group: Value,
    levels: Vec<LevelWriter>,
    summaries: Vec<SummaryWriter>,
}

/// What a store is to hold.
#[derive(Clone, Debug, Default)]
pub struct PyramidOptions {
    /// Frame and unit; how samples are compressed.
    pub save: SaveOptions,
    /// The coarsest level; level l has ceil(dims / 2^l) samples.
    pub coarsest: Level,
    /// How level 0 is stored.
    pub finest: Finest,
    /// What samples mean, if not themselves. OME-Zarr has no words for it: it is stated in an attribute of our own.
    pub rescale: Rescale,
}

/// How the finest level of a store is stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Finest {
    /// As the other levels are.
    #[default]
    Array,
    /// As details that are added to level 1 (Saladi, Pinnamaneni and Meyer 2003). Of integers only; `coarsest` is at least 1.
    Details,
}

/// The name of the store in its temporary folder.
const STORE: &str = "store";

impl PyramidWriter {
    /// Begins a store of levels 0 to `options.coarsest` at a path where nothing is yet.
    ///
    /// # Errors
    /// If there is something of this name; if the folder cannot be written to; details of samples that are not integers, or of a volume
    /// without level 1.
    pub fn create(
        path: &Path,
        grid: &Grid,
        scalar: ScalarType,
        options: &PyramidOptions,
    ) -> Result<PyramidWriter, SaveError> {
        check_finest(path, scalar, options)?;
        let fault = |source| SaveError::Io { path: path.to_owned(), source };
        if path.exists() {
            return Err(SaveError::IsThere { path: path.to_owned() });
        }
        let folder = folder_of(path);
        if !folder.is_dir() {
            return Err(SaveError::NoFolder { path: path.to_owned(), folder: folder.to_owned() });
        }
        let unfinished = tempfile::Builder::new().prefix(UNFINISHED).tempdir_in(folder).map_err(fault)?;
        let store = unfinished.path().join(STORE);
        fs::create_dir(&store).map_err(fault)?;
        let store = FilesystemStore::new(store).map_err(|e| fault(io::Error::other(e)))?;
        let mut writer = PyramidWriter::of_store(path, Arc::new(store), grid, scalar, options)?;
        writer.unfinished = Some(unfinished);
        Ok(writer)
    }

    fn of_store(
        path: &Path,
        store: ReadableWritableStorage,
        grid: &Grid,
        scalar: ScalarType,
        options: &PyramidOptions,
    ) -> Result<PyramidWriter, SaveError> {
        let PyramidOptions { save, coarsest, finest, rescale } = options;
        let first = if *finest == Finest::Details { Level(1) } else { Level(0) };
        let mut group = group(grid, save, first..=*coarsest);
        if *finest == Finest::Details {
            group["attributes"][DETAILS_KEY] = dataset(grid, Level(0), DETAILS_PATH);
        }
        if *rescale != Rescale::IDENTITY {
            group["attributes"][RESCALE_KEY] = json!({ "slope": rescale.slope(), "intercept": rescale.intercept() });
        }
        if (0..3).any(|axis| is_turned(grid, axis)) {
            group["attributes"][STEPS_KEY] = json!(grid.index_to_world().matrix3.to_cols_array_2d());
        }
        let mut writer = PyramidWriter {
            path: path.to_owned(),
            unfinished: None,
            store: store.clone(),
            group,
            levels: Vec::new(),
            summaries: Vec::new(),
        };
        let store: WritableStorage = store;
        let levels = (0..=coarsest.0)
            .map(|l| match l == 0 && *finest == Finest::Details {
                true => LevelWriter::of_details(&store, DETAILS_PATH, grid.dims(), scalar),
                false => {
                    LevelWriter::new(&store, &l.to_string(), Level(l).dims_of(grid.dims()), scalar, save.compression)
                }
            })
            .collect::<Result<_, Fault>>();
        writer.levels = levels.map_err(|e| writer.fault(e))?;
        let summaries = BlockSide::ALL.map(|side| SummaryWriter::new(&store, grid.dims(), side));
        writer.summaries = summaries.into_iter().collect::<Result<_, Fault>>().map_err(|e| writer.fault(e))?;
        Ok(writer)
    }

    /// What the store does not state in words of OME-Zarr.
    pub fn notes(&self) -> Vec<SaveNote> {
        let states = |key: &str| !self.group["attributes"][key].is_null();
        let notes = [
            (STEPS_KEY, SaveNote::DirectionOwn),
            (RESCALE_KEY, SaveNote::RescaleOwn),
            (DETAILS_KEY, SaveNote::DetailsOwn),
        ];
        notes.into_iter().filter(|(key, _)| states(key)).map(|(_, note)| note).collect()
    }

    /// Takes the next slices of a level, x fastest, as many as there are; 32 at once of the finest save a copy.
    ///
    /// # Errors
    /// Samples of another type, parts of a slice, more slices than the level has; if the store cannot be written to, as on a full disk.
    /// The store cannot be finished then.
    pub fn push(&mut self, level: Level, slices: Voxels) -> Result<(), SaveError> {
        let (n_samples, found) = (slices.len(), slices.scalar_type());
        let Some(writer) = self.levels.get_mut(usize::from(level.0)) else {
            let path = self.path.clone();
            return Err(SaveError::Slices {
                path,
                level,
                dims: UVec3::ZERO,
                n_slices: 0,
                n_samples,
                found,
                expected: found,
            });
        };
        if !writer.takes(&slices) {
            let (dims, n_slices, expected) = (writer.dims(), writer.n_slices(), writer.scalar_type());
            let path = self.path.clone();
            return Err(SaveError::Slices { path, level, dims, n_slices, n_samples, found, expected });
        }
        let outcome = writer.push(slices);
        outcome.map_err(|e| self.fault(e))
    }

    /// Takes the summaries of the next layers of blocks, whole layers, x fastest. A side of which none come has no array.
    ///
    /// # Errors
    /// If the store cannot be written to.
    pub fn push_summaries(&mut self, side: BlockSide, summaries: &[BlockSummary]) -> Result<(), SaveError> {
        let writer = self.summaries.iter_mut().find(|writer| writer.side() == side);
        let outcome = writer.map_or(Ok(()), |writer| writer.push(summaries));
        outcome.map_err(|e| self.fault(e))
    }

    /// Writes the metadata and gives the store its name.
    ///
    /// # Errors
    /// If slices or summaries are missing; if there is something of the store's name by now; if the store cannot be written to.
    pub fn finish(mut self) -> Result<(), SaveError> {
        self.check_complete()?;
        self.write_metadata().map_err(|e| self.fault(e))?;
        let Some(unfinished) = self.unfinished.take() else { return Ok(()) };
        if self.path.exists() {
            return Err(SaveError::IsThere { path: self.path });
        }
        fs::rename(unfinished.path().join(STORE), &self.path).map_err(|e| self.fault(e.into()))
    }

    fn check_complete(&self) -> Result<(), SaveError> {
        let incomplete = |what: String, n_slices: u32, n_expected: u32| {
            let path = self.path.clone();
            Err(SaveError::Incomplete { path, what, n_slices, n_expected })
        };
        for (l, level) in self.levels.iter().enumerate() {
            if level.n_slices() != level.dims().z {
                return incomplete(format!("level {l}"), level.n_slices(), level.dims().z);
            }
        }
        match self.summaries.iter().find(|s| !s.is_empty() && s.n_layers() != s.n_blocks().z) {
            Some(s) => incomplete(format!("the blocks of {} voxels", s.side()), s.n_layers(), s.n_blocks().z),
            None => Ok(()),
        }
    }

    /// The metadata of the image come last.
    fn write_metadata(&mut self) -> Result<(), Fault> {
        let shards: Vec<_> = self.levels.iter().map(LevelWriter::shard_keys).collect();
        let digest = digest(&*self.store, &shards)?;
        let summary_bytes = self.summaries.iter().map(|s| Ok((s.side().to_string(), s.n_bytes(&*self.store)?.into())));
        let summary_bytes = summary_bytes.collect::<Result<Map<String, Value>, Fault>>()?;
        self.group["attributes"][PACKED_KEY] =
            json!({ "version": PACKED_VERSION, "digest": digest, "summary_bytes": summary_bytes });
        let write = |key: &str, json: &Value| -> Result<(), Fault> {
            Ok(self.store.set(&StoreKey::new(key)?, serde_json::to_vec_pretty(json)?.into())?)
        };
        let summaries: Vec<_> = self.summaries.iter().filter(|s| !s.is_empty()).map(SummaryWriter::metadata).collect();
        let inner = json!({ "zarr_format": 3, "node_type": "group", "attributes": {} });
        let mut nodes: Vec<(String, &Value)> = self.levels.iter().map(LevelWriter::metadata).collect();
        if !summaries.is_empty() {
            nodes.push((FOLDER.to_owned(), &inner));
            nodes.extend(summaries);
        }
        for (path, json) in &nodes {
            write(&format!("{path}/{ROOT_DOCUMENT}"), json)?;
        }
        // Those that every program reads are in the group's document, too: one request finds them all.
        let is_read_by_all = |(path, _): &&(String, &Value)| path != DETAILS_PATH;
        let consolidated: Map<String, Value> =
            nodes.iter().filter(is_read_by_all).map(|(path, json)| (path.clone(), (*json).clone())).collect();
        let mut group = self.group.clone();
        group["consolidated_metadata"] =
            json!({ "kind": "inline", "must_understand": false, "metadata": consolidated });
        write(ROOT_DOCUMENT, &group)
    }

    fn fault(&self, fault: Fault) -> SaveError {
        SaveError::Io { path: self.path.clone(), source: io::Error::other(fault) }
    }
}

fn check_finest(path: &Path, scalar: ScalarType, options: &PyramidOptions) -> Result<(), SaveError> {
    let refused = |fault: String| Err(SaveError::Unsupported { path: path.to_owned(), format: Format::OmeZarr, fault });
    match options.finest {
        Finest::Details if options.coarsest < Level(1) => refused(
            "details refine level 1, which the store is not to have; its coarsest level must be at least 1".to_owned(),
        ),
        Finest::Details if matches!(scalar, ScalarType::F32 | ScalarType::F64) => {
            refused(format!("details are those of integers, and the samples are {scalar}"))
        }
        _ => Ok(()),
    }
}

/// Whether the attributes of a group say that this crate packed it.
pub(super) fn is_packed(attributes: &Value) -> bool {
    attributes[PACKED_KEY]["version"] == PACKED_VERSION
}

/// The bytes of the summaries of blocks of a side that a packed store states.
pub(super) fn stated_summary_bytes(attributes: &Value, side: BlockSide) -> Option<u64> {
    attributes[PACKED_KEY]["summary_bytes"][side.to_string()].as_u64()
}

/// The digest that a packed store states.
pub(super) fn stated_digest(attributes: &Value) -> Option<u64> {
    attributes[PACKED_KEY]["digest"].as_u64()
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use brickfield_core::glam::DVec3;
    use zarrs::storage::byte_range::ByteRangeIterator;
    use zarrs::storage::store::MemoryStore;
    use zarrs::storage::{
        Bytes, MaybeBytesIterator, OffsetBytesIterator, ReadableStorageTraits, StorageError, StorePrefix,
        WritableStorageTraits,
    };

    use super::*;

    /// A disk with room for some bytes.
    struct SmallDisk {
        store: MemoryStore,
        n_free: Mutex<usize>,
    }

    impl WritableStorageTraits for SmallDisk {
        fn set(&self, key: &StoreKey, value: Bytes) -> Result<(), StorageError> {
            let mut n_free = self.n_free.lock().unwrap();
            *n_free = n_free.checked_sub(value.len()).ok_or(io::Error::from(io::ErrorKind::StorageFull))?;
            self.store.set(key, value)
        }

        fn set_partial_many(&self, _: &StoreKey, _: OffsetBytesIterator) -> Result<(), StorageError> {
            Err(StorageError::ReadOnly)
        }

        fn erase(&self, key: &StoreKey) -> Result<(), StorageError> {
            self.store.erase(key)
        }

        fn erase_prefix(&self, prefix: &StorePrefix) -> Result<(), StorageError> {
            self.store.erase_prefix(prefix)
        }

        fn supports_set_partial(&self) -> bool {
            false
        }
    }

    impl ReadableStorageTraits for SmallDisk {
        fn get_partial_many<'a>(
            &'a self,
            key: &StoreKey,
            ranges: ByteRangeIterator<'a>,
        ) -> Result<MaybeBytesIterator<'a>, StorageError> {
            self.store.get_partial_many(key, ranges)
        }

        fn size_key(&self, key: &StoreKey) -> Result<Option<u64>, StorageError> {
            self.store.size_key(key)
        }

        fn supports_get_partial(&self) -> bool {
            true
        }
    }

    /// Writes a store of noise on a disk with room for `n_free` bytes.
    fn pack_on(disk: &Arc<SmallDisk>) -> Result<(), SaveError> {
        let dims = UVec3::new(40, 33, 70);
        let grid = Grid::axis_aligned(dims, DVec3::ONE).unwrap();
        let path = Path::new("head.zarr");
        let options = PyramidOptions { coarsest: Level(1), ..PyramidOptions::default() };
        let mut writer = PyramidWriter::of_store(path, disk.clone(), &grid, ScalarType::U16, &options)?;
        for (level, dims) in [(Level(0), dims), (Level(1), (dims - 1) / 2 + 1)] {
            let noise = (0..dims.element_product()).map(|i| i.wrapping_mul(2_654_435_761).to_le_bytes()[2].into());
            writer.push(level, noise.collect::<Vec<u16>>().into())?;
        }
        writer.finish()
    }

    #[test]
    fn a_full_disk_is_an_error_and_no_store() {
        let disk = |n_free| Arc::new(SmallDisk { store: MemoryStore::new(), n_free: Mutex::new(n_free) });
        let root = StoreKey::new("zarr.json").unwrap();
        let large = disk(usize::MAX);
        pack_on(&large).unwrap();
        assert!(large.get(&root).unwrap().is_some());
        let n_needed = usize::MAX - *large.n_free.lock().unwrap();
        for n_free in [0, 1000, n_needed / 2, n_needed - 100, n_needed - 1] {
            let small = disk(n_free);
            let fault = pack_on(&small).unwrap_err().to_string();
            assert!(fault.starts_with("head.zarr: cannot write: "), "{fault}");
            assert!(fault.contains("no storage space"), "{fault}");
            assert_eq!(small.get(&root).unwrap(), None, "{n_free}");
        }
    }
}
