//! JPEG, by `jpeg-decoder`: baseline and extended of 8 bits, lossless of up to 16.

use jpeg_decoder::{ColorTransform, Decoder, PixelFormat};

use super::FrameShape;
use crate::ReadError;
use crate::error::check_length;

pub(super) fn decode(packed: &[u8], shape: &FrameShape) -> Result<Vec<u8>, ReadError> {
    let fault = |e| ReadError::decoder("a JPEG frame", e);
    let mut decoder = Decoder::new(packed);
    decoder.read_info().map_err(fault)?;
    let info = decoder.info().ok_or(ReadError::Missing { field: "the JPEG frame header" })?;
    let (n_channels, n_bits) = match info.pixel_format {
        PixelFormat::L8 => (1, 8),
        PixelFormat::L16 => (1, 16),
        PixelFormat::RGB24 => (3, 8),
        PixelFormat::CMYK32 => (4, 8),
    };
    shape.check("JPEG", info.width.into(), info.height.into(), n_channels)?;
    shape.check_precision("JPEG", n_bits)?;
    if n_channels == 3 {
        let is_ybr = shape.is_ybr || packed[..packed.len().min(32)].windows(5).any(|w| w == b"JFIF\0");
        decoder.set_color_transform(if is_ybr { ColorTransform::YCbCr } else { ColorTransform::RGB });
    }
    decoder.set_max_decoding_buffer_size(shape.n_samples() * 2);
    let samples = decoder.decode().map_err(fault)?;
    let n_expected = shape.n_samples() * n_bits as usize / 8;
    check_length("a JPEG frame", samples.len() as u64, n_expected as u128)?;
    Ok(match n_bits {
        16 => shape.words(samples.as_chunks::<2>().0.iter().map(|b| i32::from(u16::from_ne_bytes(*b)))),
        _ => shape.words(samples.iter().map(|b| i32::from(*b))),
    })
}
