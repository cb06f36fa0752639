#![doc = include_str!("../README.md")]

// The generated grids of the tests, which name this crate.
#[cfg(test)]
extern crate self as brickfield_curvilinear;
#[cfg(test)]
#[path = "../tests/laws/grids.rs"]
#[allow(dead_code, reason = "each test uses some of them")]
mod grids;

mod axis;
mod chart;
mod check;
mod frame_rate;
mod grid;
mod layout;
mod mesh;
mod oct_tree;
mod oct_zone;
mod octree;
mod plane;
mod select;
mod surface;
mod tree;
mod view;
mod volume;
mod walk;
mod zone;

pub use axis::SplitAxis;
pub use check::{MeshFault, check_mesh};
pub use frame_rate::{FeedbackBudget, FrameTarget, FrameTime, FrameTimeError, PredictiveBudget};
pub use grid::{CurvilinearGrid, CurvilinearGridError, End, GridEnds, HeightField, Node, Positions};
pub use layout::{LayoutError, QuadLayout, Zone, ZoneRange};
pub use mesh::{OtherGrid, SurrogateMesh, surrogate_mesh};
pub use oct_tree::{OctTree, OctTreeError};
pub use oct_zone::{OctSummary, examine_cells};
pub use octree::{CellBox, OctLayout, OctLayoutError, OctZone};
pub use plane::GridPlaneError;
pub use select::{BudgetSelector, GranularityError, Label, Selection, SelectionError, SelectionWork, SizeSelector};
pub use surface::{IndexPlane, SurfaceError};
pub use tree::{ByteAccount, QuadTree};
pub use view::{View, ViewError};
pub use volume::{CurvilinearVolume, CurvilinearVolumeError};
pub use walk::{CellSegment, CellWalk, CellWalker, CellWalkerError, RayError};
pub use zone::{Niceness, ZoneSummary, examine};
