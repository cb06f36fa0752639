#![doc = include_str!("../README.md")]

mod bits;
mod coded;
mod context;
mod decode;
mod encode;
mod extent;
mod frequencies;
mod header;
mod kernel;
mod means;
mod median;
mod packed;
mod packed_brick;
mod parallel;
mod quantise;
mod sample;
mod tans;
mod token;
mod transform;

pub use decode::{DecodeError, Decoded, decode, decode_level, decode_with_low};
pub use encode::{EncodeError, EncodeOptions, Loss, LowBand, Storages, encode};
pub use extent::{ExtentError, MAX_LEVELS, MAX_SAMPLES};
pub use header::{BrickHeader, FORMAT_VERSION, Storage};
pub use kernel::Kernel;
pub use packed_brick::{PackedBrick, PackedSection};
pub use parallel::{decode_bricks, encode_bricks};
pub use sample::{Coefficient, Sample};
pub use transform::{Bands, TransformError};
