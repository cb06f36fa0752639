//! Damaged bricks are errors.

use brickfield_core::glam::UVec3;
use brickfield_core::{Level, ScalarType};
use brickfield_haar::{
    BrickHeader, DecodeError, EncodeOptions, Kernel, LowBand, PackedBrick, Sample, Storage, Storages, decode,
    decode_level, encode,
};
use proptest::prelude::*;

use crate::bricks::{bricks, hold, options};
use crate::for_all_types;

/// Every flipped bit is found, for each byte has a checksum.
fn flipped_bits_are_errors<T: Sample>() {
    let flip = (any::<prop::sample::Index>(), 0..8u32);
    hold(100, (bricks::<T>(), options(), prop::collection::vec(flip, 40)), |((extent, samples), options, flips)| {
        let brick = encode(extent, &samples, &options).expect("options within bounds");
        for (byte, bit) in flips {
            let mut damaged = brick.clone();
            damaged[byte.index(brick.len())] ^= 1 << bit;
            prop_assert!(decode::<T>(&damaged).is_err());
        }
        Ok(())
    });
}
for_all_types!(flipped_bits_are_errors);

/// Bricks whose checksums are right although their content is not: an error, or samples in the number that the header states.
fn forged_bricks_keep_to_their_extent<T: Sample>() {
    let forgery = (any::<prop::sample::Index>(), any::<u8>());
    let forgeries = prop::collection::vec(forgery, 1..4);
    hold(200, (bricks::<T>(), options(), forgeries, 0..4u8), |((extent, samples), options, forgeries, level)| {
        let brick = encode(extent, &samples, &options).expect("options within bounds");
        let mut forged = brick.clone();
        for (byte, value) in forgeries {
            forged[byte.index(brick.len())] = value;
        }
        sign(&mut forged, &BrickHeader::read(&brick).expect("a header"));
        let n_stated = BrickHeader::read(&forged).map(|header| header.extent().as_u64vec3().element_product());
        if n_stated.as_ref().is_ok_and(|n| *n > 1 << 20) {
            return Ok(());
        }
        if let Ok(packed) = PackedBrick::read(&forged) {
            let n_numbers: usize = packed.sections().iter().map(|section| section.n_numbers).sum();
            prop_assert_eq!(Ok(n_numbers as u64), n_stated);
            let has_broken_section = matches!(decode::<T>(&forged), Err(DecodeError::Section { .. }));
            prop_assert!(!has_broken_section);
        }
        for level in [Level(0), Level(level)] {
            if let Ok(decoded) = decode_level::<T>(&forged, level) {
                prop_assert_eq!(decoded.samples.len(), decoded.extent.element_product() as usize);
            }
        }
        Ok(())
    });
}
for_all_types!(forged_bricks_keep_to_their_extent);

/// Packed bricks open, and no others; a width beyond a coefficient's bits and groups that are too few do not.
#[test]
fn packed_bricks_open_if_their_groups_are_whole() {
    let samples: Vec<u8> = (0..343).map(|i| (i % 7 * 9 + i / 49) as u8).collect();
    let kernels = vec![Kernel::Haar];
    let of = |storages| EncodeOptions { storages, kernels: kernels.clone(), ..EncodeOptions::default() };
    let packed = encode(UVec3::splat(7), &samples, &of(Storages::Packed)).unwrap();
    let opened = PackedBrick::read(&packed).unwrap();
    let widths: Vec<usize> = opened.sections().iter().map(|section| section.widths.len()).collect();
    assert_eq!(widths, [1, (343 - 64usize).div_ceil(64)]);
    let header = opened.header().clone();
    for (place, width) in [(0, 17), (0, 0), (1, 255)] {
        let mut forged = packed.clone();
        forged[if place == 0 { header.n_header_bytes() } else { header.n_bytes_of_level(Level(1)) }] = width;
        sign(&mut forged, &header);
        assert_eq!(PackedBrick::read(&forged), Err(DecodeError::Section { section: place }));
    }
    assert!(matches!(PackedBrick::read(&packed[..packed.len() - 1]), Err(DecodeError::Truncated { .. })));
    let coded = encode(UVec3::splat(7), &[3u8; 343], &of(Storages::Smallest)).unwrap();
    let (found, wanted) = (Storage::OneValue, Storage::Packed);
    assert_eq!(PackedBrick::read(&coded), Err(DecodeError::Storage { found, wanted }));
    let elsewhere = EncodeOptions { low_band: LowBand::Elsewhere, ..of(Storages::Packed) };
    let elsewhere = encode(UVec3::splat(7), &samples, &elsewhere).unwrap();
    assert_eq!(PackedBrick::read(&elsewhere), Err(DecodeError::LowBandElsewhere));
}

/// Sets all checksums, for a brick with the sections of another one.
fn sign(brick: &mut [u8], original: &BrickHeader) {
    let levels = (0..=original.n_levels()).rev().map(Level);
    let ends = levels.map(|level| original.n_bytes_of_level(level));
    let mut begin = 0;
    let n_header = original.n_header_bytes();
    let n_bytes = brick.len();
    for end in std::iter::once(n_header).chain(ends).filter(|&end| end <= n_bytes) {
        if end >= begin + 4 {
            let checksum = crc32c::crc32c(&brick[begin..end - 4]);
            brick[end - 4..end].copy_from_slice(&checksum.to_le_bytes());
        }
        begin = end;
    }
}

fn every_cut_is_an_error<T: Sample>() {
    hold(60, (bricks::<T>(), options()), |((extent, samples), options)| {
        let brick = encode(extent, &samples, &options).expect("options within bounds");
        for n in (0..brick.len()).step_by(1 + brick.len() / 200) {
            prop_assert!(matches!(decode::<T>(&brick[..n]), Err(DecodeError::Truncated { .. })), "{} bytes", n);
        }
        let extended = [&brick[..], &[0]].concat();
        prop_assert_eq!(decode::<T>(&extended).err(), Some(DecodeError::TooLong { extra: 1 }));
        Ok(())
    });
}
for_all_types!(every_cut_is_an_error);

#[test]
fn bytes_of_any_kind_are_no_panic() {
    hold(2000, prop::collection::vec(any::<u8>(), 0..200), |mut bytes| {
        prop_assert!(decode::<u8>(&bytes).is_err());
        if bytes.len() > 3 {
            bytes[..3].copy_from_slice(b"BH\x01");
        }
        prop_assert!(decode::<u8>(&bytes).is_err());
        Ok(())
    });
}

#[test]
fn errors_name_what_is_wrong() {
    let ramp: Vec<u16> = (0..4096).map(|i| i % 97).collect();
    let brick = encode(UVec3::splat(16), &ramp, &EncodeOptions::default()).unwrap();
    let error = |brick: &[u8]| decode::<u16>(brick).unwrap_err();
    assert_eq!(error(b"PNG and more bytes"), DecodeError::NotABrick);
    assert_eq!(error(b"BH\x02"), DecodeError::Version { version: 2 });
    assert_eq!(error(b"BH"), DecodeError::Truncated { needed: 3, given: 2 });
    let other = decode::<u8>(&brick).unwrap_err();
    assert_eq!(other, DecodeError::Type { found: ScalarType::U16, wanted: ScalarType::U8 });
    assert_eq!(other.to_string(), "the brick's samples are u16, not u8");
    let end = error(&brick[..brick.len() - 1]);
    assert_eq!(end, DecodeError::Truncated { needed: brick.len(), given: brick.len() - 1 });
    let mut damaged = brick.clone();
    damaged[brick.len() - 5] ^= 1;
    assert_eq!(error(&damaged), DecodeError::Checksum { part: "a section" });
    let kernels = EncodeOptions { kernels: vec![Kernel::Haar], n_levels: Some(2), ..EncodeOptions::default() };
    let brick = encode(UVec3::splat(16), &ramp, &kernels).unwrap();
    assert_eq!(decode_level::<u16>(&brick, Level(3)).unwrap_err(), DecodeError::Level { level: 3, coarsest: 2 });
}

/// A few bytes cannot make a program allocate more than the format's bound.
#[test]
fn an_extent_beyond_the_bound_is_an_error() {
    let one = encode(UVec3::ONE, &[7u8], &EncodeOptions::default()).unwrap();
    let huge = [0xff, 0xff, 0xff, 0xff, 0x0f];
    let mut forged = [&one[..5], &huge, &huge, &huge, &one[8..one.len() - 4]].concat();
    forged.extend(crc32c::crc32c(&forged).to_le_bytes());
    let error = decode::<u8>(&forged).unwrap_err();
    assert!(matches!(error, DecodeError::Extent(_)), "{error}");
    assert_eq!(BrickHeader::read(&one).unwrap().storage(), Storage::OneValue);
    assert!(BrickHeader::read(&forged).is_err());
}

/// Noise is raw; a slope, all of whose details are 0, is packed; numbers that are mostly small are coded.
#[test]
fn storages_are_chosen_by_content() {
    let storage = |samples: &[u8], storages| {
        let options = EncodeOptions { storages, ..EncodeOptions::default() };
        BrickHeader::read(&encode(UVec3::new(64, 8, 8), samples, &options).unwrap()).unwrap().storage()
    };
    let mut state = 1u32;
    let mut noise = |bits: u32| {
        (0..4096)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> (32 - bits)) as u8
            })
            .collect::<Vec<u8>>()
    };
    assert_eq!(storage(&noise(8), Storages::Smallest), Storage::Raw);
    assert_eq!(storage(&noise(8), Storages::Packed), Storage::Raw);
    assert_eq!(storage(&noise(3), Storages::Packed), Storage::Packed);
    let slope: Vec<u8> = (0..4096).map(|i| (i % 64 + i / 512) as u8).collect();
    assert_eq!(storage(&slope, Storages::Smallest), Storage::Packed);
    let mostly_small: Vec<u8> = noise(8).into_iter().map(|n| n.leading_zeros() as u8).collect();
    assert_eq!(storage(&mostly_small, Storages::Smallest), Storage::Coded);
}

/// Bricks to begin fuzzing with; written only where `BRICKFIELD_FUZZ_SEEDS` names a folder.
#[test]
fn seeds_are_bricks() {
    let folder =
        std::env::var_os("BRICKFIELD_FUZZ_SEEDS").map(|folder| std::path::PathBuf::from(folder).join("decode"));
    if let Some(folder) = &folder {
        std::fs::create_dir_all(folder).expect("a folder that can be written");
    }
    for (i, kernel) in Kernel::ALL.into_iter().enumerate() {
        for storages in [Storages::Smallest, Storages::Packed] {
            let options = EncodeOptions { kernels: vec![kernel], storages, ..EncodeOptions::default() };
            let bricks = [seed::<u8>(&options), seed::<i16>(&options), seed::<u32>(&options)];
            for (j, brick) in bricks.into_iter().enumerate() {
                assert!(BrickHeader::read(&brick).is_ok());
                if let Some(folder) = &folder {
                    std::fs::write(folder.join(format!("{i}-{storages:?}-{j}")), brick)
                        .expect("a file that can be written");
                }
            }
        }
    }
}

fn seed<T: Sample>(options: &EncodeOptions) -> Vec<u8> {
    let samples: Vec<T> = (0..9 * 8 * 7).map(|i: i64| T::saturate(i * i / 100 % 90 + i % 9 / 8 * 70_000)).collect();
    encode(UVec3::new(9, 8, 7), &samples, options).expect("a brick")
}
