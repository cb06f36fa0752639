//! The colour that one value shows.

use brickfield_core::glam::DVec3;
use brickfield_core::{BlockLayout, Grid, LinearRgb, Optics};
use brickfield_optics::{alpha, cie_luv};

/// A slab of one value before an opaque background: the picture by which values are compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slab {
    background: LinearRgb,
    length_world: f64,
}

/// A slab that shows no colours.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "a slab of length {length_world} before {background:?}: the length must be finite and above 0, channels 0 to 1"
)]
#[allow(missing_docs)]
pub struct SlabError {
    pub length_world: f64,
    pub background: LinearRgb,
}

impl Slab {
    /// A slab `length_world` deep, in world units, before a background in linear RGB.
    ///
    /// # Errors
    /// A length that is not finite and above 0, a channel outside 0 to 1.
    pub fn new(length_world: f64, background: LinearRgb) -> Result<Slab, SlabError> {
        let is_color = background.iter().all(|channel| (0.0..=1.0).contains(channel));
        match length_world.is_finite() && length_world > 0.0 && is_color {
            true => Ok(Slab { background, length_world }),
            false => Err(SlabError { length_world, background }),
        }
    }

    /// A slab as deep as a block, before black: the cube root of a whole block's volume in world units.
    pub fn of_block(layout: &BlockLayout, grid: &Grid) -> Slab {
        let voxel = DVec3::element_product(grid.spacing()).cbrt();
        let length_world = voxel * f64::from(layout.side().n_voxels());
        // A product of finite spacings may be 0 or infinite.
        Slab { background: [0.0; 3], length_world: length_world.clamp(f64::MIN_POSITIVE, f64::MAX) }
    }

    /// The same slab before another background.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn before(self, background: LinearRgb) -> Result<Slab, SlabError> {
        Slab::new(self.length_world, background)
    }

    /// L*, u*, v* (CIE 1976) of the slab filled with a medium: its colour times its opacity, over the background.
    pub fn luv(&self, medium: Optics) -> [f64; 3] {
        let opacity = alpha(medium.extinction * self.length_world);
        cie_luv(std::array::from_fn(|c| medium.color[c] * opacity + self.background[c] * (1.0 - opacity)))
    }
}
