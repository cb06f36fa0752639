//! The laws of levels that come slice by slice, against a slow computation and against blocks in memory.

mod noise;

use std::sync::Arc;

use brickfield_bricks::{
    BlockOptions, BlockSource, Pyramid, SliceError, average_box, block_summaries, build_blocks, coarsest_level,
    fetch_values, level_dims,
};
use brickfield_core::glam::UVec3;
use brickfield_core::{BlockSide, Level, Scalar, ScalarType, Volume, Voxels, with_voxels};
use noise::{index, noise, points};
use proptest::prelude::*;

fn dims() -> impl Strategy<Value = UVec3> {
    let thick = [1u32..70, 1u32..40, 1u32..40].prop_map(UVec3::from);
    let thin = (1u32..300, 1u32..4, 0usize..3).prop_map(|(long, short, turn)| {
        let mut dims = [long, short, 1];
        dims.rotate_right(turn);
        UVec3::from(dims)
    });
    prop_oneof![thick, thin]
}

fn volumes() -> impl Strategy<Value = Volume> {
    (dims(), 0usize..8, any::<u64>()).prop_map(|(dims, scalar, seed)| noise(dims, ScalarType::ALL[scalar], seed))
}

/// Some samples in a row.
fn part(voxels: &Voxels, start: usize, n: usize) -> Voxels {
    fn of<T: Scalar>(v: &[T]) -> Voxels {
        T::wrap(v.to_vec())
    }
    with_voxels!(voxels, v => of(&v[start..start + n]))
}

/// All slices of every level above 0, one after the other, from pushes of `n_at_once` slices.
fn levels_of(volume: &Volume, coarsest: Level, n_at_once: usize) -> Vec<Vec<f64>> {
    let dims = volume.grid().dims();
    let n_slice = dims.x as usize * dims.y as usize;
    let mut pyramid = Pyramid::new(dims, volume.scalar_type(), coarsest);
    let mut levels = vec![Vec::new(); usize::from(coarsest.0)];
    for z in (0..dims.z as usize).step_by(n_at_once) {
        assert!(!pyramid.is_complete());
        let n_slices = n_at_once.min(dims.z as usize - z);
        let slices = part(volume.voxels(), z * n_slice, n_slices * n_slice);
        let mut keep = |Level(l): Level, slice: Voxels| {
            levels[usize::from(l) - 1].extend((0..slice.len()).map(|i| slice.at(i)));
        };
        pyramid.push(&slices, &mut keep).unwrap();
    }
    assert!(pyramid.is_complete());
    levels
}

/// The voxels that a sample covers.
fn covered(dims: UVec3, level: Level, sample: UVec3) -> Vec<usize> {
    let first = sample * level.stride();
    let end = (first + level.stride()).min(dims);
    points(end - first).map(|p| index(dims, first + p)).collect()
}

/// The mean, and how far f64 may be from it.
fn mean(volume: &Volume, voxels: &[usize]) -> (f64, f64) {
    let stored = || voxels.iter().map(|i| volume.voxels().at(*i));
    match volume.scalar_type() {
        ScalarType::F32 => ((stored().sum::<f64>() / voxels.len() as f64) as f32 as f64, 1e3 * f64::from(f32::EPSILON)),
        ScalarType::F64 => (stored().sum::<f64>() / voxels.len() as f64, 1e-14 * 1e-3),
        _ => {
            let (sum, n) = (stored().map(|v| v as i128).sum::<i128>(), voxels.len() as i128);
            ((2 * sum + n).div_euclid(2 * n) as f64, 0.0)
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn samples_of_every_level_are_means_of_the_voxels_that_they_cover(volume in volumes(), n_at_once in 1usize..40) {
        let (dims, coarsest) = (volume.grid().dims(), Level(coarsest_level(volume.grid().dims()).0.max(7)));
        for (l, samples) in (1..).zip(levels_of(&volume, coarsest, n_at_once)) {
            let n = level_dims(dims, Level(l));
            prop_assert_eq!(samples.len(), n.element_product() as usize);
            for (value, sample) in samples.into_iter().zip(points(n)) {
                let (expected, tolerance) = mean(&volume, &covered(dims, Level(l), sample));
                prop_assert!((value - expected).abs() <= tolerance, "level {l} at {sample}: {value} for {expected}");
            }
        }
    }

    #[test]
    fn they_are_the_samples_of_blocks(volume in volumes()) {
        let dims = volume.grid().dims();
        let levels = levels_of(&volume, Level(5), 3);
        let options = BlockOptions { side: BlockSide::V32, max_bytes: None };
        let source = build_blocks(Arc::new(volume.clone()), &options).unwrap();
        let tolerance = if volume.scalar_type() == ScalarType::F64 { 1e-18 } else { 0.0 };
        for (l, samples) in (1..).zip(levels) {
            let n = level_dims(dims, Level(l));
            for block in source.layout().blocks() {
                let first = source.layout().first_voxel(block) >> u32::from(l);
                let of_block = fetch_values(&source, block, Level(l)).unwrap();
                for (p, value) in points(source.layout().n_samples(block, Level(l))).zip(of_block) {
                    prop_assert!((samples[index(n, first + p)] - value).abs() <= tolerance, "level {l}, {block}, {p}");
                }
            }
        }
    }

    #[test]
    fn summaries_of_slices_are_those_of_the_volume(volume in volumes()) {
        let dims = volume.grid().dims();
        let n_slice = dims.x as usize * dims.y as usize;
        for side in BlockSide::ALL {
            let options = BlockOptions { side, max_bytes: None };
            let source = build_blocks(Arc::new(volume.clone()), &options).unwrap();
            let mut found = Vec::new();
            for z in (0..dims.z).step_by(32) {
                let n_slices = 32.min(dims.z - z);
                let slices = part(volume.voxels(), z as usize * n_slice, n_slices as usize * n_slice);
                found.extend(block_summaries(&slices, dims.with_z(n_slices), side, volume.rescale()).unwrap());
            }
            prop_assert_eq!(&found[..], source.summaries());
        }
    }

    #[test]
    fn averages_of_averages_weigh_the_voxels_that_they_cover(
        volume in volumes(), shifts in [0u32..4, 0u32..4, 0u32..4], more in 0u8..3,
    ) {
        let (dims, level) = (volume.grid().dims(), Level(shifts.into_iter().max().unwrap() as u8 + more));
        // Averages that are not rounded.
        let stored = |voxels: &[usize]| voxels.iter().map(|i| volume.voxels().at(*i)).sum::<f64>() / voxels.len() as f64;
        let shifts = UVec3::from(shifts);
        let stride = UVec3::ONE << shifts;
        let fine = points((dims + stride - 1) / stride).map(|sample| {
            let first = sample * stride;
            let n = stride.min(dims - first);
            stored(&points(n).map(|p| index(dims, first + p)).collect::<Vec<_>>())
        });
        let averaged = average_box(&Voxels::F64(fine.collect()), dims, shifts, level).unwrap();
        let greatest = volume.range().max.abs().max(volume.range().min.abs());
        for (i, sample) in points(level_dims(dims, level)).enumerate() {
            let expected = stored(&covered(dims, level, sample));
            prop_assert!((averaged.at(i) - expected).abs() <= 1e-13 * greatest, "{} for {expected}", averaged.at(i));
        }
        // Of voxels, they are rounded as all averages are.
        let averaged = average_box(volume.voxels(), dims, UVec3::ZERO, level).unwrap();
        for (i, sample) in points(level_dims(dims, level)).enumerate() {
            let (expected, tolerance) = mean(&volume, &covered(dims, level, sample));
            prop_assert!((averaged.at(i) - expected).abs() <= tolerance, "{} for {expected}", averaged.at(i));
        }
    }
}

#[test]
fn slices_that_are_none_of_the_volume_are_refused() {
    let dims = UVec3::new(4, 3, 2);
    let mut pyramid = Pyramid::new(dims, ScalarType::U8, Level(2));
    let mut push = |slices: Voxels| pyramid.push(&slices, &mut |_, _| {});
    assert_eq!(push(vec![0u16; 12].into()), Err(SliceError::Type { found: ScalarType::U16, expected: ScalarType::U8 }));
    assert_eq!(push(vec![0u8; 13].into()), Err(SliceError::Ragged { n_samples: 13, dims }));
    assert_eq!(push(vec![0u8; 12].into()), Ok(()));
    assert_eq!(push(vec![0u8; 24].into()).unwrap_err().to_string(), "3 slices; the volume has 2");
    assert_eq!(push(vec![0u8; 12].into()), Ok(()));
    assert!(pyramid.is_complete());
}
