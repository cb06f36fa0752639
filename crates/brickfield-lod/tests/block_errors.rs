//! Errors of blocks: estimates against all voxels, and edits against starting anew.

use std::convert::Infallible;

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{
    BlockLayout, BlockSide, BlockSummary, Grid, Knot, Level, N_BLOCK_BINS, TransferFunction, ValueRange,
};
use brickfield_lod::{BlockErrors, LevelErrors, Reconstruction, Slab, exact_errors, rank_correlation};
use brickfield_optics::ColorMetric;
use proptest::prelude::*;

const SIDE: BlockSide = BlockSide::V8;

/// The value of a voxel.
type Field = fn(DVec3) -> f64;

fn points(n: UVec3) -> impl Iterator<Item = UVec3> {
    (0..n.z).flat_map(move |z| (0..n.y).flat_map(move |y| (0..n.x).map(move |x| UVec3::new(x, y, z))))
}

/// Averages of a volume of whole blocks.
fn values(field: Field, layout: &BlockLayout, block: UVec3, level: Level) -> Vec<f64> {
    let stride = level.stride();
    let mean = |sample: UVec3| {
        let first = layout.first_voxel(block) + sample * stride;
        let sum: f64 = points(UVec3::splat(stride)).map(|p| field((first + p).as_dvec3())).sum();
        sum / f64::from(stride).powi(3)
    };
    points(layout.n_samples(block, level)).map(mean).collect()
}

fn summary(field: Field, layout: &BlockLayout, block: UVec3) -> BlockSummary {
    let voxels = values(field, layout, block, Level(0));
    let ends = |pick: fn(f64, f64) -> f64| voxels.iter().copied().reduce(pick).unwrap();
    let range = ValueRange { min: ends(f64::min), max: ends(f64::max) };
    let mean = voxels.iter().sum::<f64>() / voxels.len() as f64;
    let variance = |values: &[f64]| values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64;
    let mut counts = [0f64; N_BLOCK_BINS];
    for v in &voxels {
        let part = (v - range.min) / (range.max - range.min);
        counts[((part * N_BLOCK_BINS as f64) as usize).min(N_BLOCK_BINS - 1)] += 1.0;
    }
    let kept = |l| (variance(&values(field, layout, block, Level(l))) / variance(&voxels).max(1e-300)) as f32;
    BlockSummary {
        range,
        mean,
        counts: counts.map(|count| (count / voxels.len() as f64 * 65_535.0).round() as u16),
        kept_variance: [1.0, kept(1), kept(2), 0.0, 0.0, 0.0],
        variance: variance(&voxels),
    }
}

fn summaries(field: Field, layout: &BlockLayout) -> Vec<BlockSummary> {
    layout.blocks().map(|block| summary(field, layout, block)).collect()
}

fn exact(field: Field, layout: &BlockLayout, transfer: &TransferFunction, how: Reconstruction) -> Vec<LevelErrors> {
    let values = |block, level| Ok::<_, Infallible>(values(field, layout, block, level));
    exact_errors(layout, transfer, slab(), how, values).unwrap()
}

fn estimated(field: Field, layout: &BlockLayout, transfer: &TransferFunction) -> Vec<LevelErrors> {
    BlockErrors::estimate(layout, &summaries(field, layout), transfer, slab()).unwrap().levels().to_vec()
}

fn slab() -> Slab {
    Slab::new(8.0, [0.0; 3]).unwrap()
}

fn transfer(knots: &[(f64, f64, [f64; 3])]) -> TransferFunction {
    let knot = |&(value, extinction, color): &(f64, f64, [f64; 3])| Knot { value, extinction, color };
    TransferFunction::new(knots.iter().map(knot).collect()).unwrap()
}

fn ramp() -> TransferFunction {
    transfer(&[(0.2, 0.0, [0.2, 0.3, 0.9]), (0.6, 0.1, [0.9, 0.4, 0.1]), (1.0, 0.4, [1.0, 1.0, 0.9])])
}

fn peak() -> TransferFunction {
    transfer(&[(0.4, 0.0, [1.0, 0.7, 0.3]), (0.5, 0.3, [1.0, 0.7, 0.3]), (0.6, 0.0, [1.0, 0.7, 0.3])])
}

/// Balls of different softness, and noise that grows along x.
fn scan(p: DVec3) -> f64 {
    let ball = |c: DVec3, r: f64, soft: f64| 1.0 / (1.0 + (((p - c).length() - r) / soft).exp());
    let hash = (p.dot(DVec3::new(12.9898, 78.233, 37.719)).sin() * 43_758.547).fract().abs();
    let body =
        0.5 * ball(DVec3::new(20.0, 24.0, 20.0), 16.0, 0.4) + 0.4 * ball(DVec3::new(40.0, 20.0, 24.0), 14.0, 3.0);
    body + 0.1 * hash * p.x / 64.0
}

fn layout() -> BlockLayout {
    BlockLayout::new(UVec3::new(64, 40, 40), SIDE)
}

fn coarser_levels(errors: &[LevelErrors]) -> Vec<f64> {
    errors.iter().flat_map(|e| e[1..4].iter()).map(|e| f64::from(*e)).collect()
}

#[test]
fn estimates_have_the_order_and_the_size_of_exact_errors() {
    for (name, transfer, least) in [("ramp", ramp(), 0.97), ("peak", peak(), 0.9)] {
        let estimates = coarser_levels(&estimated(scan, &layout(), &transfer));
        for how in [Reconstruction::Constant, Reconstruction::Trilinear] {
            let exact = coarser_levels(&exact(scan, &layout(), &transfer, how));
            let correlation = rank_correlation(&estimates, &exact).unwrap();
            let ratio = estimates.iter().sum::<f64>() / exact.iter().sum::<f64>();
            assert!(correlation > least && (0.85..1.2).contains(&ratio), "{name} {how:?}: {correlation} {ratio}");
        }
    }
}

#[test]
fn one_sample_of_evenly_spread_values_is_estimated_to_a_fifth() {
    let slope: Field = |p| 0.1 + 0.01 * p.x + 0.002 * p.y;
    for transfer in [ramp(), peak()] {
        let estimates = estimated(slope, &layout(), &transfer);
        let exact = exact(slope, &layout(), &transfer, Reconstruction::Constant);
        for (estimate, exact) in estimates.iter().zip(exact) {
            assert!((estimate[3] - exact[3]).abs() <= 0.2 * exact[3] + 0.5, "{} {}", estimate[3], exact[3]);
        }
    }
}

#[test]
fn a_peak_between_the_values_of_voxels_is_seen() {
    // Nowhere is a voxel in the peak; between the two parts of a block every value is.
    let parts: Field = |p| f64::from(u8::from(p.x % 8.0 >= 3.0));
    let peak = |half: f64| transfer(&[(0.5 - half, 0.0, [1.0; 3]), (0.5, 4.0, [1.0; 3]), (0.5 + half, 0.0, [1.0; 3])]);
    for half in [0.2, 0.02, 0.004] {
        let of_blocks = estimated(parts, &layout(), &peak(half));
        assert!(
            of_blocks.iter().all(|errors| errors[1..4].iter().all(|error| *error > 0.5)),
            "{half}: {:?}",
            of_blocks[0]
        );
    }
}

#[test]
fn a_peak_narrower_than_a_bin_is_estimated_to_a_third() {
    // 512 values, evenly spread in a block.
    let dense: Field = |p| ((p.x % 8.0) + (p.y % 8.0) / 8.0 + (p.z % 8.0) / 64.0) / 8.0;
    for (center, half) in [(0.31, 0.02), (0.77, 0.01), (0.83, 0.005)] {
        let peak = transfer(&[(center - half, 0.0, [1.0; 3]), (center, 4.0, [1.0; 3]), (center + half, 0.0, [1.0; 3])]);
        let (estimate, exact) =
            (estimated(dense, &layout(), &peak)[0], exact(dense, &layout(), &peak, Reconstruction::Constant)[0]);
        assert!((estimate[3] / exact[3] - 1.0).abs() < 0.33, "{center} {half}: {estimate:?} {exact:?}");
    }
}

#[test]
fn what_cannot_be_told_apart_has_no_error() {
    let dark: Field = |p| 0.19 * (p.x / 64.0);
    let same: Field = |_| 0.7;
    for field in [dark, same] {
        for how in [Reconstruction::Constant, Reconstruction::Trilinear] {
            let all = [estimated(field, &layout(), &ramp()), exact(field, &layout(), &ramp(), how)].concat();
            assert!(all.iter().flatten().all(|error| *error < 1e-4), "{how:?}");
        }
    }
    assert!(estimated(dark, &layout(), &ramp()).iter().flatten().all(|error| *error == 0.0));
    let all = exact(scan, &layout(), &ramp(), Reconstruction::Trilinear);
    assert!(all.iter().all(|errors| errors[0] == 0.0 && errors[4..] == [0.0, 0.0]));
}

#[test]
fn the_exact_error_of_two_halves_is_by_hand() {
    // Half of the voxels are 0 and transparent, the other half 1; one sample shows 1/2.
    let halves: Field = |p| f64::from(u8::from(p.x % 8.0 >= 4.0));
    let white = transfer(&[(0.0, 0.0, [1.0; 3]), (1.0, 0.5, [1.0; 3])]);
    let layout = BlockLayout::new(UVec3::splat(8), SIDE);
    let gray = |extinction: f64| [-(-8.0 * extinction).exp_m1(); 3];
    let metric = |a, b| ColorMetric::CieLuv1976.of_colors(gray(a), gray(b));
    let expected = (0.5 * (metric(0.0, 0.25).powi(2) + metric(0.5, 0.25).powi(2))).sqrt();
    let found = exact(halves, &layout, &white, Reconstruction::Constant)[0];
    assert_eq!(found[1..3], [0.0, 0.0]);
    assert!((f64::from(found[3]) - expected).abs() < 1e-4, "{} {expected}", found[3]);
    let estimate = estimated(halves, &layout, &white)[0];
    // Black and nearly black differ most: of two values per bin one is nearly black.
    assert!((estimate[3] / found[3] - 1.0).abs() < 0.15 && estimate[1] < 0.01, "{estimate:?} {found:?}");
}

#[test]
fn a_background_is_seen_through_what_is_thin() {
    let grid = Grid::axis_aligned(layout().dims(), DVec3::new(0.5, 1.0, 2.0)).unwrap();
    let black = Slab::of_block(&layout(), &grid);
    assert_eq!(black, Slab::new(8.0, [0.0; 3]).unwrap());
    let white = black.before([1.0; 3]).unwrap();
    let [clear, dense] = [0.1, 1.0].map(|value| ramp().at(value));
    assert_eq!(black.luv(clear), [0.0; 3]);
    assert!((white.luv(clear)[0] - 100.0).abs() < 1e-6);
    assert!((white.luv(dense)[0] - black.luv(dense)[0]).abs() < 10.0);
    for (length, background) in [(0.0, [0.0; 3]), (f64::INFINITY, [0.0; 3]), (1.0, [0.0, 1.5, 0.0])] {
        assert!(Slab::new(length, background).unwrap_err().to_string().contains("a slab of length"));
    }
    let error = BlockErrors::estimate(&layout(), &[], &ramp(), black).unwrap_err();
    assert_eq!(error.to_string(), "0 summaries for 200 blocks: each block has one");
}

fn any_summary() -> impl Strategy<Value = BlockSummary> {
    let kept = prop::array::uniform3(0.0f32..1.0);
    let parts =
        (0.0..0.9f64, prop_oneof![Just(0.0), 0.0..0.4f64], prop::array::uniform16(0u16..4000), kept, 0.1..0.9f64);
    parts.prop_map(|(min, width, mut counts, mut kept, mean)| {
        counts[0] += 1;
        kept.sort_by(|a, b| b.total_cmp(a));
        let [one, two, three] = kept;
        BlockSummary {
            range: ValueRange { min, max: min + width },
            mean: min + mean * width,
            counts,
            kept_variance: [1.0, one, two, three, 0.0, 0.0],
            variance: (0.2 * width).powi(2),
        }
    })
}

fn any_transfer() -> impl Strategy<Value = TransferFunction> {
    let knot = (0u8..12, prop_oneof![Just(0.0), 0.0..1.0f64], prop::array::uniform3(0.0..1.0f64));
    proptest::collection::vec(knot, 1..6).prop_map(|mut knots| {
        knots.sort_by_key(|k| k.0);
        knots.dedup_by_key(|k| k.0);
        transfer(&knots.iter().map(|k| (f64::from(k.0) * 0.11, k.1, k.2)).collect::<Vec<_>>())
    })
}

proptest! {
    #[test]
    fn errors_after_edits_are_those_of_starting_anew(
        summaries in proptest::collection::vec(any_summary(), 60),
        edits in proptest::collection::vec((any_transfer(), any::<prop::sample::Index>(), 0.0..1.0f64), 1..5),
    ) {
        let layout = BlockLayout::new(UVec3::new(15 * 16, 32, 32), BlockSide::V16);
        let estimate = |transfer: &TransferFunction| BlockErrors::estimate(&layout, &summaries, transfer, slab()).unwrap();
        let mut errors = estimate(&edits[0].0);
        for (next, pick, extinction) in edits {
            // A new function, then an edit of one knot.
            let mut knots = next.knots().to_vec();
            let i = pick.index(knots.len());
            knots[i].extinction = extinction;
            for transfer in [next, TransferFunction::new(knots).unwrap()] {
                errors.update(&summaries, &transfer).unwrap();
                let anew = estimate(&transfer);
                prop_assert_eq!(errors.levels(), anew.levels());
                prop_assert_eq!(errors.transfer(), &transfer);
                prop_assert!(errors.levels().iter().flatten().all(|e| e.is_finite() && *e >= 0.0));
            }
        }
    }
}

#[test]
fn an_edit_concerns_the_blocks_that_have_its_values() {
    let summaries = summaries(scan, &layout());
    let mut errors = BlockErrors::estimate(&layout(), &summaries, &ramp(), slab()).unwrap();
    assert_eq!(errors.update(&summaries, &ramp()), Ok(0));
    let mut knots = ramp().knots().to_vec();
    knots[2].extinction = 9.0;
    let expected = summaries.iter().filter(|s| s.range.max >= 0.6).count();
    let concerned = errors.update(&summaries, &TransferFunction::new(knots).unwrap()).unwrap();
    assert!(
        (expected..expected + 10).contains(&concerned) && concerned < summaries.len() / 2,
        "{concerned} {expected}"
    );
}

#[test]
fn a_block_is_as_deep_as_a_cube_of_its_volume() {
    let grid = Grid::axis_aligned(layout().dims(), DVec3::new(1.0, 2.0, 4.0)).unwrap();
    assert_eq!(Slab::of_block(&layout(), &grid), Slab::new(16.0, [0.0; 3]).unwrap());
}

#[test]
fn an_edit_of_colours_alone_is_followed() {
    let ramp = |first: [f64; 3]| transfer(&[(0.1, 0.3, first), (0.9, 0.3, [1.0, 1.0, 0.9])]);
    let summaries = summaries(scan, &layout());
    let mut errors = BlockErrors::estimate(&layout(), &summaries, &ramp([0.9, 0.1, 0.1]), slab()).unwrap();
    let edited = ramp([0.1, 0.1, 0.9]);
    assert!(errors.update(&summaries, &edited).unwrap() > 0);
    assert_eq!(errors.levels(), BlockErrors::estimate(&layout(), &summaries, &edited, slab()).unwrap().levels());
}
