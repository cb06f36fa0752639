//! JPEG 2000, by `hayro-jpeg2000`: lossless exactly up to 16 bits, lossy to the rounding of f32.

use hayro_jpeg2000::{DecodeSettings, DecoderContext, Image};

use super::FrameShape;
use crate::ReadError;
use crate::error::check_length;

pub(super) fn decode(packed: &[u8], shape: &FrameShape) -> Result<Vec<u8>, ReadError> {
    let missing = ReadError::Missing { field: "the SIZ segment of a JPEG 2000 frame" };
    let codestream = unboxed(packed).ok_or(missing)?;
    let size = Size::of(codestream)?;
    shape.check("JPEG 2000", size.columns, size.rows, size.n_components)?;
    shape.check_precision("JPEG 2000", size.n_bits)?;
    let settings = DecodeSettings { resolve_palette_indices: false, strict: true, target_resolution: None };
    let fault = |e| ReadError::decoder("a JPEG 2000 frame", e);
    let image = Image::new(codestream, &settings).map_err(fault)?;
    let mut context = DecoderContext::default();
    let decoded = image.decode(&mut context).map_err(fault)?;
    let planes: Vec<&[f32]> = decoded.components().iter().map(|component| component.samples()).collect();
    let n_pixels = shape.columns * shape.rows;
    let n_found = planes.iter().map(|plane| plane.len()).min().unwrap_or(0).min(n_pixels) * planes.len();
    check_length("a JPEG 2000 frame", n_found as u64, shape.n_samples() as u128)?;
    // The decoder takes signed samples for unsigned ones, and adds half their range.
    let half = 1 << (size.n_bits - 1);
    let (low, min, max) = if size.is_signed { (half, -half, half - 1) } else { (0, 0, 2 * half - 1) };
    let sample = |i: usize| {
        let value = planes[i % planes.len()][i / planes.len()].round() as i32 - low;
        value.clamp(min, max)
    };
    Ok(shape.words((0..shape.n_samples()).map(sample)))
}

/// The statements of the SIZ segment (ISO/IEC 15444-1, A.5.1).
struct Size {
    columns: u64,
    rows: u64,
    n_components: u64,
    n_bits: u32,
    is_signed: bool,
}

const CODESTREAM: &[u8] = &[0xff, 0x4f, 0xff, 0x51];
/// A codestream may be wrapped in boxes; those before it are short.
const MAX_BOX_BYTES: usize = 4096;

/// The codestream without the boxes around it: DICOM, not they, tells the colours.
fn unboxed(packed: &[u8]) -> Option<&[u8]> {
    let head = &packed[..packed.len().min(MAX_BOX_BYTES)];
    let start = head.windows(CODESTREAM.len()).position(|w| w == CODESTREAM)?;
    Some(&packed[start..])
}

impl Size {
    fn of(codestream: &[u8]) -> Result<Size, ReadError> {
        let size = Size::parsed(&codestream[CODESTREAM.len()..]);
        size.ok_or_else(|| ReadError::unsupported("JPEG 2000", "components", "components of one size and type are"))
    }

    /// Length and capabilities in 2 bytes each; the grid's size and offset, the tiles' size and offset in 8 bytes each.
    fn parsed(siz: &[u8]) -> Option<Size> {
        let long = |at: usize| Some(u64::from(u32::from_be_bytes(*siz.get(at..)?.first_chunk()?)));
        let (columns, rows) = (long(4)?.checked_sub(long(12)?)?, long(8)?.checked_sub(long(16)?)?);
        let n_components = u64::from(u16::from_be_bytes(*siz.get(36..)?.first_chunk()?));
        let components = siz.get(38..38 + 3 * n_components as usize)?.as_chunks::<3>().0;
        let [first, ..] = components else { return None };
        let are_alike = components.iter().all(|c| c == first) && first[1..] == [1, 1];
        let (n_bits, is_signed) = (u32::from(first[0] & 0x7f) + 1, first[0] & 0x80 != 0);
        are_alike.then_some(Size { columns, rows, n_components, n_bits, is_signed })
    }
}
