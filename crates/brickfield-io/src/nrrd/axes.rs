//! The axes of an NRRD that are not of space: the numbers of a voxel, and volumes one after the other.

use super::header::NrrdHeader;
use super::segments::layer_names;
use crate::choice::Entries;
use crate::colour::Colours;
use crate::error::counted;
use crate::opened::FileFacts;
use crate::series::{OuterAxis, choose_volume};
use crate::stored_type::StoredType;
use crate::stored_voxel::StoredVoxel;
use crate::{ChoiceKind, ReadError};

/// The numbers that are read of each voxel, and the voxels of earlier volumes, which are skipped.
pub(super) struct Part {
    pub(super) voxel: StoredVoxel,
    pub(super) n_before: u128,
}

impl Part {
    /// Axes faster than those of space make voxels of several numbers; slower ones have volumes.
    pub(super) fn choose(
        header: &NrrdHeader,
        volume_axes: &[usize],
        stored: StoredType,
        found: &mut FileFacts,
    ) -> Result<Part, ReadError> {
        let first = volume_axes.iter().min().copied().unwrap_or(0);
        let last = volume_axes.iter().max().copied().unwrap_or(0);
        for axis in first..last {
            if header.sizes[axis] > 1 && !volume_axes.contains(&axis) {
                let value =
                    format!("{} of axis {}", counted(header.sizes[axis], "entry", "entries"), axis_name(header, axis));
                return Err(ReadError::unsupported(
                    "axis between those of space,",
                    value,
                    "before or behind them it is",
                ));
            }
        }
        let voxel = voxel(header, first, stored, found)?;
        let outer = (last + 1..header.sizes.len()).map(|axis| OuterAxis {
            name: axis_name(header, axis),
            n_entries: header.sizes[axis],
            kind: Some(outer_kind(header, axis)),
        });
        let n_volume_voxels = volume_axes.iter().fold(1u128, |n, axis| n.saturating_mul(header.sizes[*axis].into()));
        let n_before = choose_volume(outer.collect(), found)?.saturating_mul(n_volume_voxels);
        Ok(Part { voxel, n_before })
    }
}

/// "0 (list)".
fn axis_name(header: &NrrdHeader, axis: usize) -> String {
    format!("{axis} ({})", header.kind(axis).unwrap_or("no kind"))
}

fn voxel(
    header: &NrrdHeader,
    first_axis: usize,
    stored: StoredType,
    found: &mut FileFacts,
) -> Result<StoredVoxel, ReadError> {
    let mut axes = (0..first_axis).filter(|axis| header.sizes[*axis] > 1);
    let (axis, others) = (axes.next(), axes.count());
    let n_components = header.sizes[..first_axis].iter().fold(1u64, |n, size| n.saturating_mul(*size));
    let Some(axis) = axis else { return Ok(stored.into()) };
    if others > 0 {
        return StoredVoxel::of_components(stored, ChoiceKind::Channel, Entries::Numbered(n_components), found);
    }
    if let Some(colours) = colours(header.kind(axis), n_components) {
        return StoredVoxel::of_colours(stored, colours, found);
    }
    let (kind, names) = match inner_kind(header, axis) {
        ChoiceKind::Array => (ChoiceKind::Array, layer_names(header, n_components)),
        kind => (kind, component_names(header.kind(axis), n_components)),
    };
    let entries = names.map_or(Entries::Numbered(n_components), Entries::Named);
    StoredVoxel::of_components(stored, kind, entries, found)
}

fn colours(kind: Option<&str>, n_components: u64) -> Option<Colours> {
    match kind? {
        "RGB-color" | "RGBA-color" | "3-color" | "4-color" => Colours::of_channels(n_components),
        _ => None,
    }
}

fn component_names(kind: Option<&str>, n_components: u64) -> Option<Vec<String>> {
    let names: &[&str] = match kind? {
        "HSV-color" => &["hue", "saturation", "value"],
        "XYZ-color" => &["X", "Y", "Z"],
        "complex" => &["real", "imaginary"],
        _ => return None,
    };
    (names.len() as u64 == n_components).then(|| names.iter().map(|name| (*name).to_owned()).collect())
}

/// Segmentations of Slicer have their layers first, its series their times; of others they are numbers of one voxel.
fn inner_kind(header: &NrrdHeader, axis: usize) -> ChoiceKind {
    if header.is_segmentation() {
        ChoiceKind::Array
    } else if is_time(header, axis) || header.key("MultiVolume.NumberOfFrames").is_some() {
        ChoiceKind::Time
    } else {
        ChoiceKind::Channel
    }
}

/// Volumes one after the other are a series, unless the file names them parts of a vector or colours.
fn outer_kind(header: &NrrdHeader, axis: usize) -> ChoiceKind {
    match header.kind(axis) {
        _ if header.is_segmentation() => ChoiceKind::Array,
        Some(kind) if kind.contains("vector") || kind.contains("color") || kind.contains("matrix") => {
            ChoiceKind::Channel
        }
        _ => ChoiceKind::Time,
    }
}

/// Whether the kind is time, or the file has the index of a sequence (Slicer: "axis 0 index values:=0 1 2").
fn is_time(header: &NrrdHeader, axis: usize) -> bool {
    header.kind(axis) == Some("time") || header.key(&format!("axis {axis} index values")).is_some()
}
