//! The result of a reader.

use brickfield_core::glam::DVec3;
use brickfield_core::{Grid, Rescale, ScalarType, ValueRange, Volume, Voxels};

use crate::choice::{Choices, Chosen, Entries};
use crate::{Choice, ChoiceKind, Format, Note, OpenOptions, ReadError};

/// A volume from a file, and the file's statements about it.
#[derive(Clone, Debug, PartialEq)]
pub struct Opened {
    /// The volume, in the type that the file stores, with the file's rescale.
    pub volume: Volume,
    /// The format that was read.
    pub format: Format,
    /// What the axes of the world mean.
    pub frame: WorldFrame,
    /// The unit of world lengths as the file names it, if it does: "mm", "micrometer".
    pub unit: Option<String>,
    /// Notes that the user ought to know.
    pub notes: Vec<Note>,
    /// What the file has several of, and which was read.
    pub choices: Vec<Choice>,
}

/// All about a volume but its samples.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeFacts {
    /// Where the voxels lie.
    pub grid: Grid,
    /// The type of the samples.
    pub scalar: ScalarType,
    /// The map from samples to data values.
    pub rescale: Rescale,
    /// The format that is read.
    pub format: Format,
    /// What the axes of the world mean.
    pub frame: WorldFrame,
    /// The unit of world lengths as the file names it, if it does: "mm", "micrometer".
    pub unit: Option<String>,
    /// Notes that the user ought to know.
    pub notes: Vec<Note>,
    /// What the file has several of, and which is read.
    pub choices: Vec<Choice>,
}

/// What the axes of the world mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum WorldFrame {
    /// The patient: +x towards the left, +y towards the back, +z towards the head (DICOM, ITK).
    ///
    /// Every format that states an anatomical frame is brought to this one: of NIfTI, and of NRRD files in
    /// right-anterior-superior, x and y are negated.
    Lps,
    /// A stack of pictures: +x to the right, +y down, +z into the stack (TIFF, PNG, OME-Zarr).
    Pictures,
    #[default]
    /// The axes mean what the file's author meant: VTK, raw, and files without orientation.
    Plain,
}

impl WorldFrame {
    /// The key under which a file states its frame, where its format has no words for it but keys of one's own.
    pub(crate) const KEY: &str = "brickfield_frame";
    const NAMES: [(WorldFrame, &str); 3] =
        [(WorldFrame::Lps, "lps"), (WorldFrame::Pictures, "pictures"), (WorldFrame::Plain, "plain")];

    /// The name in files.
    pub(crate) fn name(self) -> &'static str {
        WorldFrame::NAMES.into_iter().find(|(frame, _)| *frame == self).map_or("", |(_, name)| name)
    }

    /// The frame of a name in files.
    pub(crate) fn of_name(name: &str) -> Option<WorldFrame> {
        WorldFrame::NAMES.into_iter().find(|(_, known)| name.trim() == *known).map(|(frame, _)| frame)
    }

    /// The directions of the axes, for messages.
    pub(crate) fn axes(self) -> &'static str {
        match self {
            WorldFrame::Lps => "+x left, +y back, +z head",
            WorldFrame::Pictures => "+x right, +y down, +z into the stack",
            WorldFrame::Plain => "axes without meaning",
        }
    }
}

/// The parts of [`Opened`] before the volume is made.
pub(crate) struct FileFacts {
    pub(crate) format: Format,
    pub(crate) frame: WorldFrame,
    pub(crate) unit: Option<String>,
    pub(crate) notes: Vec<Note>,
    pub(crate) choices: Choices,
    spacing: Option<DVec3>,
}

impl FileFacts {
    pub(crate) fn plain(format: Format, options: &OpenOptions) -> FileFacts {
        let (choices, spacing) = (Choices::new(options.wanted.clone()), options.spacing);
        FileFacts { format, frame: WorldFrame::Plain, unit: None, notes: Vec::new(), choices, spacing }
    }

    #[cfg(any(feature = "ome-zarr", feature = "tiff", feature = "png"))]
    pub(crate) fn pictures(format: Format, options: &OpenOptions) -> FileFacts {
        FileFacts { frame: WorldFrame::Pictures, ..FileFacts::plain(format, options) }
    }

    /// The number of the entry to read: the one that the caller wants, else the first, with a note.
    pub(crate) fn choose(&mut self, kind: ChoiceKind, entries: Entries) -> Result<u64, ReadError> {
        self.choose_or(kind, entries, 0)
    }

    /// The number of the entry to read: the one that the caller wants, else the one that the file prefers, with a note.
    pub(crate) fn choose_or(&mut self, kind: ChoiceKind, entries: Entries, preferred: u64) -> Result<u64, ReadError> {
        let Chosen { entry, is_default } = self.choices.choose(kind, entries, preferred)?;
        if let Some(choice) = self.choices.made(kind).filter(|_| is_default) {
            self.notes.push(Note::OneOfSeveral { kind, read: choice.label(entry), n_entries: choice.n_entries });
        }
        Ok(entry)
    }

    /// The facts of a volume whose samples are read later, slice by slice or box by box.
    pub(crate) fn described(self, grid: Grid, scalar: ScalarType, rescale: Rescale) -> Result<VolumeFacts, ReadError> {
        let grid = match self.spacing {
            Some(spacing) => respaced(&grid, spacing)?,
            None => grid,
        };
        let FileFacts { format, frame, unit, notes, choices, .. } = self;
        Ok(VolumeFacts { grid, scalar, rescale, format, frame, unit, notes, choices: choices.finish()? })
    }

    pub(crate) fn finish(self, grid: Grid, voxels: Voxels) -> Result<Opened, ReadError> {
        self.finish_rescaled(grid, voxels, Rescale::IDENTITY)
    }

    pub(crate) fn finish_rescaled(mut self, grid: Grid, voxels: Voxels, rescale: Rescale) -> Result<Opened, ReadError> {
        let grid = match self.spacing {
            Some(spacing) => respaced(&grid, spacing)?,
            None => grid,
        };
        let volume = Volume::rescaled(grid, voxels, rescale)?;
        if volume.non_finite().total() > 0 {
            // The least number of the file has the greatest value if the slope is below 0.
            let (low, high) = match volume.range() {
                ValueRange { min, max } if rescale.slope() < 0.0 => (max, min),
                ValueRange { min, max } => (min, max),
            };
            self.notes.push(Note::NonFinite { counts: volume.non_finite(), low, high });
        }
        let FileFacts { format, frame, unit, notes, choices, .. } = self;
        Ok(Opened { volume, format, frame, unit, notes, choices: choices.finish()? })
    }
}

/// The grid with another spacing; the first sample stays where it is, unless its corner was the world's origin: then the
/// corner stays.
fn respaced(grid: &Grid, spacing: DVec3) -> Result<Grid, ReadError> {
    let map = grid.index_to_world();
    let directions = map.matrix3;
    let is_at_corner = map.translation == DVec3::ZERO;
    let first_sample = match is_at_corner {
        true => 0.5 * (directions * (spacing / grid.spacing())),
        false => map.transform_point3(DVec3::splat(0.5)),
    };
    Ok(Grid::from_first_sample(grid.dims(), spacing, first_sample, directions)?)
}
