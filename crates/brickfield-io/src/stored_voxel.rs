//! The interleaved numbers of a voxel in a file, and the part of them that is read.

use std::ops::Range;

use brickfield_core::ScalarType;

use crate::choice::Entries;
use crate::colour::{ColourPart, Colours};
use crate::opened::FileFacts;
use crate::stored_type::StoredType;
use crate::{ChoiceKind, ReadError};

/// The interleaved numbers of a voxel in a file, all of one type, and the part of them that is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct StoredVoxel {
    pub(crate) stored: StoredType,
    pub(crate) n_components: u64,
    pub(crate) part: ColourPart,
}

/// The most numbers of a voxel: a piece that is read at once holds a whole voxel.
pub(crate) const MAX_COMPONENTS: u64 = 32_768;

impl StoredVoxel {
    /// Red, green and blue, or these and alpha: the channel that is wanted, else the luminance with a note.
    pub(crate) fn of_colours(
        stored: StoredType,
        colours: Colours,
        found: &mut FileFacts,
    ) -> Result<StoredVoxel, ReadError> {
        let part = colours.choose(found)?;
        Ok(StoredVoxel { stored, n_components: colours.n_channels() as u64, part })
    }

    /// Numbers that are no colours: the one that is wanted, else the first with a note.
    pub(crate) fn of_components(
        stored: StoredType,
        kind: ChoiceKind,
        entries: Entries,
        found: &mut FileFacts,
    ) -> Result<StoredVoxel, ReadError> {
        let n_components = entries.n_entries();
        let entry = found.choose(kind, entries)?;
        Ok(StoredVoxel { stored, n_components, part: ColourPart::Channel(entry as usize) })
    }

    /// Bytes of one voxel in the file; the number of components has been [checked](Self::check).
    pub(crate) fn n_bytes(self) -> usize {
        self.n_components as usize * self.stored.n_bytes()
    }

    /// # Errors
    /// If a voxel has no number, or more of them than are read at once.
    pub(crate) fn check(self) -> Result<(), ReadError> {
        match (1..=MAX_COMPONENTS).contains(&self.n_components) {
            true => Ok(()),
            false => Err(ReadError::field("number of components", self.n_components, format!("1 to {MAX_COMPONENTS}"))),
        }
    }

    /// The components that the part needs.
    pub(crate) fn kept(self) -> Range<usize> {
        match self.part {
            ColourPart::Channel(i) => i..i + 1,
            ColourPart::Luminance => 0..3,
        }
    }
}

/// One number.
impl From<StoredType> for StoredVoxel {
    fn from(stored: StoredType) -> StoredVoxel {
        StoredVoxel { stored, n_components: 1, part: ColourPart::Channel(0) }
    }
}

/// One number.
impl From<ScalarType> for StoredVoxel {
    fn from(scalar: ScalarType) -> StoredVoxel {
        StoredType::from(scalar).into()
    }
}

/// Moves the kept components of each voxel to the front; the bytes that they take there.
pub(crate) fn keep_components(bytes: &mut [u8], n_components: usize, sample_bytes: usize, kept: Range<usize>) -> usize {
    if kept == (0..n_components) {
        return bytes.len();
    }
    let (n_in, n_out) = (n_components * sample_bytes, kept.len() * sample_bytes);
    let n_voxels = bytes.len() / n_in;
    for i in 0..n_voxels {
        let start = i * n_in + kept.start * sample_bytes;
        bytes.copy_within(start..start + n_out, i * n_out);
    }
    n_voxels * n_out
}
