//! Chunks come back: every data type, shape and configuration.

use crate::chunks::{Integer, chunk_shape, coded, decoded};
use brickfield_haar::{Kernel, Storages};
use brickfield_haar_zarrs::{HaarCodec, HaarOptions};
use proptest::prelude::*;
use zarrs::array::{ArrayBytes, ArrayToBytesCodecTraits, CodecOptions, FillValue};

fn options() -> impl Strategy<Value = HaarOptions> {
    let kernels = prop::sample::subsequence(Kernel::ALL.to_vec(), 1..=4).prop_shuffle();
    let n_levels = prop_oneof![Just(None), (0u8..16).prop_map(Some)];
    let max_error = prop_oneof![Just(0u32), 1u32..40, Just(i32::MAX as u32)];
    let storages = prop_oneof![Just(Storages::Smallest), Just(Storages::Packed)];
    (kernels, n_levels, max_error, storages).prop_map(|(kernels, n_levels, max_error, storages)| HaarOptions {
        kernels,
        n_levels,
        max_error,
        storages,
    })
}

/// Shapes of one to four dimensions, most of them odd; of four, the first is 1.
fn shape() -> impl Strategy<Value = Vec<u64>> {
    prop_oneof![
        prop::collection::vec(1u64..200, 1),
        prop::collection::vec(1u64..40, 2),
        prop::collection::vec(1u64..20, 3),
        prop::collection::vec(1u64..20, 3).prop_map(|s| vec![1, s[0], s[1], s[2]]),
    ]
}

/// A wave, noise, or the ends of the type in turns.
fn sample<T: Integer>(kind: u8, seed: u64, i: u64) -> T {
    let noise = (i + 1).wrapping_mul(seed | 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 33;
    match kind {
        0 => T::wrapped(60 + (40.0 * (i as f64 / 9.0).sin()) as i64),
        1 => T::wrapped(noise as i64),
        2 if noise.is_multiple_of(2) => T::LEAST,
        2 => T::GREATEST,
        _ => T::wrapped(seed as i64),
    }
}

fn check<T: Integer>(shape: &[u64], kind: u8, seed: u64, options: &HaarOptions) -> Result<(), TestCaseError> {
    let n = shape.iter().product();
    let samples: Vec<T> = (0..n).map(|i| sample(kind, seed, i)).collect();
    let codec = HaarCodec::new(options.clone()).unwrap();
    let encoded = coded(&codec, shape, &samples).unwrap();
    let fill = FillValue::new(vec![0; size_of::<T>()]);
    let most = codec.encoded_representation(&chunk_shape(shape), &T::zarr_type(), &fill).unwrap().size().unwrap();
    prop_assert!(encoded.len() as u64 <= most, "{} bytes, at most {most} promised", encoded.len());

    let decoded: Vec<T> = decoded(&codec, shape, &encoded).unwrap();
    prop_assert_eq!(decoded.len(), samples.len());
    let error = samples.iter().zip(&decoded).map(|(a, b)| a.value().abs_diff(b.value())).max().unwrap();
    prop_assert!(error <= u64::from(options.max_error), "an error of {error} with {options:?}");
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 192, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn samples_come_back(options in options(), shape in shape(), kind in 0u8..4, seed in any::<u64>(), number in 0u8..6) {
        match number {
            0 => check::<u8>(&shape, kind, seed, &options),
            1 => check::<u16>(&shape, kind, seed, &options),
            2 => check::<u32>(&shape, kind, seed, &options),
            3 => check::<i8>(&shape, kind, seed, &options),
            4 => check::<i16>(&shape, kind, seed, &options),
            _ => check::<i32>(&shape, kind, seed, &options),
        }?;
    }
}

/// The bound is used up: it reaches the encoder.
#[test]
fn a_bounded_error_keeps_its_bound_and_saves_bytes() {
    let samples: Vec<u16> = (0..17 * 18 * 19).map(|i| sample(1, 99, i)).map(|s: u16| 3000 + s % 500).collect();
    let encoded = |max_error| {
        let codec = HaarCodec::new(HaarOptions { max_error, ..HaarOptions::default() }).unwrap();
        coded(&codec, &[17, 18, 19], &samples).unwrap()
    };
    let (exact, lossy) = (encoded(0), encoded(7));
    assert!(lossy.len() * 4 < exact.len() * 3, "{} bytes, {} if lossless", lossy.len(), exact.len());
    let header = brickfield_haar::BrickHeader::read(&lossy).unwrap();
    assert_eq!(header.max_error(), 7);
}

/// The axes of the brick are those of the volume: x is the last dimension of the chunk.
#[test]
fn a_chunk_is_a_brick_whose_x_is_the_last_dimension() {
    let shape = [2, 3, 5];
    let samples: Vec<u8> = (0..30).map(|i| (i * i % 200) as u8).collect();
    let encoded = coded(&HaarCodec::default(), &shape, &samples).unwrap();
    let brick = brickfield_haar::decode::<u8>(&encoded).unwrap();
    assert_eq!(brick.extent.to_array(), [5, 3, 2]);
    assert_eq!(brick.samples, samples);
}

/// The options reach the encoder.
#[test]
fn a_chunk_has_the_kernel_levels_and_storage_of_the_options() {
    let samples: Vec<u16> = (0..16 * 16 * 16).map(|i| sample(0, 0, i)).collect();
    for kernel in Kernel::ALL.into_iter().filter(|kernel| kernel.has_bands()) {
        let options = HaarOptions {
            kernels: vec![kernel],
            n_levels: Some(1),
            storages: Storages::Packed,
            ..HaarOptions::default()
        };
        let encoded = coded(&HaarCodec::new(options).unwrap(), &[16, 16, 16], &samples).unwrap();
        let header = brickfield_haar::BrickHeader::read(&encoded).unwrap();
        assert_eq!((header.kernel(), header.n_levels()), (kernel, 1));
        assert_eq!(header.storage(), brickfield_haar::Storage::Packed);
    }
}

/// `zarrs` checks chunks that come through an array; a codec alone has to do so itself.
#[test]
fn bytes_of_another_length_are_refused() {
    let bytes = ArrayBytes::new_flen(vec![0u8; 7]);
    let (data_type, fill) = (u16::zarr_type(), FillValue::from(0u16));
    let codec = HaarCodec::default();
    let error = codec.encode(bytes, &chunk_shape(&[4]), &data_type, &fill, &CodecOptions::default()).unwrap_err();
    assert!(error.to_string().contains('7') && error.to_string().contains('8'), "{error}");
}
