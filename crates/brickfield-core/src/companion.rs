//! What samples have besides their value.

use std::fmt;

/// A second datum of every sample, kept beside the values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Companion {
    /// How far the voxels that a sample averages lie around it: half the width of the uniform distribution that stands for them.
    ///
    /// That is sqrt(3) standard deviations, or less: the distribution does not leave the range of these voxels. 0 at level 0. One byte,
    /// in 255ths of the source's greatest spread: the nearest that does not leave the range either.
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
