#![doc = include_str!("../README.md")]

mod dark;
mod keep;
mod slices;

pub use dark::{DarkValues, ThresholdError};
pub use keep::{Class, Interpolation, kept_box};
pub use slices::{BoxError, MinMaxArrays, SampleBox};
