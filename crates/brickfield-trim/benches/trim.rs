//! Time to make min-max arrays of 256^3 voxels, to classify them after an edit, and to store what is left.

use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{
    BlockLayout, BlockSide, BrickSide, Grid, Knot, Level, Rescale, Scalar, TransferFunction, Volume,
};
use brickfield_trim::{
    BrickArrays, DarkValues, Interpolation, MergeOptions, MinMaxArrays, SampleBox, TrimmedBricks, merge_bricks,
    pack_bricks, reclassify, trim_blocks, trim_bricks,
};
use divan::Bencher;
use divan::counter::{BytesCount, ItemsCount};

const N: u32 = 256;

fn main() {
    divan::main();
}

#[divan::bench(types = [u8, u16, f32], args = BrickSide::ALL)]
fn min_max_arrays<T: Scalar>(bencher: Bencher<'_, '_>, side: BrickSide) {
    let volume = noisy_ball::<T>();
    let n_bytes = volume.grid().n_voxels() * T::TYPE.n_bytes();
    bencher.counter(BytesCount::new(n_bytes)).bench(|| BrickArrays::of_volume(&volume, side));
}

#[divan::bench(args = BrickSide::ALL)]
fn classify_by_threshold(bencher: Bencher<'_, '_>, side: BrickSide) {
    let arrays = arrays(side);
    let edited = DarkValues::below(61.0).expect("a number");
    bench_edit(bencher, &arrays, &edited);
}

/// A peak between every two of 256 values, and nothing between the peaks.
#[divan::bench(args = BrickSide::ALL)]
fn classify_by_transfer_function(bencher: Bencher<'_, '_>, side: BrickSide) {
    let knot = |i: u32| Knot { value: f64::from(i) * 0.25, extinction: f64::from(i % 4 / 3), color: [1.0; 3] };
    let transfer = TransferFunction::new((0..1024).map(knot).collect()).expect("knots in order");
    let arrays = arrays(side);
    bench_edit(bencher, &arrays, &DarkValues::of(&transfer));
}

#[divan::bench(args = BrickSide::ALL)]
fn merge(bencher: Bencher<'_, '_>, side: BrickSide) {
    let trimmed = trimmed(&arrays(side));
    let n = side.n_samples();
    let options =
        MergeOptions { cluster: UVec2::splat(2), cache: UVec3::new(2 * n, 2 * n, n), ..MergeOptions::default() };
    bencher.bench(|| merge_bricks(&trimmed, &options).expect("a cache of a cluster"));
}

#[divan::bench(args = BrickSide::ALL)]
fn pack(bencher: Bencher<'_, '_>, side: BrickSide) {
    let trimmed = trimmed(&arrays(side));
    bencher.bench(|| pack_bricks(&trimmed, UVec3::splat(2048)).expect("room for all"));
}

/// 32^3 flat blocks of 8^3 voxels, at four levels.
#[divan::bench]
fn trim_blended_blocks(bencher: Bencher<'_, '_>) {
    let volume = noisy_ball::<u8>();
    let layout = BlockLayout::new(UVec3::splat(N), BlockSide::V8);
    let levels: Vec<Level> = layout.blocks().map(|b| Level((b.element_sum() % 4) as u8)).collect();
    let of_block = |(block, level): (UVec3, &Level)| {
        let n = layout.n_samples(block, *level);
        let voxel = |i: UVec3| {
            let p = layout.first_voxel(block) + i * level.stride();
            volume.value((p.x + N * (p.y + N * p.z)) as usize) as f32
        };
        let samples: Vec<f32> =
            (0..n.element_product()).map(|i| voxel(UVec3::new(i % n.x, i / n.x % n.y, i / n.x / n.y))).collect();
        MinMaxArrays::of_box(&samples, n, SampleBox::whole(n), Rescale::IDENTITY).expect("the samples of a block")
    };
    let arrays: Vec<MinMaxArrays> = layout.blocks().zip(&levels).map(of_block).collect();
    let dark = DarkValues::below(60.0).expect("a number");
    bencher.bench(|| trim_blocks(&layout, &levels, &arrays, &dark).expect("arrays of all blocks"));
}

fn bench_edit(bencher: Bencher<'_, '_>, arrays: &BrickArrays, edited: &DarkValues) {
    let trimmed = trimmed(arrays);
    bencher
        .counter(ItemsCount::new(arrays.arrays().len()))
        .with_inputs(|| trimmed.clone())
        .bench_refs(|trimmed| reclassify(trimmed, arrays, edited).expect("the same layout"));
}

fn arrays(side: BrickSide) -> BrickArrays {
    BrickArrays::of_volume(&noisy_ball::<u8>(), side)
}

fn trimmed(arrays: &BrickArrays) -> TrimmedBricks {
    trim_bricks(arrays, &DarkValues::below(60.0).expect("a number"), Interpolation::Trilinear)
}

/// A ball in noise: neither constant, which flatters, nor pure noise, which no scanner makes.
fn noisy_ball<T: Scalar>() -> Volume {
    let half = f64::from(N) / 2.0;
    let value = |i: u32| {
        let p = UVec3::new(i % N, i / N % N, i / (N * N)).as_dvec3() - half;
        let noise = f64::from(i.wrapping_mul(2_654_435_761) >> 28);
        T::from_f64((220.0 * (1.0 - p.length() / half)).max(0.0) + noise)
    };
    let voxels: Vec<T> = (0..N.pow(3)).map(value).collect();
    let grid = Grid::axis_aligned(UVec3::splat(N), DVec3::ONE).expect("a plain grid");
    Volume::new(grid, T::wrap(voxels)).expect("voxels fill the grid")
}
