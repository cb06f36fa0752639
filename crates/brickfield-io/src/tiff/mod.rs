//! TIFF and BigTIFF stacks: each page a slice. Pages by the `tiff` crate.
//!
//! Spacing from the description that ImageJ or OME-TIFF write; without one it is 1, for the resolution tags of other
//! writers are about paper. Of several channels and frames the first is read. Not: colours, palettes, packed bits.

mod description;
mod fault;
mod tags;

use std::io::{BufRead, Seek, SeekFrom};

use ::tiff::ColorType;
use ::tiff::decoder::{Decoder, DecodingResult, Limits as TiffLimits};
use ::tiff::tags::{SampleFormat, Tag};
use brickfield_core::glam::DVec3;
use brickfield_core::{ScalarType, Voxels};

use crate::files::{ByteSource, n_bytes_left, read_head};
use crate::format::is_tiff;
use crate::guard::guarded;
use crate::limits::{CheckedShape, check_bytes};
use crate::opened::FileFacts;
use crate::placement::GridPlacement;
use crate::samples::allocate;
use crate::{Format, Limits, Note, Opened, ReadError};
use description::ImageDescription;
use fault::PageNames;
use tags::check_tags;

/// Reads a TIFF stack; the outer corner of the first voxel is the world's origin.
///
/// # Errors
/// As [`ReadError`] lists them: pages that are wrong, unsupported, unlike each other or beyond the limits.
pub fn read(mut input: impl BufRead + Seek, limits: &Limits) -> Result<Opened, ReadError> {
    guarded("TIFF", || read_from(&mut input, limits))
}

type PageDecoder<'a> = Decoder<&'a mut dyn ByteSource>;

fn read_from(source: &mut dyn ByteSource, limits: &Limits) -> Result<Opened, ReadError> {
    source.seek(SeekFrom::Start(0)).map_err(|e| ReadError::io("the file", e))?;
    let n_file_bytes = n_bytes_left(source)?;
    if n_file_bytes == 0 {
        return Err(ReadError::Empty);
    }
    let head = read_head(source, 16)?;
    if !is_tiff(&head) {
        return Err(ReadError::wrong_start(Format::Tiff, &head, "II or MM, then 42 or 43"));
    }
    let mut names = PageNames { n_file_bytes, n_pages: None };
    check_tags(source, &names)?;
    let mut decoder = Decoder::new(source).map_err(|e| names.tags_fault(0, e))?.with_limits(header_limits());
    let mut found = FileFacts::pictures(Format::Tiff);
    let first = Page::read(&mut decoder, 0, &names)?;
    let description = ImageDescription::read(&decoder.get_tag_ascii_string(Tag::ImageDescription).unwrap_or_default());
    let spacing = spacing(&mut decoder, &description);
    first.check_length(n_file_bytes, limits)?;
    names.n_pages = description.order.as_ref().map(|order| order.n_pages());
    let pages = list_pages(&mut decoder, &first, &names)?;
    names.n_pages = Some(pages.n_pages as u64);
    if pages.n_reduced() > 0 {
        found.notes.push(Note::PagesSkipped { n_pages: pages.n_reduced() });
    }
    let slices = slices(&pages.like_first, &description, &mut found.notes)?;
    let dims = [first.width.into(), first.height.into(), slices.len() as u64];
    let shape = CheckedShape::claim(dims, first.scalar, limits)?;
    let grid = GridPlacement::axis_aligned(spacing, 0.5 * spacing).grid(shape.dims)?;
    let voxels = read_pages(decoder.with_limits(first.limits(limits)), &slices, &shape, &names)?;
    found.unit = description.unit;
    found.finish(grid, voxels)
}

/// Tables of strips may be long; nothing is decoded while pages are listed.
fn header_limits() -> TiffLimits {
    let mut limits = TiffLimits::default();
    limits.ifd_value_size = 64 << 20;
    limits.decoding_buffer_size = 64 << 20;
    limits
}

/// The properties that must be alike in all slices.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Page {
    width: u32,
    height: u32,
    scalar: ScalarType,
}

impl Page {
    fn read(decoder: &mut PageDecoder, page: usize, names: &PageNames) -> Result<Page, ReadError> {
        let fault = |e| names.tags_fault(page, e);
        let (width, height) = decoder.dimensions().map_err(fault)?;
        let bits = match decoder.colortype().map_err(fault)? {
            ColorType::Gray(bits) => bits,
            other => return Err(ReadError::unsupported("colour type", format!("{other:?}"), "grey is")),
        };
        let format = decoder.find_tag_unsigned::<u16>(Tag::SampleFormat).map_err(fault)?;
        let format = format.map_or(SampleFormat::Uint, SampleFormat::from_u16_exhaustive);
        let scalar = match (format, bits) {
            (SampleFormat::Uint, 8) => ScalarType::U8,
            (SampleFormat::Uint, 16) => ScalarType::U16,
            (SampleFormat::Uint, 32) => ScalarType::U32,
            (SampleFormat::Int, 8) => ScalarType::I8,
            (SampleFormat::Int, 16) => ScalarType::I16,
            (SampleFormat::Int, 32) => ScalarType::I32,
            (SampleFormat::IEEEFP, 32) => ScalarType::F32,
            (SampleFormat::IEEEFP, 64) => ScalarType::F64,
            _ => {
                return Err(ReadError::unsupported(
                    "sample type",
                    format!("{format:?} of {bits} bits"),
                    crate::SCALARS,
                ));
            }
        };
        Ok(Page { width, height, scalar })
    }

    fn n_bytes(&self) -> u128 {
        u128::from(self.width) * u128::from(self.height) * self.scalar.n_bytes() as u128
    }

    /// A page can only be so many times larger than the file that holds it.
    fn check_length(&self, n_file_bytes: u64, limits: &Limits) -> Result<(), ReadError> {
        let what = || format!("a page of {} x {} samples of {}", self.width, self.height, self.scalar);
        check_bytes(self.n_bytes(), limits, what)?;
        if self.n_bytes() > u128::from(n_file_bytes) * MAX_RATIO {
            let (n_compressed_bytes, expected_bytes) = (n_file_bytes, self.n_bytes());
            return Err(ReadError::TooFewCompressed { what: what(), n_compressed_bytes, expected_bytes });
        }
        Ok(())
    }

    /// A decoded page (the decoder holds tables of tags to the same limit), and room for strips that reach beyond it.
    fn limits(&self, limits: &Limits) -> TiffLimits {
        let page_bytes = self.n_bytes().min(u128::from(limits.max_bytes)) as usize;
        let mut tiff_limits = header_limits();
        tiff_limits.decoding_buffer_size = page_bytes.max(tiff_limits.ifd_value_size);
        tiff_limits.intermediate_buffer_size = page_bytes.saturating_mul(2).saturating_add(1 << 20);
        tiff_limits
    }
}

/// More than LZW, deflate and packed bits can expand.
const MAX_RATIO: u128 = 4096;

struct PageList {
    n_pages: usize,
    /// Numbers from 0 of the pages that are like the first; reduced copies are left out.
    like_first: Vec<usize>,
}

impl PageList {
    fn n_reduced(&self) -> usize {
        self.n_pages - self.like_first.len()
    }
}

fn list_pages(decoder: &mut PageDecoder, first: &Page, names: &PageNames) -> Result<PageList, ReadError> {
    let mut pages = PageList { n_pages: 1, like_first: vec![0] };
    while decoder.more_images() {
        let i = pages.n_pages;
        pages.n_pages += 1;
        let before = decoder.ifd_pointer();
        decoder.next_image().map_err(|e| names.next_fault(i, decoder, before, e))?;
        let subfile_type = decoder.find_tag_unsigned::<u32>(Tag::NewSubfileType);
        if subfile_type.map_err(|e| names.tags_fault(i, e))?.unwrap_or(0) & 1 == 1 {
            continue;
        }
        let page = Page::read(decoder, i, names)?;
        if page != *first {
            let value = format!("{} x {} {} ({})", page.width, page.height, page.scalar, names.page(i));
            let expected = format!("{} x {} {}, as the first page", first.width, first.height, first.scalar);
            return Err(ReadError::field("page", value, expected));
        }
        pages.like_first.push(i);
    }
    Ok(pages)
}

/// The pages of the first channel and frame.
fn slices(pages: &[usize], description: &ImageDescription, notes: &mut Vec<Note>) -> Result<Vec<usize>, ReadError> {
    let Some(order) = &description.order else { return Ok(pages.to_vec()) };
    let n_described = order.n_pages();
    if n_described != pages.len() as u64 {
        let expected = format!("{n_described}, from the description");
        return Err(ReadError::field("number of pages", pages.len(), expected));
    }
    for (axis, n_entries) in [("c", order.n_channels), ("t", order.n_frames)] {
        if n_entries > 1 {
            notes.push(Note::FirstOfAxis { axis: axis.to_owned(), n_entries });
        }
    }
    let step = order.pages_per_slice as usize;
    Ok(pages.iter().copied().step_by(step).take(order.n_slices as usize).collect())
}

fn spacing(decoder: &mut PageDecoder, description: &ImageDescription) -> DVec3 {
    let mut per_pixel = |tag| {
        let pixels_per_unit = resolution(decoder, tag)?;
        description.uses_resolution.then_some(1.0 / pixels_per_unit)
    };
    let [x, y] = [per_pixel(Tag::XResolution), per_pixel(Tag::YResolution)];
    let [dx, dy, dz] = description.spacing;
    let usable = |v: &f64| v.is_finite() && *v > 0.0;
    let or_one = |v: Option<f64>| v.filter(usable).unwrap_or(1.0);
    DVec3::new(or_one(dx.or(x)), or_one(dy.or(y)), or_one(dz))
}

fn resolution(decoder: &mut PageDecoder, tag: Tag) -> Option<f64> {
    use ::tiff::decoder::ifd::Value;
    match decoder.find_tag(tag).ok()?? {
        Value::Rational(n, d) => Some(f64::from(n) / f64::from(d)),
        _ => None,
    }
}

fn read_pages(
    mut decoder: PageDecoder,
    slices: &[usize],
    shape: &CheckedShape,
    names: &PageNames,
) -> Result<Voxels, ReadError> {
    let n_page = shape.dims.x as usize * shape.dims.y as usize;
    let mut voxels = None;
    for page in slices {
        decoder.seek_to_image(*page).map_err(|e| names.tags_fault(*page, e))?;
        let samples = decoder.read_image().map_err(|e| names.samples_fault(*page, &mut decoder, e))?;
        // Allocated when the first page has been decoded, so that a page which cannot be costs nothing.
        let voxels = match &mut voxels {
            Some(voxels) => voxels,
            None => voxels.insert(allocate(shape)?),
        };
        append_page(voxels, samples, n_page, &names.page(*page))?;
    }
    voxels.ok_or(ReadError::Missing { field: "a page" })
}

fn append_page(voxels: &mut Voxels, samples: DecodingResult, n_page: usize, page: &str) -> Result<(), ReadError> {
    macro_rules! append {
        ($out:expr, $samples:expr) => {{
            let found = $samples.len();
            if found != n_page {
                return Err(ReadError::TooFewSamples { what: page.to_owned(), found, expected: n_page });
            }
            $out.extend_from_slice(&$samples);
        }};
    }
    match (voxels, samples) {
        (Voxels::U8(out), DecodingResult::U8(s)) => append!(out, s),
        (Voxels::I8(out), DecodingResult::I8(s)) => append!(out, s),
        (Voxels::U16(out), DecodingResult::U16(s)) => append!(out, s),
        (Voxels::I16(out), DecodingResult::I16(s)) => append!(out, s),
        (Voxels::U32(out), DecodingResult::U32(s)) => append!(out, s),
        (Voxels::I32(out), DecodingResult::I32(s)) => append!(out, s),
        (Voxels::F32(out), DecodingResult::F32(s)) => append!(out, s),
        (Voxels::F64(out), DecodingResult::F64(s)) => append!(out, s),
        (voxels, _) => {
            let expected = format!("{}, as its tags say", voxels.scalar_type());
            return Err(ReadError::field(page, "of another sample type", expected));
        }
    }
    Ok(())
}
