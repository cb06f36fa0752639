//! The boxes of trimmed bricks.

use brickfield_core::Aabb;
use brickfield_core::glam::DVec3;

use crate::Chunked;
use crate::content::Pages;

/// For each slot a closed box in sample space: the part of its block beside the box is dark (Tong, Wang, Tsang and Tang 1999, section
/// 3.2.2), so that passing over it changes no sample.
///
/// A box may be without end where the volume ends; of a block that is dark it is empty, with its lower corner above the upper one.
#[derive(Clone, Debug)]
pub struct KeptBoxes {
    boxes: Vec<Aabb>,
    table: Pages,
}

/// Boxes are equal if their numbers are.
impl PartialEq for KeptBoxes {
    fn eq(&self, other: &KeptBoxes) -> bool {
        self.boxes == other.boxes
    }
}

/// Beyond every volume.
const OUTSIDE: f64 = 1e9;

impl KeptBoxes {
    /// The boxes of slots, by number.
    pub fn new(boxes: Vec<Aabb>) -> KeptBoxes {
        let corner = |p: DVec3| p.clamp(DVec3::splat(-OUTSIDE), DVec3::splat(OUTSIDE)).as_vec3().extend(0.0).to_array();
        let rows: Vec<[f32; 4]> = boxes.iter().flat_map(|b| [corner(b.min), corner(b.max)]).collect();
        KeptBoxes { table: Pages::new(bytemuck::cast_slice(&rows)), boxes }
    }

    /// The same boxes, whose table keeps the identity of the pages that are equal to pages of boxes before them.
    #[must_use]
    pub fn following(mut self, before: &KeptBoxes) -> KeptBoxes {
        self.table.follow(&before.table);
        self
    }

    /// The boxes, by slot.
    #[inline]
    pub fn boxes(&self) -> &[Aabb] {
        &self.boxes
    }

    /// The same as shaders read it: two rows of four numbers for each slot, the lower corner and the upper one.
    pub fn table(&self) -> &dyn Chunked {
        &self.table
    }
}
