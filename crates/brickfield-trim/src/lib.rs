#![doc = include_str!("../README.md")]

mod blocks;
mod bricks;
mod dark;
mod keep;
mod merge;
mod pack;
mod pages;
mod slices;
mod stored;

pub use blocks::{BlocksError, block_place, trim_blocks};
pub use bricks::{
    ArraysError, BrickArrays, ClassCounts, OtherLayout, TrimmedBricks, brick_samples, reclassify, trim_bricks,
};
pub use dark::{DarkValues, ThresholdError};
pub use keep::{Class, Interpolation, kept_box};
pub use merge::{
    BetweenClusters, ChunkPart, FirstMerge, MergeError, MergeOptions, MergedBricks, TextureChunk, merge_bricks,
};
pub use pack::{PackError, PackedBoxes, pack_boxes};
pub use pages::{PagedBrick, PagedBricks};
pub use slices::{BoxError, MinMaxArrays, SampleBox};
pub use stored::{StoredBricks, TexelAccount, VoxelsError, pack_bricks, samples_of, store_alone};
