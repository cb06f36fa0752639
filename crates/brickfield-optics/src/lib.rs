#![doc = include_str!("../README.md")]

mod opacity;
mod quadrature;

pub use opacity::{OPAQUE_DEPTH, alpha, depth, rescale_alpha, transmittance};
pub use quadrature::{QuadratureRule, RayState, Segment, preintegrate};
