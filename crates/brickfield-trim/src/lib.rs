#![doc = include_str!("../README.md")]

mod blocks;
mod bricks;
mod dark;
mod keep;
mod slices;

pub use blocks::{BlocksError, trim_blocks};
pub use bricks::{
    ArraysError, BrickArrays, ClassCounts, OtherLayout, TrimmedBricks, brick_samples, reclassify, trim_bricks,
};
pub use dark::{DarkValues, ThresholdError};
pub use keep::{Class, Interpolation, kept_box};
pub use slices::{BoxError, MinMaxArrays, SampleBox};
