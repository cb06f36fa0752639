//! A frame in several dispatches.

use std::ops::Range;

/// One dispatch of a frame: some rows of the picture, and some segments of their rays.
#[derive(Clone, Debug, PartialEq)]
pub struct Pass {
    /// Rows of the picture.
    pub rows: Range<u32>,
    /// Segments, counted from the frame's start; segments before them were integrated by earlier passes over the same rows.
    pub segments: Range<f32>,
}

impl Pass {
    /// All segments of the rays of some rows.
    pub fn whole_rays(rows: Range<u32>) -> Pass {
        Pass { rows, segments: f32::MIN..f32::MAX }
    }
}
