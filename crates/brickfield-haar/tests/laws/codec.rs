//! Bricks are decoded as they were encoded.

use brickfield_core::Level;
use brickfield_core::glam::UVec3;
use brickfield_haar::{
    Bands, BrickHeader, Coefficient, DecodeError, EncodeError, EncodeOptions, Kernel, Loss, LowBand, Sample, Storage,
    decode, decode_bricks, decode_level, decode_with_low, encode, encode_bricks,
};
use proptest::prelude::*;

use crate::bricks::{bricks, hold, name, options};
use crate::for_all_types;

fn bricks_are_lossless<T: Sample>() {
    hold(300, (bricks::<T>(), options()), |((extent, samples), options)| {
        let brick = encode(extent, &samples, &options).expect("options within bounds");
        let decoded = decode::<T>(&brick).map_err(|e| TestCaseError::fail(format!("{}: {e}", name::<T>())))?;
        prop_assert_eq!(decoded.extent, extent);
        prop_assert!(decoded.samples == samples);
        let header = BrickHeader::read(&brick).expect("a header");
        prop_assert_eq!((header.max_error(), header.scalar(), header.extent()), (0, T::TYPE, extent));
        prop_assert!(brick.len() <= samples.len() * T::TYPE.n_bytes() + 40, "{} bytes", brick.len());
        Ok(())
    });
}
for_all_types!(bricks_are_lossless);

/// A level needs a prefix of the brick, and is the band of that level.
fn levels_are_low_bands<T: Sample>() {
    hold(100, (bricks::<T>(), options(), 0..5u8), |((extent, samples), options, level)| {
        let brick = encode(extent, &samples, &options).expect("options within bounds");
        let header = BrickHeader::read(&brick).expect("a header");
        let level = Level(level);
        let prefix = &brick[..header.n_bytes_of_level(level)];
        let has_bands = matches!(header.storage(), Storage::Coded | Storage::Packed) && header.kernel().has_bands();
        let Ok(decoded) = decode_level::<T>(prefix, level) else {
            prop_assert!(level.0 > header.coarsest_level());
            return Ok(());
        };
        let kernel = if has_bands { header.kernel() } else { Kernel::Haar };
        let bands = Bands::of_samples(kernel, extent, &samples, level.0).expect("a brick within bounds");
        prop_assert_eq!(decoded.extent, level.dims_of(extent));
        let expected: Vec<i64> = bands.low().iter().map(|&c| T::saturate(Coefficient::to_i64(c)).to_i64()).collect();
        let found: Vec<i64> = decoded.samples.iter().map(|s| s.to_i64()).collect();
        prop_assert_eq!(found, expected);
        {
            prop_assert!(decode_level::<T>(&prefix[..prefix.len() - 1], level).is_err());
        }
        Ok(())
    });
}
for_all_types!(levels_are_low_bands);

fn errors_keep_to_their_bound<T: Sample>() {
    let most = prop_oneof![0..20u32, 0..70_000u32, 0..=i32::MAX as u32];
    hold(300, (bricks::<T>(), options(), most), |((extent, samples), options, most)| {
        let options = EncodeOptions { loss: Loss::MaxError(most), ..options };
        let brick = encode(extent, &samples, &options).expect("options within bounds");
        let header = BrickHeader::read(&brick).expect("a header");
        let decoded = decode::<T>(&brick).map_err(|e| TestCaseError::fail(e.to_string()))?.samples;
        let error = samples.iter().zip(&decoded).map(|(a, b)| a.to_i64().abs_diff(b.to_i64())).max();
        prop_assert_eq!(error, Some(u64::from(header.max_error())));
        prop_assert!(header.max_error() <= most);
        Ok(())
    });
}
for_all_types!(errors_keep_to_their_bound);

fn thresholds_say_their_error<T: Sample>() {
    let kernels = vec![Kernel::Haar, Kernel::HaarPredicted, Kernel::LeGall53];
    hold(100, (bricks::<T>(), options(), 0..200u32), |((extent, samples), options, bound)| {
        let options = EncodeOptions { kernels: kernels.clone(), loss: Loss::Threshold(bound), ..options };
        let brick = encode(extent, &samples, &options).expect("options within bounds");
        let header = BrickHeader::read(&brick).expect("a header");
        let decoded = decode::<T>(&brick).map_err(|e| TestCaseError::fail(e.to_string()))?.samples;
        let error = samples.iter().zip(&decoded).map(|(a, b)| a.to_i64().abs_diff(b.to_i64())).max();
        prop_assert_eq!(error, Some(u64::from(header.max_error())));
        let has_bands = matches!(header.storage(), Storage::Coded | Storage::Packed);
        if has_bands {
            let mut bands = Bands::of_samples(header.kernel(), extent, &samples, header.n_levels()).expect("a brick");
            bands.threshold(u64::from(bound));
            let expected: Vec<T> =
                bands.into_level(Level(0)).into_iter().map(|c| T::saturate(Coefficient::to_i64(c))).collect();
            prop_assert!(decoded == expected);
        }
        Ok(())
    });
}
for_all_types!(thresholds_say_their_error);

/// Bricks with different averaging kernels make one pyramid.
#[test]
fn averaging_kernels_agree_on_levels() {
    hold(100, bricks::<i16>(), |(extent, samples)| {
        let level = |kernel, level| {
            let options = EncodeOptions { kernels: vec![kernel], n_levels: Some(2), ..EncodeOptions::default() };
            let brick = encode(extent, &samples, &options).expect("options within bounds");
            decode_level::<i16>(&brick, Level(level)).expect("a level of two").samples
        };
        for l in 1..=2 {
            let haar = level(Kernel::Haar, l);
            prop_assert!(level(Kernel::HaarPredicted, l) == haar && level(Kernel::Median, l) == haar);
        }
        Ok(())
    });
}

#[test]
fn one_value_costs_a_few_bytes() {
    let brick = encode(UVec3::splat(32), &[1000u16; 32 * 32 * 32], &EncodeOptions::default()).unwrap();
    assert!(brick.len() <= 16, "{} bytes", brick.len());
    assert_eq!(decode::<u16>(&brick).unwrap().samples, [1000; 32 * 32 * 32]);
    let nearly: Vec<u16> = (0..32 * 32 * 32).map(|i| 1000 + i % 3).collect();
    let options = EncodeOptions { loss: Loss::MaxError(1), ..EncodeOptions::default() };
    let brick = encode(UVec3::splat(32), &nearly, &options).unwrap();
    assert_eq!(decode::<u16>(&brick).unwrap().samples, [1001; 32 * 32 * 32]);
    assert_eq!(BrickHeader::read(&brick).unwrap().max_error(), 1);
}

#[test]
fn options_out_of_bounds_are_named() {
    let error = |options: EncodeOptions| encode(UVec3::ONE, &[1u8], &options).unwrap_err();
    let default = EncodeOptions::default;
    assert_eq!(error(EncodeOptions { kernels: vec![], ..default() }), EncodeError::NoKernel);
    let levels = error(EncodeOptions { n_levels: Some(16), ..default() });
    assert_eq!(levels.to_string(), "16 levels of a brick; at most 15 can be stored");
    let most = error(EncodeOptions { loss: Loss::MaxError(1 << 31), ..default() });
    assert_eq!(most.to_string(), "a greatest error of 2147483648; at most 2147483647 can be asked for");
    let threshold = error(EncodeOptions { loss: Loss::Threshold(9), ..default() });
    assert_eq!(threshold, EncodeError::NoDetails { threshold: 9 });
    let samples = encode(UVec3::ONE, &[1u8; 2], &default()).unwrap_err();
    assert_eq!(samples.to_string(), "a brick of [1, 1, 1] has 1 samples, but 2 are given");
}

#[test]
fn bricks_of_all_threads_are_those_of_one() {
    hold(20, prop::collection::vec(bricks::<u8>(), 0..6), |bricks| {
        let options = EncodeOptions::default();
        let encoded = encode_bricks(&bricks, &options).expect("options within bounds");
        let decoded = decode_bricks::<u8>(&encoded).expect("bricks");
        for ((extent, samples), (encoded, decoded)) in bricks.iter().zip(encoded.iter().zip(decoded)) {
            prop_assert!(*encoded == encode(*extent, samples, &options).expect("options within bounds"));
            prop_assert!(decoded.extent == *extent && decoded.samples == *samples);
        }
        Ok(())
    });
    let error = encode_bricks(&[(UVec3::ONE, vec![1u8]), (UVec3::ZERO, vec![])], &EncodeOptions::default());
    assert!(matches!(error, Err(EncodeError::Extent(_))));
    assert!(decode_bricks::<u8>(&[b"no brick"]).is_err());
}

/// The mean of each 2 x 2 x 2 samples, fewer at the upper ends, rounded to the nearest, halves up; by the definition.
fn means<T: Sample>(extent: UVec3, samples: &[T]) -> Vec<T> {
    let n = Level(1).dims_of(extent);
    let mut sums = vec![(0i64, 0i64); n.element_product() as usize];
    for (i, sample) in (0..).zip(samples) {
        let cell = UVec3::new(i % extent.x, i / extent.x % extent.y, i / extent.x / extent.y) / 2;
        let sum = &mut sums[(cell.x + n.x * (cell.y + n.y * cell.z)) as usize];
        *sum = (sum.0 + sample.to_i64(), sum.1 + 1);
    }
    sums.into_iter().map(|(sum, n)| T::saturate((2 * sum + n).div_euclid(2 * n))).collect()
}

/// A brick without its low band is made whole by the means that are level 1 of any pyramid.
fn low_bands_may_be_elsewhere<T: Sample>() {
    let one = |kernel| vec![kernel];
    let kernels = vec![vec![Kernel::Haar, Kernel::HaarPredicted], one(Kernel::Haar), one(Kernel::HaarPredicted)];
    let n_levels = prop::sample::select(vec![None, Some(1)]);
    let cases = (bricks::<T>(), options(), prop::sample::select(kernels), n_levels);
    hold(100, cases, |((extent, samples), options, kernels, n_levels)| {
        let options = EncodeOptions { kernels, n_levels, low_band: LowBand::Elsewhere, ..options };
        let brick = encode(extent, &samples, &options).expect("options within bounds");
        let header = BrickHeader::read(&brick).expect("a header");
        let low = means(extent, &samples);
        let decoded = decode_with_low(&brick, &low).map_err(|e| TestCaseError::fail(e.to_string()))?;
        prop_assert!(decoded.extent == extent && decoded.samples == samples);
        let has_bands = matches!(header.storage(), Storage::Coded | Storage::Packed);
        prop_assert_eq!(header.low_band() == LowBand::Elsewhere, has_bands);
        if has_bands {
            prop_assert_eq!(decode::<T>(&brick).err(), Some(DecodeError::LowBandElsewhere));
            let expected = Some(DecodeError::LowBand { expected: low.len(), given: low.len() - 1 });
            prop_assert_eq!(decode_with_low(&brick, &low[1..]).err(), expected);
        }
        Ok(())
    });
}
for_all_types!(low_bands_may_be_elsewhere);

#[test]
fn a_low_band_elsewhere_needs_bands_without_loss() {
    let haar = || EncodeOptions {
        kernels: vec![Kernel::Haar],
        n_levels: Some(1),
        low_band: LowBand::Elsewhere,
        ..EncodeOptions::default()
    };
    let error = |options: EncodeOptions| encode(UVec3::splat(2), &[1u8; 8], &options).unwrap_err();
    for kernel in [Kernel::LeGall53, Kernel::Median] {
        let kernels = vec![Kernel::Haar, kernel];
        assert_eq!(error(EncodeOptions { kernels, ..haar() }), EncodeError::NoLowBand { kernel });
    }
    for given in [0, 2] {
        let options = EncodeOptions { n_levels: Some(given), ..haar() };
        assert_eq!(error(options), EncodeError::LevelsBelowMeans { given });
    }
    let loss = Loss::MaxError(1);
    assert_eq!(error(EncodeOptions { loss, ..haar() }), EncodeError::LossyLowBand { loss });
}
