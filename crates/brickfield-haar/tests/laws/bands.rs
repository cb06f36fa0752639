//! Bands lead back to the samples, and the low band is the next level.

use brickfield_core::Level;
use brickfield_core::glam::UVec3;
use brickfield_haar::{Bands, Coefficient, ExtentError, Kernel, MAX_LEVELS, Sample, TransformError};
use proptest::prelude::*;

use crate::bricks::{bricks, hold};
use crate::for_all_types;

const WITH_BANDS: [Kernel; 3] = [Kernel::Haar, Kernel::HaarPredicted, Kernel::LeGall53];

fn bands_are_reversible<T: Sample>() {
    hold(200, (bricks::<T>(), 0..=MAX_LEVELS), |((extent, samples), n_levels)| {
        for kernel in WITH_BANDS {
            let bands = Bands::of_samples(kernel, extent, &samples, n_levels).expect("a brick within bounds");
            let back = bands.into_level(Level(0));
            prop_assert!(back.iter().zip(&samples).all(|(&c, &s)| T::holds(c) && T::truncate(c) == s), "{}", kernel);
        }
        Ok(())
    });
}
for_all_types!(bands_are_reversible);

/// The floors of averages along x, then y, then z; the last sample of an odd axis as it is.
fn averages(extent: UVec3, samples: &[i64]) -> Vec<i64> {
    let mut n = extent.to_array().map(|n| n as usize);
    let mut array = samples.to_vec();
    for axis in 0..3 {
        let mut half = n;
        half[axis] = n[axis].div_ceil(2);
        let value = |i: [usize; 3]| array[i[0] + n[0] * (i[1] + n[1] * i[2])];
        let mut next = Vec::new();
        for z in 0..half[2] {
            for y in 0..half[1] {
                for x in 0..half[0] {
                    let (mut a, mut b) = ([x, y, z], [x, y, z]);
                    a[axis] *= 2;
                    b[axis] = a[axis] + 1;
                    let a = value(a);
                    next.push(if b[axis] < n[axis] { (a + value(b)).div_euclid(2) } else { a });
                }
            }
        }
        (n, array) = (half, next);
    }
    array
}

fn low_bands_are_averages<T: Sample>() {
    hold(100, bricks::<T>(), |(extent, samples)| {
        let mut expected: Vec<i64> = samples.iter().map(|s| s.to_i64()).collect();
        for n_levels in 1..4u8 {
            expected = averages(Level(n_levels - 1).dims_of(extent), &expected);
            for kernel in [Kernel::Haar, Kernel::HaarPredicted] {
                let bands = Bands::of_samples(kernel, extent, &samples, n_levels).expect("a brick within bounds");
                let low: Vec<i64> = bands.low().iter().map(|c| c.to_i64()).collect();
                prop_assert_eq!(&low, &expected, "{}, level {}", kernel, n_levels);
                prop_assert!(bands.low().iter().all(|&c| T::holds(c)));
                let level = bands.into_level(Level(n_levels));
                prop_assert_eq!(level.len(), expected.len());
            }
        }
        Ok(())
    });
}
for_all_types!(low_bands_are_averages);

/// Coarser levels are the same however many are made, and a level between is computed from bands.
#[test]
fn levels_between_come_from_bands() {
    hold(100, bricks::<u16>(), |(extent, samples)| {
        for kernel in WITH_BANDS {
            let of = |n| Bands::of_samples(kernel, extent, &samples, n).expect("a brick within bounds");
            prop_assert_eq!(of(3).into_level(Level(1)), of(1).into_level(Level(1)), "{}", kernel);
        }
        Ok(())
    });
}

/// The paper's own example of a line of eight: averages 8 4 6 5 and details, here the differences a - b.
#[test]
fn the_line_of_the_paper() {
    let line = [9u8, 7, 3, 5, 9, 3, 1, 9];
    let bands = Bands::of_samples(Kernel::Haar, UVec3::new(8, 1, 1), &line, 1).unwrap();
    assert_eq!(bands.low(), [8, 4, 6, 5]);
}

/// The details of a line 0, 3, 6, ... are its slope; minus their prediction they are 0 but at the ends' rounding.
#[test]
fn a_slope_is_predicted() {
    let line: Vec<u16> = (0..32).map(|x| 4 * x).collect();
    let extent = UVec3::new(32, 1, 1);
    let n_small = |kernel| {
        let mut bands = Bands::of_samples(kernel, extent, &line, 1).unwrap();
        bands.threshold(u64::MAX)
    };
    assert_eq!((n_small(Kernel::Haar), n_small(Kernel::HaarPredicted), n_small(Kernel::LeGall53)), (16, 0, 1));
}

#[test]
fn extents_out_of_bounds_are_named() {
    let of = |extent, n_levels, kernel| Bands::of_samples(kernel, extent, &[0u8; 4], n_levels).unwrap_err();
    let empty = UVec3::new(2, 0, 2);
    assert_eq!(of(empty, 1, Kernel::Haar), TransformError::Extent(ExtentError { extent: empty }));
    assert!(matches!(of(UVec3::splat(u32::MAX), 1, Kernel::Haar), TransformError::Extent(_)));
    let short = of(UVec3::new(5, 1, 1), 1, Kernel::Haar);
    assert_eq!(short.to_string(), "a brick of [5, 1, 1] has 5 samples, but 4 are given");
    let line = UVec3::new(4, 1, 1);
    assert_eq!(of(line, 16, Kernel::Haar).to_string(), "16 levels of a brick; at most 15 can be made");
    assert_eq!(of(line, 1, Kernel::Median).to_string(), "the kernel median has no bands");
}
