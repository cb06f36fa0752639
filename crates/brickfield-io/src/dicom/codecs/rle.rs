//! Runs of bytes (PS3.5, annex G): one segment for each byte of a sample, the high byte first.

use super::FrameShape;
use crate::ReadError;
use crate::error::check_length;
use crate::runs::unpack_runs;

const HEADER_BYTES: usize = 64;
const MAX_SEGMENTS: usize = 15;

pub(super) fn decode(packed: &[u8], shape: &FrameShape) -> Result<Vec<u8>, ReadError> {
    let expected = shape.n_channels * shape.word_bytes();
    check_length("the header of an RLE frame", packed.len() as u64, HEADER_BYTES as u128)?;
    let words: Vec<usize> =
        packed[..HEADER_BYTES].as_chunks::<4>().0.iter().map(|b| u32::from_le_bytes(*b) as usize).collect();
    if words[0] != expected || expected > MAX_SEGMENTS {
        return Err(ReadError::field("segments of an RLE frame", words[0], expected.to_string()));
    }
    let mut out = vec![0; shape.n_samples() * shape.word_bytes()];
    for i in 0..expected {
        let end = if i + 1 < expected { words[i + 2] } else { packed.len() };
        let segment = packed.get(words[1 + i]..end.min(packed.len())).unwrap_or_default();
        let (channel, byte) = (i / shape.word_bytes(), i % shape.word_bytes());
        let first = channel * shape.word_bytes() + shape.word_bytes() - 1 - byte;
        let mut places = out.iter_mut().skip(first).step_by(expected);
        let n_missing = unpack_runs(segment, &mut places);
        if n_missing > 0 {
            let n_pixels = (shape.columns * shape.rows) as u64;
            let what = format!("segment {} of an RLE frame", i + 1);
            check_length(&what, n_pixels - n_missing as u64, u128::from(n_pixels))?;
        }
    }
    Ok(out)
}
