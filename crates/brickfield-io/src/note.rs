//! Notes of a reader that the user ought to know, though the volume could be read.

use std::fmt;

use brickfield_core::{NonFinite, ScalarType};

use crate::ChoiceKind;
use crate::error::{Shown, bytes, counted};

/// Something about a file that the volume alone does not show.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum Note {
    /// Voxels that were not finite and have been replaced: +infinity by the greatest finite number of the file, the others by
    /// the least; `low` and `high` are their values.
    NonFinite { counts: NonFinite, low: f64, high: f64 },
    /// Slices that are not evenly spaced. `positions` are the distances from the first slice along the stack, in
    /// world units; the grid has the median step, and voxels are as in the file.
    UnevenSpacing { positions: Vec<f64>, min_step: f64, median_step: f64, max_step: f64, max_shift: f64 },
    /// Slices that are not evenly spaced, resampled linearly onto even ones ([`Opened::evenly_spaced`](crate::Opened::evenly_spaced)).
    EvenSlices { n_slices: usize, min_step: f64, max_step: f64, n_even: usize, step: f64 },
    /// The slices are sheared against their normal. The grid honours it: its third direction is not the normal.
    GantryTilt { degrees: f64 },
    /// There are several of a kind, and nobody said which to read.
    OneOfSeveral { kind: ChoiceKind, read: String, n_entries: u64 },
    /// An axis that is neither of space nor a choice; its first entry was read.
    FirstOfAxis { axis: String, n_entries: u64 },
    /// Voxels have colours; their luminance was read (ITU-R BT.709).
    Luminance,
    /// The stored type is none of [`ScalarType`](brickfield_core::ScalarType); every value fits the one that was taken.
    Converted { from: &'static str, to: ScalarType },
    /// The file states no usable spacing; 1 was taken.
    SpacingAssumed { axis: char, reason: &'static str },
    /// Lengths along these axes have a unit that is no known unit of length; they were not converted.
    UnknownUnit { axes: Vec<char>, unit: String },
    /// The file states an orientation that cannot be used; the next best statement was taken.
    OrientationIgnored { what: &'static str },
    /// The file states a rescale that cannot be used; the stored values were kept.
    RescaleIgnored { slope: f64, intercept: f64 },
    /// Slices at a position that an earlier slice has; they were left out.
    DuplicateSlices { n_slices: usize },
    /// Files of a folder that are not slices, or damaged slices of other series.
    FilesSkipped { n_files: usize, first: String, reason: String },
    /// The numbers of pictures leave some out; their slices are stacked without a gap.
    NumbersMissing { n_missing: u64, before: String, after: String },
    /// Slices without usable positions of their own; their step is what this element states.
    StepStated { from: &'static str, step: f64 },
    /// A table from stored values to the modality's unit (DICOM Modality LUT); the stored values were kept.
    ModalityLutIgnored,
    /// Colours by number, whose table cannot be used; the numbers were read.
    PaletteIgnored,
    /// Chunks of an OME-Zarr, strips or tiles of a TIFF that are not stored; their voxels have the fill value (of TIFF: 0).
    MissingChunks { n_missing: u64, n_chunks: u64 },
    /// A store that was packed, and whose samples were changed since: summaries of its blocks are not taken.
    ChangedStore,
    /// Planes of an OME-TIFF that are in none of its files; their voxels are 0.
    MissingPlanes { n_missing: u64, n_planes: u64 },
    /// A volume of which slices were asked for, whose format is read whole.
    ReadWhole { n_bytes: u64 },
    /// Pages of a TIFF that are reduced copies of others.
    PagesSkipped { n_pages: usize },
    /// The file was read as raw voxels, but begins as files of a known format do.
    ReadAsRaw { begins_like: &'static str },
    /// The data go on after the last voxel that the header promises.
    SurplusData,
    /// MONOCHROME1: the file wants low values shown bright. Values are as in the file.
    LowIsBright,
    /// The file wants its values shown in some way that the volume does not have.
    AsStored { shown: &'static str },
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Note::NonFinite { counts: n, low, high } => write!(
                f,
                "{} not finite and {} replaced: {} NaN and {} -infinity by {low}, {} +infinity by {high}",
                counted(n.total(), "voxel is", "voxels are"),
                were(n.total()),
                n.n_nan,
                n.n_negative_infinity,
                n.n_positive_infinity
            ),
            Note::UnevenSpacing { positions, min_step, median_step, max_step, max_shift } => write!(
                f,
                "{} slices are unevenly spaced, by {min_step:.4} to {max_step:.4}; the median {median_step:.4} is used, which puts them up to {max_shift:.4} out of place",
                positions.len()
            ),
            Note::EvenSlices { n_slices, min_step, max_step, n_even, step } => write!(
                f,
                "{n_slices} slices are unevenly spaced, by {min_step:.4} to {max_step:.4}; they were resampled onto {n_even}, {step:.4} apart"
            ),
            Note::GantryTilt { degrees } => write!(f, "gantry tilt of {degrees:.2} degrees; the grid is sheared by it"),
            Note::OneOfSeveral { kind, read, n_entries } => {
                write!(f, "one of {n_entries} {} was read: {read}", kind.plural())
            }
            Note::FirstOfAxis { axis, n_entries } => {
                write!(f, "axis {axis:?} has {n_entries} entries; the first was read")
            }
            Note::ChangedStore => f.write_str(
                "samples were changed since the store was packed: its summaries of blocks are made anew, its coarse levels are taken as they are",
            ),
            Note::Luminance => f.write_str("voxels have colours; their luminance was read"),
            Note::Converted { from, to } => write!(f, "values stored as {from} were read as {to}, all exactly"),
            Note::SpacingAssumed { axis, reason } => write!(f, "spacing {axis} {reason}; 1 is used"),
            Note::UnknownUnit { axes, unit } => {
                write!(
                    f,
                    "the unit {} of lengths along {} is not known; they are used as they are",
                    Shown::new(unit),
                    listed(axes)
                )
            }
            Note::OrientationIgnored { what } => write!(f, "{what} and was ignored"),
            Note::RescaleIgnored { slope, intercept } => {
                write!(f, "rescale by slope {slope} and intercept {intercept} was ignored")
            }
            Note::DuplicateSlices { n_slices } => {
                let slices = counted(n_slices, "slice lies", "slices lie");
                write!(f, "{slices} where another does and {} left out", were(*n_slices))
            }
            Note::FilesSkipped { n_files, first, reason } => {
                let files = counted(n_files, "file is no slice of this volume", "files are no slices of this volume");
                let which = if *n_files == 1 { "" } else { "first " };
                write!(f, "{files} and {} skipped, {which}{first:?}: {reason}", were(*n_files))
            }
            Note::NumbersMissing { n_missing, before, after } => {
                let pictures = counted(n_missing, "picture is", "pictures are");
                let first = if *n_missing == 1 { "" } else { "first " };
                write!(
                    f,
                    "by the numbers of the names {pictures} missing, {first}between {before:?} and {after:?}; the slices are stacked without a gap"
                )
            }
            Note::StepStated { from, step } => {
                write!(f, "slices state no positions of their own; their step {step:.4} comes from {from}")
            }
            Note::ModalityLutIgnored => {
                f.write_str("the file has a table of the modality's units (Modality LUT); values are as stored")
            }
            Note::PaletteIgnored => f.write_str(
                "values are numbers of colours, whose table is missing or cannot be used; values are as stored",
            ),
            Note::MissingChunks { n_missing, n_chunks } => {
                write!(f, "{n_missing} of {n_chunks} chunks are not stored; their voxels have the fill value")
            }
            Note::MissingPlanes { n_missing, n_planes } => {
                write!(f, "{n_missing} of {n_planes} planes are not stored; their voxels are 0")
            }
            Note::ReadWhole { n_bytes } => {
                write!(f, "the format cannot be read slice by slice: all {} of voxels are in memory", bytes(n_bytes))
            }
            Note::PagesSkipped { n_pages } => {
                let pages = counted(n_pages, "page", "pages");
                write!(f, "{pages} of reduced resolution {} skipped", were(*n_pages))
            }
            Note::ReadAsRaw { begins_like } => {
                write!(f, "the file begins like {begins_like}; it is read as raw voxels, as asked")
            }
            Note::SurplusData => f.write_str("the data go on after the last voxel that the header promises"),
            Note::LowIsBright => {
                f.write_str("the file wants low values shown bright (MONOCHROME1); values are as stored")
            }
            Note::AsStored { shown } => write!(f, "the file wants its values shown {shown}; they are as stored"),
        }
    }
}

/// "x", "x and y", "x, y and z".
fn listed(axes: &[char]) -> String {
    let names: Vec<_> = axes.iter().map(char::to_string).collect();
    match &names[..] {
        [first @ .., last] if !first.is_empty() => format!("{} and {last}", first.join(", ")),
        _ => names.concat(),
    }
}

fn were(n: usize) -> &'static str {
    if n == 1 { "was" } else { "were" }
}

/// Notes, once, that the data go on.
pub(crate) fn note_surplus(notes: &mut Vec<Note>) {
    if !notes.contains(&Note::SurplusData) {
        notes.push(Note::SurplusData);
    }
}
