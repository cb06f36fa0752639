//! What a caller wants of a file.

use brickfield_core::glam::DVec3;

use crate::{Limits, WantedEntries};

/// What a caller wants of a file, and how much may be allocated for it.
///
/// ```
/// use brickfield_io::{ChoiceKind, OpenOptions};
/// let mut options = OpenOptions::default();
/// options.limits.max_bytes = 1 << 30;
/// options.wanted.want(ChoiceKind::Channel, "DAPI");
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct OpenOptions {
    /// How much may be allocated.
    pub limits: Limits,
    /// The entries that are read where the file has several.
    pub wanted: WantedEntries,
    /// World units between samples, in place of what the file states.
    pub spacing: Option<DVec3>,
}

impl From<Limits> for OpenOptions {
    /// The first of everything, within limits.
    fn from(limits: Limits) -> OpenOptions {
        OpenOptions { limits, ..OpenOptions::default() }
    }
}
