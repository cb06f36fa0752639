//! A plan of cells as f32 arithmetic takes it.

use brickfield_core::ValueRange;
use brickfield_core::glam::Vec4;
use brickfield_frame::{CellsPlan, Handedness};
use rayon::prelude::*;

use crate::fast::classify::Classifier;

/// Nodes, and what is known of cells.
pub(super) struct Scene<'a> {
    pub(super) plan: &'a CellsPlan,
    /// x, y, z in units of [`unit`](Self::unit), and the value as a number of the value scale.
    pub(super) nodes: Vec<Vec4>,
    /// Cells along each axis.
    pub(super) n: [u32; 3],
    /// How far the nodes of a cell's corners are from its first one.
    pub(super) corners: [usize; 8],
    /// How far the next cell, and the next node, along each axis are.
    pub(super) cell_strides: [usize; 3],
    pub(super) node_strides: [usize; 3],
    /// A bit for each cell whose values the transfer function makes invisible; no words if there is none.
    dark: Vec<u32>,
    pub(super) transfer: Classifier,
    /// A power of two near the radius, in world units: products of lengths stay within f32.
    pub(super) unit: f64,
    pub(super) per_unit: f32,
    pub(super) handedness: Handedness,
}

/// A cell: its number, its first node, and its place along each axis.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Cell {
    pub(super) number: usize,
    pub(super) node: usize,
    pub(super) at: [u32; 3],
}

impl<'a> Scene<'a> {
    pub(super) fn new(plan: &'a CellsPlan) -> Scene<'a> {
        let cells = plan.cells();
        let (unit, scale) = (plan.unit(), plan.value_scale());
        let node = |n: &brickfield_frame::CellNode| {
            let [x, y, z] = n.position.map(|x| (f64::from(x) / unit) as f32);
            Vec4::new(x, y, z, scale.number(f64::from(n.value)) as f32)
        };
        let n = cells.n_cells().to_array();
        let [nx, ny, _] = n.map(|n| n as usize);
        let node_strides = [1, nx + 1, (nx + 1) * (ny + 1)];
        let mut scene = Scene {
            plan,
            nodes: cells.nodes().iter().map(node).collect(),
            n,
            corners: std::array::from_fn(|i| (0..3).map(|axis| (i >> axis & 1) * node_strides[axis]).sum()),
            cell_strides: [1, nx, nx * ny],
            node_strides,
            dark: Vec::new(),
            transfer: Classifier::new(plan.transfer(), scale),
            unit,
            per_unit: (1.0 / unit) as f32,
            handedness: cells.handedness(),
        };
        scene.dark = scene.dark_cells();
        scene
    }

    /// A cell by its number.
    pub(super) fn cell(&self, number: usize) -> Cell {
        let [nx, ny, _] = self.n.map(|n| n as usize);
        let at = [number % nx, number / nx % ny, number / nx / ny];
        let node = (0..3).map(|axis| at[axis] * self.node_strides[axis]).sum();
        Cell { number, node, at: at.map(|i| i as u32) }
    }

    /// The cell beside a face; `None` if there is none.
    #[inline(always)]
    pub(super) fn beside(&self, cell: Cell, face: usize) -> Option<Cell> {
        let axis = face >> 1;
        let (up, step) = (face & 1 == 1, if face & 1 == 1 { 1 } else { usize::MAX });
        let mut next = cell;
        next.at[axis] = cell.at[axis].wrapping_add(step as u32);
        if next.at[axis] >= self.n[axis] {
            return None;
        }
        let moved = |from: usize, by: usize| if up { from + by } else { from - by };
        next.number = moved(cell.number, self.cell_strides[axis]);
        next.node = moved(cell.node, self.node_strides[axis]);
        (!self.plan.cells().is_void(next.number)).then_some(next)
    }

    /// Whether the transfer function is 0 over a cell's values.
    #[inline(always)]
    pub(super) fn is_dark(&self, cell: usize) -> bool {
        self.dark.get(cell / 32).is_some_and(|word| word >> (cell % 32) & 1 == 1)
    }

    fn dark_cells(&self) -> Vec<u32> {
        let transfer = self.plan.transfer();
        if transfer.knots().iter().all(|knot| knot.extinction > 0.0) {
            return Vec::new();
        }
        let n_cells = self.n.map(|n| n as usize).iter().product::<usize>();
        let is_dark = |cell: usize| transfer.is_transparent(self.range(self.cell(cell).node));
        let word = |word: usize| {
            let cells = 32 * word..n_cells.min(32 * word + 32);
            cells.filter(|cell| is_dark(*cell)).fold(0, |bits, cell| bits | 1u32 << (cell % 32))
        };
        (0..n_cells.div_ceil(32)).into_par_iter().map(word).collect()
    }

    /// The values of a cell's corners.
    fn range(&self, node: usize) -> ValueRange {
        let values = self.corners.map(|corner| f64::from(self.plan.cells().nodes()[node + corner].value));
        let [min, max] = [f64::min, f64::max].map(|f| values.into_iter().reduce(f).unwrap_or(0.0));
        ValueRange { min, max }
    }
}
