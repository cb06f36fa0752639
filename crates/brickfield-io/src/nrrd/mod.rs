//! NRRD, attached and detached (Kindlmann, "Definition of NRRD file format", teem.sourceforge.net/nrrd/format.html).
//!
//! Encodings raw, ascii and gzip, both byte orders, line and byte skip, data files as one name, a list or a pattern.
//! Voxels of several numbers, series, layers of segmentations: one of them is read. Not: bzip2 and hex.

mod axes;
mod header;
mod segments;
mod space;
mod write;

pub use write::{save, write};

use std::io::{BufRead, Seek};

use brickfield_core::Rescale;

use crate::detached::Promised;
use crate::files::ByteSource;
use crate::limits::CheckedShape;
use crate::opened::FileFacts;
use crate::slices::{SamplesAt, StoredVolume};
use crate::{DataFiles, Format, OpenOptions, Opened, ReadError};
use axes::Part;
use header::NrrdHeader;
use space::Space;

/// Reads an NRRD from its header on; `files` finds detached data.
///
/// Spaces left-posterior-superior, right-anterior-superior and left-anterior-superior become
/// [`WorldFrame::Lps`](crate::WorldFrame::Lps); others stay as they are, and a key of our own (`brickfield_frame`) says that axes
/// are those of pictures. `space origin` is the first sample's centre.
///
/// # Errors
/// As [`ReadError`] lists them: a header that is wrong, unsupported or beyond the limits; data that are missing.
pub fn read(mut input: impl BufRead + Seek, files: &dyn DataFiles, options: &OpenOptions) -> Result<Opened, ReadError> {
    read_from(&mut input, files, options)
}

fn read_from(source: &mut dyn ByteSource, files: &dyn DataFiles, options: &OpenOptions) -> Result<Opened, ReadError> {
    described(source, options)?.read(source, files)
}

/// The volume of the header; the source is then at the first byte of attached data.
pub(crate) fn described(source: &mut dyn ByteSource, options: &OpenOptions) -> Result<StoredVolume, ReadError> {
    let header = NrrdHeader::read(source)?;
    let stored_type = header.stored_type()?;
    let stored = header.stored(stored_type)?;
    let mut found = FileFacts::plain(Format::Nrrd, options);
    let space = Space::of(&header, &mut found.notes)?;
    let Part { voxel, n_before } = Part::choose(&header, &space.axes, stored_type, &mut found)?;
    let shape = CheckedShape::claim(space.dims, voxel, &options.limits)?;
    let grid = space.placement.grid(shape.dims)?;
    let promised = Promised { n_voxels: header.n_samples / u128::from(voxel.n_components), n_before };
    let place = header.file_names()?.map_or(SamplesAt::Here("the data after the header"), SamplesAt::Files);
    (found.frame, found.unit) = (space.frame, space.unit);
    Ok(StoredVolume { found, grid, rescale: Rescale::IDENTITY, shape, stored, promised, place })
}
