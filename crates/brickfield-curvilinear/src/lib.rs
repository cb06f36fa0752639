#![doc = include_str!("../README.md")]

mod axis;
mod chart;
mod grid;
mod layout;
mod tree;
mod zone;

pub use axis::SplitAxis;
pub use grid::{CurvilinearGrid, CurvilinearGridError, End, GridEnds, HeightField, Node, Positions, hgt_value};
pub use layout::{LayoutError, QuadLayout, Zone, ZoneRange};
pub use tree::{ByteAccount, QuadTree};
pub use zone::{Niceness, ZoneSummary, examine};
