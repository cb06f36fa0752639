//! From cell to cell along a line.

use brickfield_core::glam::Vec3;
use brickfield_frame::Handedness;

use super::crossing::{Crossing, Crossings, Sides};
use super::entry::Entry;
use super::lanes::Lanes;
use super::line::{Corners, Line};
use super::scene::{Cell, Scene};

/// A line on its way through a row of cells.
pub(super) struct Walk<'a, L: Lanes> {
    scene: &'a Scene<'a>,
    crossings: Crossings,
    line: &'a Line,
    corners: Corners<L>,
    /// The next cell, and where it is entered.
    cell: Option<Cell>,
    entered: Crossing,
}

/// The part of a line in one cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passage {
    pub(super) cell: usize,
    pub(super) node: usize,
    /// Where the line enters and leaves; not in order if the cell is folded.
    pub(super) w: [f32; 2],
    /// Near the local coordinates of both.
    pub(super) local: [Vec3; 2],
}

impl<'a, L: Lanes> Walk<'a, L> {
    #[inline(always)]
    pub(super) fn new(
        lanes: L,
        scene: &'a Scene<'a>,
        crossings: Crossings,
        line: &'a Line,
        entry: &Entry,
    ) -> Walk<'a, L> {
        let corners = Corners::of(lanes, scene, line, entry.cell.node);
        Walk { scene, crossings, line, corners, cell: Some(entry.cell), entered: entry.crossing }
    }

    /// The next cell.
    #[inline(always)]
    pub(super) fn step(&mut self) -> Option<Passage> {
        let cell = self.cell?;
        let sides = Sides::of(&self.corners);
        let left = self.exit(&sides)?;
        let passage = Passage {
            cell: cell.number,
            node: cell.node,
            w: [self.entered.w, left.w],
            local: [self.entered.local, left.local],
        };
        let face = left.triangle >> 1;
        self.cell = self.scene.beside(cell, face);
        if let Some(next) = self.cell {
            self.corners.follow(self.scene, self.line, next.node, face ^ 1);
            let mut local = left.local;
            local[face >> 1] = 1.0 - local[face >> 1];
            self.entered = Crossing { triangle: left.triangle ^ 2, w: left.w, local };
        }
        Some(passage)
    }

    #[inline(always)]
    fn exit(&self, sides: &Sides<L>) -> Option<Crossing> {
        let is_left = usize::from(self.scene.handedness == Handedness::Right);
        match self.crossings.once(sides) {
            Some(pair) if pair[1 - is_left] == self.entered.triangle => Some(sides.crossing(pair[is_left])),
            _ => self.exit_of_many(sides),
        }
    }

    /// A cell that is not convex may be entered several times: the first exit belongs to the first entry, the second to the second.
    #[cold]
    #[inline(never)]
    fn exit_of_many(&self, sides: &Sides<L>) -> Option<Crossing> {
        let leaves = self.scene.handedness == Handedness::Right;
        let entered = sides.all(!leaves);
        let turn = entered.iter().position(|crossing| crossing.triangle == self.entered.triangle)?;
        sides.all(leaves).get(turn).copied()
    }
}
