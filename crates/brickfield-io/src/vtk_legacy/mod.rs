//! Legacy VTK files of structured points, .vtk (vtk.org, "VTK File Formats", "Simple Legacy Formats").
//!
//! Versions 1.0 to 5.1, as text and binary (big endian). Not: other data sets, strings, text and binary mixed.

mod dataset;
mod grids;
mod sections;
mod shares;
mod types;

use std::io::{BufRead, Seek, SeekFrom};

use brickfield_core::Voxels;

use crate::error::check_length;
use crate::files::{ByteSource, n_bytes_left};
use crate::limits::CheckedShape;
use crate::opened::FileFacts;
use crate::samples::{allocate, append_text, least_text_bytes};
use crate::vtk_arrays::{choose, dims};
use crate::{ByteOrder, Format, OpenOptions, Opened, ReadError};
use dataset::Wanted;
pub(crate) use grids::read_grid;
use sections::{Sections, StoredArray};
use shares::Shares;

/// Reads structured points.
///
/// The first SCALARS or COLOR_SCALARS of POINT_DATA are read, else its first array of one component, else CELL_DATA's in
/// the same way. Cell values are samples at cell centres. The world is the file's own. The numbers from 0 to 1 that VTK
/// writes for bytes as text are read as these bytes.
///
/// # Errors
/// As [`ReadError`] lists them: sections that are wrong, unsupported or beyond the limits; data that are missing.
pub fn read(mut input: impl BufRead + Seek, options: &OpenOptions) -> Result<Opened, ReadError> {
    read_from(&mut input, options)
}

fn read_from(source: &mut dyn ByteSource, options: &OpenOptions) -> Result<Opened, ReadError> {
    let sections = Sections::read(source, Wanted::Image)?;
    let mut found = FileFacts::plain(Format::VtkLegacy, options);
    let arrays: Vec<_> = sections.arrays.iter().map(|array| &array.about).collect();
    let chosen =
        choose(&arrays, &mut found)?.ok_or(ReadError::Missing { field: "an array of POINT_DATA or CELL_DATA" })?;
    let array = &sections.arrays[chosen];
    let (support, geometry) = (array.about.support, &sections.geometry);
    let voxel = array.about.voxel(&mut found)?;
    let shape = CheckedShape::claim(dims(&geometry.extent, support)?, voxel, &options.limits)?;
    if array.n_voxels != shape.n_voxels() as u64 {
        let expected = format!("{}, from the dimensions", shape.n_voxels());
        return Err(ReadError::field(format!("size of {}", array.what()), array.n_voxels, expected));
    }
    let grid = geometry.placement(support, &mut found.notes).grid(shape.dims)?;
    let voxels = read_array(source, array, sections.is_binary, &shape)?;
    let voxels = shape.converted(voxels, &mut found.notes)?;
    found.finish(grid, voxels)
}

fn read_array(
    source: &mut dyn ByteSource,
    array: &StoredArray,
    is_binary: bool,
    shape: &CheckedShape,
) -> Result<Voxels, ReadError> {
    let what = array.what();
    source.seek(SeekFrom::Start(array.position)).map_err(|e| ReadError::io(&what, e))?;
    let n_left = n_bytes_left(source)?;
    let n_samples = shape.n_voxels() as u64 * shape.voxel.n_components;
    let sample = array.about.sample()?;
    let expected_bytes = match is_binary {
        true => u128::from(sample.n_bytes(n_samples)),
        false => least_text_bytes(n_samples.into()),
    };
    check_length(&what, n_left, expected_bytes)?;
    let mut voxels = allocate(shape)?;
    let (n, voxel) = (shape.n_voxels(), shape.voxel);
    match is_binary {
        true => sample.append(&mut voxels, &mut &mut *source, shape, ByteOrder::Big, &what)?,
        false if array.are_shares => append_text(&mut voxels, &mut Shares::new(source), n, voxel, &what)?,
        false => append_text(&mut voxels, source, n, voxel, &what)?,
    }
    Ok(voxels)
}
