//! The dark regions of a field, which rays pass over.

mod beams;
mod chebyshev;
mod dark;
mod dark_runs;
mod kept;
mod macrocells;
mod occupancy;

pub use beams::{Beams, Overview};
pub use dark::{DarkError, DarkRegions};
pub use dark_runs::DarkRuns;
pub use kept::KeptBoxes;
pub use macrocells::MacrocellRanges;
pub use occupancy::{MACROCELL_SIDE, Occupancy};
