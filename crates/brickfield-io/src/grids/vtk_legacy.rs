//! Legacy VTK files of rectilinear and structured grids, .vtk (vtk.org, "VTK File Formats", "Simple Legacy Formats").

use std::io::{BufRead, Seek};

use crate::{GridFormat, GridOptions, OpenedGrids, ReadError};

/// Reads `RECTILINEAR_GRID` or `STRUCTURED_GRID`, as text or binary (big endian).
///
/// All arrays of POINT_DATA are fields: of an array "u" with three components "u x", "u y" and "u z", with more "u 0" and so
/// on. `BLANKING` 0, and the mark of hidden points in `vtkGhostType`, make holes. Arrays of cells are left out with a note.
///
/// # Errors
/// As [`ReadError`] lists them: other data sets; arrays of another size than the dimensions; arrays of cells only; grids
/// beyond the limits or the file.
pub fn read(mut input: impl BufRead + Seek, options: &GridOptions) -> Result<OpenedGrids, ReadError> {
    let (grid, notes) = crate::vtk_legacy::read_grid(&mut input, &options.limits)?;
    Ok(OpenedGrids { notes, ..OpenedGrids::new(vec![grid], GridFormat::VtkLegacy) })
}
