#![doc = include_str!("../README.md")]

mod axis;
mod chart;
mod frame_rate;
mod grid;
mod layout;
mod select;
mod tree;
mod view;
mod zone;

pub use axis::SplitAxis;
pub use frame_rate::{FeedbackBudget, FrameTarget, FrameTime, FrameTimeError, PredictiveBudget};
pub use grid::{CurvilinearGrid, CurvilinearGridError, End, GridEnds, HeightField, Node, Positions, hgt_value};
pub use layout::{LayoutError, QuadLayout, Zone, ZoneRange};
pub use select::{BudgetSelector, GranularityError, Label, Selection, SelectionError, SelectionWork, SizeSelector};
pub use tree::{ByteAccount, QuadTree};
pub use view::{View, ViewError};
pub use zone::{Niceness, ZoneSummary, examine};
