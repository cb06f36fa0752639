//! From chunks to voxels.

use brickfield_core::{Scalar, ScalarType, Voxels};
use zarrs::array::{Array, ArrayBytes};
use zarrs::storage::{ReadableStorage, ReadableStorageTraits};

use super::axes::VolumeAxes;
use super::metadata::ArrayMetadata;
use crate::error::bytes;
use crate::limits::CheckedShape;
use crate::numbers::FileScalar;
use crate::numbers::with_room;
use crate::stored_type::StoredType;
use crate::{ByteOrder, Note, ReadError};

/// The part of an array that is read.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part<'a> {
    /// Path of the array, without a slash in front.
    pub(super) path: &'a str,
    pub(super) volume_axes: VolumeAxes,
    /// The entry along each axis that is none of the volume's.
    pub(super) entries: &'a [u64],
    /// Whether all chunks are stored, so that one that is not is lost.
    pub(super) is_packed: bool,
}

/// Reads all chunks that hold the part; notes that some are not stored.
pub(super) fn read(
    store: &ReadableStorage,
    part: Part,
    metadata: &ArrayMetadata,
    shape: &CheckedShape,
) -> Result<(Voxels, Option<Note>), ReadError> {
    let array = Array::new_with_metadata(store.clone(), &format!("/{}", part.path), metadata.for_zarrs()?);
    let array = array.map_err(|e| ReadError::decoder("the array", e))?;
    let dims = shape.dims.to_array().map(u64::from);
    let mut reader = Reader { array, metadata, part, dims, n_chunks: 0, n_missing: 0 };
    let voxels = match shape.scalar {
        ScalarType::U8 => reader.read::<u8>(),
        ScalarType::I8 => reader.read::<i8>(),
        ScalarType::U16 => reader.read::<u16>(),
        ScalarType::I16 => reader.read::<i16>(),
        ScalarType::U32 => reader.read::<u32>(),
        ScalarType::I32 => reader.read::<i32>(),
        ScalarType::F32 => reader.read::<f32>(),
        ScalarType::F64 => reader.read::<f64>(),
    }?;
    let Reader { n_chunks, n_missing, .. } = reader;
    Ok((voxels, (n_missing > 0).then_some(Note::MissingChunks { n_missing, n_chunks })))
}

struct Reader<'a> {
    array: Array<dyn ReadableStorageTraits>,
    metadata: &'a ArrayMetadata,
    part: Part<'a>,
    dims: [u64; 3],
    n_chunks: u64,
    /// Chunks that are not stored, and have the fill value.
    n_missing: u64,
}

/// The order of unpacked bytes.
const NATIVE: ByteOrder = if cfg!(target_endian = "big") { ByteOrder::Big } else { ByteOrder::Little };

impl Reader<'_> {
    fn read<T: FileScalar>(&mut self) -> Result<Voxels, ReadError> {
        let fill = self.fill_value::<T>()?;
        let n = self.dims.iter().product::<u64>() as usize;
        let mut values = with_room::<T>(n)?;
        values.resize(n, fill);
        let chunk = self.along_volume(&self.metadata.chunk_shape);
        let n_chunks = [0, 1, 2].map(|i| self.dims[i].div_ceil(chunk[i]));
        for z in 0..n_chunks[2] {
            for y in 0..n_chunks[1] {
                for x in 0..n_chunks[0] {
                    let is_stored = self.read_chunk([x, y, z], chunk, &mut values)?;
                    self.n_chunks += 1;
                    self.n_missing += u64::from(!is_stored);
                }
            }
        }
        Ok(Scalar::wrap(values))
    }

    fn fill_value<T: FileScalar>(&self) -> Result<T, ReadError> {
        let bytes = self.array.fill_value().as_ne_bytes();
        let values = self.samples(bytes, "the fill value")?;
        let stored: StoredType = self.metadata.stored;
        values.first().copied().ok_or_else(|| ReadError::field("fill_value", format!("{bytes:?}"), stored.name()))
    }

    fn samples<T: FileScalar>(&self, bytes: &[u8], what: &str) -> Result<Vec<T>, ReadError> {
        let stored = self.metadata.stored;
        let mut samples = with_room(bytes.len() / stored.n_bytes())?;
        let outcome = stored.append(bytes, NATIVE, &mut samples);
        outcome.map_err(|fault| fault.of_sample(samples.len(), what))?;
        Ok(samples)
    }

    /// Sizes along x, y, z; 1 where the array has no such axis.
    fn along_volume(&self, sizes: &[u64]) -> [u64; 3] {
        self.part.volume_axes.map(|axis| axis.map_or(1, |a| sizes[a]))
    }

    /// Whether the chunk is stored.
    fn read_chunk<T: FileScalar>(&self, at: [u64; 3], chunk: [u64; 3], values: &mut [T]) -> Result<bool, ReadError> {
        let chunk_shape = &self.metadata.chunk_shape;
        let mut indices: Vec<u64> = self.part.entries.iter().zip(chunk_shape).map(|(entry, n)| entry / n).collect();
        for (axis, i) in self.part.volume_axes.iter().zip(at) {
            if let Some(axis) = axis {
                indices[*axis] = i;
            }
        }
        let what = format!("chunk {indices:?}");
        let stored = self.array.retrieve_encoded_chunk(&indices).map_err(|e| ReadError::decoder(&what, e))?;
        let Some(stored) = stored else {
            return if self.part.is_packed { Err(ReadError::LostChunk { what }) } else { Ok(false) };
        };
        let named = format!("{what} of {} stored", bytes(stored.len()));
        let sample_bytes = self.metadata.stored.n_bytes() as u64;
        self.metadata.packing.check(&stored, chunk_shape, sample_bytes, &what)?;
        drop(stored);
        let unpacked: ArrayBytes = self.array.retrieve_chunk(&indices).map_err(|e| ReadError::decoder(&named, e))?;
        let unpacked = unpacked.into_fixed().map_err(|e| ReadError::decoder(named, e))?;
        let samples = self.samples(&unpacked, &what)?;
        let n_expected = chunk_shape.iter().product::<u64>() as usize;
        if samples.len() != n_expected {
            return Err(ReadError::TooFewSamples { what, found: samples.len(), expected: n_expected });
        }
        self.place(&samples, [0, 1, 2].map(|i| at[i] * chunk[i]), chunk, values);
        Ok(true)
    }

    /// Copies the part of a chunk that lies in the volume; `start` is its first voxel.
    fn place<T: Copy>(&self, samples: &[T], start: [u64; 3], chunk: [u64; 3], values: &mut [T]) {
        let chunk_shape = &self.metadata.chunk_shape;
        let all_strides = strides(chunk_shape);
        let strides = self.along_volume(&all_strides);
        let first = self.part.entries.iter().zip(chunk_shape).zip(&all_strides).map(|((i, n), stride)| i % n * stride);
        let first: u64 = first.sum();
        let [nx, ny, nz] = [0, 1, 2].map(|i| chunk[i].min(self.dims[i] - start[i]));
        for z in 0..nz {
            for y in 0..ny {
                let from = (first + z * strides[2] + y * strides[1]) as usize;
                let row = ((start[2] + z) * self.dims[1] + start[1] + y) * self.dims[0] + start[0];
                let out = &mut values[row as usize..(row + nx) as usize];
                match strides[0] {
                    1 => out.copy_from_slice(&samples[from..from + nx as usize]),
                    stride => {
                        let column = samples[from..].iter().step_by(stride as usize);
                        out.iter_mut().zip(column).for_each(|(o, s)| *o = *s);
                    }
                }
            }
        }
    }
}

/// Samples from one entry to the next along each axis, the last being fastest.
pub(super) fn strides(shape: &[u64]) -> Vec<u64> {
    let mut strides = vec![1; shape.len()];
    for axis in (1..shape.len()).rev() {
        strides[axis - 1] = strides[axis] * shape[axis];
    }
    strides
}
