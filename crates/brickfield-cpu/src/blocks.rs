//! The blocks that a ray crosses, one after the other.

use brickfield_core::Span;
use brickfield_core::glam::UVec3;
use brickfield_frame::{FramePlan, IndexEntry, PlanRay};

/// A ray's way through a block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossing {
    /// An index cell of the block.
    pub(crate) cell: UVec3,
    /// The block's entry of the index.
    pub(crate) entry: IndexEntry,
    /// Parameters of the ray; not empty.
    pub(crate) span: Span,
}

/// The blocks along a ray's span: their spans follow one another without gap or overlap.
pub(crate) struct Blocks<'a> {
    plan: &'a FramePlan,
    ray: &'a PlanRay,
    cell: UVec3,
    t: f64,
    end: f64,
}

impl<'a> Blocks<'a> {
    /// The blocks of a span in the domain.
    pub(crate) fn new(plan: &'a FramePlan, ray: &'a PlanRay, span: Span) -> Blocks<'a> {
        let mut blocks = Blocks { plan, ray, cell: UVec3::ZERO, t: span.start, end: span.end };
        blocks.cell = blocks.cell_at(span.start);
        blocks
    }

    /// The index cell of the ray's position at `t`.
    fn cell_at(&self, t: f64) -> UVec3 {
        self.plan.field().cell_at(self.plan.rays().center + self.ray.at(t))
    }

    /// The cells of a block: from the first, to the one behind the last.
    fn cells(&self, entry: IndexEntry) -> (UVec3, UVec3) {
        let (low, high) = entry.reach().block(self.cell);
        (low, high.min(self.plan.field().index().dims()))
    }

    /// Where the ray leaves some cells, along which axis; beyond the index there is nothing to leave to.
    fn exit(&self, low: UVec3, high: UVec3) -> (f64, Option<usize>) {
        let (ray, index) = (self.ray, self.plan.field().index());
        let lattice = index.lattice();
        let mut exit = (f64::INFINITY, None);
        for axis in 0..3 {
            let d = ray.direction[axis];
            let face = if d > 0.0 { high[axis] } else { low[axis] };
            if d == 0.0 || face == 0 || face == index.dims()[axis] {
                continue;
            }
            let face =
                f64::from(face) * f64::from(lattice.cell_samples) + lattice.origin - self.plan.rays().center[axis];
            let t = (face - ray.anchor[axis]) / d + ray.t_anchor;
            if t < exit.0 {
                exit = (t, Some(axis));
            }
        }
        exit
    }

    /// Moves on through the face of `axis`.
    fn leave(&mut self, low: UVec3, high: UVec3, axis: usize) {
        self.cell = self.cell_at(self.t).clamp(low, high - 1);
        self.cell[axis] = if self.ray.direction[axis] > 0.0 { high[axis] } else { low[axis] - 1 };
    }
}

impl Iterator for Blocks<'_> {
    type Item = Crossing;

    fn next(&mut self) -> Option<Crossing> {
        while self.t < self.end {
            let (cell, entry, start) = (self.cell, self.plan.field().index().at(self.cell), self.t);
            let (low, high) = self.cells(entry);
            let (exit, axis) = self.exit(low, high);
            self.t = exit.clamp(start, self.end);
            match axis {
                Some(axis) if self.t < self.end => self.leave(low, high, axis),
                _ => self.t = self.end,
            }
            if start < self.t {
                return Some(Crossing { cell, entry, span: Span { start, end: self.t } });
            }
        }
        None
    }
}
