#![doc = include_str!("../README.md")]

mod interpolate;
mod neighbourhood;
mod real;
mod weights;

pub use interpolate::interpolate;
pub use neighbourhood::Neighbourhood;
pub use real::Real;
pub use weights::{block_weights, edge_weight};
