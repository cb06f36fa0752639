//! VTK XML RectilinearGrid and StructuredGrid, .vtr and .vts (vtk.org, "VTK XML Formats").

use std::io::{BufRead, Seek};

use crate::guard::guarded;
use crate::{GridFormat, GridOptions, OpenedGrids, ReadError};

/// Reads a .vtr or .vts file, in all encodings of [`vti`](crate::vti). Each piece is a grid of its own.
///
/// Fields, holes and notes are those of [`vtk_legacy`](super::vtk_legacy::read), from PointData.
///
/// # Errors
/// As [`ReadError`] lists them: a document that is wrong or about other data; arrays of cells only; data that are missing;
/// grids beyond the limits or the file.
pub fn read(mut input: impl BufRead + Seek, options: &GridOptions) -> Result<OpenedGrids, ReadError> {
    guarded("VTK", || {
        let (grids, notes) = crate::vti::read_grids(&mut input, &options.limits)?;
        Ok(OpenedGrids { notes, ..OpenedGrids::new(grids, GridFormat::VtkXml) })
    })
}
