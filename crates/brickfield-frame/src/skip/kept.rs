//! The boxes of trimmed bricks.

use brickfield_core::Aabb;
use brickfield_core::glam::DVec3;

use crate::Chunked;
use crate::content::Pages;

/// For each slot a closed box in sample space: the part of its block beside the box is dark (Tong, Wang, Tsang and Tang 1999, section
/// 3.2.2), so that passing over it changes no sample.
///
/// A box may be without end where the volume ends; of a block that is dark it is empty, with its lower corner above the upper one.
///
/// Slots may be lent to a batch of a frame ([`PlanParts::sequence`](crate::PlanParts)): their values are read beside those of other
/// slots, and the segments that begin in them are another batch's.
#[derive(Clone, Debug)]
pub struct KeptBoxes {
    boxes: Vec<Aabb>,
    lent: Vec<bool>,
    has_lent: bool,
    table: Pages,
}

/// Boxes are equal if their numbers are.
impl PartialEq for KeptBoxes {
    fn eq(&self, other: &KeptBoxes) -> bool {
        (&self.boxes, &self.lent) == (&other.boxes, &other.lent)
    }
}

/// Beyond every volume.
const OUTSIDE: f64 = 1e9;

impl KeptBoxes {
    /// The boxes of slots, by number.
    pub fn new(boxes: Vec<Aabb>) -> KeptBoxes {
        KeptBoxes::lending(boxes, |_| false)
    }

    /// The boxes of slots, some of which are lent.
    pub fn lending(boxes: Vec<Aabb>, is_lent: impl Fn(usize) -> bool) -> KeptBoxes {
        let lent: Vec<bool> = (0..boxes.len()).map(is_lent).collect();
        let corner =
            |p: DVec3, w: f32| p.clamp(DVec3::splat(-OUTSIDE), DVec3::splat(OUTSIDE)).as_vec3().extend(w).to_array();
        let row = |(b, lent): (&Aabb, &bool)| [corner(b.min, f32::from(u8::from(*lent))), corner(b.max, 0.0)];
        let rows: Vec<[f32; 4]> = boxes.iter().zip(&lent).flat_map(row).collect();
        KeptBoxes { table: Pages::new(bytemuck::cast_slice(&rows)), boxes, has_lent: lent.contains(&true), lent }
    }

    /// Whether a slot is lent.
    #[inline]
    pub fn is_lent(&self, slot: u32) -> bool {
        self.lent[slot as usize]
    }

    /// Whether any slot is lent.
    pub fn has_lent(&self) -> bool {
        self.has_lent
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

    /// The same as shaders read it: two rows of four numbers for each slot, the lower corner and the upper one; behind the lower
    /// one 1 if the slot is lent.
    pub fn table(&self) -> &dyn Chunked {
        &self.table
    }
}
