//! The series among slices, and the sets of slices within a series that make one volume.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use brickfield_core::glam::DVec3;

use super::frames::Unread;
use super::slice::Slice;
use crate::choice::Entries;
use crate::opened::FileFacts;
use crate::{ChoiceKind, Note, ReadError};

/// The slices of a series with equal size and orientation. If there are several such sets: the wanted set, else the largest.
pub(super) fn chosen_series(slices: Vec<Slice>, found: &mut FileFacts) -> Result<Vec<Slice>, ReadError> {
    let mut kinds: BTreeMap<_, Vec<Slice>> = BTreeMap::new();
    for slice in slices {
        let image = &slice.image;
        let format = (image.is_float(), image.colour.is_grey());
        let key = (image.series.clone(), slice.columns, slice.rows, format, slice.stack.clone());
        kinds.entry(key).or_default().push(slice);
    }
    // The largest first; the order of keys makes the rest repeatable.
    let mut sets: Vec<Vec<Slice>> = kinds.into_values().flat_map(by_orientation).collect();
    sets.sort_by_key(|slices| Reverse(slices.len()));
    let names = sets.iter().map(|slices| slices[0].image.series.clone()).collect();
    let chosen = found.choose(ChoiceKind::Series, Entries::Named(names))?;
    Ok(sets.swap_remove(chosen as usize))
}

/// Directions that differ by less, in each of their numbers, are one: writers round them differently from slice to slice.
const SAME_DIRECTION: f64 = 1e-3;

/// Sets of slices whose orientations are near that of the set's first slice.
fn by_orientation(slices: Vec<Slice>) -> Vec<Vec<Slice>> {
    let mut sets: Vec<Vec<Slice>> = Vec::new();
    for slice in slices {
        match sets.iter_mut().find(|set| are_near(&set[0], &slice)) {
            Some(set) => set.push(slice),
            None => sets.push(vec![slice]),
        }
    }
    sets
}

fn are_near(a: &Slice, b: &Slice) -> bool {
    let near = |a: DVec3, b: DVec3| (a - b).abs().max_element() < SAME_DIRECTION;
    match (a.orientation, b.orientation) {
        (Some([a, b]), Some([c, d])) => near(a, c) && near(b, d),
        (a, b) => a.is_none() && b.is_none(),
    }
}

/// Notes the files that gave no slices.
///
/// # Errors
/// If one of them is of this series, or may be: without it the volume would have another shape.
pub(super) fn pass_over(unread: Vec<Unread>, series: &str, notes: &mut Vec<Note>) -> Result<(), ReadError> {
    let is_missed = |file: &Unread| match &file.series {
        Some(of) => of == series && (is_damage(&file.fault) || matches!(file.fault, ReadError::Unsupported { .. })),
        None => is_damage(&file.fault),
    };
    if let Some(i) = unread.iter().position(is_missed) {
        return Err(unread.into_iter().nth(i).map_or(ReadError::Empty, Unread::into_fault));
    }
    let n_files = unread.len();
    if let Some(Unread { name, fault, .. }) = unread.into_iter().next() {
        notes.push(Note::FilesSkipped { n_files, first: name, reason: fault.to_string() });
    }
    Ok(())
}

/// Whether a DICOM file ends too early or states impossible numbers; other files are no slices.
pub(super) fn is_damage(fault: &ReadError) -> bool {
    use super::image::PIXEL_DATA;
    use super::source::META_END;
    use ReadError::{EndsWithin, Field, Missing, Truncated};
    matches!(fault, Field { .. } | EndsWithin { .. } | Truncated { .. } | Missing { field: META_END | PIXEL_DATA })
}
