//! The laws of the octree, each against a slow computation of its own.

mod noise;

use brickfield_bricks::{Bins, BrickTree, BuildOptions, Downsampling, Histogram, N_BINS, build_tree};
use brickfield_core::glam::UVec3;
use brickfield_core::{BrickId, BrickLayout, BrickSide, Level, Rescale, ScalarType, ValueRange, Volume, Voxels};
use noise::{index, noise, points, volume};
use proptest::prelude::*;

const BOTH: [Downsampling; 2] = [Downsampling::Subsample, Downsampling::Average];

fn tree(volume: &Volume, side: BrickSide, downsampling: Downsampling) -> BrickTree {
    build_tree(volume, &BuildOptions { side, downsampling, max_bytes: None }).unwrap()
}

/// One sample of the next level by the definition: the sum over 27 weights.
fn law(below: &[f64], dims: UVec3, p: UVec3, how: Downsampling, scalar: ScalarType) -> f64 {
    if how == Downsampling::Subsample {
        return below[index(dims, 2 * p)];
    }
    let weight = |offset: UVec3| offset.to_array().into_iter().map(|o| [1.0, 2.0, 1.0][o as usize]).product::<f64>();
    let tap = |offset| weight(offset) * below[index(dims, (2 * p + offset).saturating_sub(UVec3::ONE))];
    let mean = points(UVec3::splat(3)).map(tap).sum::<f64>() / 64.0;
    match scalar {
        ScalarType::F32 => f64::from(mean as f32),
        ScalarType::F64 => mean,
        _ => (mean + 0.5).floor(),
    }
}

/// All samples of every level, finest first.
fn pyramid(volume: &Volume, layout: &BrickLayout, how: Downsampling) -> Vec<Vec<f64>> {
    let mut levels = vec![(0..volume.voxels().len()).map(|i| volume.voxels().at(i)).collect::<Vec<_>>()];
    for level in 1..layout.n_levels() {
        let (below, dims) = (&levels[usize::from(level) - 1], layout.level_dims(Level(level - 1)));
        let above = points(layout.level_dims(Level(level)));
        let above = above.map(|p| law(below, dims, p, how, volume.scalar_type())).collect();
        levels.push(above);
    }
    levels
}

fn all_bricks(layout: BrickLayout) -> impl Iterator<Item = BrickId> {
    (0..layout.n_levels()).flat_map(move |l| layout.bricks(Level(l)))
}

fn side_cube(layout: &BrickLayout) -> UVec3 {
    UVec3::splat(layout.side().n_samples())
}

fn check_samples(volume: &Volume, tree: &BrickTree) {
    let layout = tree.layout();
    let expected = pyramid(volume, layout, tree.downsampling());
    let tolerance = match volume.scalar_type() {
        ScalarType::F32 => 1e-7 * 1e3,
        ScalarType::F64 => 4e-16 * 1e-3,
        _ => 0.0,
    };
    for id in all_bricks(*layout) {
        let (samples, dims) = (tree.samples(id), layout.level_dims(id.level));
        let level = &expected[usize::from(id.level.0)];
        for (i, p) in points(side_cube(layout)).enumerate() {
            let want = level[index(dims, id.coords * layout.side().n_cells() + p)];
            assert!((samples.at(i) - want).abs() <= tolerance, "{id} sample {p}: {} for {want}", samples.at(i));
        }
    }
}

/// Subsampled levels by their position in level 0, not by the level below.
fn check_subsampled(volume: &Volume, tree: &BrickTree) {
    let layout = tree.layout();
    for id in all_bricks(*layout) {
        let samples = tree.samples(id);
        for (i, p) in points(side_cube(layout)).enumerate() {
            let at = (id.coords * layout.side().n_cells() + p) * id.level.stride();
            assert_eq!(samples.at(i), volume.voxels().at(index(volume.grid().dims(), at)));
        }
    }
}

fn check_shared_faces(tree: &BrickTree) {
    let layout = tree.layout();
    for (id, axis) in all_bricks(*layout).flat_map(|id| UVec3::AXES.map(|axis| (id, axis))) {
        let next = BrickId { level: id.level, coords: id.coords + axis };
        if !layout.contains(next) {
            continue;
        }
        let (here, there, n) = (tree.samples(id), tree.samples(next), side_cube(layout));
        for p in points(n - (n - 1) * axis) {
            assert_eq!(
                here.at(index(n, p + (n - 1) * axis)).to_bits(),
                there.at(index(n, p)).to_bits(),
                "{id}, {next}"
            );
        }
    }
}

fn check_ranges(tree: &BrickTree) {
    let layout = tree.layout();
    for id in all_bricks(*layout) {
        let samples = tree.samples(id);
        let own = (0..samples.len())
            .map(|i| samples.at(i))
            .map(|v| ValueRange { min: v, max: v })
            .map(|v| tree.rescale().values(v));
        let below = layout.children(id).map(|child| tree.summary(child).range);
        assert_eq!(tree.summary(id).range, own.chain(below).reduce(ValueRange::union).unwrap(), "{id}");
    }
}

/// Counts voxels by the half-open boxes in sample space, the upper end included at the border.
fn check_histograms(volume: &Volume, tree: &BrickTree) {
    let (layout, bins) = (tree.layout(), Bins::new(volume.range()));
    let dims = volume.grid().dims();
    for level in (0..layout.n_levels()).map(Level) {
        let mut expected = vec![Histogram::default(); layout.n_bricks_total(level)];
        for p in points(dims) {
            let coords = (p / (layout.side().n_cells() * level.stride())).min(layout.n_bricks(level) - 1);
            let bin = bins.of(volume.value(index(dims, p)));
            expected[layout.ordinal(BrickId { level, coords })].counts[bin] += 1;
        }
        for (id, expected) in layout.bricks(level).zip(expected) {
            assert_eq!(tree.summary(id).histogram, expected, "{id}");
        }
        let total: u64 = tree.summaries(level).iter().map(|s| s.histogram.total()).sum();
        assert_eq!(total, dims.element_product() as u64);
    }
}

fn check_all(volume: &Volume, side: BrickSide) {
    for how in BOTH {
        let tree = tree(volume, side, how);
        check_samples(volume, &tree);
        check_shared_faces(&tree);
        check_ranges(&tree);
        check_histograms(volume, &tree);
        if how == Downsampling::Subsample {
            check_subsampled(volume, &tree);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    #[test]
    fn the_laws_hold(x in 1u32..70, y in 1u32..36, z in 1u32..36, turn in 0usize..3, t in 0usize..8, seed: u64) {
        let mut dims = [x, y, z];
        dims.rotate_right(turn);
        check_all(&noise(dims.into(), ScalarType::ALL[t], seed), BrickSide::S16);
    }
}

#[test]
fn the_laws_hold_where_bricks_begin_and_end() {
    for n in [1, 2, 15, 16, 17, 30, 31, 32, 46, 61, 62] {
        for dims in [[n, 1, 1], [1, n, 1], [1, 1, n], [n, n.min(17), 2]] {
            check_all(&noise(dims.into(), ScalarType::I16, u64::from(n)), BrickSide::S16);
        }
    }
    check_all(&noise(UVec3::new(65, 3, 33), ScalarType::U8, 5), BrickSide::S32);
    check_all(&noise(UVec3::new(65, 3, 128), ScalarType::F32, 6), BrickSide::S64);
}

#[test]
fn the_laws_hold_for_every_scalar_type() {
    for (seed, scalar) in ScalarType::ALL.into_iter().enumerate() {
        check_all(&noise(UVec3::new(37, 20, 18), scalar, seed as u64), BrickSide::S16);
    }
}

#[test]
fn the_laws_hold_for_stored_numbers_of_other_values() {
    for (scalar, slope, intercept) in
        [(ScalarType::U8, -0.3, 7.0), (ScalarType::I16, 2.5, -1024.0), (ScalarType::F32, -1e6, 0.1)]
    {
        let stored = noise(UVec3::new(37, 20, 18), scalar, 9);
        let rescale = Rescale::new(slope, intercept).unwrap();
        let volume = Volume::rescaled(*stored.grid(), stored.voxels().clone(), rescale).unwrap();
        check_all(&volume, BrickSide::S16);
        let tree = tree(&volume, BrickSide::S16, Downsampling::Subsample);
        assert_eq!(tree.summary(tree.layout().root()).range, volume.range());
        assert_ne!(tree, self::tree(&stored, BrickSide::S16, Downsampling::Subsample));
    }
}

#[test]
fn averaging_keeps_constant_fields_of_every_type() {
    let dims = UVec3::new(50, 33, 20);
    let constants: [Voxels; 11] = [
        vec![255u8; 33_000].into(),
        vec![-128i8; 33_000].into(),
        vec![u16::MAX; 33_000].into(),
        vec![i16::MIN; 33_000].into(),
        vec![u32::MAX; 33_000].into(),
        vec![i32::MIN; 33_000].into(),
        vec![i32::MAX; 33_000].into(),
        vec![0.1f32; 33_000].into(),
        vec![f32::MIN; 33_000].into(),
        vec![0.1f64; 33_000].into(),
        vec![f64::MAX; 33_000].into(),
    ];
    for voxels in constants {
        let value = voxels.at(0);
        let tree = tree(&volume(dims, voxels), BrickSide::S16, Downsampling::Average);
        for id in all_bricks(*tree.layout()) {
            assert!((0..tree.samples(id).len()).all(|i| tree.samples(id).at(i) == value), "{value}");
            assert_eq!(tree.summary(id).range, ValueRange { min: value, max: value });
        }
    }
}

#[test]
fn averaging_keeps_linear_fields_away_from_the_borders() {
    let dims = UVec3::new(70, 40, 33);
    let field = |p: UVec3| 3.0 * f64::from(p.x) - 2.0 * f64::from(p.y) + 5.0 * f64::from(p.z);
    let voxels: Vec<i16> = points(dims).map(|p| field(p) as i16).collect();
    let tree = tree(&volume(dims, voxels.into()), BrickSide::S16, Downsampling::Average);
    let layout = tree.layout();
    for id in all_bricks(*layout) {
        let stride = id.level.stride();
        for (i, p) in points(side_cube(layout)).enumerate() {
            let at = (id.coords * layout.side().n_cells() + p) * stride;
            // The support of level l reaches 2^l - 1 voxels to each side.
            if at.cmpge(UVec3::splat(stride - 1)).all() && (at + stride - 1).cmplt(dims).all() {
                assert_eq!(tree.samples(id).at(i), field(at), "{id} sample {p}");
            }
        }
    }
}

#[test]
fn a_peak_stays_in_the_range_of_every_brick_above_it() {
    let dims = UVec3::splat(61);
    let mut voxels = vec![10u8; 61 * 61 * 61];
    voxels[index(dims, UVec3::new(31, 33, 7))] = 200;
    let tree = tree(&volume(dims, voxels.into()), BrickSide::S16, Downsampling::Subsample);
    let root = tree.layout().root();
    let samples = tree.samples(root);
    assert!((0..samples.len()).all(|i| samples.at(i) == 10.0), "subsampling steps over the peak");
    assert_eq!(tree.summary(root).range, ValueRange { min: 10.0, max: 200.0 });
    assert_eq!(tree.summary(root).histogram.counts[N_BINS - 1], 1);
}
