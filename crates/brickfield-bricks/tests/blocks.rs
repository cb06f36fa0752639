//! The laws of flat blocks, each against a slow computation of its own.

mod noise;

use std::error::Error;
use std::sync::Arc;

use brickfield_bricks::{
    BlockBuildError, BlockOptions, BlockSource, BlockVolume, NoSuchBlock, block_memory, build_blocks, fetch_values,
    greatest_gradient, greatest_spread,
};
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{
    BlockLayout, BlockSide, BlockSummary, Companion, Grid, Level, N_BLOCK_BINS, Rescale, ScalarType, ValueRange,
    Volume, Voxels,
};
use noise::{index, noise, points, volume};
use proptest::prelude::*;

fn blocks(volume: &Volume, side: BlockSide) -> BlockVolume {
    build_blocks(Arc::new(volume.clone()), &BlockOptions { side, max_bytes: None }).unwrap()
}

fn all(layout: &BlockLayout) -> impl Iterator<Item = (UVec3, Level)> {
    let side = layout.side();
    layout.blocks().flat_map(move |block| side.levels().map(move |level| (block, level)))
}

/// The gradient at a voxel along the grid's axes, in data values per world unit; beyond the volume's faces its outer voxels are repeated.
fn sobel(volume: &Volume, i: usize) -> DVec3 {
    let dims = volume.grid().dims().as_ivec3();
    let p = (0..3).scan(i as i32, |rest, axis| {
        let at = *rest % dims[axis];
        *rest /= dims[axis];
        Some(at)
    });
    let p: Vec<i32> = p.collect();
    let along = [0, 1, 2].map(|axis: usize| {
        let value = |way: i32, j: i32, k: i32| {
            let mut q = [p[0], p[1], p[2]];
            (q[axis], q[(axis + 1) % 3], q[(axis + 2) % 3]) =
                (q[axis] + way, q[(axis + 1) % 3] + j, q[(axis + 2) % 3] + k);
            let [x, y, z] = [0, 1, 2].map(|a| q[a].clamp(0, dims[a] - 1));
            volume.value((x + dims.x * (y + dims.y * z)) as usize)
        };
        let distance = (p[axis] + 1).min(dims[axis] - 1) - (p[axis] - 1).max(0);
        let across = (-1..=1).flat_map(|j: i32| (-1..=1).map(move |k: i32| (j, k)));
        let weighted =
            across.map(|(j, k)| f64::from((2 - j.abs()) * (2 - k.abs())) / 16.0 * (value(1, j, k) - value(-1, j, k)));
        weighted.sum::<f64>() / f64::from(distance.max(1)) / volume.grid().spacing()[axis]
    });
    DVec3::from(along)
}

/// A stored gradient in parts of the greatest.
fn decoded([x, y, z, root]: [u8; 4]) -> DVec3 {
    let direction = (DVec3::new(x.into(), y.into(), z.into()) - 127.0) / 127.0;
    direction * (f64::from(root) / 255.0).powi(2)
}

fn dims() -> impl Strategy<Value = UVec3> {
    let thick = [1u32..40, 1u32..36, 1u32..36].prop_map(UVec3::from);
    let thin = (1u32..200, 1u32..4, 0usize..3).prop_map(|(long, short, turn)| {
        let mut dims = [long, short, 1];
        dims.rotate_right(turn);
        UVec3::from(dims)
    });
    prop_oneof![2 => thick, 1 => thin]
}

fn side() -> impl Strategy<Value = BlockSide> {
    (0usize..3).prop_map(|i| BlockSide::ALL[i])
}

fn rescale() -> impl Strategy<Value = Rescale> {
    let any = prop_oneof![Just((1.0, 0.0)), (0.1..3.0, -2000.0..2000.0), (-3.0..-0.1, -2000.0..2000.0)];
    any.prop_map(|(slope, intercept)| Rescale::new(slope, intercept).unwrap())
}

/// Volumes of every type, with and without a map of their values.
fn volumes() -> impl Strategy<Value = Volume> {
    (dims(), 0usize..8, any::<u64>(), rescale()).prop_map(|(dims, scalar, seed, rescale)| {
        let stored = noise(dims, ScalarType::ALL[scalar], seed);
        Volume::rescaled(*stored.grid(), stored.voxels().clone(), rescale).unwrap()
    })
}

/// The voxels that a sample averages.
fn covered(layout: &BlockLayout, block: UVec3, level: Level, sample: UVec3) -> impl Iterator<Item = usize> {
    let (stride, dims) = (level.stride(), layout.dims());
    let first = layout.first_voxel(block) + sample * stride;
    let end = (first + stride).min(layout.first_voxel(block) + layout.extent(block));
    points(end - first).map(move |p| index(dims, first + p))
}

/// The mean of stored integers, halves up.
fn integer_mean(volume: &Volume, voxels: &[usize]) -> f64 {
    let (sum, n) = (voxels.iter().map(|i| volume.voxels().at(*i) as i128).sum::<i128>(), voxels.len() as i128);
    (2 * sum + n).div_euclid(2 * n) as f64
}

fn float_mean(volume: &Volume, voxels: &[usize]) -> f64 {
    voxels.iter().map(|i| volume.voxels().at(*i)).sum::<f64>() / voxels.len() as f64
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn samples_are_means_of_the_voxels_that_they_cover(volume in volumes(), side in side()) {
        let source = blocks(&volume, side);
        let layout = source.layout();
        for (block, level) in all(layout) {
            let found = fetch_values(&source, block, level).unwrap();
            prop_assert_eq!(found.len(), layout.n_samples(block, level).element_product() as usize);
            for (value, sample) in found.into_iter().zip(points(layout.n_samples(block, level))) {
                let voxels: Vec<usize> = covered(layout, block, level, sample).collect();
                let (mean, tolerance) = match volume.scalar_type() {
                    ScalarType::F32 => (float_mean(&volume, &voxels) as f32 as f64, 1e3 * f64::from(f32::EPSILON)),
                    ScalarType::F64 => (float_mean(&volume, &voxels), 1e-14 * 1e-3),
                    _ => (integer_mean(&volume, &voxels), 0.0),
                };
                let (expected, tolerance) = (volume.rescale().value(mean), tolerance * volume.rescale().slope().abs());
                let rounding = if tolerance == 0.0 { 0.0 } else { 1e-15 * expected.abs() };
                prop_assert!((value - expected).abs() <= tolerance + rounding, "{value} for {expected}");
            }
        }
    }

    #[test]
    fn linear_fields_are_reproduced_where_samples_lie(dims in dims(), side in side(), slope in [-3.0..3.0, -3.0..3.0, -3.0..3.0]) {
        let field = |p: DVec3| 100.0 + DVec3::from(slope).dot(p);
        let voxels: Vec<f64> = points(dims).map(|p| field(p.as_dvec3())).collect();
        let source = blocks(&volume(dims, voxels.into()), side);
        let layout = source.layout();
        for (block, level) in all(layout) {
            let (first, last) = layout.sample_ends(block, level);
            let n = layout.n_samples(block, level);
            let values = fetch_values(&source, block, level).unwrap();
            for (value, sample) in values.into_iter().zip(points(n)) {
                let between = first + sample.as_dvec3() * f64::from(level.stride());
                let place = DVec3::select((sample + 1).cmpeq(n), last, between);
                prop_assert!((value - field(place)).abs() < 1e-11, "block {block} sample {sample} of {level:?}");
            }
        }
    }

    #[test]
    fn a_block_does_not_depend_on_voxels_outside(
        dims in dims(), side in side(), scalar in 0usize..8, seeds: (u64, u64), pick: prop::sample::Index,
    ) {
        let layout = BlockLayout::new(dims, side);
        let chosen = pick.index(layout.n_blocks_total());
        let block = layout.block(chosen);
        let end = layout.first_voxel(block) + layout.extent(block);
        let is_inside = |p: UVec3| p.cmpge(layout.first_voxel(block)).all() && p.cmplt(end).all();
        let [one, other] = [seeds.0, seeds.1].map(|seed| noise(dims, ScalarType::ALL[scalar], seed));
        let mixed = points(dims).map(|p| if is_inside(p) { &one } else { &other }.value(index(dims, p)));
        let mixed = Volume::new(*one.grid(), noise::of_type(ScalarType::ALL[scalar], mixed)).unwrap();
        let (alone, among_others) = (blocks(&one, side), blocks(&mixed, side));
        prop_assert_eq!(alone.summaries()[chosen], among_others.summaries()[chosen]);
        for level in side.levels() {
            let [a, b] = [&alone, &among_others].map(|source| fetch_values(source, block, level).unwrap());
            prop_assert_eq!(a, b);
        }
    }

    #[test]
    fn spreads_are_those_of_the_voxels_that_samples_average(volume in volumes(), side in side()) {
        let source = blocks(&volume, side);
        let (layout, greatest) = (source.layout(), greatest_spread(&source));
        for (block, level) in all(layout) {
            let mut codes = Vec::new();
            source.fetch_companion(Companion::Spread, block, level, &mut codes).unwrap();
            prop_assert_eq!(codes.len(), layout.n_samples(block, level).element_product() as usize);
            for (code, sample) in codes.into_iter().zip(points(layout.n_samples(block, level))) {
                let values: Vec<f64> = covered(layout, block, level, sample).map(|i| volume.value(i)).collect();
                let mean = values.iter().sum::<f64>() / values.len() as f64;
                let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64;
                let expected = if variance > 0.0 { variance.sqrt() / greatest * 255.0 } else { 0.0 };
                prop_assert!((f64::from(code) - expected).abs() <= 0.5 + 1e-6, "{code} for {expected}");
                prop_assert!(level > Level(0) || code == 0);
            }
        }
    }

    #[test]
    fn gradients_are_averages_of_sobels(volume in volumes(), side in side()) {
        let source = blocks(&volume, side);
        let (layout, greatest) = (source.layout(), greatest_gradient(&source));
        for (block, level) in all(layout) {
            let mut codes = Vec::new();
            source.fetch_companion(Companion::Gradient, block, level, &mut codes).unwrap();
            let n = layout.n_samples(block, level);
            prop_assert_eq!(codes.len(), 4 * n.element_product() as usize);
            for (code, sample) in codes.as_chunks().0.iter().zip(points(n)) {
                let voxels: Vec<usize> = covered(layout, block, level, sample).collect();
                let sum: DVec3 = voxels.iter().map(|i| sobel(&volume, *i)).sum();
                let expected = if greatest > 0.0 { sum / voxels.len() as f64 / greatest } else { DVec3::ZERO };
                let found = decoded(*code);
                // Half a code of the length's root, and of each component.
                let half = 0.5 / 255.0;
                let off = 2.0 * expected.length().sqrt() * half + half * half + 3f64.sqrt() * 0.5 / 127.0 * found.length();
                prop_assert!((found - expected).length() <= off + 1e-9, "{found} for {expected}");
            }
        }
    }

    #[test]
    fn summaries_are_those_of_counting(volume in volumes(), side in side()) {
        let source = blocks(&volume, side);
        for (block, summary) in source.layout().blocks().zip(source.summaries()) {
            check_summary(&volume, source.layout(), block, summary)?;
        }
    }
}

fn check_summary(
    volume: &Volume,
    layout: &BlockLayout,
    block: UVec3,
    summary: &BlockSummary,
) -> Result<(), TestCaseError> {
    let voxels: Vec<usize> = covered(layout, block, layout.side().one_sample(), UVec3::ZERO).collect();
    let values: Vec<f64> = voxels.iter().map(|i| volume.value(*i)).collect();
    let n = values.len() as f64;
    let ends = |pick: fn(f64, f64) -> f64| values.iter().copied().reduce(pick).unwrap();
    let range = ValueRange { min: ends(f64::min), max: ends(f64::max) };
    prop_assert_eq!(summary.range, range);
    let (width, mean) = (range.max - range.min, values.iter().sum::<f64>() / n);
    let near = |found: f64, expected: f64, size: f64| (found - expected).abs() <= 1e-9 * size;
    prop_assert!(near(summary.mean, mean, mean.abs().max(width)) && range.contains(summary.mean));
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n;
    prop_assert!(near(summary.variance, variance, width * width), "{} {variance}", summary.variance);
    let mut counts = [0u64; N_BLOCK_BINS];
    values.iter().for_each(|v| counts[bin(range, *v)] += 1);
    for (found, count) in summary.counts.iter().zip(counts) {
        prop_assert!((f64::from(*found) - count as f64 / n * 65_535.0).abs() <= 0.5);
        prop_assert_eq!(*found == 0, count == 0);
    }
    check_kept(volume, layout, block, summary, variance)
}

fn bin(range: ValueRange, value: f64) -> usize {
    let part = (value - range.min) / (range.max - range.min);
    ((part * N_BLOCK_BINS as f64) as usize).min(N_BLOCK_BINS - 1)
}

fn check_kept(
    volume: &Volume,
    layout: &BlockLayout,
    block: UVec3,
    summary: &BlockSummary,
    variance: f64,
) -> Result<(), TestCaseError> {
    let kept = summary.kept_variance;
    prop_assert!(kept.windows(2).all(|pair| pair[1] <= pair[0] + 1e-6), "{kept:?}");
    prop_assert!(kept[0] == 1.0 && kept[usize::from(layout.side().one_sample().0)..].iter().all(|k| *k < 1e-6));
    for level in layout.side().levels().skip(1) {
        let between = points(layout.n_samples(block, level)).map(|sample| {
            let voxels: Vec<usize> = covered(layout, block, level, sample).collect();
            let mean = voxels.iter().map(|i| volume.value(*i)).sum::<f64>() / voxels.len() as f64;
            voxels.len() as f64 * (mean - summary.mean).powi(2)
        });
        let between = between.sum::<f64>() / f64::from(layout.extent(block).element_product());
        let found = f64::from(kept[usize::from(level.0)]);
        prop_assert!(variance == 0.0 && found == 0.0 || (found - between / variance).abs() < 1e-5, "{found}");
    }
    Ok(())
}

#[test]
fn one_value_stays_that_value_at_every_level() {
    let dims = UVec3::new(35, 18, 3);
    for (scalar, value) in [
        (ScalarType::U8, 255.0),
        (ScalarType::I8, -128.0),
        (ScalarType::U16, 65_535.0),
        (ScalarType::I16, -32_768.0),
        (ScalarType::U32, f64::from(u32::MAX)),
        (ScalarType::I32, f64::from(i32::MIN)),
        (ScalarType::F32, f64::from(f32::MAX)),
        (ScalarType::F64, f64::MIN),
        (ScalarType::F64, 5e-324),
    ] {
        let source = blocks(&volume(dims, noise::of_type(scalar, points(dims).map(|_| value))), BlockSide::V16);
        for (block, level) in all(source.layout()) {
            assert!(fetch_values(&source, block, level).unwrap().iter().all(|v| *v == value), "{scalar} {value}");
        }
        assert!(source.summaries().iter().all(|s| (s.mean, s.variance, s.counts[0]) == (value, 0.0, u16::MAX)));
    }
}

#[test]
fn extremes_neither_overflow_nor_leave_the_range() {
    let dims = UVec3::new(33, 9, 9);
    let alternate = |a: f64, b: f64| points(dims).map(move |p| if p.element_sum() % 2 == 0 { a } else { b });
    for (scalar, a, b) in [
        (ScalarType::F64, f64::MAX, f64::MIN),
        (ScalarType::F64, f64::MAX, f64::MAX / 2.0),
        (ScalarType::F64, 5e-324, 1e-323),
        (ScalarType::F32, f64::from(f32::MAX), f64::from(f32::MIN)),
        (ScalarType::U32, 0.0, f64::from(u32::MAX)),
        (ScalarType::I32, f64::from(i32::MIN), f64::from(i32::MAX)),
    ] {
        for side in BlockSide::ALL {
            let source = blocks(&volume(dims, noise::of_type(scalar, alternate(a, b))), side);
            for (block, level) in all(source.layout()) {
                let range = source.summaries()[source.layout().ordinal(block)].range;
                let values = fetch_values(&source, block, level).unwrap();
                assert!(values.into_iter().all(|v| range.contains(v)), "{scalar} {a} {b}");
            }
            for summary in source.summaries() {
                assert!(summary.mean.is_finite() && summary.variance.is_finite(), "{scalar} {a} {b}");
                assert!(summary.kept_variance.iter().all(|k| (0.0..=1.0).contains(k)), "{:?}", summary.kept_variance);
            }
        }
    }
}

#[test]
fn the_voxels_are_shared() {
    let volume = Arc::new(noise(UVec3::new(20, 20, 20), ScalarType::U16, 1));
    let source = build_blocks(volume.clone(), &BlockOptions::default()).unwrap();
    assert!(Arc::ptr_eq(&volume, source.volume()));
    assert_eq!((source.range(), *source.grid()), (volume.range(), *volume.grid()));
    assert_eq!(source.id(), source.clone().id());
    assert_ne!(source.id(), blocks(&volume, BlockSide::V16).id());
}

#[test]
fn blocks_do_not_depend_on_the_number_of_threads() {
    let volume = noise(UVec3::new(70, 40, 30), ScalarType::F32, 3);
    let on = |n_threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
        pool.install(|| blocks(&volume, BlockSide::V8))
    };
    let (one, three) = (on(1), on(3));
    assert_eq!(one.summaries(), three.summaries());
    let values = |source| all(one.layout()).map(move |(block, level)| fetch_values(source, block, level).unwrap());
    assert!(values(&one).eq(values(&three)));
}

#[test]
fn what_does_not_exist_is_named() {
    let source = blocks(&noise(UVec3::new(20, 3, 1), ScalarType::U8, 0), BlockSide::V8);
    for (block, level) in [(UVec3::new(3, 0, 0), Level(0)), (UVec3::ZERO, Level(4))] {
        let error = source.fetch(block, level, &mut Vec::new()).unwrap_err();
        let said =
            format!("block ({}, 0, 0) of level {} cannot be fetched: there are 3 x 1 x 1 blocks", block.x, level.0);
        assert!(error.to_string().starts_with(&said), "{error}");
        let cause = error.source().and_then(|cause| cause.downcast_ref::<NoSuchBlock>()).unwrap();
        assert_eq!(cause.to_string(), "there are 3 x 1 x 1 blocks, of levels 0 to 3");
    }
}

#[test]
fn the_limit_is_checked_first_and_named() {
    let volume = Arc::new(noise(UVec3::new(40, 17, 50), ScalarType::U16, 0));
    let needed = blocks(&volume, BlockSide::V16).n_bytes();
    let build = |max_bytes| build_blocks(volume.clone(), &BlockOptions { side: BlockSide::V16, max_bytes });
    assert!(build(Some(needed)).is_ok());
    let error = build(Some(needed - 1)).unwrap_err();
    assert!(matches!(error, BlockBuildError::TooLarge { needed_bytes, .. } if needed_bytes == needed));
    let limit = needed - 1;
    assert_eq!(
        error.to_string(),
        format!("averages and summaries of 24 blocks of 16^3 voxels take {needed} bytes; the limit is {limit}")
    );
}

/// Ljung, Lundstroem and Ynnerman 2006, figure 9: blocks of 16^3, counts from one sample up.
#[test]
fn the_ratio_of_figure_9_leaves_out_blocks_of_one_sample() {
    let layout = BlockLayout::new(UVec3::new(512, 512, 990), BlockSide::V16);
    let counts = [(Level(1), 2551), (Level(2), 5128), (Level(3), 23_041), (Level(4), 32_768)];
    let levels: Vec<Level> = counts.into_iter().flat_map(|(level, n)| std::iter::repeat_n(level, n)).collect();
    assert_eq!(levels.len(), layout.n_blocks_total());
    let memory = block_memory(&layout, ScalarType::U8, &levels);
    assert_eq!((memory.one_sample.n_blocks, memory.larger.n_blocks), (32_768, 2551 + 5128 + 23_041));
    let tenths = |ratio: f64| (10.0 * ratio).round() / 10.0;
    assert_eq!((tenths(memory.ratio()), tenths(memory.ratio_of_all())), (142.7, 140.2));
    // With ghost layers the same blocks take 1.54 and 2.26 times as much.
    let double = 2551 * 1000 + 5128 * 216 + 23_041 * 64;
    let single = 2551 * 729 + 5128 * 125 + 23_041 * 27;
    assert_eq!((memory.larger.single_sided_bytes, memory.larger.double_sided_bytes), (single, double));
}

proptest! {
    #[test]
    fn the_account_is_what_is_fetched(dims in dims(), side in side(), seeds in proptest::collection::vec(0u8..6, 500)) {
        let source = blocks(&noise(dims, ScalarType::U16, 0), side);
        let layout = source.layout();
        let levels: Vec<Level> = seeds.into_iter().map(|l| Level(l.min(side.one_sample().0))).take(layout.n_blocks_total()).collect();
        let memory = block_memory(layout, ScalarType::U16, &levels);
        let (mut n_bytes, mut bytes) = (0, Vec::new());
        for (block, level) in layout.blocks().zip(levels) {
            source.fetch(block, level, &mut bytes).unwrap();
            n_bytes += bytes.len() as u64;
        }
        prop_assert_eq!(memory.larger.bytes + memory.one_sample.bytes, n_bytes);
        prop_assert_eq!(2 * memory.one_sample.n_blocks, memory.one_sample.bytes);
        prop_assert!(memory.larger.bytes <= memory.larger.single_sided_bytes);
        prop_assert!(memory.larger.single_sided_bytes <= memory.larger.double_sided_bytes);
        prop_assert_eq!(memory.volume_bytes, 2 * u64::from(dims.element_product()));
    }
}

#[test]
fn a_grid_and_a_type_are_the_volumes() {
    let grid = Grid::axis_aligned(UVec3::new(3, 4, 5), DVec3::new(1.0, 2.0, 3.0)).unwrap();
    let rescale = Rescale::new(2.0, -1024.0).unwrap();
    let volume = Volume::rescaled(grid, Voxels::I16((0..60).collect()), rescale).unwrap();
    let source = blocks(&volume, BlockSide::V8);
    assert_eq!((source.scalar_type(), source.rescale(), source.grid()), (ScalarType::I16, rescale, &grid));
    let mut bytes = Vec::new();
    source.fetch(UVec3::ZERO, Level(0), &mut bytes).unwrap();
    assert_eq!(bytes[..6], [0, 0, 1, 0, 2, 0]);
    assert_eq!(source.summaries()[0].range, ValueRange { min: -1024.0, max: -906.0 });
}
