//! Bricks of random extents and of several kinds of content.

use brickfield_core::Scalar;
use brickfield_core::glam::UVec3;
use brickfield_haar::{EncodeOptions, Kernel, Loss, LowBand, Sample, Storages};
use proptest::prelude::*;

/// The least and the greatest sample of a type, as i64.
pub(crate) fn range<T: Sample>() -> (i64, i64) {
    (T::saturate(i64::MIN).to_i64(), T::saturate(i64::MAX).to_i64())
}

/// Extents from 1 to 70 along each axis, of at most 6,000 samples.
pub(crate) fn extents() -> impl Strategy<Value = UVec3> {
    let any = (1..=70u32, 1..=70u32, 1..=70u32, 0..6usize);
    any.prop_map(|(x, y, z, order)| {
        let (y, z) = (y.min((6000 / x).max(1)), z);
        let z = z.min((6000 / (x * y)).max(1));
        let orders = [[x, y, z], [x, z, y], [y, x, z], [y, z, x], [z, x, y], [z, y, x]];
        UVec3::from_array(orders[order])
    })
}

/// Samples of a brick: noise of all values, the two extremes only, one value, smooth, smooth with noise, mostly one value.
pub(crate) fn samples<T: Sample>(extent: UVec3) -> impl Strategy<Value = Vec<T>> {
    let n = extent.element_product() as usize;
    (0..6u8, any::<u64>(), any::<i64>()).prop_map(move |(kind, seed, value)| {
        let (least, greatest) = range::<T>();
        let mut random = Random(seed);
        let at = |i: usize| {
            let i = i as u32;
            [i % extent.x, i / extent.x % extent.y, i / extent.x / extent.y].map(i64::from)
        };
        let mut sample = |i: usize| {
            let noise = random.next();
            let [x, y, z] = at(i);
            let smooth = value % 1000 + 3 * x - 2 * y + z * (x + y) / 16;
            match kind {
                0 => least + (noise % (greatest - least + 1) as u64) as i64,
                1 => [least, greatest][(noise & 1) as usize],
                2 => value.clamp(least, greatest),
                3 => smooth,
                4 => smooth + (noise % 7) as i64,
                _ => {
                    if noise.is_multiple_of(50) {
                        (noise >> 8) as i64 % 300
                    } else {
                        5
                    }
                }
            }
        };
        (0..n).map(|i| T::saturate(sample(i))).collect()
    })
}

/// A brick: extent and samples.
pub(crate) fn bricks<T: Sample>() -> impl Strategy<Value = (UVec3, Vec<T>)> {
    extents().prop_flat_map(|extent| (Just(extent), samples(extent)))
}

/// Any lossless options.
pub(crate) fn options() -> impl Strategy<Value = EncodeOptions> {
    let kernels = prop_oneof![
        Just(Kernel::ALL.to_vec()),
        Just(Kernel::AVERAGING.to_vec()),
        prop::sample::select(Kernel::ALL.to_vec()).prop_map(|kernel| vec![kernel]),
    ];
    let storages = prop::sample::select(vec![Storages::Smallest, Storages::Packed]);
    let n_levels = prop_oneof![Just(None), (0..=15u8).prop_map(Some)];
    (kernels, storages, n_levels).prop_map(|(kernels, storages, n_levels)| EncodeOptions {
        kernels,
        storages,
        n_levels,
        loss: Loss::None,
        low_band: LowBand::Stored,
    })
}

/// SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
}

/// Runs a generic function for each of the six sample types.
#[macro_export]
macro_rules! for_all_types {
    ($law:ident) => {
        mod $law {
            #[test]
            fn of_u8() {
                super::$law::<u8>();
            }
            #[test]
            fn of_i8() {
                super::$law::<i8>();
            }
            #[test]
            fn of_u16() {
                super::$law::<u16>();
            }
            #[test]
            fn of_i16() {
                super::$law::<i16>();
            }
            #[test]
            fn of_u32() {
                super::$law::<u32>();
            }
            #[test]
            fn of_i32() {
                super::$law::<i32>();
            }
        }
    };
}

/// Runs a law on many cases of a strategy.
pub(crate) fn hold<S: Strategy>(n_cases: u32, strategy: S, law: impl Fn(S::Value) -> Result<(), TestCaseError>) {
    let mut runner = proptest::test_runner::TestRunner::new(ProptestConfig::with_cases(n_cases));
    if let Err(error) = runner.run(&strategy, law) {
        panic!("{error}");
    }
}

/// The type's name, for messages.
pub(crate) fn name<T: Scalar>() -> &'static str {
    T::TYPE.name()
}
