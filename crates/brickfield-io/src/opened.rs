//! The result of a reader.

use brickfield_core::{Grid, Volume, Voxels};

use crate::{Format, Note, ReadError};

/// A volume from a file, and the file's statements about it.
#[derive(Clone, Debug, PartialEq)]
pub struct Opened {
    /// The volume, in the file's scalar type unless its values had to be rescaled.
    pub volume: Volume,
    /// The format that was read.
    pub format: Format,
    /// What the axes of the world mean.
    pub frame: WorldFrame,
    /// The unit of world lengths as the file names it, if it does: "mm", "micrometer".
    pub unit: Option<String>,
    /// Notes that the user ought to know.
    pub notes: Vec<Note>,
}

/// What the axes of the world mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum WorldFrame {
    /// The patient: +x towards the left, +y towards the back, +z towards the head (DICOM, ITK).
    ///
    /// Every format that states an anatomical frame is brought to this one: of NIfTI, and of NRRD files in
    /// right-anterior-superior, x and y are negated.
    Lps,
    /// A stack of pictures: +x to the right, +y down, +z into the stack (TIFF, OME-Zarr).
    Pictures,
    /// The axes mean what the file's author meant: VTK, raw, and files without orientation.
    Plain,
}

/// The parts of [`Opened`] before the volume is made.
pub(crate) struct FileFacts {
    pub(crate) format: Format,
    pub(crate) frame: WorldFrame,
    pub(crate) unit: Option<String>,
    pub(crate) notes: Vec<Note>,
}

impl FileFacts {
    pub(crate) fn plain(format: Format) -> FileFacts {
        FileFacts { format, frame: WorldFrame::Plain, unit: None, notes: Vec::new() }
    }

    #[cfg(any(feature = "ome-zarr", feature = "tiff"))]
    pub(crate) fn pictures(format: Format) -> FileFacts {
        FileFacts { frame: WorldFrame::Pictures, ..FileFacts::plain(format) }
    }

    pub(crate) fn finish(mut self, grid: Grid, voxels: Voxels) -> Result<Opened, ReadError> {
        let volume = Volume::new(grid, voxels)?;
        if volume.non_finite().total() > 0 {
            self.notes.push(Note::NonFinite(volume.non_finite()));
        }
        Ok(Opened { volume, format: self.format, frame: self.frame, unit: self.unit, notes: self.notes })
    }
}
