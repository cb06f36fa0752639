//! An array that is stored as details of another one.

mod codec;

use brickfield_core::ScalarType;
use brickfield_core::glam::UVec3;
use brickfield_haar::{BrickHeader, DecodeError, Sample, decode_with_low};
use zarrs::array::{
    Array, ArrayCreateError, ArrayError, ArrayShardedExt, ArrayShardedReadableExt, ArrayShardedReadableExtCache,
    ArraySubset, DataType, ElementOwned,
};
use zarrs::group::{Group, GroupCreateError};
use zarrs::storage::{ReadableStorage, ReadableStorageTraits};

pub use codec::{DETAILS_CODEC_NAME, HaarDetailsCodec};

/// Level 0 of a pyramid, stored as details of level 1: what `brickfield pack --codec haar` writes.
///
/// ```text
/// group          attributes: brickfield_details.path, ome.multiscales[0].datasets[0].path
///   details      sharded bricks, z, y, x         7/8 of the samples
///   level 1      an ordinary array of means      1/8
/// ```
///
/// Indices of shards are kept once they are read; samples are not.
pub struct DetailArray {
    details: Array<dyn ReadableStorageTraits>,
    means: Array<dyn ReadableStorageTraits>,
    cache: ArrayShardedReadableExtCache,
    dims: [u64; 3],
    side: [u64; 3],
}

/// Why an array of details is not opened or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum DetailError {
    #[error("the group {path:?}: {error}")]
    Group { path: String, error: Box<GroupCreateError> },
    #[error("the group {path:?} has no attribute {attribute}: it has no level that is stored as details")]
    Attribute { path: String, attribute: &'static str },
    #[error("the array {path:?}: {error}")]
    Open { path: String, error: Box<ArrayCreateError> },
    #[error("the array of details has {what} {found}, but {expected}")]
    Layout { what: &'static str, found: String, expected: String },
    #[error("samples {found} are asked for of an array of shape {shape:?}")]
    Subset { found: String, shape: [u64; 3] },
    #[error("samples of {asked} are asked for of an array of {stored}")]
    Type { asked: ScalarType, stored: DataType },
    #[error(transparent)]
    Array(#[from] ArrayError),
    #[error("the chunk {chunk:?} of details is not stored")]
    Missing { chunk: [u64; 3] },
    #[error("the chunk {chunk:?} of details: {error}")]
    Decode { chunk: [u64; 3], error: DecodeError },
    #[error("the chunk {chunk:?} of details has {found} samples along x, y, z, but {expected} lie within the array")]
    Extent { chunk: [u64; 3], found: UVec3, expected: UVec3 },
}

impl DetailArray {
    /// Opens level 0 of a group. Only documents are read.
    ///
    /// # Errors
    /// If the group or one of its arrays cannot be opened; if it states no details, or they do not fit level 1.
    pub fn open(store: ReadableStorage, group: &str) -> Result<DetailArray, DetailError> {
        let path = group.trim_end_matches('/');
        let opened = Group::open(store.clone(), group)
            .map_err(|error| DetailError::Group { path: group.to_owned(), error: Box::new(error) })?;
        let stated = |pointer: &'static str| {
            let (first, rest) = pointer.split_once('/').unwrap_or((pointer, ""));
            let value = opened.attributes().get(first).and_then(|value| value.pointer(&format!("/{rest}")));
            let text = value.and_then(|value| value.as_str());
            text.ok_or_else(|| DetailError::Attribute { path: group.to_owned(), attribute: pointer })
        };
        let array = |within: &str| {
            let path = format!("{path}/{within}");
            let opened = Array::open(store.clone(), &path);
            opened.map_err(|error| DetailError::Open { path, error: Box::new(error) })
        };
        let details = array(stated("brickfield_details/path")?)?;
        let means = array(stated("ome/multiscales/0/datasets/0/path")?)?;
        DetailArray::of(details, means)
    }

    fn of(
        details: Array<dyn ReadableStorageTraits>,
        means: Array<dyn ReadableStorageTraits>,
    ) -> Result<DetailArray, DetailError> {
        let fault = |what, found: String, expected: String| DetailError::Layout { what, found, expected };
        let shape = details.shape().to_vec();
        let dims: [u64; 3] = shape
            .as_slice()
            .try_into()
            .map_err(|_| fault("the shape", format!("{shape:?}"), "three dimensions, z, y, x, are read".into()))?;
        let halves = dims.map(|n| n.div_ceil(2));
        if means.shape() != halves {
            let expected = format!("the array that it refines {:?} instead of {halves:?}", means.shape());
            return Err(fault("the shape", format!("{dims:?}"), expected));
        }
        if details.data_type() != means.data_type() {
            let expected = format!("the array that it refines {}", means.data_type());
            return Err(fault("the data type", details.data_type().to_string(), expected));
        }
        let side = details.subchunk_shape().map(|shape| shape.iter().map(|n| n.get()).collect::<Vec<_>>());
        let side: Option<[u64; 3]> = side.as_deref().and_then(|side| side.try_into().ok());
        let even = side.filter(|side| {
            side.iter().all(|n| n % 2 == 0) && side.iter().product::<u64>() <= brickfield_haar::MAX_SAMPLES
        });
        let Some(side) = even.filter(|_| details.is_exclusively_sharded()) else {
            let expected = "chunks of even sides within shards are read".to_owned();
            return Err(fault("chunks of", format!("{side:?}"), expected));
        };
        let cache = ArrayShardedReadableExtCache::new(&details);
        Ok(DetailArray { details, means, cache, dims, side })
    }

    /// Samples along z, y, x.
    pub fn shape(&self) -> [u64; 3] {
        self.dims
    }

    /// The type of the samples.
    pub fn data_type(&self) -> &DataType {
        self.details.data_type()
    }

    /// The array of details, with its metadata. Its chunks are not decoded alone.
    pub fn details(&self) -> &Array<dyn ReadableStorageTraits> {
        &self.details
    }

    /// The array that is refined: level 1.
    pub fn means(&self) -> &Array<dyn ReadableStorageTraits> {
        &self.means
    }

    /// All samples of the array, x fastest.
    ///
    /// # Errors
    /// As [`retrieve_array_subset`](Self::retrieve_array_subset).
    pub fn retrieve_all<T: Sample + ElementOwned>(&self) -> Result<Vec<T>, DetailError> {
        self.retrieve_array_subset(&ArraySubset::new_with_shape(self.dims.to_vec()))
    }

    /// The samples of a part of the array, x fastest, chunk by chunk.
    ///
    /// # Errors
    /// A part beyond the array; samples of another type; a chunk that is missing or damaged.
    pub fn retrieve_array_subset<T: Sample + ElementOwned>(&self, part: &ArraySubset) -> Result<Vec<T>, DetailError> {
        let stored = self.data_type();
        T::validate_data_type(stored).map_err(|_| DetailError::Type { asked: T::TYPE, stored: stored.clone() })?;
        let region = self.region(part)?;
        let mut samples = vec![T::default(); region.n.iter().product::<u64>() as usize];
        for chunk in region.chunks(self.side) {
            let (of_chunk, decoded) = self.chunk::<T>(chunk)?;
            region.take(&of_chunk, &decoded, &mut samples);
        }
        Ok(samples)
    }

    fn region(&self, part: &ArraySubset) -> Result<Region, DetailError> {
        let of = |list: &[u64]| <[u64; 3]>::try_from(list).ok();
        let region = of(part.start()).zip(of(part.shape())).map(|(first, n)| Region { first, n });
        let is_within =
            |r: &Region| (0..3).all(|a| r.first[a].checked_add(r.n[a]).is_some_and(|end| end <= self.dims[a]));
        region.filter(is_within).ok_or_else(|| DetailError::Subset { found: part.to_string(), shape: self.dims })
    }

    /// The samples of a chunk that lie within the array.
    fn chunk<T: Sample + ElementOwned>(&self, chunk: [u64; 3]) -> Result<(Region, Vec<T>), DetailError> {
        let first = [0, 1, 2].map(|a| chunk[a] * self.side[a]);
        let n = [0, 1, 2].map(|a| self.side[a].min(self.dims[a] - first[a]));
        let brick = self.details.retrieve_encoded_subchunk(&self.cache, &chunk)?;
        let brick = brick.ok_or(DetailError::Missing { chunk })?;
        let fault = |error| DetailError::Decode { chunk, error };
        let expected = UVec3::from([n[2], n[1], n[0]].map(|n| n as u32));
        let found = BrickHeader::read(&brick).map_err(fault)?.extent();
        if found != expected {
            return Err(DetailError::Extent { chunk, found, expected });
        }
        let (low, n_low) = (first.map(|i| i / 2), n.map(|n| n.div_ceil(2)));
        let low = ArraySubset::new_with_start_shape(low.to_vec(), n_low.to_vec());
        let low: Vec<T> = self.means.retrieve_array_subset(&low.map_err(ArrayError::from)?)?;
        Ok((Region { first, n }, decode_with_low(&brick, &low).map_err(fault)?.samples))
    }
}

/// A box of samples along z, y, x.
#[derive(Clone, Copy)]
struct Region {
    first: [u64; 3],
    n: [u64; 3],
}

impl Region {
    /// The chunks that have samples in it.
    fn chunks(&self, side: [u64; 3]) -> impl Iterator<Item = [u64; 3]> + use<> {
        let [z, y, x] = [0, 1, 2].map(|a| self.first[a] / side[a]..(self.first[a] + self.n[a]).div_ceil(side[a]));
        let is_empty = self.n.contains(&0);
        let all = z.flat_map(move |z| {
            let x = x.clone();
            y.clone().flat_map(move |y| x.clone().map(move |x| [z, y, x]))
        });
        all.filter(move |_| !is_empty)
    }

    /// Copies the samples of another box that lie in this one.
    fn take<T: Copy>(&self, other: &Region, from: &[T], to: &mut [T]) {
        let [z, y, x] = [0, 1, 2]
            .map(|a| self.first[a].max(other.first[a])..(self.first[a] + self.n[a]).min(other.first[a] + other.n[a]));
        let n_row = (x.end - x.start) as usize;
        for (z, y) in z.flat_map(|z| y.clone().map(move |y| (z, y))) {
            let row = [z, y, x.start];
            to[self.number(row)..][..n_row].copy_from_slice(&from[other.number(row)..][..n_row]);
        }
    }

    fn number(&self, at: [u64; 3]) -> usize {
        let [z, y, x] = [0, 1, 2].map(|a| at[a] - self.first[a]);
        (x + self.n[2] * (y + self.n[1] * z)) as usize
    }
}
