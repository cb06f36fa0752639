//! The smallest parts of an array that can be read alone: its chunks, or the parts of its shards.

use std::ops::Range;
use std::sync::Arc;

use brickfield_core::glam::UVec3;
use brickfield_core::{Scalar, ScalarType};
use brickfield_haar::Sample;
use zarrs::array::codec::api::ArrayToBytesCodecTraits;
use zarrs::array::{Array, ArrayBytesRaw, CodecOptions};
use zarrs::storage::byte_range::ByteRange;
use zarrs::storage::{ReadableStorage, ReadableStorageTraits, StoreKey};

use super::super::bounds::{Packing, Shard, check_stream};
use super::super::metadata::ArrayMetadata;
use super::super::pack::{decode_details, keys};
use crate::error::{bytes, check_length};
use crate::numbers::{FileScalar, with_room};
use crate::stored_type::StoredType;
use crate::{ByteOrder, ReadError};

/// An array whose parts are read one by one.
pub(super) struct Parts {
    /// Path of the array, for messages.
    path: String,
    store: ReadableStorage,
    /// The array as it is: its chunks are files.
    chunks: Array<dyn ReadableStorageTraits>,
    /// The array as if its parts were chunks.
    parts: Array<dyn ReadableStorageTraits>,
    packing: Packing,
    stored: StoredType,
    /// Samples of a part along each axis.
    pub(super) part_shape: Vec<u64>,
    /// Parts of a chunk along each axis.
    per_chunk: Vec<u64>,
}

/// Where the parts of a shard lie in its file.
pub(super) struct ShardIndex {
    n_file_bytes: u64,
    /// Offset and length; both are all ones where there is no part.
    entries: Vec<(u64, u64)>,
}

/// A part as it is stored.
pub(super) enum StoredPart {
    Bytes(Vec<u8>),
    /// A part of a shard that holds nothing but the fill value.
    Fill,
    /// The file is not there.
    Missing,
}

/// Where a part lies: an object, its range or all of it, and the number of its bytes.
pub(super) struct StoredPlace {
    pub(super) key: String,
    pub(super) range: Option<Range<u64>>,
    pub(super) n_bytes: u64,
}

const NO_PART: (u64, u64) = (u64::MAX, u64::MAX);
const ENTRY_BYTES: u64 = 16;
const CHECKSUM_BYTES: u64 = 4;
/// More parts than this a shard does not have.
const MAX_PARTS: u64 = 1 << 20;

/// The order of unpacked bytes.
const NATIVE: ByteOrder = if cfg!(target_endian = "big") { ByteOrder::Big } else { ByteOrder::Little };

impl Parts {
    pub(super) fn new(store: &ReadableStorage, path: &str, metadata: &ArrayMetadata) -> Result<Parts, ReadError> {
        let array = |metadata| {
            Array::new_with_metadata(store.clone(), &format!("/{path}"), metadata)
                .map_err(|e| ReadError::decoder("the array", e))
        };
        let chunk_shape = &metadata.chunk_shape;
        let part_shape = match &metadata.packing {
            Packing::Plain(_) => chunk_shape.clone(),
            Packing::Shard(shard) => shard.part_shape.clone(),
        };
        let divides = |(chunk, part): (&u64, &u64)| *part > 0 && chunk.is_multiple_of(*part);
        if part_shape.len() != chunk_shape.len() || !chunk_shape.iter().zip(&part_shape).all(divides) {
            let (value, expected) = (format!("{part_shape:?}"), format!("a divisor of {chunk_shape:?}"));
            return Err(ReadError::field(format!("part shape of array {path:?}"), value, expected));
        }
        let per_chunk: Vec<u64> = chunk_shape.iter().zip(&part_shape).map(|(chunk, part)| chunk / part).collect();
        let n_parts = per_chunk.iter().fold(1u64, |n, m| n.saturating_mul(*m));
        if n_parts > MAX_PARTS {
            let expected = format!("at most {MAX_PARTS}");
            return Err(ReadError::field(format!("number of parts of a shard of array {path:?}"), n_parts, expected));
        }
        Ok(Parts {
            path: path.to_owned(),
            store: store.clone(),
            chunks: array(metadata.for_zarrs()?)?,
            parts: array(metadata.of_parts()?)?,
            packing: metadata.packing.clone(),
            stored: metadata.stored,
            part_shape,
            per_chunk,
        })
    }

    /// Bytes of an unpacked part, in the type that is stored and in the type that it is read into.
    pub(super) fn n_bytes(&self) -> u128 {
        let n_bytes = self.stored.n_bytes().max(self.scalar().n_bytes());
        self.part_shape.iter().fold(n_bytes as u128, |n, m| n.saturating_mul(u128::from(*m)))
    }

    /// Whether chunks are shards, and parts less than a chunk.
    pub(super) fn is_sharded(&self) -> bool {
        matches!(self.packing, Packing::Shard(_))
    }

    /// Whether parts are details of the next level.
    pub(super) fn has_details(&self) -> bool {
        self.packing.has_details()
    }

    /// Whether samples are 64-bit integers.
    pub(super) fn is_wide(&self) -> bool {
        matches!(self.stored, StoredType::I64 | StoredType::U64)
    }

    /// The type that samples are read into.
    pub(super) fn scalar(&self) -> ScalarType {
        self.stored.read_into()
    }

    /// The keys of the files of all chunks.
    pub(super) fn chunk_keys(&self) -> Vec<StoreKey> {
        keys(self.chunks.chunk_grid_shape(), |chunk| self.chunks.chunk_key(chunk))
    }

    /// The chunk that a part lies in.
    pub(super) fn chunk_of(&self, part: &[u64]) -> Vec<u64> {
        part.iter().zip(&self.per_chunk).map(|(i, n)| i / n).collect()
    }

    /// The index of a shard; `None` if the shard is not there, or if chunks are no shards.
    pub(super) fn index(&self, chunk: &[u64], read: &dyn Fn(u64)) -> Result<Option<ShardIndex>, ReadError> {
        let Packing::Shard(shard) = &self.packing else { return Ok(None) };
        let what = format!("shard {chunk:?} of array {:?}", self.path);
        let fault = |e| ReadError::decoder(&what, e);
        let key = self.chunks.chunk_key(chunk);
        let Some(n_file_bytes) = self.store.size_key(&key).map_err(fault)? else { return Ok(None) };
        let n_entries: u64 = self.per_chunk.iter().product();
        let n_bytes = self.n_index_bytes(shard);
        check_length(&format!("{what}, with an index of {},", bytes(n_bytes)), n_file_bytes, n_bytes.into())?;
        let range = match shard.is_index_first {
            true => ByteRange::FromStart(0, Some(n_bytes)),
            false => ByteRange::Suffix(n_bytes),
        };
        let Some(index) = self.store.get_partial(&key, range).map_err(fault)? else { return Ok(None) };
        read(n_bytes);
        let (entries, checksum) = index.split_at((n_entries * ENTRY_BYTES) as usize);
        if shard.index_has_checksum && checksum != crc32c::crc32c(entries).to_le_bytes() {
            return Err(ReadError::WrongChecksum { what: format!("the index of {what}") });
        }
        let (words, _) = entries.as_chunks::<8>();
        let entries = words.as_chunks::<2>().0.iter().map(|[a, b]| (u64::from_le_bytes(*a), u64::from_le_bytes(*b)));
        Ok(Some(ShardIndex { n_file_bytes, entries: entries.collect() }))
    }

    /// A part of a chunk file; of a shard by its index.
    pub(super) fn stored(
        &self,
        part: &[u64],
        index: Option<&ShardIndex>,
        read: &dyn Fn(u64),
    ) -> Result<StoredPart, ReadError> {
        let fault = |e| ReadError::decoder(self.named(part), e);
        let key = self.chunks.chunk_key(&self.chunk_of(part));
        let stored = match (&self.packing, index) {
            (Packing::Plain(_), _) => self.store.get(&key).map_err(fault)?,
            (Packing::Shard(_), None) => None,
            (Packing::Shard(_), Some(index)) => match self.place_in(index, part)? {
                Some((offset, n_bytes)) => {
                    self.store.get_partial(&key, ByteRange::FromStart(offset, Some(n_bytes))).map_err(fault)?
                }
                None => return Ok(StoredPart::Fill),
            },
        };
        let Some(stored) = stored else { return Ok(StoredPart::Missing) };
        read(stored.len() as u64);
        Ok(StoredPart::Bytes(stored.into()))
    }

    /// Offset and length of a part in its shard; `None` if it holds nothing but the fill value.
    fn place_in(&self, index: &ShardIndex, part: &[u64]) -> Result<Option<(u64, u64)>, ReadError> {
        let (offset, n_bytes) = index.entries[self.place_in_chunk(part)];
        if (offset, n_bytes) == NO_PART {
            return Ok(None);
        }
        if offset.checked_add(n_bytes).is_none_or(|end| end > index.n_file_bytes) {
            let field = format!("the place of {}", self.named(part));
            let expected = format!("within the {} of its shard", bytes(index.n_file_bytes));
            return Err(ReadError::field(field, format!("{offset} + {n_bytes}"), expected));
        }
        Ok(Some((offset, n_bytes)))
    }

    /// Where a part lies; an empty range if it is not stored.
    pub(super) fn stored_place(&self, part: &[u64], index: Option<&ShardIndex>) -> Result<StoredPlace, ReadError> {
        let chunk_key = self.chunks.chunk_key(&self.chunk_of(part));
        let key = chunk_key.as_str().to_owned();
        let place = match (&self.packing, index) {
            (Packing::Plain(_), _) => {
                let n_bytes = self.store.size_key(&chunk_key).map_err(|e| ReadError::decoder(self.named(part), e))?;
                return Ok(match n_bytes {
                    Some(n_bytes) => StoredPlace { key, range: None, n_bytes },
                    None => StoredPlace { key, range: Some(0..0), n_bytes: 0 },
                });
            }
            (Packing::Shard(_), None) => None,
            (Packing::Shard(_), Some(index)) => self.place_in(index, part)?,
        };
        let (offset, n_bytes) = place.unwrap_or((0, 0));
        Ok(StoredPlace { key, range: Some(offset..offset + n_bytes), n_bytes })
    }

    /// The bytes of a shard that are its index; `None`, for all of it, if the index is at its end.
    pub(super) fn index_range(&self) -> Option<Range<u64>> {
        let Packing::Shard(shard) = &self.packing else { return None };
        shard.is_index_first.then(|| 0..self.n_index_bytes(shard))
    }

    fn n_index_bytes(&self, shard: &Shard) -> u64 {
        let n_entries: u64 = self.per_chunk.iter().product();
        n_entries * ENTRY_BYTES + if shard.index_has_checksum { CHECKSUM_BYTES } else { 0 }
    }

    /// The number of a part in its chunk, the last axis fastest.
    fn place_in_chunk(&self, part: &[u64]) -> usize {
        let place = part.iter().zip(&self.per_chunk).fold(0, |place, (i, n)| place * n + i % n);
        place as usize
    }

    /// The samples of a part, little-endian, in the type that they are read into.
    pub(super) fn unpacked(&self, part: &[u64], stored: Vec<u8>) -> Result<Vec<u8>, ReadError> {
        let what = format!("{} of {} stored", self.named(part), bytes(stored.len()));
        let codecs = match &self.packing {
            Packing::Plain(codecs) => *codecs,
            Packing::Shard(Shard { codecs, .. }) => *codecs,
        };
        let n_samples: u64 = self.part_shape.iter().product();
        check_stream(codecs, &stored, n_samples * self.stored.n_bytes() as u64, &what)?;
        let at = vec![0; self.part_shape.len()];
        let shape = self.parts.chunk_shape(&at).map_err(|e| ReadError::decoder(&what, e))?;
        let (data_type, fill_value) = (self.parts.data_type(), self.parts.fill_value());
        let options = CodecOptions::default();
        let raw = ArrayBytesRaw::from(stored);
        let unpacked = self.parts.codecs().decode(raw, &shape, data_type, fill_value, &options);
        let unpacked = unpacked.map_err(|e| ReadError::decoder(&what, e))?;
        let unpacked = unpacked.into_fixed().map_err(|e| ReadError::decoder(&what, e))?;
        let samples = self.little_endian(unpacked.into_owned(), &what)?;
        let (found, expected) = (samples.len() / self.scalar().n_bytes(), n_samples as usize);
        match found == expected {
            true => Ok(samples),
            false => Err(ReadError::TooFewSamples { what, found, expected }),
        }
    }

    /// The samples of a part that is stored as details, of which `extent` lie within the array: x fastest, little-endian, zeros behind them.
    /// `low` are those of the next level, little-endian.
    pub(super) fn refined(&self, part: &[u64], stored: &[u8], extent: UVec3, low: &[u8]) -> Result<Vec<u8>, ReadError> {
        let what = format!("{} of {} stored", self.named(part), bytes(stored.len()));
        match self.scalar() {
            ScalarType::U8 => self.details::<u8, 1>(stored, extent, low, &what, u8::to_le_bytes),
            ScalarType::I8 => self.details::<i8, 1>(stored, extent, low, &what, i8::to_le_bytes),
            ScalarType::U16 => self.details::<u16, 2>(stored, extent, low, &what, u16::to_le_bytes),
            ScalarType::I16 => self.details::<i16, 2>(stored, extent, low, &what, i16::to_le_bytes),
            ScalarType::U32 => self.details::<u32, 4>(stored, extent, low, &what, u32::to_le_bytes),
            ScalarType::I32 => self.details::<i32, 4>(stored, extent, low, &what, i32::to_le_bytes),
            other @ (ScalarType::F32 | ScalarType::F64) => {
                Err(ReadError::field(format!("type of array {:?}", self.path), other, "an integer type, for details"))
            }
        }
    }

    fn details<T: Sample + FileScalar, const N: usize>(
        &self,
        stored: &[u8],
        extent: UVec3,
        low: &[u8],
        what: &str,
        to_le_bytes: fn(T) -> [u8; N],
    ) -> Result<Vec<u8>, ReadError> {
        let samples = decode_details::<T>(stored, extent, low, what)?;
        let [ny, nx] = [1, 2].map(|axis| self.part_shape[axis] as usize);
        let mut all = vec![0; self.part_shape.iter().product::<u64>() as usize * N];
        for (row, samples) in samples.chunks_exact(extent.x as usize).enumerate() {
            let (y, z) = (row % extent.y as usize, row / extent.y as usize);
            let to = &mut all[nx * (y + ny * z) * N..][..samples.len() * N];
            to.as_chunks_mut::<N>().0.iter_mut().zip(samples).for_each(|(to, sample)| *to = to_le_bytes(*sample));
        }
        Ok(all)
    }

    /// The sample of all that is not stored, little-endian, in the type that samples are read into.
    pub(super) fn fill_value(&self) -> Result<Vec<u8>, ReadError> {
        let fill = self.little_endian(self.parts.fill_value().as_ne_bytes().to_vec(), "the fill value")?;
        match fill.len() == self.scalar().n_bytes() {
            true => Ok(fill),
            false => Err(ReadError::field("fill_value", format!("{fill:?}"), self.stored.name())),
        }
    }

    fn little_endian(&self, native: Vec<u8>, what: &str) -> Result<Vec<u8>, ReadError> {
        if NATIVE == ByteOrder::Little && matches!(self.stored, StoredType::Scalar(_)) {
            return Ok(native);
        }
        match self.scalar() {
            ScalarType::U8 => self.converted::<u8, 1>(&native, what, u8::to_le_bytes),
            ScalarType::I8 => self.converted::<i8, 1>(&native, what, i8::to_le_bytes),
            ScalarType::U16 => self.converted::<u16, 2>(&native, what, u16::to_le_bytes),
            ScalarType::I16 => self.converted::<i16, 2>(&native, what, i16::to_le_bytes),
            ScalarType::U32 => self.converted::<u32, 4>(&native, what, u32::to_le_bytes),
            ScalarType::I32 => self.converted::<i32, 4>(&native, what, i32::to_le_bytes),
            ScalarType::F32 => self.converted::<f32, 4>(&native, what, f32::to_le_bytes),
            ScalarType::F64 => self.converted::<f64, 8>(&native, what, f64::to_le_bytes),
        }
    }

    fn converted<T: FileScalar + Scalar, const N: usize>(
        &self,
        native: &[u8],
        what: &str,
        to_le_bytes: fn(T) -> [u8; N],
    ) -> Result<Vec<u8>, ReadError> {
        let mut samples = with_room::<T>(native.len() / self.stored.n_bytes())?;
        let outcome = self.stored.append(native, NATIVE, &mut samples);
        outcome.map_err(|fault| fault.of_sample(samples.len(), what))?;
        Ok(samples.into_iter().flat_map(to_le_bytes).collect())
    }

    pub(super) fn named(&self, part: &[u64]) -> String {
        format!("chunk {part:?} of array {:?}", self.path)
    }
}

/// Something of an array that was read, and is kept as long as there is room.
#[derive(Clone)]
pub(super) enum Kept {
    Index(Option<Arc<ShardIndex>>),
    /// `None` where nothing is stored: all samples have the fill value.
    Samples(Option<Arc<Vec<u8>>>),
}

impl Kept {
    pub(super) fn n_bytes(&self) -> u64 {
        let n_bytes = match self {
            Kept::Index(index) => index.as_ref().map_or(0, |index| size_of_val(&index.entries[..])),
            Kept::Samples(samples) => samples.as_ref().map_or(0, |samples| samples.len()),
        };
        // The entry itself.
        n_bytes as u64 + 128
    }
}
