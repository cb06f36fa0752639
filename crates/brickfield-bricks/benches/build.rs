//! Throughput of building a tree: 512^3 voxels, every brick side and both downsamplings.

use brickfield_bricks::{BrickTree, BuildOptions, Downsampling, build_tree};
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{BrickSide, Grid, Scalar, Volume};
use divan::Bencher;
use divan::counter::BytesCount;

const N: u32 = 512;

fn main() {
    divan::main();
}

#[divan::bench(types = [u8, u16, f32], args = cases(), sample_count = 5, sample_size = 1)]
fn build<T: Scalar>(bencher: Bencher<'_, '_>, (side, downsampling): &(BrickSide, Downsampling)) {
    let volume = noisy_ball::<T>();
    let n_bytes = volume.grid().n_voxels() * T::TYPE.n_bytes();
    let options = BuildOptions { side: *side, downsampling: *downsampling, max_bytes: None };
    bencher.counter(BytesCount::new(n_bytes)).bench(|| tree(&volume, &options));
}

fn cases() -> Vec<(BrickSide, Downsampling)> {
    let pair = |side| [(side, Downsampling::Subsample), (side, Downsampling::Average)];
    BrickSide::ALL.into_iter().flat_map(pair).collect()
}

fn tree(volume: &Volume, options: &BuildOptions) -> BrickTree {
    build_tree(volume, options).expect("the machine holds the tree")
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
