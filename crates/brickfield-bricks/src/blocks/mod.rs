//! Flat blocks of a volume: their averages, their summaries, and sources to fetch their samples from.

mod build;
mod memory;
mod shrink;
mod source;
mod summary;
mod volume;

pub use build::{BlockBuildError, BlockOptions, block_summaries, build_blocks};
pub use memory::{BlockMemory, BlockTally, block_memory};
pub use source::{BlockSource, FetchError, NoSuchBlock, SourceId, fetch_values};
pub use volume::BlockVolume;
