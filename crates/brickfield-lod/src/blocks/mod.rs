//! A level for every flat block: what a block's levels cost in visible error, and how a byte budget is spent on them.

mod bumps;
mod change;
mod differences;
mod errors;
mod estimate;
mod exact;
mod fetch;
mod levels;
mod rank;
mod rest;
mod slab;
mod spend;
mod table;
mod weights;

pub use change::changed_values;
pub use errors::{BlockErrors, EstimateError, LevelErrors};
pub use exact::{Reconstruction, exact_errors};
pub use fetch::{FetchItem, FetchOrder, FetchOrderError, fetch_order};
pub use levels::{BlockLevels, BlockLevelsError};
pub use rank::rank_correlation;
pub use rest::spend_rest;
pub use slab::{Slab, SlabError};
pub use spend::{BlockBudget, BlockSelection, BudgetError, BudgetSize, OneSampleBlocks, select_block_levels};
pub use weights::{BlockView, Importance, block_weights};
