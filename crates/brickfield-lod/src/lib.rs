#![doc = include_str!("../README.md")]

mod blocks;
mod criterion;
mod filter;
mod frustum;
mod order;
mod select;
mod tile;

pub use blocks::{
    BlockBudget, BlockErrors, BlockLevels, BlockLevelsError, BlockSelection, BlockView, BudgetError, BudgetSize,
    EstimateError, FetchItem, FetchOrder, FetchOrderError, Importance, LevelErrors, OneSampleBlocks, Reconstruction,
    Slab, SlabError, block_weights, changed_values, exact_errors, fetch_order, rank_correlation, select_block_levels,
    spend_rest,
};
pub use criterion::{Criterion, CriterionInView};
pub use filter::{And, Answer, Filter};
pub use frustum::{Frustum, Planes};
pub use order::back_to_front;
pub use select::{Culling, Selection, View, select_by, select_cut};
pub use tile::Tile;
