//! A file's slope and intercept.

use brickfield_core::Rescale;

use crate::Note;

/// value = slope * stored + intercept, as a file states it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StatedRescale {
    pub(crate) slope: f64,
    pub(crate) intercept: f64,
}

impl StatedRescale {
    /// The rescale, or the identity with a note if it is not finite or loses everything.
    pub(crate) fn usable(self, notes: &mut Vec<Note>) -> Rescale {
        let StatedRescale { slope, intercept } = self;
        Rescale::new(slope, intercept).unwrap_or_else(|_| {
            notes.push(Note::RescaleIgnored { slope, intercept });
            Rescale::IDENTITY
        })
    }
}
