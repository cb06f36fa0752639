#![doc = include_str!("../README.md")]

mod chunk;
mod codec;
mod details;
mod options;

pub use chunk::ChunkError;
pub use codec::{CODEC_NAME, HaarCodec};
pub use details::{DETAILS_CODEC_NAME, DetailArray, DetailError, HaarDetailsCodec};
pub use options::{ConfigurationError, HaarOptions};
