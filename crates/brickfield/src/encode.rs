//! From samples as they are stored to samples as a backend reads them.

use std::sync::Arc;

use brickfield_core::glam::UVec3;
use brickfield_core::{Rescale, ScalarType, ValueRange, Voxels, with_voxels};
use brickfield_frame::{Chunk, Decode, SampleFormat, Upload};
use bytes::Bytes;

/// How the samples of a source are held for a backend.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coding {
    scalar: ScalarType,
    rescale: Rescale,
    pub(crate) format: SampleFormat,
    /// From a texture read to the stored number.
    pub(crate) stored: Decode,
    /// How they are brought to a device.
    pub(crate) upload: Upload,
}

impl Coding {
    /// Of samples of a type, with a map to values, and values in a range.
    pub(crate) fn of(scalar: ScalarType, rescale: Rescale, range: ValueRange) -> Coding {
        let (format, stored) = SampleFormat::encoding(scalar, rescale.stored_range(range));
        Coding { scalar, rescale, format, stored, upload: Upload::Plain }
    }

    /// The same, brought to a device in a way.
    pub(crate) fn brought(self, upload: Upload) -> Coding {
        Coding { upload, ..self }
    }

    /// From a texture read to the value.
    pub(crate) fn decode(&self) -> Decode {
        self.stored.rescaled(self.rescale)
    }

    /// Little-endian samples, x fastest, in the form of a backend.
    pub(crate) fn chunk(&self, extent: UVec3, bytes: Vec<u8>) -> Chunk {
        let samples = encode(bytes, self.scalar, self.format, self.stored);
        self.chunk_of_encoded(extent, samples.into())
    }

    /// Samples that are in the form of a backend.
    pub(crate) fn chunk_of_encoded(&self, extent: UVec3, samples: Bytes) -> Chunk {
        Chunk::of_samples(extent, self.format, samples, self.upload)
    }

    /// The bytes of samples whose form is that of a backend: nothing is copied. `None` of all others.
    pub(crate) fn as_stored(&self, samples: &Arc<Voxels>) -> Option<Bytes> {
        let is_stored =
            self.scalar == ScalarType::U8 || self.scalar == ScalarType::U16 && cfg!(target_endian = "little");
        is_stored.then(|| Bytes::from_owner(Stored(samples.clone())))
    }
}

/// Samples as bytes in the order of the machine.
struct Stored(Arc<Voxels>);

impl AsRef<[u8]> for Stored {
    fn as_ref(&self) -> &[u8] {
        with_voxels!(&*self.0, v => bytemuck::cast_slice(v))
    }
}

/// Little-endian samples of a type in the form of [`SampleFormat::encoding`], which `decode` undoes.
fn encode(mut bytes: Vec<u8>, scalar: ScalarType, format: SampleFormat, decode: Decode) -> Vec<u8> {
    match scalar {
        ScalarType::U8 | ScalarType::U16 => bytes,
        ScalarType::I8 | ScalarType::I16 => {
            // Two's complement with the top bit turned is the value shifted by half its range.
            bytes.iter_mut().skip(scalar.n_bytes() - 1).step_by(scalar.n_bytes()).for_each(|high| *high ^= 0x80);
            bytes
        }
        ScalarType::U32 => encode_f32(&bytes, format, decode, |b| f64::from(u32::from_le_bytes(b))),
        ScalarType::I32 => encode_f32(&bytes, format, decode, |b| f64::from(i32::from_le_bytes(b))),
        ScalarType::F32 => encode_f32(&bytes, format, decode, |b| f64::from(f32::from_le_bytes(b))),
        ScalarType::F64 => encode_f32(&bytes, format, decode, f64::from_le_bytes),
    }
}

fn encode_f32<const N: usize>(
    bytes: &[u8],
    format: SampleFormat,
    decode: Decode,
    number: impl Fn([u8; N]) -> f64,
) -> Vec<u8> {
    let (samples, _) = bytes.as_chunks::<N>();
    let mut out = vec![0; samples.len() * format.n_bytes()];
    for (sample, out) in samples.iter().zip(out.as_chunks_mut().0) {
        let read = (number(*sample) - decode.offset) / decode.scale;
        *out = (read as f32).to_le_bytes();
    }
    out
}
