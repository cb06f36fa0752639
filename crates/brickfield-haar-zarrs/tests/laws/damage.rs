//! Damaged and foreign chunks are errors.

use crate::chunks::{Integer, coded, decoded};
use brickfield_core::glam::UVec3;
use brickfield_haar::{EncodeOptions, Kernel, Loss, LowBand, Storages, encode};
use brickfield_haar_zarrs::{HaarCodec, HaarOptions};

const SHAPE: [u64; 3] = [6, 7, 9];
const N: usize = 6 * 7 * 9;

fn decode_error<T: Integer>(bytes: &[u8], shape: &[u64]) -> String {
    decoded::<T>(&HaarCodec::default(), shape, bytes).unwrap_err().to_string()
}

/// Chunks of all storages: coded, packed, raw and of one value.
fn chunks() -> Vec<Vec<u8>> {
    let packed = HaarCodec::new(HaarOptions { storages: Storages::Packed, ..HaarOptions::default() }).unwrap();
    let wave = |i: usize| 1000 + (300.0 * (i as f64 / 5.0).sin()) as u16;
    let noise = |i: usize| (i as u16).wrapping_mul(40503) ^ (i as u16 * 77) << 7;
    let of = |codec: &HaarCodec, sample: &dyn Fn(usize) -> u16| {
        coded(codec, &SHAPE, &(0..N).map(sample).collect::<Vec<_>>()).unwrap()
    };
    vec![
        of(&HaarCodec::default(), &wave),
        of(&packed, &wave),
        of(&HaarCodec::default(), &noise),
        of(&HaarCodec::default(), &|_| 7),
    ]
}

#[test]
fn a_flipped_bit_anywhere_is_an_error() {
    for chunk in chunks() {
        assert!(decoded::<u16>(&HaarCodec::default(), &SHAPE, &chunk).is_ok());
        for bit in 0..8 * chunk.len() {
            let mut damaged = chunk.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            let error = decode_error::<u16>(&damaged, &SHAPE);
            assert!(error.starts_with("brickfield.haar: "), "bit {bit}: {error}");
        }
    }
}

#[test]
fn a_cut_or_an_appended_byte_is_an_error() {
    for chunk in chunks() {
        for n in 0..chunk.len() {
            let error = decode_error::<u16>(&chunk[..n], &SHAPE);
            assert!(error.starts_with("brickfield.haar: "), "{n} bytes: {error}");
        }
        let longer = [chunk.as_slice(), &[0]].concat();
        assert!(decode_error::<u16>(&longer, &SHAPE).contains("1 bytes behind its end"));
    }
}

#[test]
fn a_chunk_of_another_shape_or_type_is_an_error() {
    let chunk = &chunks()[0];
    let error = decode_error::<u16>(chunk, &[6, 7, 8]);
    assert!(error.contains("[9, 7, 6] samples along x, y, z") && error.contains("[8, 7, 6]"), "{error}");
    assert!(decode_error::<u16>(chunk, &[9, 7, 6]).contains("samples along x, y, z"));
    let error = decode_error::<i16>(chunk, &SHAPE);
    assert!(error.contains("u16") && error.contains("i16"), "{error}");
}

/// A few bytes that claim 2^28 samples: refused before anything is decoded.
#[test]
fn a_huge_claim_is_refused_for_its_shape() {
    let huge = brickfield_haar_one_value(UVec3::new(1 << 14, 1 << 14, 1));
    assert!(decode_error::<u16>(&huge, &SHAPE).contains("[16384, 16384, 1] samples along x, y, z"));
}

/// A brick of one value is the same for every extent, but for the extent and the checksum.
fn brickfield_haar_one_value(extent: UVec3) -> Vec<u8> {
    let number = |bytes: &mut Vec<u8>, mut n: u32| {
        while n > 127 {
            bytes.push(n as u8 | 128);
            n >>= 7;
        }
        bytes.push(n as u8);
    };
    let of = |extent: UVec3| {
        let mut bytes = vec![b'B', b'H', 1, 1, 0];
        extent.to_array().into_iter().for_each(|n| number(&mut bytes, n));
        bytes.extend([1, 0, 14]);
        bytes.extend(crc32c(&bytes).to_le_bytes());
        bytes
    };
    assert_eq!(of(UVec3::new(9, 7, 6)), chunks()[3], "the format is that of the encoder");
    of(extent)
}

/// CRC-32C, bit by bit.
fn crc32c(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| crc >> 1 ^ if crc & 1 == 1 { 0x82f6_3b78 } else { 0 })
    })
}

/// An array that promises an error of at most 3 has no chunk with more, whoever wrote it.
#[test]
fn a_chunk_with_a_greater_error_than_the_arrays_is_refused() {
    let samples: Vec<u16> = (0..N as u32).map(|i| (i * i % 3001) as u16).collect();
    let options = EncodeOptions { loss: Loss::MaxError(8), ..EncodeOptions::default() };
    let brick = encode(UVec3::new(9, 7, 6), &samples, &options).unwrap();
    let codec = |max_error| HaarCodec::new(HaarOptions { max_error, ..HaarOptions::default() }).unwrap();
    assert!(decoded::<u16>(&codec(8), &SHAPE, &brick).is_ok());
    for bound in [0, 3, 7] {
        let error = decoded::<u16>(&codec(bound), &SHAPE, &brick).unwrap_err().to_string();
        assert!(error.contains("an error of 8") && error.contains(&format!("max_error is {bound}")), "{error}");
    }
}

/// A chunk must stand alone.
#[test]
fn a_brick_without_its_low_band_is_refused() {
    let samples: Vec<u16> = (0..N as u32).map(|i| (i * i % 3001) as u16).collect();
    let options = EncodeOptions {
        kernels: vec![Kernel::Haar],
        low_band: LowBand::Elsewhere,
        n_levels: Some(1),
        storages: Storages::Packed,
        ..EncodeOptions::default()
    };
    let brick = encode(UVec3::new(9, 7, 6), &samples, &options).unwrap();
    assert!(decode_error::<u16>(&brick, &SHAPE).contains("the low band of the brick is stored elsewhere"));
}
