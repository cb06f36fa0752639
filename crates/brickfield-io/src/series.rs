//! Files that hold several volumes one after the other: the one that is read.

use crate::choice::Entries;
use crate::opened::FileFacts;
use crate::{ChoiceKind, Note, ReadError};

/// An axis along which a file has volumes.
pub(crate) struct OuterAxis {
    pub(crate) name: String,
    pub(crate) n_entries: u64,
    /// Nothing if it is no choice.
    pub(crate) kind: Option<ChoiceKind>,
}

/// How many volumes come before the one that is read; the axes are in order, the fastest first.
///
/// Of a second axis of a kind, and of one that is no choice, it is the first entry, with a note.
pub(crate) fn choose_volume(axes: Vec<OuterAxis>, found: &mut FileFacts) -> Result<u128, ReadError> {
    let (mut n_before, mut stride) = (0, 1u128);
    for OuterAxis { name, n_entries, kind } in axes {
        let entry = match kind.filter(|kind| found.choices.made(*kind).is_none()) {
            Some(kind) => found.choose(kind, Entries::Numbered(n_entries))?,
            None if n_entries == 1 => 0,
            None => {
                found.notes.push(Note::FirstOfAxis { axis: name, n_entries });
                0
            }
        };
        n_before += u128::from(entry) * stride;
        stride = stride.saturating_mul(n_entries.into());
    }
    Ok(n_before)
}
