//! Structured grids: nodes with positions and values, in rows, columns and layers.
//!
//! | format | detected by | module |
//! |---|---|---|
//! | PLOT3D grids, with solutions and functions | `.xyz`, `.p3d`, `.x`, `.g`, or its length | [`plot3d`] |
//! | SRTM tiles | `.hgt` | [`hgt`] |
//! | USGS DEM | `.dem`, or its first record | [`usgs_dem`] |
//! | GeoTIFF of one band | magic | `geotiff` (feature `tiff`) |
//! | VTK XML `RectilinearGrid`, `StructuredGrid` | magic | `vtk_xml` (feature `vti`) |
//! | legacy VTK `RECTILINEAR_GRID`, `STRUCTURED_GRID` | magic | [`vtk_legacy`] |
//!
//! Values are rounded to f32, positions are f64. A number beyond f32, and one that is not finite, makes its node a hole.

mod claim;
mod format;
mod geographic;
#[cfg(feature = "tiff")]
pub mod geotiff;
pub mod hgt;
mod note;
mod open;
mod opened;
mod options;
pub mod plot3d;
pub mod usgs_dem;
mod vtk_fields;
pub mod vtk_legacy;
#[cfg(feature = "vti")]
pub mod vtk_xml;

pub(crate) use claim::{check_nodes, checked_nodes};
pub use format::GridFormat;
pub use geographic::EARTH_RADIUS_M;
#[cfg(feature = "tiff")]
pub(crate) use geographic::{GeoPlacement, Horizontal};
pub use note::GridNote;
pub use open::{detect_grid, open_grid};
pub use opened::OpenedGrids;
pub use options::GridOptions;
pub(crate) use vtk_fields::{add_array, n_field_bytes, positions};

/// What the volume reader says of a structured grid.
pub(crate) const OPENED_BY: &str = "it is a structured grid, and no volume";
