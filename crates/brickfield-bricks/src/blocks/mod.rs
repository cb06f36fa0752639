//! Flat blocks of a volume: their averages, their summaries, and sources to fetch their samples from.

mod build;
mod gradient;
mod memory;
mod shrink;
mod source;
mod spread;
mod summary;
mod volume;

pub use build::{BlockBuildError, BlockOptions, block_summaries, build_blocks};
pub use memory::{BlockMemory, BlockTally, block_memory};
pub use source::{
    BlockSource, FetchError, NoCompanion, NoSuchBlock, SourceId, fetch_values, greatest_gradient, greatest_spread,
};
pub use volume::BlockVolume;
