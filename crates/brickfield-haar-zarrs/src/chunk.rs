//! Chunks of `zarrs` to bricks of `brickfield-haar`, and back.

use std::num::NonZeroU64;

use brickfield_core::glam::UVec3;
use brickfield_haar::{BrickHeader, DecodeError, EncodeError, EncodeOptions, MAX_SAMPLES, Sample, decode, encode};
use zarrs::array::data_type::{
    Int8DataType, Int16DataType, Int32DataType, UInt8DataType, UInt16DataType, UInt32DataType,
};
use zarrs::array::{ArrayBytes, CodecError, DataType, ElementError, ElementOwned};

use crate::codec::CODEC_NAME;

/// Why a chunk is not encoded or decoded. Within `zarrs` it is the text of a [`CodecError::Other`].
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum ChunkError {
    #[error(
        "{CODEC_NAME} codes the data types uint8, uint16, uint32, int8, int16 and int32, but the chunk has {data_type}"
    )]
    DataType { data_type: DataType },
    #[error(
        "{CODEC_NAME} codes chunks with at most three dimensions of more than one sample, but the chunk has shape {shape:?}"
    )]
    Dimensions { shape: Vec<u64> },
    #[error("{CODEC_NAME} codes chunks of at most {MAX_SAMPLES} samples, but the chunk has shape {shape:?}")]
    TooLarge { shape: Vec<u64> },
    #[error("{CODEC_NAME}: {0}")]
    Encode(#[from] EncodeError),
    #[error("{CODEC_NAME}: {0}")]
    Decode(#[from] DecodeError),
    #[error(
        "{CODEC_NAME}: the encoded chunk has {found} samples along x, y, z, but the array's chunks have {expected}"
    )]
    Extent { found: UVec3, expected: UVec3 },
    #[error("{CODEC_NAME}: the encoded chunk states an error of {found}, but the array's max_error is {bound}")]
    MaxError { found: u32, bound: u32 },
    #[error("{CODEC_NAME}: {0}")]
    Element(#[from] ElementError),
}

impl From<ChunkError> for CodecError {
    fn from(error: ChunkError) -> CodecError {
        CodecError::Other(error.to_string())
    }
}

/// A data type that the codec codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ChunkType {
    U8,
    U16,
    U32,
    I8,
    I16,
    I32,
}

/// Calls a generic function for the samples of a [`ChunkType`].
macro_rules! with_samples {
    ($chunk_type:expr, $function:ident($($argument:expr),*)) => {
        match $chunk_type {
            ChunkType::U8 => $function::<u8>($($argument),*),
            ChunkType::U16 => $function::<u16>($($argument),*),
            ChunkType::U32 => $function::<u32>($($argument),*),
            ChunkType::I8 => $function::<i8>($($argument),*),
            ChunkType::I16 => $function::<i16>($($argument),*),
            ChunkType::I32 => $function::<i32>($($argument),*),
        }
    };
}

impl ChunkType {
    pub(crate) fn of(data_type: &DataType) -> Result<ChunkType, ChunkError> {
        match data_type {
            d if d.is::<UInt8DataType>() => Ok(ChunkType::U8),
            d if d.is::<UInt16DataType>() => Ok(ChunkType::U16),
            d if d.is::<UInt32DataType>() => Ok(ChunkType::U32),
            d if d.is::<Int8DataType>() => Ok(ChunkType::I8),
            d if d.is::<Int16DataType>() => Ok(ChunkType::I16),
            d if d.is::<Int32DataType>() => Ok(ChunkType::I32),
            _ => Err(ChunkError::DataType { data_type: data_type.clone() }),
        }
    }

    fn n_bytes(self) -> u64 {
        fn size<T>() -> u64 {
            size_of::<T>() as u64
        }
        with_samples!(self, size())
    }
}

/// By how many bytes an encoded chunk exceeds its samples at most: an invariant of `brickfield-haar`.
const MAX_EXCESS_BYTES: u64 = 40;

/// The most bytes that a chunk takes when it is encoded.
pub(crate) fn max_encoded_bytes(shape: &[NonZeroU64], data_type: &DataType) -> Result<u64, ChunkError> {
    let extent = extent_of(shape)?;
    let n_samples: u64 = extent.to_array().into_iter().map(u64::from).product();
    Ok(n_samples * ChunkType::of(data_type)?.n_bytes() + MAX_EXCESS_BYTES)
}

/// Samples along x, y, z of a chunk, whose last dimension varies fastest and is x. Dimensions of one sample are left out, foremost
/// first, until three are left; missing ones are of one sample.
///
/// ```text
/// shape          extent
/// [7]            (7, 1, 1)
/// [5, 7]         (7, 5, 1)
/// [1, 3, 5, 7]   (7, 5, 3)
/// [1, 3, 1, 7]   (7, 1, 3)
/// [2, 1, 5, 7]   (7, 5, 2)
/// ```
pub(crate) fn extent_of(shape: &[NonZeroU64]) -> Result<UVec3, ChunkError> {
    let shape: Vec<u64> = shape.iter().map(|n| n.get()).collect();
    let n_samples = shape.iter().try_fold(1u64, |n, &axis| n.checked_mul(axis));
    if n_samples.is_none_or(|n| n > MAX_SAMPLES) {
        return Err(ChunkError::TooLarge { shape });
    }
    let mut axes = shape.clone();
    while axes.len() > 3 {
        let of_one = axes.iter().position(|&n| n == 1);
        axes.remove(of_one.ok_or_else(|| ChunkError::Dimensions { shape: shape.clone() })?);
    }
    let mut from_x = axes.iter().rev().map(|&n| n as u32).chain(std::iter::repeat(1));
    let mut next = || from_x.next().unwrap_or(1);
    Ok(UVec3::new(next(), next(), next()))
}

/// Encodes a chunk of `shape`.
pub(crate) fn encode_chunk(
    bytes: ArrayBytes<'_>,
    shape: &[NonZeroU64],
    data_type: &DataType,
    options: &EncodeOptions,
) -> Result<Vec<u8>, CodecError> {
    let chunk_type = ChunkType::of(data_type)?;
    let extent = extent_of(shape)?;
    bytes.validate(shape.iter().map(|n| n.get()).product(), data_type)?;
    Ok(with_samples!(chunk_type, encode_as(bytes, extent, data_type, options))?)
}

fn encode_as<T: Sample + ElementOwned>(
    bytes: ArrayBytes<'_>,
    extent: UVec3,
    data_type: &DataType,
    options: &EncodeOptions,
) -> Result<Vec<u8>, ChunkError> {
    Ok(encode(extent, &T::from_array_bytes(data_type, bytes)?, options)?)
}

/// Decodes a chunk of `shape`, whose samples may differ from the encoded ones by `max_error`. Allocates only if the bytes state the
/// same shape.
pub(crate) fn decode_chunk(
    bytes: &[u8],
    shape: &[NonZeroU64],
    data_type: &DataType,
    max_error: u32,
) -> Result<ArrayBytes<'static>, ChunkError> {
    let chunk_type = ChunkType::of(data_type)?;
    let expected = extent_of(shape)?;
    let header = BrickHeader::read(bytes)?;
    if header.extent() != expected {
        return Err(ChunkError::Extent { found: header.extent(), expected });
    }
    if header.max_error() > max_error {
        return Err(ChunkError::MaxError { found: header.max_error(), bound: max_error });
    }
    with_samples!(chunk_type, decode_as(bytes, data_type))
}

fn decode_as<T: Sample + ElementOwned>(bytes: &[u8], data_type: &DataType) -> Result<ArrayBytes<'static>, ChunkError> {
    Ok(T::into_array_bytes(data_type, decode::<T>(bytes)?.samples)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn extent(shape: &[u64]) -> Result<[u32; 3], String> {
        let shape: Vec<NonZeroU64> = shape.iter().map(|&n| NonZeroU64::new(n).unwrap()).collect();
        extent_of(&shape).map(|extent| extent.to_array()).map_err(|error| error.to_string())
    }

    #[test]
    fn the_last_dimension_is_x() {
        assert_eq!(extent(&[]), Ok([1, 1, 1]));
        assert_eq!(extent(&[7]), Ok([7, 1, 1]));
        assert_eq!(extent(&[5, 7]), Ok([7, 5, 1]));
        assert_eq!(extent(&[3, 5, 7]), Ok([7, 5, 3]));
        assert_eq!(extent(&[3, 1, 7]), Ok([7, 1, 3]));
    }

    #[test]
    fn dimensions_of_one_sample_are_left_out_from_the_front() {
        assert_eq!(extent(&[1, 3, 5, 7]), Ok([7, 5, 3]));
        assert_eq!(extent(&[1, 1, 3, 1, 7]), Ok([7, 1, 3]));
        assert_eq!(extent(&[2, 1, 5, 7]), Ok([7, 5, 2]));
        assert_eq!(extent(&[3, 5, 7, 1]), Ok([7, 5, 3]));
        assert_eq!(extent(&[1, 1, 1, 1]), Ok([1, 1, 1]));
    }

    #[test]
    fn shapes_that_no_brick_has_are_refused() {
        let error = extent(&[2, 3, 5, 7]).unwrap_err();
        assert!(error.contains("at most three dimensions") && error.contains("[2, 3, 5, 7]"), "{error}");
        assert_eq!(extent(&[1 << 28]), Ok([1 << 28, 1, 1]));
        for shape in [vec![(1 << 28) + 1], vec![1 << 40, 1 << 40], vec![u64::MAX, 1, 1, 1]] {
            let error = extent(&shape).unwrap_err();
            assert!(error.contains("at most 268435456 samples"), "{error}");
        }
    }
}
