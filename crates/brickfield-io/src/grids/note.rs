//! Notes of a reader of grids that the user ought to know, though the grids could be read.

use std::fmt;

use crate::error::{bytes, counted, one_line};

/// Something about a file that the grids alone do not show.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum GridNote {
    /// A file beside a PLOT3D grid whose name suggests that it has the values of its nodes.
    SolutionBeside { name: String },
    /// Zeros after the last number of a PLOT3D file.
    SpareBytes { what: String, n_bytes: u64 },
    /// The four numbers before the values of a PLOT3D solution, of this grid and of those after it up to the next note;
    /// `grid` counts from 0, `alpha` is in degrees.
    FlowConditions { grid: usize, mach: f64, alpha: f64, reynolds: f64, time: f64 },
    /// Arrays of cells beside those of nodes.
    CellDataLeftOut { names: Vec<String> },
    /// Degrees became metres: `west` and `south` are where the grid's outermost nodes lie, `scale_latitude` is the one whose
    /// cosine scales longitudes.
    Degrees { west: f64, south: f64, scale_latitude: f64 },
    /// Strips or tiles of a GeoTIFF that are not stored; their nodes are holes.
    MissingChunks { n_missing: u64, n_chunks: u64 },
}

impl fmt::Display for GridNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            GridNote::SolutionBeside { name } => {
                write!(f, "{:?} beside it may have its values: state it as the solution", one_line(name))
            }
            GridNote::SpareBytes { what, n_bytes } => {
                write!(f, "{} of zeros follow the last number of {what}", bytes(n_bytes))
            }
            GridNote::FlowConditions { grid, mach, alpha, reynolds, time } => write!(
                f,
                "grid {}: Mach number {mach}, angle of attack {alpha}, Reynolds number {reynolds}, time {time}",
                grid + 1
            ),
            GridNote::CellDataLeftOut { names } => write!(
                f,
                "{} of cells left out: {}",
                counted(names.len(), "array", "arrays"),
                one_line(&names.join(", "))
            ),
            GridNote::Degrees { west, south, scale_latitude } => write!(
                f,
                "degrees became metres from longitude {west}, latitude {south}; longitudes are those of latitude {scale_latitude}"
            ),
            GridNote::MissingChunks { n_missing, n_chunks } => {
                write!(f, "{n_missing} of {n_chunks} strips or tiles are not stored; their nodes are holes")
            }
        }
    }
}
