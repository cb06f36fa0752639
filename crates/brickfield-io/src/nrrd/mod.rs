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

use crate::detached::{Promised, read_detached};
use crate::files::ByteSource;
use crate::limits::CheckedShape;
use crate::opened::FileFacts;
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
    let header = NrrdHeader::read(source)?;
    let stored_type = header.stored_type()?;
    let stored = header.stored(stored_type)?;
    let mut found = FileFacts::plain(Format::Nrrd, options);
    let space = Space::of(&header, &mut found.notes)?;
    let Part { voxel, n_before } = Part::choose(&header, &space.axes, stored_type, &mut found)?;
    let shape = CheckedShape::claim(space.dims, voxel, &options.limits)?;
    let grid = space.placement.grid(shape.dims)?;
    let promised = Promised { n_voxels: header.n_samples / u128::from(voxel.n_components), n_before };
    let voxels = match header.file_names()? {
        Some(names) => read_detached(&names, promised, &shape, &stored, files, &mut found.notes)?,
        None => stored.read(source, &promised.attached(&shape), &shape, &mut found.notes)?,
    };
    (found.frame, found.unit) = (space.frame, space.unit);
    found.finish(grid, voxels)
}
