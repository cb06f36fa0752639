//! NRRD, attached and detached (Kindlmann, "Definition of NRRD file format", teem.sourceforge.net/nrrd/format.html).
//!
//! Encodings raw, ascii and gzip, both byte orders, line and byte skip, data files as one name, a list or a pattern.
//! Not: bzip2 and hex; more than one value per voxel.

mod header;
mod space;
mod write;

pub use write::{save, write};

use std::io::{BufRead, Seek};

use crate::detached::read_detached;
use crate::files::ByteSource;
use crate::limits::CheckedShape;
use crate::opened::FileFacts;
use crate::samples::allocate;
use crate::stored::DataFile;
use crate::{DataFiles, Format, OpenOptions, Opened, ReadError};
use header::NrrdHeader;
use space::Space;

/// Reads an NRRD from its header on; `files` finds detached data.
///
/// Spaces left-posterior-superior, right-anterior-superior and left-anterior-superior become
/// [`WorldFrame::Lps`](crate::WorldFrame::Lps); others stay as they are. `space origin` is the first sample's centre.
///
/// # Errors
/// As [`ReadError`] lists them: a header that is wrong, unsupported or beyond the limits; data that are missing.
pub fn read(mut input: impl BufRead + Seek, files: &dyn DataFiles, options: &OpenOptions) -> Result<Opened, ReadError> {
    read_from(&mut input, files, options)
}

fn read_from(source: &mut dyn ByteSource, files: &dyn DataFiles, options: &OpenOptions) -> Result<Opened, ReadError> {
    let header = NrrdHeader::read(source)?;
    let scalar = header.scalar()?;
    let stored = header.stored(scalar)?;
    let mut found = FileFacts::plain(Format::Nrrd, options);
    let space = Space::of(&header, &mut found.notes)?;
    let shape = CheckedShape::claim(space.dims, scalar, &options.limits)?;
    let grid = space.placement.grid(shape.dims)?;
    let voxels = match header.file_names()? {
        Some(names) => read_detached(&names, header.n_samples(), &shape, &stored, files, &mut found.notes)?,
        None => {
            let n_wanted = shape.n_voxels();
            let part = DataFile { name: "the data after the header", n_samples: header.n_samples(), n_wanted };
            stored.seek_samples(source, &part, scalar.n_bytes())?;
            let mut voxels = allocate(&shape)?;
            stored.append(&mut voxels, source, &part, &mut found.notes)?;
            voxels
        }
    };
    (found.frame, found.unit) = (space.frame, space.unit);
    found.finish(grid, voxels)
}
