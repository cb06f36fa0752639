//! Where a whole cut is dark: distances on a lattice over the volume.

use brickfield_core::BrickSide;
use brickfield_core::glam::{UVec3, Vec3A};
use rayon::prelude::*;

use super::super::{chebyshev, occupancy::is_all_visible};
use crate::{IndexEntry, IndexGrid, MACROCELL_SIDE, Occupancy, Reach};

/// Most cells of a lattice: 128^3.
const MAX_CELLS: usize = 1 << 21;
/// Most macrocells along a brick's side.
const MAX_MACROCELLS: usize = Occupancy::n_macrocells(BrickSide::S64) as usize;
/// Cells that a distance can tell; farther ones are as if that far away.
const FARTHEST: u8 = 32;

/// Where a whole cut is dark: a lattice over the volume, whose cells are the macrocells of bricks of level 0, or 2^m of them
/// along each axis where the volume has more than 128^3 macrocells.
///
/// Each cell has its Chebyshev distance, in cells, to the nearest that may show something, whatever brick that is in.
#[derive(Clone, Debug)]
pub struct Overview {
    n_cells: UVec3,
    distances: Vec<u8>,
    /// Where cells begin along each axis, in sample space; one more than there are cells.
    edges: [Vec<f32>; 3],
    lattice: Lattice,
}

/// How positions become cells, along any axis.
#[derive(Clone, Copy, Debug)]
struct Lattice {
    /// Samples from brick to brick.
    n_brick: u32,
    /// Macrocells from brick to brick.
    n_macrocells: u32,
    /// The power of two of macrocells that are a cell.
    shift: u32,
}

impl Lattice {
    /// The cell of a sample position that is not negative.
    #[inline(always)]
    fn cell(&self, sample: u32) -> u32 {
        let brick = sample / self.n_brick;
        (brick * self.n_macrocells + (sample - brick * self.n_brick) / MACROCELL_SIDE) >> self.shift
    }

    /// Sets the cells of a brick of level 0 that hold visible macrocells to 0; all of them if nothing is known of its
    /// macrocells. Rows and layers of cells are so far apart.
    fn mark_fine(&self, cells: &mut [u8], [row, layer]: [usize; 2], distances: Option<&[i8]>) {
        let (n, side) = (self.n_macrocells as usize, 1 << self.shift);
        let n_cells = n >> self.shift;
        for (z, y) in (0..n_cells).flat_map(|z| (0..n_cells).map(move |y| (z, y))) {
            let cells = &mut cells[z * layer + y * row..][..n_cells];
            let Some(distances) = distances else {
                cells.fill(0);
                continue;
            };
            // The sign of a cell's macrocells: negative if one of them is.
            let mut signs = [0; MAX_MACROCELLS];
            for i in (0..side).flat_map(|j| (0..side).map(move |k| (z * side + j) * n + y * side + k)) {
                signs.iter_mut().zip(&distances[i * n..][..n]).for_each(|(sign, d)| *sign |= d);
            }
            for (cell, signs) in cells.iter_mut().zip(signs.chunks_exact(side)) {
                if signs.iter().fold(0, |a, b| a | b) < 0 {
                    *cell = 0;
                }
            }
        }
    }

    /// Where a cell begins.
    fn edge(&self, cell: u32) -> u32 {
        let macrocell = cell << self.shift;
        macrocell / self.n_macrocells * self.n_brick + macrocell % self.n_macrocells * MACROCELL_SIDE
    }
}

/// A box of positions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Region {
    pub(super) low: Vec3A,
    pub(super) high: Vec3A,
}

impl Overview {
    /// The overview of an index of bricks and of their macrocells; `None` if nothing is known to be dark.
    pub fn of(side: BrickSide, index: &IndexGrid, occupancy: Option<&Occupancy>) -> Option<Overview> {
        if occupancy.is_none() && !index.has_empty() {
            return None;
        }
        let mut lattice = Lattice { n_brick: side.n_cells(), n_macrocells: Occupancy::n_macrocells(side), shift: 0 };
        let n_macrocells = index.dims() * lattice.n_macrocells;
        let n_cells = |shift: u32| (n_macrocells + ((1 << shift) - 1)) >> shift;
        let total = |n: UVec3| n.to_array().into_iter().map(|n| n as usize).product::<usize>();
        while total(n_cells(lattice.shift)) > MAX_CELLS {
            lattice.shift += 1;
        }
        let n_cells = n_cells(lattice.shift);
        let edges = n_cells.to_array().map(|n| edges(&lattice, n));
        let mut overview = Overview { n_cells, distances: vec![FARTHEST; total(n_cells)], edges, lattice };
        overview.mark(index, occupancy);
        chebyshev::spread(&mut overview.distances, n_cells.to_array().map(|n| n as usize), FARTHEST);
        Some(overview)
    }

    /// Sets cells that may show something to 0.
    fn mark(&mut self, index: &IndexGrid, occupancy: Option<&Occupancy>) {
        let dims = index.dims();
        // Bricks of level 0 that are whole cells a side lie in slabs of cells of their own.
        let n_cells = self.lattice.n_macrocells >> self.lattice.shift;
        let is_fine = |entry: IndexEntry| n_cells > 0 && entry.reach() == Reach(0);
        for cell in
            (0..dims.z).flat_map(|z| (0..dims.y).flat_map(move |y| (0..dims.x).map(move |x| UVec3::new(x, y, z))))
        {
            let entry @ IndexEntry::Resident { slot, reach } = index.at(cell) else { continue };
            // A coarse brick is marked once, from its lower corner.
            if !is_fine(entry) && cell & (reach.n_cells() - 1) == UVec3::ZERO {
                self.mark_brick(occupancy, cell, slot, reach.n_cells());
            }
        }
        if n_cells == 0 {
            return;
        }
        let (lattice, row) = (self.lattice, self.n_cells.x as usize);
        let is_all_visible = |distances: &[i8]| occupancy.is_some_and(|o| is_all_visible(o.side(), distances));
        let slab = row * (self.n_cells.y * n_cells) as usize;
        self.distances.par_chunks_mut(slab).enumerate().for_each(|(z, cells)| {
            for (x, y) in (0..dims.y).flat_map(|y| (0..dims.x).map(move |x| (x, y))) {
                match index.at(UVec3::new(x, y, z as u32)) {
                    IndexEntry::Resident { slot, reach: Reach(0) } => {
                        let corner = (x * n_cells) as usize + row * (y * n_cells) as usize;
                        let seen = occupancy.map(|occupancy| occupancy.brick(slot));
                        let seen = seen.filter(|distances| !is_all_visible(distances));
                        lattice.mark_fine(&mut cells[corner..], [row, row * self.n_cells.y as usize], seen);
                    }
                    _ => continue,
                }
            }
        });
    }

    fn mark_brick(&mut self, occupancy: Option<&Occupancy>, cell: UVec3, slot: u32, stride: u32) {
        let corner = cell * self.lattice.n_brick;
        let Some(occupancy) = occupancy else {
            return self.mark_box(corner, corner + self.lattice.n_brick * stride);
        };
        let n = self.lattice.n_macrocells;
        for (i, _) in occupancy.brick(slot).iter().enumerate().filter(|(_, d)| **d < 0) {
            let i = i as u32;
            let at = UVec3::new(i % n, i / n % n, i / n / n);
            let low = at * MACROCELL_SIDE;
            let high = (low + MACROCELL_SIDE).min(UVec3::splat(self.lattice.n_brick));
            self.mark_box(corner + low * stride, corner + high * stride);
        }
    }

    /// Marks the cells that overlap the samples from `low` to `high`, as far as the lattice extends.
    fn mark_box(&mut self, low: UVec3, high: UVec3) {
        let cell = |v: UVec3| UVec3::from(v.to_array().map(|s| self.lattice.cell(s)));
        let high = (cell(high - 1) + 1).min(self.n_cells);
        let low = cell(low).min(high);
        for z in low.z..high.z {
            for y in low.y..high.y {
                let row = ((z * self.n_cells.y + y) * self.n_cells.x) as usize;
                self.distances[row + low.x as usize..row + high.x as usize].fill(0);
            }
        }
    }

    /// World units in which a position that moves this many samples per unit passes a cell.
    pub(super) fn pace(&self, change: f32) -> f32 {
        (MACROCELL_SIDE << self.lattice.shift) as f32 / change
    }

    /// All dark cells around the cell that holds `p`, as a box; `None` if that cell may show something.
    #[inline(always)]
    pub(super) fn dark_around(&self, p: Vec3A) -> Option<Region> {
        let top = self.n_cells - 1;
        let sample = p.max(Vec3A::ZERO).as_uvec3();
        let cell = UVec3::from(sample.to_array().map(|s| self.lattice.cell(s))).min(top);
        let i = cell.x + self.n_cells.x * (cell.y + self.n_cells.y * cell.z);
        let d = u32::from(self.distances[i as usize]);
        if d == 0 {
            return None;
        }
        let (mut low, mut high) = (Vec3A::ZERO, Vec3A::ZERO);
        for axis in 0..3 {
            let c = cell[axis];
            low[axis] = if c < d { f32::NEG_INFINITY } else { self.edges[axis][(c + 1 - d) as usize] };
            high[axis] = if c + d > top[axis] { f32::INFINITY } else { self.edges[axis][(c + d) as usize] };
        }
        Some(Region { low, high })
    }
}

fn edges(lattice: &Lattice, n: u32) -> Vec<f32> {
    (0..=n).map(|cell| lattice.edge(cell) as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::IndexLattice;
    use std::sync::Arc;

    #[test]
    fn bricks_of_level_0_are_marked_as_all_others_are() {
        let dims = UVec3::new(5, 3, 4);
        let n = dims.element_product();
        let cell = |i: u32| UVec3::new(i % dims.x, i / dims.x % dims.y, i / dims.x / dims.y);
        let entries =
            (0..n).filter(|i| i % 5 != 2).map(|i| (cell(i), IndexEntry::Resident { slot: i, reach: Reach(0) }));
        let lattice = IndexLattice { cell_samples: 15, origin: 0.0 };
        let index = IndexGrid::new(dims, lattice, entries);
        let visible = |slot: u32| (0..512).map(|m| (m * 7 + slot * 13) % 97 < slot % 5).collect::<Vec<_>>();
        let distances =
            (0..n).map(|slot| Some(Arc::new(Occupancy::of_brick(BrickSide::S16, &visible(slot))))).collect();
        let occupancy = Occupancy::new(BrickSide::S16, distances).unwrap();
        for occupancy in [None, Some(&*occupancy)] {
            for shift in 0..=3 {
                let lattice = Lattice { n_brick: 15, n_macrocells: 8, shift };
                let n_cells = (dims * 8) >> shift;
                let edges = n_cells.to_array().map(|n| edges(&lattice, n));
                let distances = vec![FARTHEST; n_cells.element_product() as usize];
                let mut fine = Overview { n_cells, distances, edges, lattice };
                let mut general = fine.clone();
                fine.mark(&index, occupancy);
                for i in 0..n {
                    if let IndexEntry::Resident { slot, .. } = index.at(cell(i)) {
                        general.mark_brick(occupancy, cell(i), slot, 1);
                    }
                }
                assert!(fine.distances.contains(&0) && fine.distances == general.distances, "{shift}");
            }
        }
    }
}
