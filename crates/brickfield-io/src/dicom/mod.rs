//! DICOM series: the slices of a folder and its sub-folders, or one file.
//!
//! Plain, deflated, RLE, JPEG baseline and lossless, JPEG-LS, JPEG 2000; one frame a file or many; with or without
//! preamble and meta group; grey or in colour. Not: JPEG 2000 of several components of different sizes, video.
//!
//! | file | where to start for |
//! |---|---|
//! | `source.rs`, `elements.rs`, `headers.rs`, `tags.rs`, `attributes.rs` | bytes to elements |
//! | `image.rs`, `slice.rs`, `frames.rs`, `mosaic.rs` | elements to slices |
//! | `series.rs`, `stack.rs` | slices to a stack |
//! | `frame_bytes.rs`, `codecs/`, `colours.rs`, `palette.rs`, `pixels.rs` | frames to voxels |
//!
//! Slices are sorted by position along their normal and kept as they are: none is resampled. Gantry tilt becomes a
//! sheared grid, which is exact. Uneven steps cannot be a grid; it gets the median step, and
//! [`Note::UnevenSpacing`] has all positions, so that nothing is lost.

mod attributes;
mod codecs;
mod colours;
mod elements;
mod frame_bytes;
mod frames;
mod headers;
mod image;
mod mosaic;
mod palette;
mod pixels;
mod series;
mod slice;
mod source;
mod stack;
mod tags;

pub(crate) use source::begins_with_elements;

use crate::colour::{ColourPart, Colours};
use crate::limits::CheckedShape;
use crate::opened::FileFacts;
use crate::{DataFiles, Format, Limits, Note, OpenOptions, Opened, ReadError, WorldFrame};
use frames::{Unread, read_slices};
use slice::Slice;

/// Reads one series among the named files, the largest unless another is selected; the world is the patient's,
/// left-posterior-superior.
///
/// Values are in the modality's unit (Hounsfield units). A rescale by integers gives integers, in the stored type if they
/// fit, else in the first of i16, u16, i32, u32 that they fit. Another rescale becomes the volume's, and voxels keep their type;
/// where slices differ in it, values become f32, or f64 for stored 32-bit integers.
///
/// # Errors
/// As [`ReadError`] lists them. In a folder, files that are no slices, and damaged ones of other series, are skipped with
/// a note; if none is left, the first one's error is returned.
pub fn read(names: &[String], files: &dyn DataFiles, options: &OpenOptions) -> Result<Opened, ReadError> {
    let mut found = FileFacts::plain(Format::Dicom, options);
    let (slices, unread) = read_headers(names, files, &options.limits);
    if slices.is_empty() {
        return Err(first_fault(unread));
    }
    let slices = series::chosen_series(slices, &mut found)?;
    series::pass_over(unread, &slices[0].image.series, &mut found.notes)?;
    let slices = stack::stacked(slices, &mut found)?;
    let first = &slices[0];
    let scalar = pixels::common_scalar(&slices, &mut found.notes);
    let dims = [first.columns, first.rows, slices.len() as u64];
    let shape = CheckedShape::claim(dims, scalar, &options.limits)?;
    let (placement, frame) = stack::placement(&slices, &mut found.notes);
    let grid = placement.grid(shape.dims)?;
    note_meaning(&slices, &mut found.notes);
    let part = match first.image.colour.is_grey() {
        true => ColourPart::Luminance,
        false => Colours::Rgb.choose(&mut found)?,
    };
    let stored = pixels::read_stored(&slices, &shape, part, files, &options.limits)?;
    let rescaled = pixels::rescaled_slices(stored, &slices, &options.limits, &mut found.notes)?;
    found.frame = frame;
    found.unit = (frame == WorldFrame::Lps).then(|| "mm".to_owned());
    found.finish_rescaled(grid, rescaled.voxels, rescaled.rescale)
}

/// Whether a file lists others (DICOMDIR) and has no slices itself.
pub(crate) fn is_index(name: &str, files: &dyn DataFiles, limits: &Limits) -> bool {
    matches!(read_slices(name, files, limits), Ok(slices) if slices.is_empty())
}

/// The slices of all files, and the files that gave none.
fn read_headers(names: &[String], files: &dyn DataFiles, limits: &Limits) -> (Vec<Slice>, Vec<Unread>) {
    let (mut slices, mut unread) = (Vec::new(), Vec::new());
    for name in names {
        match read_slices(name, files, limits) {
            Ok(mut of_file) => slices.append(&mut of_file),
            Err(file) => unread.push(*file),
        }
    }
    (slices, unread)
}

/// Why there is no slice: the fault of a damaged file, else of the first.
fn first_fault(unread: Vec<Unread>) -> ReadError {
    let damaged = unread.iter().position(|file| series::is_damage(&file.fault)).unwrap_or(0);
    match unread.into_iter().nth(damaged) {
        Some(file) if series::is_damage(&file.fault) => file.into_fault(),
        Some(file) => file.fault,
        None => ReadError::Missing { field: "a slice" },
    }
}

fn note_meaning(slices: &[Slice], notes: &mut Vec<Note>) {
    if slices.iter().any(|slice| slice.image.low_is_bright) {
        notes.push(Note::LowIsBright);
    }
    if slices.iter().any(|slice| slice.image.has_modality_lut) {
        notes.push(Note::ModalityLutIgnored);
    }
    if slices.iter().any(|slice| slice.image.lacks_palette) {
        notes.push(Note::PaletteIgnored);
    }
}
