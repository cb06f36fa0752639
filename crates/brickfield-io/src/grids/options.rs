//! What a caller wants of a file of grids.

use std::path::PathBuf;

use crate::grids::plot3d::Plot3dLayout;
use crate::{GridFormat, Limits};

/// What a caller wants of a file of grids, and how much may be allocated for it.
///
/// ```
/// use brickfield_io::{ByteOrder, GridOptions};
/// let mut options = GridOptions::default();
/// options.limits.max_bytes = 1 << 30;
/// options.solution = Some("combq.bin".into());
/// options.layout.order = Some(ByteOrder::Big);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct GridOptions {
    /// How much may be allocated for all grids of the file and their fields.
    pub limits: Limits,
    /// The format, in place of what content and extension suggest.
    pub format: Option<GridFormat>,
    /// The PLOT3D file of solutions (q) or functions (f) that belongs to the grid.
    pub solution: Option<PathBuf>,
    /// The layout of PLOT3D files, as far as the caller knows it.
    pub layout: Plot3dLayout,
}

impl From<Limits> for GridOptions {
    fn from(limits: Limits) -> GridOptions {
        GridOptions { limits, ..GridOptions::default() }
    }
}
