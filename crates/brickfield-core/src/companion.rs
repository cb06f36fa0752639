//! What samples have besides their value.

use std::fmt;

/// A second datum of every sample, kept beside the values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Companion {
    /// The standard deviation of the voxels that a sample averages: 0 at level 0.
    ///
    /// One byte: the nearest 255th of the source's greatest spread.
    Spread,
    /// The gradient of the field: the Sobel operator at level 0, averaged at others (Ljung, Lundstroem and Ynnerman 2006, section 5).
    ///
    /// Four bytes. The first three are the direction of (slope along an axis / spacing), each component c as 127 c + 127
    /// ([`GRADIENT_ZERO`] stands for 0); the fourth is its length, as 255 times the square root of its part of the source's
    /// greatest gradient. All to the nearest.
    Gradient,
    /// The normal of a surface voxel: one that the transfer function shows, beside one that it makes transparent (Saladi, Pinnamaneni and
    /// Meyer 2003). It belongs to a source and a transfer function.
    ///
    /// Four bytes, as of [`Companion::Gradient`], of the direction towards the inside, -normal. The length is 1 at a surface voxel, and 0
    /// at others; at coarser levels it is that of the average.
    SurfaceNormal,
}

/// The byte of a direction's component that is 0.
pub const GRADIENT_ZERO: u8 = 127;

impl Companion {
    /// All companions.
    pub const ALL: [Companion; 3] = [Companion::Spread, Companion::Gradient, Companion::SurfaceNormal];

    /// Bytes of a sample.
    pub const fn n_bytes(self) -> usize {
        match self {
            Companion::Spread => 1,
            Companion::Gradient | Companion::SurfaceNormal => 4,
        }
    }

    /// The name in messages, of several samples.
    pub const fn name(self) -> &'static str {
        match self {
            Companion::Spread => "spreads",
            Companion::Gradient => "gradients",
            Companion::SurfaceNormal => "surface normals",
        }
    }
}

impl fmt::Display for Companion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
