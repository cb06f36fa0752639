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
}

/// The byte of a direction's component that is 0.
pub const GRADIENT_ZERO: u8 = 127;

impl Companion {
    /// All companions.
    pub const ALL: [Companion; 2] = [Companion::Spread, Companion::Gradient];

    /// Bytes of a sample.
    pub const fn n_bytes(self) -> usize {
        match self {
            Companion::Spread => 1,
            Companion::Gradient => 4,
        }
    }

    /// The name in messages, of several samples.
    pub const fn name(self) -> &'static str {
        match self {
            Companion::Spread => "spreads",
            Companion::Gradient => "gradients",
        }
    }
}

impl fmt::Display for Companion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
