//! The data sets of legacy VTK that are read: images as volumes, and structured grids.

use crate::ReadError;
use crate::grids::OPENED_BY;

/// What a file is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Dataset {
    Image,
    Rectilinear,
    Structured,
}

/// What a caller reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wanted {
    Image,
    Grid,
}

impl Dataset {
    /// # Errors
    /// Another data set than the caller's.
    pub(super) fn of_name(name: &str, wanted: Wanted) -> Result<Dataset, ReadError> {
        let dataset = match name.to_ascii_lowercase().as_str() {
            "structured_points" => Some(Dataset::Image),
            "rectilinear_grid" => Some(Dataset::Rectilinear),
            "structured_grid" => Some(Dataset::Structured),
            _ => None,
        };
        let supported = match (dataset, wanted) {
            (Some(Dataset::Image), Wanted::Image) => return Ok(Dataset::Image),
            (Some(dataset @ (Dataset::Rectilinear | Dataset::Structured)), Wanted::Grid) => return Ok(dataset),
            (Some(Dataset::Image), Wanted::Grid) => {
                "RECTILINEAR_GRID and STRUCTURED_GRID are; `open` reads it as a volume"
            }
            (Some(_), Wanted::Image) => OPENED_BY,
            (None, Wanted::Image) => "STRUCTURED_POINTS is",
            (None, Wanted::Grid) => "RECTILINEAR_GRID and STRUCTURED_GRID are",
        };
        Err(ReadError::unsupported("DATASET", name, supported))
    }
}
