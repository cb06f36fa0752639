//! A frame, or a batch of it, in several dispatches.

use std::ops::Range;

/// One dispatch of a frame: some rows of the picture, and some segments of their rays.
#[derive(Clone, Debug, PartialEq)]
pub struct Pass {
    /// Rows of the picture.
    pub rows: Range<u32>,
    /// Segments, counted from the frame's start; segments before them were integrated by earlier passes over the same rows.
    pub segments: Range<f32>,
    /// The row of the picture whose rays have the first places in the list of what rays have seen.
    pub first_seen_row: u32,
    /// Whether rays go on with what they have seen in earlier passes or batches.
    pub goes_on: bool,
}

impl Pass {
    /// All segments of the rays of some rows.
    pub fn whole_rays(rows: Range<u32>) -> Pass {
        Pass { first_seen_row: rows.start, rows, segments: f32::MIN..f32::MAX, goes_on: false }
    }
}
