//! The result of a reader of grids.

use brickfield_core::StructuredGrid;

use crate::{GridFormat, GridNote};

/// Structured grids from a file, and the file's statements about them.
#[derive(Clone, Debug, PartialEq)]
pub struct OpenedGrids {
    /// One or more. The fields of PLOT3D and VTK are those of the file; those of terrain have one, "elevation".
    pub grids: Vec<StructuredGrid>,
    /// The format that was read.
    pub format: GridFormat,
    /// The unit of positions, if the file states one: "m", "ft". Degrees have become metres.
    pub unit: Option<String>,
    /// Notes that the user ought to know.
    pub notes: Vec<GridNote>,
}

impl OpenedGrids {
    pub(crate) fn new(grids: Vec<StructuredGrid>, format: GridFormat) -> OpenedGrids {
        OpenedGrids { grids, format, unit: None, notes: Vec::new() }
    }
}
