//! Extents of bricks and of their bands.

use brickfield_core::Level;
use brickfield_core::glam::UVec3;

/// The most samples that a brick may have, 2^28: a cube of 645 samples a side has less.
pub const MAX_SAMPLES: u64 = 1 << 28;

/// The most levels above level 0 that a brick may have.
pub const MAX_LEVELS: u8 = 15;

/// An extent that no brick has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a brick of {extent} samples: each axis must have at least 1, and all together at most {MAX_SAMPLES}")]
pub struct ExtentError {
    /// Samples along x, y, z.
    pub extent: UVec3,
}

/// The number of samples of a brick.
pub(crate) fn n_samples(extent: UVec3) -> Result<usize, ExtentError> {
    let n = extent.to_array().iter().try_fold(1u64, |n, &axis| n.checked_mul(u64::from(axis)));
    match n {
        Some(n) if (1..=MAX_SAMPLES).contains(&n) => Ok(n as usize),
        _ => Err(ExtentError { extent }),
    }
}

/// A box of coefficients in a level's array: the first one, and how many along each axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct BandBox {
    pub(crate) first: UVec3,
    pub(crate) n: UVec3,
}

impl BandBox {
    /// The whole of an array.
    pub(crate) fn whole(extent: UVec3) -> BandBox {
        BandBox { first: UVec3::ZERO, n: extent }
    }

    /// The low band of an array of this extent.
    pub(crate) fn low(extent: UVec3) -> BandBox {
        BandBox::whole(Level(1).dims_of(extent))
    }

    /// The seven detail bands of an array of this extent: numbers 1 to 7, of which bit 0 is set if the band has details along x, bit 1
    /// along y, bit 2 along z. Along an axis of one sample there are none.
    pub(crate) fn details(extent: UVec3) -> impl Iterator<Item = BandBox> {
        let low = Level(1).dims_of(extent);
        let band = move |number: u32| {
            let pick =
                |axis: u32, low: u32, all: u32| if number >> axis & 1 == 1 { (low, all - low) } else { (0, low) };
            let (x, y, z) = (pick(0, low.x, extent.x), pick(1, low.y, extent.y), pick(2, low.z, extent.z));
            BandBox { first: UVec3::new(x.0, y.0, z.0), n: UVec3::new(x.1, y.1, z.1) }
        };
        (1..8).map(band).filter(|band| band.n.min_element() > 0)
    }

    /// Where row (y, z) of the box begins in an array of extent `all`.
    #[inline]
    pub(crate) fn row(&self, all: UVec3, y: usize, z: usize) -> usize {
        let [fx, fy, fz] = self.first.to_array().map(|i| i as usize);
        fx + all.x as usize * (fy + y + all.y as usize * (fz + z))
    }
}
