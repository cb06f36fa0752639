#![doc = include_str!("../README.md")]

mod chunk;
mod codec;
mod options;

pub use chunk::ChunkError;
pub use codec::{CODEC_NAME, HaarCodec};
pub use options::{ConfigurationError, HaarOptions};
