//! Encoded chunks and their samples.

use std::num::NonZeroU64;

use brickfield_haar_zarrs::HaarCodec;
use zarrs::array::{
    ArrayToBytesCodecTraits, ChunkShape, CodecError, CodecOptions, DataType, ElementOwned, FillValue, data_type,
};

/// A type of samples.
pub(crate) trait Integer: ElementOwned + Copy + std::fmt::Debug + PartialEq {
    const LEAST: Self;
    const GREATEST: Self;
    fn wrapped(value: i64) -> Self;
    fn value(self) -> i64;
    fn zarr_type() -> DataType;
}

macro_rules! integers {
    ($($t:ident $data_type:ident;)*) => { $(
        impl Integer for $t {
            const LEAST: $t = $t::MIN;
            const GREATEST: $t = $t::MAX;
            fn wrapped(value: i64) -> $t { value as $t }
            fn value(self) -> i64 { i64::from(self) }
            fn zarr_type() -> DataType { data_type::$data_type() }
        }
    )* };
}
integers! { u8 uint8; u16 uint16; u32 uint32; i8 int8; i16 int16; i32 int32; }

pub(crate) fn chunk_shape(shape: &[u64]) -> ChunkShape {
    shape.iter().map(|&n| NonZeroU64::new(n).unwrap()).collect()
}

/// An encoded chunk.
pub(crate) fn coded<T: Integer>(codec: &HaarCodec, shape: &[u64], samples: &[T]) -> Result<Vec<u8>, CodecError> {
    let data_type = T::zarr_type();
    let bytes = T::to_array_bytes(&data_type, samples).unwrap();
    let fill = FillValue::new(vec![0; size_of::<T>()]);
    let encoded = codec.encode(bytes, &chunk_shape(shape), &data_type, &fill, &CodecOptions::default())?;
    Ok(encoded.into_owned())
}

/// The samples of an encoded chunk.
pub(crate) fn decoded<T: Integer>(codec: &HaarCodec, shape: &[u64], bytes: &[u8]) -> Result<Vec<T>, CodecError> {
    let data_type = T::zarr_type();
    let fill = FillValue::new(vec![0; size_of::<T>()]);
    let decoded = codec.decode(bytes.into(), &chunk_shape(shape), &data_type, &fill, &CodecOptions::default())?;
    Ok(T::from_array_bytes(&data_type, decoded).unwrap())
}
