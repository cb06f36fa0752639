//! What the axes of an array are: x, y, z, channels, times, or something else.

use serde_json::Value;

use crate::choice::Entries;
use crate::opened::FileFacts;
use crate::{ChoiceKind, Note, ReadError};

pub(super) struct Axis {
    pub(super) name: String,
    kind: String,
    pub(super) unit: Option<String>,
}

/// Which array axis is x, y, z; none where the array is flat.
pub(super) type VolumeAxes = [Option<usize>; 3];

impl Axis {
    /// An object with a name, or the bare name that versions before 0.4 had.
    pub(super) fn of(value: &Value) -> Axis {
        let text = |field: &str| value[field].as_str().unwrap_or_default().to_owned();
        let name = value.as_str().map_or_else(|| text("name"), str::to_owned);
        Axis { name, kind: text("type"), unit: value["unit"].as_str().map(str::to_owned) }
    }

    /// What the entries of the axis are, if it is none of space.
    fn choice(&self) -> Option<ChoiceKind> {
        match (self.name.to_lowercase().as_str(), self.kind.as_str()) {
            (_, "time") | ("t" | "time" | "times" | "frame" | "frames", _) => Some(ChoiceKind::Time),
            (_, "channel") | ("c" | "ch" | "channel" | "channels" | "band" | "bands", _) => Some(ChoiceKind::Channel),
            _ => None,
        }
    }
}

/// Finds x, y and z by name.
///
/// # Errors
/// If there is no x or no y.
pub(super) fn volume_axes_by_name(axes: &[Axis]) -> Result<VolumeAxes, ReadError> {
    let find = |name: &str| axes.iter().position(|a| a.name.eq_ignore_ascii_case(name));
    let volume_axes = ["x", "y", "z"].map(find);
    match volume_axes {
        [Some(_), Some(_), _] => Ok(volume_axes),
        _ => Err(ReadError::Missing { field: "an axis named x and one named y" }),
    }
}

/// x, y and z by name, else the last axes that are neither channels nor times: z, y, x.
pub(super) fn volume_axes_of_array(axes: &[Axis]) -> VolumeAxes {
    volume_axes_by_name(axes).unwrap_or_else(|_| {
        let mut spatial = (0..axes.len()).rev().filter(|i| axes[*i].choice().is_none());
        [spatial.next(), spatial.next(), spatial.next()]
    })
}

/// The entry that is read along each axis that is none of space; 0 along the others.
///
/// Channels and times are chosen; of further axes the first entry is read, with a note.
pub(super) fn choose_entries(
    axes: &[Axis],
    shape: &[u64],
    volume_axes: VolumeAxes,
    channel_names: &[String],
    found: &mut FileFacts,
) -> Result<Vec<u64>, ReadError> {
    let mut entries = vec![0; shape.len()];
    let mut chosen = Vec::new();
    for (i, (axis, n_entries)) in axes.iter().zip(shape).enumerate() {
        if volume_axes.contains(&Some(i)) || *n_entries <= 1 {
            continue;
        }
        let Some(kind) = axis.choice().filter(|kind| !chosen.contains(kind)) else {
            found.notes.push(Note::FirstOfAxis { axis: axis.name.clone(), n_entries: *n_entries });
            continue;
        };
        chosen.push(kind);
        let offered = match kind == ChoiceKind::Channel && channel_names.len() as u64 == *n_entries {
            true => Entries::Named(channel_names.to_vec()),
            false => Entries::Numbered(*n_entries),
        };
        entries[i] = found.choose(kind, offered)?;
    }
    Ok(entries)
}
