#![doc = include_str!("../README.md")]

mod automatic;
#[cfg(feature = "color")]
mod difference;
mod histogram;
mod light;
mod narrow_peak;
mod opacity;
mod prefiltered;
#[cfg(feature = "color")]
mod presets;
mod quadrature;
#[cfg(feature = "color")]
mod srgb;
#[cfg(feature = "files")]
mod transfer_file;

pub use automatic::{automatic, diagonal_world};
#[cfg(feature = "color")]
pub use difference::{ColorDifferences, ColorMetric, PixelCountError, cie_luv};
pub use light::{Light, LightError, LightSource, LightTerms, LitSides, Normals, SURFACE_STEEPNESS, Shade, flat_below};
pub use narrow_peak::{NarrowPeak, changes_across, narrow_peak, narrow_peak_of};
pub use opacity::{OPAQUE_DEPTH, alpha, depth, rescale_alpha, transmittance};
pub use prefiltered::{ValueSpread, expected_optics};
#[cfg(feature = "color")]
pub use presets::{Preset, PresetScale};
pub use quadrature::{QuadratureRule, RayState, Segment, preintegrate};
#[cfg(feature = "files")]
pub use transfer_file::{
    KnotProblem, ParseTransferError, ReadTransferError, TransferFormat, WriteTransferError, parse_transfer,
    read_transfer, write_transfer,
};
