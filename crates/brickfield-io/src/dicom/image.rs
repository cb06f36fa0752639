//! What a file states about all its frames: their size, the format of their samples, and where these lie.

use brickfield_core::{ScalarType, ValueRange};

use super::elements::{DataSet, PixelElement, PixelParts};
use super::palette::Palette;
use super::source::Codec;
use super::tags;
use crate::ReadError;
use crate::error::check_length;

#[derive(Debug)]
pub(super) struct Image {
    pub(super) name: String,
    pub(super) series: String,
    /// SOPInstanceUID: two files that share it are copies.
    pub(super) instance_uid: Option<String>,
    pub(super) columns: u64,
    pub(super) rows: u64,
    pub(super) n_frames: u32,
    /// The type that BitsAllocated and PixelRepresentation give, or that of floating-point pixel data.
    pub(super) scalar: ScalarType,
    pub(super) bits: Bits,
    pub(super) colour: Colour,
    pub(super) planes: Planes,
    pub(super) low_is_bright: bool,
    pub(super) has_modality_lut: bool,
    /// Colours by number, whose table is missing or cannot be used: the numbers are read.
    pub(super) lacks_palette: bool,
    pub(super) codec: Codec,
    pub(super) pixels: PixelElement,
    /// Where the frames begin, counted from the first fragment.
    pub(super) extended_offsets: Option<Vec<u64>>,
}

/// Which bits of a stored word are the sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Bits {
    /// 1 for samples that are packed eight to a byte.
    pub(super) n_allocated: u32,
    pub(super) n_stored: u32,
    pub(super) high: u32,
}

/// The meaning of a pixel's samples (PhotometricInterpretation).
#[derive(Debug)]
pub(super) enum Colour {
    Grey,
    Rgb,
    /// Luma and two chroma samples for each pixel.
    Ybr,
    /// The same, the chroma once for two pixels.
    Ybr422,
    Palette(Palette),
}

impl Colour {
    pub(super) fn is_grey(&self) -> bool {
        matches!(self, Colour::Grey)
    }
}

/// The order of the samples of a frame in colour (PlanarConfiguration).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Planes {
    Interleaved,
    Separate,
}

impl Image {
    pub(super) fn new(
        name: &str,
        elements: &DataSet,
        pixels: Option<PixelElement>,
        codec: Codec,
    ) -> Result<Image, ReadError> {
        let columns = elements.required(tags::COLUMNS, "Columns")? as u64;
        let rows = elements.required(tags::ROWS, "Rows")? as u64;
        let pixels = pixels.ok_or(ReadError::Missing { field: PIXEL_DATA })?;
        if let Codec::Unknown(uid) = &codec {
            let supported = "uncompressed, deflated, RLE, JPEG baseline and lossless, JPEG-LS and JPEG 2000 are";
            return Err(ReadError::unsupported("transfer syntax", uid, supported));
        }
        let (scalar, bits) = format(elements, pixels.tag)?;
        let photometric = elements.text(tags::PHOTOMETRIC_INTERPRETATION).unwrap_or_default();
        let colour = colour(elements, &photometric)?;
        let image = Image {
            name: name.to_owned(),
            series: series(elements),
            instance_uid: elements.text(tags::SOP_INSTANCE_UID),
            columns,
            rows,
            n_frames: n_frames(elements)?,
            scalar,
            bits,
            lacks_palette: photometric == PALETTE_COLOR && colour.is_grey(),
            colour,
            planes: match elements.number(tags::PLANAR_CONFIGURATION) {
                Some(1.0) => Planes::Separate,
                _ => Planes::Interleaved,
            },
            low_is_bright: photometric == "MONOCHROME1",
            has_modality_lut: !elements.items(tags::MODALITY_LUT).is_empty(),
            codec,
            pixels,
            extended_offsets: elements.bytes(tags::EXTENDED_OFFSETS).map(offsets),
        };
        image.check_frames()?;
        Ok(image)
    }

    pub(super) fn n_pixels(&self) -> u64 {
        self.columns * self.rows
    }

    pub(super) fn is_float(&self) -> bool {
        matches!(self.scalar, ScalarType::F32 | ScalarType::F64)
    }

    /// The type of a voxel: of a palette that of its entries, else that of the stored samples.
    pub(super) fn value_scalar(&self) -> ScalarType {
        match &self.colour {
            Colour::Palette(palette) if palette.n_bits == 8 => ScalarType::U8,
            Colour::Palette(_) => ScalarType::U16,
            _ => self.scalar,
        }
    }

    /// The values that the stored bits can have.
    pub(super) fn value_range(&self) -> ValueRange {
        let n_bits = match &self.colour {
            Colour::Palette(palette) => palette.n_bits,
            _ => self.bits.n_stored,
        };
        let size = (1u64 << n_bits) as f64;
        match self.value_scalar() {
            ScalarType::I8 | ScalarType::I16 | ScalarType::I32 => {
                ValueRange { min: -size / 2.0, max: size / 2.0 - 1.0 }
            }
            _ => ValueRange { min: 0.0, max: size - 1.0 },
        }
    }

    /// Samples of a frame as they are stored.
    pub(super) fn n_stored_samples(&self) -> u64 {
        match (&self.colour, &self.codec) {
            (Colour::Grey | Colour::Palette(_), _) => self.n_pixels(),
            (Colour::Ybr422, Codec::None) => self.rows * self.columns.next_multiple_of(2) * 2,
            _ => self.n_pixels() * 3,
        }
    }

    /// Bytes of all frames, where they are not packed by a codec.
    pub(super) fn n_plain_bytes(&self) -> u128 {
        let n_bits = u128::from(self.n_stored_samples()) * u128::from(self.bits.n_allocated);
        (n_bits * u128::from(self.n_frames)).div_ceil(8)
    }

    /// Each frame needs bytes, so that no more slices are made than the file has room for.
    fn check_frames(&self) -> Result<(), ReadError> {
        match &self.pixels.parts {
            PixelParts::Whole(_) if self.codec != Codec::None => {
                let value = format!("{} bytes without fragments", self.pixels.parts.n_bytes());
                Err(ReadError::field(PIXEL_DATA, value, "fragments, as the transfer syntax has it"))
            }
            PixelParts::Fragments(_) if self.codec == Codec::None => {
                Err(ReadError::field(PIXEL_DATA, "fragments", "plain bytes, as the transfer syntax has it"))
            }
            PixelParts::Fragments(fragments) => {
                let n_fragments = fragments.len().saturating_sub(1);
                match n_fragments >= self.n_frames as usize {
                    true => Ok(()),
                    false => Err(ReadError::field("fragments", n_fragments, format!("{} or more", self.n_frames))),
                }
            }
            PixelParts::Whole(_) if self.n_frames == 1 => Ok(()),
            PixelParts::Whole(extent) => check_length(PIXEL_DATA, extent.n_bytes, self.n_plain_bytes()),
        }
    }
}

impl PixelParts {
    fn n_bytes(&self) -> u64 {
        match self {
            PixelParts::Whole(extent) => extent.n_bytes,
            PixelParts::Fragments(fragments) => fragments.iter().map(|f| f.n_bytes).sum(),
        }
    }
}

pub(super) const PIXEL_DATA: &str = "PixelData";
const PALETTE_COLOR: &str = "PALETTE COLOR";

pub(super) fn series(elements: &DataSet) -> String {
    elements.text(tags::SERIES_INSTANCE_UID).unwrap_or_default()
}

const MAX_FRAMES: f64 = 1_048_576.0;

fn n_frames(elements: &DataSet) -> Result<u32, ReadError> {
    let n_frames = elements.number(tags::NUMBER_OF_FRAMES).unwrap_or(1.0);
    match n_frames <= MAX_FRAMES {
        true => Ok(n_frames.max(1.0) as u32),
        false => Err(ReadError::field("NumberOfFrames", n_frames, format!("1 to {MAX_FRAMES}"))),
    }
}

fn format(elements: &DataSet, pixels: tags::Tag) -> Result<(ScalarType, Bits), ReadError> {
    let whole = |n| Bits { n_allocated: n, n_stored: n, high: n - 1 };
    match pixels {
        tags::FLOAT_PIXELS => Ok((ScalarType::F32, whole(32))),
        tags::DOUBLE_PIXELS => Ok((ScalarType::F64, whole(64))),
        _ => {
            let bits = bits(elements)?;
            Ok((scalar(elements, bits.n_allocated), bits))
        }
    }
}

fn bits(elements: &DataSet) -> Result<Bits, ReadError> {
    let n_allocated = elements.required(tags::BITS_ALLOCATED, "BitsAllocated")? as u32;
    if !matches!(n_allocated, 1 | 8 | 16 | 32) {
        return Err(ReadError::unsupported("BitsAllocated", n_allocated, "1, 8, 16 and 32 are"));
    }
    let n_stored = elements.number(tags::BITS_STORED).map_or(n_allocated, |n| n as u32);
    let high = elements.number(tags::HIGH_BIT).map_or(n_stored.saturating_sub(1), |n| n as u32);
    if !(1..=n_allocated).contains(&n_stored) || !(n_stored - 1..n_allocated).contains(&high) {
        let value = format!("{n_stored} with HighBit {high}");
        return Err(ReadError::field("BitsStored", value, format!("to lie within {n_allocated} bits")));
    }
    Ok(Bits { n_allocated, n_stored, high })
}

fn scalar(elements: &DataSet, n_allocated: u32) -> ScalarType {
    let is_signed = elements.number(tags::PIXEL_REPRESENTATION) == Some(1.0);
    match (n_allocated, is_signed) {
        (1, _) | (8, false) => ScalarType::U8,
        (8, true) => ScalarType::I8,
        (16, false) => ScalarType::U16,
        (16, true) => ScalarType::I16,
        (_, false) => ScalarType::U32,
        (_, true) => ScalarType::I32,
    }
}

fn colour(elements: &DataSet, photometric: &str) -> Result<Colour, ReadError> {
    let n_samples = elements.number(tags::SAMPLES_PER_PIXEL).unwrap_or(1.0);
    match (n_samples, photometric) {
        (1.0, PALETTE_COLOR) => Ok(Palette::new(elements).map_or(Colour::Grey, Colour::Palette)),
        (1.0, _) => Ok(Colour::Grey),
        (3.0, "YBR_FULL_422") => Ok(Colour::Ybr422),
        (3.0, "YBR_FULL") => Ok(Colour::Ybr),
        // What JPEG 2000 makes of RGB; its decoder turns it back.
        (3.0, "RGB" | "YBR_RCT" | "YBR_ICT" | "") => Ok(Colour::Rgb),
        (3.0, other) => {
            let supported = "RGB, YBR_FULL, YBR_FULL_422, YBR_RCT, YBR_ICT and PALETTE COLOR are";
            Err(ReadError::unsupported("PhotometricInterpretation", other, supported))
        }
        (n, _) => Err(ReadError::unsupported("SamplesPerPixel", n, "1 and 3 are")),
    }
}

fn offsets(bytes: &[u8]) -> Vec<u64> {
    bytes.as_chunks::<8>().0.iter().map(|b| u64::from_le_bytes(*b)).collect()
}
