//! The codecs of packed pixel data. Each turns the fragments of one frame into words of BitsAllocated bits, low byte
//! first, the samples of a pixel side by side.

mod jpeg;
mod jpeg2000;
mod jpeg_ls;
mod jpeg_ls_scan;
mod rle;

use super::source::Codec;
use crate::ReadError;

/// The samples that a frame must have.
#[derive(Clone, Copy, Debug)]
pub(super) struct FrameShape {
    pub(super) columns: usize,
    pub(super) rows: usize,
    pub(super) n_channels: usize,
    pub(super) n_bits_allocated: u32,
    /// Whether luma and chroma are stored, as far as the data set says.
    pub(super) is_ybr: bool,
}

impl FrameShape {
    fn n_samples(&self) -> usize {
        self.columns * self.rows * self.n_channels
    }

    fn word_bytes(&self) -> usize {
        self.n_bits_allocated as usize / 8
    }

    /// Holds the codec's own statement of its size against the data set's: decoders allocate by it.
    fn check(&self, codec: &'static str, columns: u64, rows: u64, n_channels: u64) -> Result<(), ReadError> {
        let text = |c: u64, r: u64, n: u64| format!("{c} x {r} x {n}");
        let expected = text(self.columns as u64, self.rows as u64, self.n_channels as u64);
        match text(columns, rows, n_channels) {
            found if found == expected => Ok(()),
            found => Err(ReadError::field(
                format!("{codec} frame"),
                found,
                format!("{expected}, as the data set has it (columns, rows, samples)"),
            )),
        }
    }

    fn check_precision(&self, codec: &'static str, n_bits: u32) -> Result<(), ReadError> {
        match (1..=self.n_bits_allocated.min(16)).contains(&n_bits) {
            true => Ok(()),
            false => {
                let expected = format!("1 to {}", self.n_bits_allocated.min(16));
                Err(ReadError::field(format!("bits of a {codec} sample"), n_bits, expected))
            }
        }
    }

    /// Samples as words.
    fn words(&self, samples: impl Iterator<Item = i32>) -> Vec<u8> {
        let n_bytes = self.word_bytes();
        let mut words = Vec::with_capacity(self.n_samples() * n_bytes);
        for sample in samples.take(self.n_samples()) {
            words.extend_from_slice(&sample.to_le_bytes()[..n_bytes]);
        }
        words
    }
}

/// The words of a frame.
pub(super) fn decode(codec: &Codec, packed: &[u8], shape: &FrameShape) -> Result<Vec<u8>, ReadError> {
    match codec {
        Codec::Rle => rle::decode(packed, shape),
        Codec::Jpeg => jpeg::decode(packed, shape),
        Codec::JpegLs => jpeg_ls::decode(packed, shape),
        Codec::Jpeg2000 => jpeg2000::decode(packed, shape),
        Codec::None | Codec::Unknown(_) => Ok(packed.to_vec()),
    }
}
