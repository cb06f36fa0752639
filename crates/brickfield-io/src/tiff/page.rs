//! What the tags of a page say about its samples.

use brickfield_core::ScalarType;

use super::directory::{Directory, TiffFile};
use super::predict::Predictor;
use super::unpack::PageCompression;
use crate::ReadError;
use crate::colour::Colours;
use crate::limits::{Limits, check_bytes};
use crate::pixel::{PictureShape, Pixel};
use crate::stored_type::StoredType;

mod tag {
    pub(super) const WIDTH: u16 = 256;
    pub(super) const LENGTH: u16 = 257;
    pub(super) const BITS_PER_SAMPLE: u16 = 258;
    pub(super) const COMPRESSION: u16 = 259;
    pub(super) const PHOTOMETRIC: u16 = 262;
    pub(super) const FILL_ORDER: u16 = 266;
    pub(super) const SAMPLES_PER_PIXEL: u16 = 277;
    pub(super) const PLANAR_CONFIGURATION: u16 = 284;
    pub(super) const PREDICTOR: u16 = 317;
    pub(super) const COLOR_MAP: u16 = 320;
    pub(super) const EXTRA_SAMPLES: u16 = 338;
    pub(super) const SAMPLE_FORMAT: u16 = 339;
    pub(super) const YCBCR_SUBSAMPLING: u16 = 530;
    pub(super) const IMAGE_DEPTH: u16 = 32997;
}

/// One page: its shape, and how its samples are stored.
#[derive(Clone, Debug)]
pub(super) struct Page {
    pub(super) directory: Directory,
    pub(super) shape: PictureShape,
    /// Bits of a stored sample.
    pub(super) n_bits: usize,
    pub(super) compression: PageCompression,
    pub(super) predictor: Predictor,
    /// Whether each sample of a pixel has planes of its own.
    pub(super) is_planar: bool,
    pub(super) bits_are_reversed: bool,
    pub(super) is_ycbcr: bool,
    /// How the file wants values shown, where that is not low ones dark.
    pub(super) shown: Option<&'static str>,
}

impl Page {
    pub(super) fn read(file: &mut TiffFile, directory: Directory) -> Result<Page, ReadError> {
        let mut tags = Tags { file, directory: &directory };
        let compression = PageCompression::of_code(tags.number(tag::COMPRESSION, 1)?)?;
        let n_samples = tags.number(tag::SAMPLES_PER_PIXEL, 1)?;
        if !(1..=u64::from(u16::MAX)).contains(&n_samples) {
            return Err(ReadError::field(format!("samples a pixel of {}", directory.page), n_samples, "1 to 65535"));
        }
        let (n_bits, stored) = tags.sample_type()?;
        if compression == PageCompression::Jpeg && n_bits != 8 {
            let value = format!("JPEG of {n_bits} bits");
            return Err(ReadError::unsupported("compression", value, "JPEG of 8 bits is"));
        }
        let photometric = tags.number(tag::PHOTOMETRIC, if n_samples < 3 { 1 } else { 2 })?;
        let pixel = tags.pixel(photometric, n_samples as u16, compression)?;
        let [width, height, depth] =
            [tags.dimension(tag::WIDTH)?, tags.dimension(tag::LENGTH)?, tags.dimension(tag::IMAGE_DEPTH)?];
        let page = Page {
            shape: PictureShape { width, height, depth, stored, pixel },
            n_bits,
            compression,
            predictor: tags.predictor(n_bits, compression)?,
            is_planar: n_samples > 1 && tags.number(tag::PLANAR_CONFIGURATION, 1)? == 2,
            bits_are_reversed: tags.number(tag::FILL_ORDER, 1)? == 2,
            is_ycbcr: photometric == YCBCR,
            shown: match photometric {
                0 => Some("with low ones bright (MINISWHITE)"),
                32803 => Some("as a colour filter array"),
                _ => None,
            },
            directory: directory.clone(),
        };
        Ok(page)
    }

    /// A page can only be so many times larger than the file that holds it.
    pub(super) fn check_length(&self, n_file_bytes: u64, limits: &Limits) -> Result<(), ReadError> {
        let n_bytes = self.shape.n_bytes();
        let what = || format!("a page of {}", self.shape);
        check_bytes(n_bytes, limits, what)?;
        if n_bytes > u128::from(n_file_bytes) * self.compression.max_ratio() {
            let (n_compressed_bytes, expected_bytes) = (n_file_bytes, n_bytes);
            return Err(ReadError::TooFewCompressed { what: what(), n_compressed_bytes, expected_bytes });
        }
        Ok(())
    }

    /// The colours of its palette; empty without one.
    pub(super) fn palette(&self, file: &mut TiffFile) -> Result<Vec<[u8; 3]>, ReadError> {
        let map = file.numbers(&self.directory, tag::COLOR_MAP)?.unwrap_or_default();
        // Of 16 bits, though some writers use the lower 8 only.
        let shift = if map.iter().any(|v| *v > 255) { 8 } else { 0 };
        let n = map.len() / 3;
        let value = |i: usize| (map[i] >> shift).min(255) as u8;
        Ok((0..n).map(|i| [value(i), value(n + i), value(2 * n + i)]).collect())
    }

    pub(super) fn name(&self) -> &str {
        &self.directory.page
    }
}

const YCBCR: u64 = 6;

/// The tags of one page.
struct Tags<'a, 'f> {
    file: &'a mut TiffFile<'f>,
    directory: &'a Directory,
}

impl Tags<'_, '_> {
    fn number(&mut self, tag: u16, default: u64) -> Result<u64, ReadError> {
        Ok(self.file.number(self.directory, tag)?.unwrap_or(default))
    }

    fn dimension(&mut self, tag: u16) -> Result<u32, ReadError> {
        let (name, default) = match tag {
            tag::WIDTH => ("width", 0),
            tag::LENGTH => ("height", 0),
            _ => ("depth", 1),
        };
        let value = self.number(tag, default)?;
        let in_range = u32::try_from(value).ok().filter(|v| *v >= 1);
        let field = || format!("{name} of {}", self.directory.page);
        in_range.ok_or_else(|| ReadError::field(field(), value, "1 to 4294967295"))
    }

    /// Bits of a stored sample, and the type that it is read as.
    fn sample_type(&mut self) -> Result<(usize, StoredType), ReadError> {
        let one = |values: Option<Vec<u64>>, default| {
            let values = values.filter(|v| !v.is_empty()).unwrap_or_else(|| vec![default]);
            values.iter().all(|v| *v == values[0]).then_some(values[0]).ok_or(values)
        };
        let bits = one(self.file.numbers(self.directory, tag::BITS_PER_SAMPLE)?, 1);
        let format = one(self.file.numbers(self.directory, tag::SAMPLE_FORMAT)?, UNSIGNED);
        let (bits, format) = match (bits, format) {
            (Ok(bits), Ok(format)) => (bits, format),
            (Err(unlike), _) | (_, Err(unlike)) => {
                let value = format!("{unlike:?} in one pixel");
                return Err(ReadError::unsupported("sample type", value, "samples of one type are"));
            }
        };
        let scalar = match (format, bits) {
            (UNSIGNED | UNDEFINED, 1..=8) => ScalarType::U8,
            (UNSIGNED | UNDEFINED, 9..=16) => ScalarType::U16,
            (UNSIGNED | UNDEFINED, 32) => ScalarType::U32,
            (SIGNED, 8) => ScalarType::I8,
            (SIGNED, 16) => ScalarType::I16,
            (SIGNED, 32) => ScalarType::I32,
            (UNSIGNED | UNDEFINED, 64) => return Ok((64, StoredType::U64)),
            (SIGNED, 64) => return Ok((64, StoredType::I64)),
            (FLOAT, 16) => return Ok((16, StoredType::F16)),
            (FLOAT, 32) => ScalarType::F32,
            (FLOAT, 64) => ScalarType::F64,
            _ => {
                let kind = match format {
                    UNSIGNED | UNDEFINED => "unsigned integers",
                    SIGNED => "signed integers",
                    FLOAT => "floats",
                    _ => "complex or unknown numbers",
                };
                let value = format!("{kind} of {bits} bits");
                return Err(ReadError::unsupported("sample type", value, SAMPLE_TYPES));
            }
        };
        Ok((bits as usize, scalar.into()))
    }

    fn pixel(&mut self, photometric: u64, n_samples: u16, compression: PageCompression) -> Result<Pixel, ReadError> {
        if n_samples == 1 {
            return Ok(if photometric == 3 { Pixel::Palette } else { Pixel::Grey });
        }
        if photometric == YCBCR && compression != PageCompression::Jpeg {
            let factors = self.file.numbers(self.directory, tag::YCBCR_SUBSAMPLING)?.unwrap_or_else(|| vec![2, 2]);
            if factors.iter().any(|f| *f != 1) {
                let value = format!("{factors:?}");
                return Err(ReadError::unsupported("YCbCr subsampling", value, "none is, or JPEG compression"));
            }
        }
        let extra = self.number(tag::EXTRA_SAMPLES, 0)?;
        let named = |names: &'static [&'static str]| match names.len() == usize::from(n_samples) {
            true => Pixel::Named(names),
            false => Pixel::Unnamed(n_samples),
        };
        Ok(match photometric {
            0 | 1 if extra > 0 => named(&["grey", "alpha"]),
            2 => Colours::of_channels(n_samples.into()).map_or(Pixel::Unnamed(n_samples), Pixel::Colours),
            YCBCR if compression == PageCompression::Jpeg && n_samples == 3 => Pixel::Colours(Colours::Rgb),
            YCBCR => named(&["Y", "Cb", "Cr"]),
            5 => named(&["cyan", "magenta", "yellow", "black"]),
            8..=10 => named(&["L*", "a*", "b*"]),
            _ => Pixel::Unnamed(n_samples),
        })
    }

    fn predictor(&mut self, n_bits: usize, compression: PageCompression) -> Result<Predictor, ReadError> {
        // Writers put the tag into pages whose compression has no predictor.
        let has_none = matches!(compression, PageCompression::None | PageCompression::Jpeg | PageCompression::PackBits);
        match self.number(tag::PREDICTOR, 1)? {
            1 => Ok(Predictor::None),
            2 | 3 if has_none => Ok(Predictor::None),
            2 if n_bits.is_multiple_of(8) => Ok(Predictor::Horizontal),
            3 if n_bits >= 16 => Ok(Predictor::Float),
            other => {
                let value = format!("{other} of samples of {n_bits} bits");
                Err(ReadError::unsupported("predictor", value, "1, 2 of whole bytes, and 3 of floats are"))
            }
        }
    }
}

const SAMPLE_TYPES: &str = "integers of 1 to 16, 32 and 64 bits, floats of 16, 32 and 64 bits are";
const UNSIGNED: u64 = 1;
const SIGNED: u64 = 2;
const FLOAT: u64 = 3;
const UNDEFINED: u64 = 4;
