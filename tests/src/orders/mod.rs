//! Observed orders of accuracy, and closed forms met to rounding.
//!
//! Order is tested, not asserted: a rule that claims order p is run with its step halved, and the slope of its error over
//! the step is fitted. A renderer that is wrong by one node, one segment or half a voxel loses its order long before the error is seen.

mod closed_forms;
mod fit;
mod grids;
mod images;
mod rays;

pub use closed_forms::{ClosedForm, closed_forms};
pub use fit::{Observed, OrderRow};
pub use grids::grid_refinement;
pub use images::{backend_images, reference_images};
pub use rays::rays;

/// How far an observed order may be from the claimed one.
pub const WITHIN: f64 = 0.1;
