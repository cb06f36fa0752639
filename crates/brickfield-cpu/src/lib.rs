#![doc = include_str!("../README.md")]

mod discrete;
mod fast;

pub use discrete::{Discrete, discrete};
pub use fast::CpuBackend;
