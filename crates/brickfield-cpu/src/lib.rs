#![doc = include_str!("../README.md")]

mod blocks;
mod cells;
pub mod closed_form;
mod continuous;
mod discrete;
mod fast;
mod mesh;

pub use cells::{DiscreteCells, discrete_cells};
pub use continuous::{Continuous, ContinuousOptions, RayIntegral, continuous, continuous_ray};
pub use discrete::{Discrete, discrete, filter_rounding, position_rounding};
pub use fast::CpuBackend;
pub use mesh::{MeshAnswer, mesh_answer, mesh_pixels};
