//! Throughput of cutting 256^3 voxels into blocks, and of fetching all of one level.

mod ball;

use std::sync::Arc;

use ball::noisy_ball;
use brickfield_bricks::{BlockOptions, BlockSource, BlockVolume, build_blocks};
use brickfield_core::{BlockSide, Level, Scalar, Volume};
use divan::Bencher;
use divan::counter::BytesCount;

const N: u32 = 256;

fn main() {
    divan::main();
}

#[divan::bench(types = [u8, u16, f32], args = BlockSide::ALL, sample_count = 5, sample_size = 1)]
fn build<T: Scalar>(bencher: Bencher<'_, '_>, side: BlockSide) {
    let volume = Arc::new(noisy_ball::<T>(N));
    let n_bytes = volume.grid().n_voxels() * T::TYPE.n_bytes();
    bencher.counter(BytesCount::new(n_bytes)).bench(|| blocks(volume.clone(), side));
}

#[divan::bench(args = [0, 1, 2, 3, 4], sample_count = 5, sample_size = 1)]
fn fetch_u16(bencher: Bencher<'_, '_>, level: u8) {
    let source = blocks(Arc::new(noisy_ball::<u16>(N)), BlockSide::V16);
    let n_bytes = (2 * source.volume().grid().n_voxels()) >> (3 * level);
    bencher.counter(BytesCount::new(n_bytes)).bench(|| {
        let mut bytes = Vec::new();
        source.layout().blocks().try_for_each(|block| source.fetch(block, Level(level), &mut bytes))
    });
}

fn blocks(volume: Arc<Volume>, side: BlockSide) -> BlockVolume {
    build_blocks(volume, &BlockOptions { side, max_bytes: None }).expect("the machine holds the averages")
}
