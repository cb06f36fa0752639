//! Throughput of building a tree: 512^3 voxels, every brick side and both downsamplings.

mod ball;

use ball::noisy_ball;
use brickfield_bricks::{BrickTree, BuildOptions, Downsampling, build_tree};
use brickfield_core::{BrickSide, Scalar, Volume};
use divan::Bencher;
use divan::counter::BytesCount;

const N: u32 = 512;

fn main() {
    divan::main();
}

#[divan::bench(types = [u8, u16, f32], args = cases(), sample_count = 5, sample_size = 1)]
fn build<T: Scalar>(bencher: Bencher<'_, '_>, (side, downsampling): &(BrickSide, Downsampling)) {
    let volume = noisy_ball::<T>(N);
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
