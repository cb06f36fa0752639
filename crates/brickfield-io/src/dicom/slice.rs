//! One file's statements about its slice.

use std::io::{Read, SeekFrom};

use brickfield_core::ScalarType;
use brickfield_core::glam::DVec3;
use dicom_dictionary_std::tags;
use dicom_object::file::ReadPreamble;
use dicom_object::{DefaultDicomObject, OpenFileOptions, Tag};

use super::elements::{Syntax, check_lengths, read_transfer_syntax};
use crate::files::{ByteSource, DataFiles, n_bytes_left, open_named, read_head};
use crate::rescale::Rescale;
use crate::{Format, ReadError};

#[derive(Clone, Debug)]
pub(super) struct Slice {
    pub(super) name: String,
    pub(super) series: String,
    pub(super) instance: f64,
    pub(super) columns: u64,
    pub(super) rows: u64,
    /// The type that BitsAllocated and PixelRepresentation give.
    pub(super) scalar: ScalarType,
    pub(super) bits: Bits,
    pub(super) low_is_bright: bool,
    pub(super) position: Option<DVec3>,
    /// Directions of increasing column and row number.
    pub(super) orientation: Option<[DVec3; 2]>,
    /// World units between columns and between rows.
    pub(super) pixel_spacing: Option<[f64; 2]>,
    /// The step to the next slice as the file states it, for want of positions.
    pub(super) stated_step: Option<f64>,
    pub(super) rescale: Rescale,
}

/// Which bits of a stored word are the sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Bits {
    pub(super) n_allocated: u32,
    pub(super) n_stored: u32,
    pub(super) high: u32,
}

impl Slice {
    pub(super) fn read(name: &str, files: &dyn DataFiles) -> Result<Slice, ReadError> {
        let mut source = open_named(files, name)?;
        let object = read_object(&mut *source, ReadExtent::BeforePixels)?;
        let attributes = Attributes { object: &object };
        attributes.check_supported()?;
        let bits = attributes.bits()?;
        Ok(Slice {
            name: name.to_owned(),
            series: attributes.text(tags::SERIES_INSTANCE_UID).unwrap_or_default(),
            instance: attributes.number(tags::INSTANCE_NUMBER).unwrap_or(0.0),
            columns: attributes.required(tags::COLUMNS, "Columns")? as u64,
            rows: attributes.required(tags::ROWS, "Rows")? as u64,
            scalar: attributes.scalar(bits.n_allocated),
            bits,
            low_is_bright: attributes.text(tags::PHOTOMETRIC_INTERPRETATION).as_deref() == Some("MONOCHROME1"),
            position: attributes.numbers(tags::IMAGE_POSITION_PATIENT).map(DVec3::from),
            orientation: attributes.orientation(),
            pixel_spacing: attributes.pixel_spacing(),
            stated_step: attributes
                .number(tags::SPACING_BETWEEN_SLICES)
                .or(attributes.number(tags::SLICE_THICKNESS))
                .filter(|step| *step > 0.0),
            rescale: Rescale {
                slope: attributes.number(tags::RESCALE_SLOPE).unwrap_or(1.0),
                intercept: attributes.number(tags::RESCALE_INTERCEPT).unwrap_or(0.0),
            },
        })
    }

    pub(super) fn n_samples(&self) -> usize {
        (self.columns * self.rows) as usize
    }
}

/// How much of a data set is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ReadExtent {
    BeforePixels,
    WithPixels,
}

/// Parses a file, once all its lengths are known to lie within it.
pub(super) fn read_object(source: &mut dyn ByteSource, part: ReadExtent) -> Result<DefaultDicomObject, ReadError> {
    if n_bytes_left(source)? == 0 {
        return Err(ReadError::Empty);
    }
    let head = read_head(source, 132)?;
    if head.get(128..) != Some(b"DICM") {
        return Err(ReadError::wrong_start(Format::Dicom, &head, "128 bytes of any kind, then DICM"));
    }
    let syntax = known_syntax(&read_transfer_syntax(source)?)?;
    let end = check_lengths(source, syntax)?;
    source.seek(SeekFrom::Start(0)).map_err(|e| ReadError::io("the data set", e))?;
    let options = OpenFileOptions::new().read_preamble(ReadPreamble::Always);
    let options = match part {
        ReadExtent::BeforePixels => options.read_until(tags::PIXEL_DATA),
        ReadExtent::WithPixels => options.read_to(tags::PIXEL_DATA),
    };
    options.from_reader(source.take(end)).map_err(|e| ReadError::decoder("the data set", e))
}

fn known_syntax(uid: &str) -> Result<Syntax, ReadError> {
    let supported = "uncompressed, RLE, JPEG baseline and JPEG lossless are";
    match uid.strip_prefix("1.2.840.10008.1.2") {
        Some("") => Ok(Syntax::Implicit),
        Some(".1") => Ok(Syntax::ExplicitLittle),
        Some(".2") => Ok(Syntax::ExplicitBig),
        // JPEG baseline, extended, lossless, lossless first-order; RLE.
        Some(".4.50" | ".4.51" | ".4.57" | ".4.70" | ".5") => Ok(Syntax::ExplicitLittle),
        _ => Err(ReadError::unsupported("transfer syntax", uid, supported)),
    }
}

struct Attributes<'a> {
    object: &'a DefaultDicomObject,
}

impl Attributes<'_> {
    fn text(&self, tag: Tag) -> Option<String> {
        let text = self.object.get(tag)?.to_str().ok()?.into_owned();
        Some(text.trim_end_matches(['\0', ' ']).to_owned())
    }

    /// A finite number.
    fn number(&self, tag: Tag) -> Option<f64> {
        let number = self.object.get(tag)?.to_multi_float64().ok()?.first().copied()?;
        number.is_finite().then_some(number)
    }

    /// So many finite numbers.
    fn numbers<const N: usize>(&self, tag: Tag) -> Option<[f64; N]> {
        let numbers = self.object.get(tag)?.to_multi_float64().ok()?;
        let numbers: [f64; N] = numbers.try_into().ok()?;
        numbers.iter().all(|n| n.is_finite()).then_some(numbers)
    }

    fn required(&self, tag: Tag, field: &'static str) -> Result<f64, ReadError> {
        let number = self.number(tag).ok_or(ReadError::Missing { field })?;
        match (1.0..=65535.0).contains(&number) {
            true => Ok(number),
            false => Err(ReadError::field(field, number, "1 to 65535")),
        }
    }

    fn check_supported(&self) -> Result<(), ReadError> {
        let n_samples = self.number(tags::SAMPLES_PER_PIXEL).unwrap_or(1.0);
        if n_samples != 1.0 {
            return Err(ReadError::unsupported("SamplesPerPixel", n_samples, "1 is"));
        }
        let n_frames = self.number(tags::NUMBER_OF_FRAMES).unwrap_or(1.0);
        if n_frames > 1.0 {
            return Err(ReadError::unsupported("NumberOfFrames", n_frames, "1 is (one slice a file)"));
        }
        Ok(())
    }

    fn bits(&self) -> Result<Bits, ReadError> {
        let n_allocated = self.required(tags::BITS_ALLOCATED, "BitsAllocated")? as u32;
        if !matches!(n_allocated, 8 | 16 | 32) {
            return Err(ReadError::unsupported("BitsAllocated", n_allocated, "8, 16 and 32 are"));
        }
        let n_stored = self.number(tags::BITS_STORED).map_or(n_allocated, |n| n as u32);
        let high = self.number(tags::HIGH_BIT).map_or(n_stored.saturating_sub(1), |n| n as u32);
        if !(1..=n_allocated).contains(&n_stored) || !(n_stored - 1..n_allocated).contains(&high) {
            let value = format!("{n_stored} with HighBit {high}");
            return Err(ReadError::field("BitsStored", value, format!("to lie within {n_allocated} bits")));
        }
        Ok(Bits { n_allocated, n_stored, high })
    }

    fn scalar(&self, n_allocated: u32) -> ScalarType {
        let is_signed = self.number(tags::PIXEL_REPRESENTATION) == Some(1.0);
        match (n_allocated, is_signed) {
            (8, false) => ScalarType::U8,
            (8, true) => ScalarType::I8,
            (16, false) => ScalarType::U16,
            (16, true) => ScalarType::I16,
            (_, false) => ScalarType::U32,
            (_, true) => ScalarType::I32,
        }
    }

    fn orientation(&self) -> Option<[DVec3; 2]> {
        let [a, b, c, d, e, f] = self.numbers(tags::IMAGE_ORIENTATION_PATIENT)?;
        let (along_row, along_column) = (DVec3::new(a, b, c), DVec3::new(d, e, f));
        let usable = along_row.normalize_or_zero().cross(along_column.normalize_or_zero()).length() > 1e-3;
        usable.then(|| [along_row.normalize(), along_column.normalize()])
    }

    /// PixelSpacing gives the step between rows first.
    fn pixel_spacing(&self) -> Option<[f64; 2]> {
        let spacing = self.numbers(tags::PIXEL_SPACING).or_else(|| self.numbers(tags::IMAGER_PIXEL_SPACING));
        let [between_rows, between_columns] = spacing?;
        (between_rows > 0.0 && between_columns > 0.0).then_some([between_columns, between_rows])
    }
}
