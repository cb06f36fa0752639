#![doc = include_str!("../README.md")]

mod automatic;
mod difference;
mod histogram;
mod opacity;
mod presets;
mod quadrature;
mod srgb;
mod transfer_file;

pub use automatic::automatic;
pub use difference::{ColorDifferences, ColorMetric, PixelCountError};
pub use opacity::{OPAQUE_DEPTH, alpha, depth, rescale_alpha, transmittance};
pub use presets::{Preset, PresetScale, diagonal_world};
pub use quadrature::{QuadratureRule, RayState, Segment, preintegrate};
pub use transfer_file::{
    KnotProblem, ParseTransferError, ReadTransferError, TransferFormat, WriteTransferError, parse_transfer,
    read_transfer, write_transfer,
};
