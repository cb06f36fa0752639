//! Flat blocks of a volume: their averages, their summaries, and sources to fetch their samples from.

mod build;
mod gradient;
mod memory;
mod outside;
mod shrink;
mod source;
mod spread;
mod summary;
mod surface;
mod volume;

use brickfield_core::glam::UVec3;

pub use build::{BlockBuildError, BlockOptions, block_summaries, build_blocks};
pub use memory::{BlockMemory, BlockTally, block_memory};
pub use source::{
    BlockSource, FetchError, NoCompanion, NoSuchBlock, SourceId, fetch_values, greatest_gradient, greatest_spread,
};
pub use surface::{SurfaceEdit, SurfaceNormals};
pub use volume::BlockVolume;

/// All positions of a box of so many samples, x fastest.
fn positions(n: UVec3) -> impl Iterator<Item = UVec3> {
    (0..n.element_product()).map(move |i| UVec3::new(i % n.x, i / n.x % n.y, i / (n.x * n.y)))
}
