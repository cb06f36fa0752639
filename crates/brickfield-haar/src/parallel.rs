//! Many bricks on all threads. Bricks do not depend on each other.

use brickfield_core::glam::UVec3;
use rayon::prelude::*;

use crate::decode::{DecodeError, Decoded, decode};
use crate::encode::{EncodeError, EncodeOptions, encode};
use crate::sample::Sample;

/// Encodes bricks, each with its extent, on all threads of rayon's current pool; the result is that of [`encode`] for each.
///
/// # Errors
/// The error of one of the bricks that have one.
pub fn encode_bricks<T, S>(bricks: &[(UVec3, S)], options: &EncodeOptions) -> Result<Vec<Vec<u8>>, EncodeError>
where
    T: Sample,
    S: AsRef<[T]> + Sync,
{
    bricks.par_iter().map(|(extent, samples)| encode(*extent, samples.as_ref(), options)).collect()
}

/// Decodes bricks on all threads of rayon's current pool; the result is that of [`decode`] for each.
///
/// # Errors
/// The error of one of the bricks that have one.
pub fn decode_bricks<T: Sample>(bricks: &[impl AsRef<[u8]> + Sync]) -> Result<Vec<Decoded<T>>, DecodeError> {
    bricks.par_iter().map(|brick| decode(brick.as_ref())).collect()
}
