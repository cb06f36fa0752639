//! Notes of a reader that the user ought to know, though the volume could be read.

use std::fmt;

use brickfield_core::NonFinite;

use crate::error::counted;

/// Something about a file that the volume alone does not show.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum Note {
    /// Voxels that were not finite and have been replaced.
    NonFinite(NonFinite),
    /// Slices that are not evenly spaced. `positions` are the distances from the first slice along the stack, in
    /// world units; the grid has the median step, and voxels are as in the file.
    UnevenSpacing { positions: Vec<f64>, min_step: f64, median_step: f64, max_step: f64, max_shift: f64 },
    /// Slices that are not evenly spaced, resampled linearly onto even ones ([`Opened::evenly_spaced`](crate::Opened::evenly_spaced)).
    EvenSlices { n_slices: usize, min_step: f64, max_step: f64, n_even: usize, step: f64 },
    /// The slices are sheared against their normal. The grid honours it: its third direction is not the normal.
    GantryTilt { degrees: f64 },
    /// The file has several arrays (channels, data sets); one was read.
    SeveralArrays { kept: String, n_arrays: usize },
    /// An axis beyond the three of space; its first entry was read.
    FirstOfAxis { axis: String, n_entries: u64 },
    /// The file states no usable spacing; 1 was taken.
    SpacingAssumed { axis: char, reason: &'static str },
    /// The file states an orientation that cannot be used; the next best statement was taken.
    OrientationIgnored { what: &'static str },
    /// The file states a rescale that cannot be used; the stored values were kept.
    RescaleIgnored { slope: f64, intercept: f64 },
    /// A folder holds several series; the one with most slices was read.
    SeveralSeries { kept: String, n_series: usize, n_slices_left_out: usize },
    /// Slices at a position that an earlier slice has; they were left out.
    DuplicateSlices { n_slices: usize },
    /// Files of a folder that are not slices.
    FilesSkipped { n_files: usize, first: String, reason: String },
    /// Chunks of an OME-Zarr that are not stored; their voxels have the array's fill value.
    MissingChunks { n_missing: u64, n_chunks: u64 },
    /// Pages of a TIFF that are reduced copies of others.
    PagesSkipped { n_pages: usize },
    /// The file was read as raw voxels, but begins as files of a known format do.
    ReadAsRaw { begins_like: &'static str },
    /// The data go on after the last voxel that the header promises.
    SurplusData,
    /// MONOCHROME1: the file wants low values shown bright. Values are as in the file.
    LowIsBright,
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Note::NonFinite(n) => write!(
                f,
                "{} not finite ({} NaN, {} +infinity, {} -infinity) and {} replaced",
                counted(n.total(), "voxel is", "voxels are"),
                n.n_nan,
                n.n_positive_infinity,
                n.n_negative_infinity,
                were(n.total())
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
            Note::SeveralArrays { kept, n_arrays } => write!(f, "one of {n_arrays} arrays was read: {kept:?}"),
            Note::FirstOfAxis { axis, n_entries } => {
                write!(f, "axis {axis:?} has {n_entries} entries; the first was read")
            }
            Note::SpacingAssumed { axis, reason } => write!(f, "spacing {axis} {reason}; 1 is used"),
            Note::OrientationIgnored { what } => write!(f, "{what} and was ignored"),
            Note::RescaleIgnored { slope, intercept } => {
                write!(f, "rescale by slope {slope} and intercept {intercept} was ignored")
            }
            Note::SeveralSeries { kept, n_series, n_slices_left_out } => {
                let left_out = counted(n_slices_left_out, "slice was", "slices were");
                write!(f, "one of {n_series} series was read: {kept}; {left_out} left out")
            }
            Note::DuplicateSlices { n_slices } => {
                let slices = counted(n_slices, "slice lies", "slices lie");
                write!(f, "{slices} where another does and {} left out", were(*n_slices))
            }
            Note::FilesSkipped { n_files, first, reason } => {
                let files = counted(n_files, "file is no slice", "files are no slices");
                let which = if *n_files == 1 { "" } else { "first " };
                write!(f, "{files} and {} skipped, {which}{first:?}: {reason}", were(*n_files))
            }
            Note::MissingChunks { n_missing, n_chunks } => {
                write!(f, "{n_missing} of {n_chunks} chunks are not stored; their voxels have the fill value")
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
        }
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
