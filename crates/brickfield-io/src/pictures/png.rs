//! PNG files as slices. Pictures by the `png` crate.

use brickfield_core::{ScalarType, Voxels};
use png::{BitDepth, ColorType, Decoder, Reader, Transformations};

use crate::colour::Colours;
use crate::files::ByteSource;
use crate::limits::{Limits, check_bytes};
use crate::numbers::with_room;
use crate::packed_bits::widen_bits;
use crate::pixel::{KeptSamples, PictureShape, Pixel, PixelPart, keep_samples};
use crate::{ByteOrder, ReadError};

/// A PNG file whose header has been read.
pub(super) struct PngSlice<'a> {
    reader: Reader<Box<dyn ByteSource + 'a>>,
    pub(super) shape: PictureShape,
    n_bits: usize,
    palette: Vec<[u8; 3]>,
}

impl<'a> PngSlice<'a> {
    pub(super) fn open(source: Box<dyn ByteSource + 'a>, limits: &Limits) -> Result<PngSlice<'a>, ReadError> {
        let max_bytes = usize::try_from(limits.max_bytes).unwrap_or(usize::MAX).max(MIN_BUFFER);
        let mut decoder = Decoder::new_with_limits(source, png::Limits { bytes: max_bytes });
        decoder.set_transformations(Transformations::IDENTITY);
        decoder.set_ignore_text_chunk(true);
        decoder.set_ignore_iccp_chunk(true);
        let reader = decoder.read_info().map_err(|e| ReadError::decoder("the PNG header", e))?;
        let info = reader.info();
        let n_bits = info.bit_depth as usize;
        let stored = if info.bit_depth == BitDepth::Sixteen { ScalarType::U16 } else { ScalarType::U8 }.into();
        let pixel = match info.color_type {
            ColorType::Grayscale => Pixel::Grey,
            ColorType::GrayscaleAlpha => Pixel::Named(&["grey", "alpha"]),
            ColorType::Rgb => Pixel::Colours(Colours::Rgb),
            ColorType::Rgba => Pixel::Colours(Colours::Rgba),
            ColorType::Indexed => Pixel::Palette,
        };
        let palette = info.palette.as_deref().unwrap_or_default();
        let palette = palette.as_chunks::<3>().0.to_vec();
        let shape = PictureShape { width: info.width, height: info.height, depth: 1, stored, pixel };
        Ok(PngSlice { reader, shape, n_bits, palette })
    }

    /// Appends one value for each pixel.
    pub(super) fn append(
        &mut self,
        voxels: &mut Voxels,
        part: PixelPart,
        limits: &Limits,
        name: &str,
    ) -> Result<(), ReadError> {
        check_bytes(self.shape.n_bytes(), limits, || format!("a picture of {}", self.shape))?;
        let too_large = || ReadError::OutOfMemory { n_bytes: self.shape.n_bytes() };
        let n_bytes = self.reader.output_buffer_size().ok_or_else(too_large)?;
        let mut bytes = with_room(n_bytes)?;
        bytes.resize(n_bytes, 0u8);
        self.reader.next_frame(&mut bytes).map_err(|e| ReadError::decoder("the PNG data", e))?;
        let (n_samples, stored, n_pixels) =
            (self.shape.pixel.n_samples(), self.shape.stored, self.shape.n_pixels() as usize);
        if self.n_bits < 8 {
            let mut widened = with_room(n_pixels)?;
            widen_bits(&bytes, self.shape.width as usize, self.n_bits, &mut widened);
            bytes = widened;
        }
        let bytes = keep_samples(bytes, n_samples, stored.n_bytes(), part.kept());
        let kept = KeptSamples { bytes: &bytes, order: ByteOrder::Big, stored, n_pixels, palette: &self.palette };
        part.append(voxels, kept, limits, name)
    }
}

/// What a decoder needs besides the picture.
const MIN_BUFFER: usize = 1 << 20;
