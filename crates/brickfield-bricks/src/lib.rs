#![doc = include_str!("../README.md")]

mod bins;
mod blocks;
mod build;
mod downsample;
mod fill;
mod mean;
mod memory;
mod pyramid;
mod sample;
mod tally;
mod tree;

pub use bins::{Bins, Histogram, N_BINS};
pub use blocks::{
    BlockBuildError, BlockMemory, BlockOptions, BlockSource, BlockTally, BlockVolume, FetchError, NoCompanion,
    NoSuchBlock, SourceId, SurfaceEdit, SurfaceNormals, block_memory, block_summaries, build_blocks, fetch_values,
    greatest_gradient, greatest_spread,
};
pub use build::{BuildError, BuildOptions, Progress, build_tree, build_tree_observed};
pub use downsample::Downsampling;
pub use memory::{LevelMemory, TreeMemory, tree_memory};
pub use pyramid::{MAX_PYRAMID_LEVEL, Pyramid, SliceError, average_box, coarsest_level, level_dims};
pub use sample::BrickSamples;
pub use tree::{BrickSummary, BrickTree, TreeId};
