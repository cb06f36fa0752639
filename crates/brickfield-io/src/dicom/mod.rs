//! DICOM series: the slices of a folder, or one file. Data sets by `dicom-object`, pixels by `dicom-pixeldata`.
//!
//! Uncompressed, RLE, JPEG baseline and lossless. Not: multi-frame objects, colours, JPEG 2000, JPEG-LS, deflated.
//!
//! Slices are sorted by position along their normal and kept as they are: none is resampled. Gantry tilt becomes a
//! sheared grid, which is exact. Uneven steps cannot be a grid; it gets the median step, and
//! [`Note::UnevenSpacing`] has all positions, so that nothing is lost.

mod elements;
mod pixels;
mod slice;
mod stack;

use crate::guard::guarded;
use crate::limits::CheckedShape;
use crate::opened::FileFacts;
use crate::{DataFiles, Format, Limits, Note, Opened, ReadError, WorldFrame};
use slice::Slice;

/// Reads the largest series among the named files; the world is the patient's, left-posterior-superior.
///
/// Values are rescaled to the modality's unit (Hounsfield units). A rescale by integers keeps integers, in the
/// stored type if they fit, else in the first of i16, u16, i32, u32 that they fit; others give f32, or f64 for stored
/// 32-bit integers.
///
/// # Errors
/// As [`ReadError`] lists them. In a folder, files that are no slices are skipped with a note; if none is left, the first
/// one's error is returned.
pub fn read(names: &[String], files: &dyn DataFiles, limits: &Limits) -> Result<Opened, ReadError> {
    let mut found = FileFacts::plain(Format::Dicom);
    let slices = read_headers(names, files, &mut found.notes)?;
    let slices = stack::largest_series(slices, &mut found.notes);
    let slices = stack::sorted(slices, &mut found.notes);
    let first = slices.first().ok_or(ReadError::Missing { field: "a slice" })?;
    let dims = [first.columns, first.rows, slices.len() as u64];
    let shape = CheckedShape::claim(dims, first.scalar, limits)?;
    let (placement, frame) = stack::placement(&slices, &mut found.notes);
    let grid = placement.grid(shape.dims)?;
    if first.low_is_bright {
        found.notes.push(Note::LowIsBright);
    }
    let stored = pixels::read_stored(&slices, &shape, files)?;
    let voxels = pixels::rescaled_slices(stored, &slices, limits, &mut found.notes)?;
    found.frame = frame;
    found.unit = (frame == WorldFrame::Lps).then(|| "mm".to_owned());
    found.finish(grid, voxels)
}

fn read_headers(names: &[String], files: &dyn DataFiles, notes: &mut Vec<Note>) -> Result<Vec<Slice>, ReadError> {
    let mut slices = Vec::new();
    let mut skipped = Vec::new();
    for name in names {
        match guarded("DICOM", || Slice::read(name, files)) {
            Ok(slice) => slices.push(slice),
            // A file that begins as DICOM and is damaged: without it the volume would have another shape.
            Err(fault) if is_damage(&fault) => return Err(ReadError::decoder(format!("slice {name:?}"), fault)),
            Err(fault) => skipped.push((name, fault)),
        }
    }
    let n_files = skipped.len();
    if let Some((first, fault)) = skipped.into_iter().next() {
        if slices.is_empty() {
            return Err(fault);
        }
        notes.push(Note::FilesSkipped { n_files, first: first.clone(), reason: fault.to_string() });
    }
    Ok(slices)
}

/// Whether a DICOM file ends too early or states impossible numbers; other files are no slices.
fn is_damage(fault: &ReadError) -> bool {
    use ReadError::{EndsWithin, Field, Missing, Truncated};
    matches!(fault, Field { .. } | EndsWithin { .. } | Truncated { .. } | Missing { field: elements::META_END })
}
