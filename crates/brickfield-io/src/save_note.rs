//! What is left of a volume in a saved file, where it is not all.

use std::fmt;

use brickfield_core::{ScalarType, Volume};

use crate::{Format, SaveOptions, WorldFrame};

/// A saved file: the type of its samples, and notes that the user ought to know.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Saved {
    /// The type in which samples are stored.
    pub scalar: ScalarType,
    /// What the file does not state, or states in another way.
    pub notes: Vec<SaveNote>,
}

/// Something about a volume that a saved file does not state, or states in another way.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum SaveNote {
    /// The format stores no slope and intercept, so that samples are values, in another type.
    ValuesStored { format: Format, from: ScalarType, to: ScalarType },
    /// The format has no words for the frame; the file is read in another one.
    FrameLost { format: Format, frame: WorldFrame, read_as: WorldFrame },
    /// The format has no words for the unit of lengths; they are the same numbers.
    UnitLost { format: Format, unit: String },
    /// The format states no spacing, place or direction: the file is read with a spacing of 1.
    PlacementLost { format: Format },
    /// Nothing but samples was written; `spec` is what `brickfield --raw` must be told.
    SamplesAlone { spec: String },
    /// OME-Zarr has no words for the direction of axes; it is stated in an attribute of our own.
    DirectionOwn,
    /// OME-Zarr has no words for slope and intercept: samples are stored numbers, and both are stated in attributes of our own.
    RescaleOwn,
    /// Level 0 is stored as details of level 1: programs without the codec open levels 1 and coarser.
    DetailsOwn,
    /// NIfTI-2 was written, which many programs do not open.
    Nifti2 { reason: String },
}

/// What a file states of the options with which it was saved.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stated {
    /// The frame in which it is read.
    pub(crate) frame: WorldFrame,
    pub(crate) unit: bool,
}

impl Saved {
    /// A file of a volume, of samples of a type.
    pub(crate) fn of(
        format: Format,
        volume: &Volume,
        scalar: ScalarType,
        options: &SaveOptions,
        stated: Stated,
    ) -> Saved {
        let mut notes = vec![];
        if scalar != volume.scalar_type() {
            notes.push(SaveNote::ValuesStored { format, from: volume.scalar_type(), to: scalar });
        }
        if stated.frame != options.frame {
            notes.push(SaveNote::FrameLost { format, frame: options.frame, read_as: stated.frame });
        }
        if let Some(unit) = options.unit.as_ref().filter(|_| !stated.unit) {
            notes.push(SaveNote::UnitLost { format, unit: unit.clone() });
        }
        Saved { scalar, notes }
    }
}

impl fmt::Display for SaveNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            SaveNote::ValuesStored { format, from, to } => {
                write!(f, "{format} stores no slope and intercept: {from} samples were saved as their values, in {to}")
            }
            SaveNote::FrameLost { format, frame, read_as } => {
                let (axes, other) = (frame.axes(), read_as.axes());
                write!(f, "{format} cannot state the frame {frame:?} ({axes}); it is read as {read_as:?} ({other})")?;
                match frame {
                    WorldFrame::Pictures => f.write_str(", and cameras by name look from other sides"),
                    _ => Ok(()),
                }
            }
            SaveNote::UnitLost { format, unit } => {
                write!(f, "{format} cannot state the unit {unit:?}; lengths are the same numbers without it")
            }
            SaveNote::PlacementLost { format } => {
                write!(f, "{format} states no spacing, place or direction: the file is read with a spacing of 1")
            }
            SaveNote::SamplesAlone { spec } => {
                write!(
                    f,
                    "the file has samples alone: --raw {spec} reads it; place, direction, frame and unit are lost"
                )
            }
            SaveNote::DirectionOwn => f.write_str(
                "the axes of the volume are not those of the world; OME-Zarr has no words for that: brickfield reads the \
                 direction from an attribute of its own, and other programs show the volume along its own axes",
            ),
            SaveNote::RescaleOwn => f.write_str(
                "samples are the stored numbers, not the values; OME-Zarr has no words for slope and intercept: brickfield \
                 reads both from an attribute of its own, and other programs show the stored numbers",
            ),
            SaveNote::DetailsOwn => f.write_str(
                "level 0 is stored as details of level 1, which take the codec brickfield.haar_details; other programs open \
                 levels 1 and coarser",
            ),
            SaveNote::Nifti2 { reason } => {
                write!(f, "the file is NIfTI-2, which many programs do not open, for {reason}")
            }
        }
    }
}
