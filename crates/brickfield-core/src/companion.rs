//! What samples have besides their value.

use std::fmt;

/// A second datum of every sample, kept beside the values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Companion {
    /// The standard deviation of the voxels that a sample averages: 0 at level 0.
    ///
    /// One byte: the nearest 255th of the source's greatest spread.
    Spread,
}

impl Companion {
    /// All companions.
    pub const ALL: [Companion; 1] = [Companion::Spread];

    /// Bytes of a sample.
    pub const fn n_bytes(self) -> usize {
        match self {
            Companion::Spread => 1,
        }
    }

    /// The name in messages, of several samples.
    pub const fn name(self) -> &'static str {
        match self {
            Companion::Spread => "spreads",
        }
    }
}

impl fmt::Display for Companion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
