#![doc = include_str!("../README.md")]

mod extent;
mod kernel;
mod median;
mod sample;
mod transform;

pub use extent::{ExtentError, MAX_LEVELS, MAX_SAMPLES};
pub use kernel::Kernel;
pub use sample::{Coefficient, Sample};
pub use transform::{Bands, TransformError};
