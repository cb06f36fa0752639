//! The blocks that a ray passes through, one after the other.

use brickfield_core::glam::DVec3;
use brickfield_frame::{IndexEntry, Reach};

use super::brick::Stored;
use super::f32_plan::F32Plan;
use super::march::{Path, Resident};

/// Where the outermost blocks end: nowhere. (A number, so that 0 times it is 0.)
const NOWHERE: f64 = 1e300;

/// Where `n` index cells with so many samples each meet along an axis, in sample space.
pub(super) fn faces(n: u32, cell_samples: f64) -> Vec<f64> {
    let inner = (1..n).map(|i| f64::from(i) * cell_samples);
    std::iter::once(-NOWHERE).chain(inner).chain([NOWHERE]).collect()
}

/// A ray's way from block to block.
///
/// Behind a block of one cell lies the cell beyond the face where the ray leaves: to find it takes a few steps of arithmetic, and to find the
/// cell of a position many.
pub(super) struct Walk<'a, const N: usize, S> {
    plan32: &'a F32Plan<'a, N, S>,
    path: &'a Path<'a>,
    /// Where the ray is at parameter `anchor`.
    origin: [f64; 3],
    /// In segments; infinite along axes along which the ray stays where it is.
    anchor: [f64; 3],
    /// Segments per sample, 0 along those axes.
    per_sample: [f64; 3],
    /// 1 where the ray goes up.
    up: [usize; 3],
    cell: [usize; 3],
    entry: IndexEntry,
    /// Where the ray passes the faces that it goes to, in segments.
    exits: [f64; 3],
    /// Where it leaves the block.
    pub(super) exit: f64,
}

impl<'a, const N: usize, S: Stored> Walk<'a, N, S> {
    /// Begins in the block that holds a point of the path, in segments.
    #[inline(always)]
    pub(super) fn new(plan32: &'a F32Plan<'a, N, S>, path: &'a Path<'a>, at: f64) -> Self {
        let (direction, per_unit) = (path.ray.direction.to_array(), path.per_unit);
        let mut walk = Walk {
            plan32,
            path,
            origin: (plan32.center + path.ray.anchor).to_array(),
            anchor: [f64::INFINITY; 3],
            per_sample: [0.0; 3],
            up: [0; 3],
            cell: [0; 3],
            entry: IndexEntry::Empty { reach: Reach(0) },
            exits: [0.0; 3],
            exit: 0.0,
        };
        for (axis, change) in direction.into_iter().enumerate() {
            let per_sample = per_unit / change;
            if per_sample.is_finite() {
                (walk.per_sample[axis], walk.anchor[axis]) = (per_sample, path.ray.t_anchor * per_unit);
            }
            walk.up[axis] = usize::from(change > 0.0);
        }
        walk.seek(at);
        walk
    }

    /// Goes to the block that holds a point of the path; it ends behind that point, whatever rounding says.
    #[inline(always)]
    fn seek(&mut self, at: f64) {
        let cell = self.plan32.cell_at(self.plan32.center + self.path.ray.at(at * self.path.step));
        self.cell = [cell.x as usize, cell.y as usize, cell.z as usize];
        self.enter();
        self.exit = self.exit.max(at.next_up());
    }

    /// Looks at the block around the cell.
    #[inline(always)]
    fn enter(&mut self) {
        let ([x, y, z], [n_x, n_y, _]) = (self.cell, self.plan32.n_cells);
        self.entry = IndexEntry::unpack(self.plan32.words[x + n_x * (y + n_y * z)]);
        let reach = self.entry.reach();
        for axis in 0..3 {
            let low = self.cell[axis] >> reach.0 << reach.0;
            let faces = &self.plan32.faces[axis];
            let face = faces[(low + self.up[axis] * reach.n_cells() as usize).min(faces.len() - 1)];
            self.exits[axis] = (face - self.origin[axis]) * self.per_sample[axis] + self.anchor[axis];
        }
        let [x, y, z] = self.exits;
        self.exit = x.min(y).min(z);
    }

    /// Goes on to the next block; behind a block of several cells, to the block of a point of the path.
    #[inline(always)]
    pub(super) fn leave(&mut self, at: f64) {
        if self.entry.reach() != Reach(0) {
            return self.seek(at);
        }
        for axis in 0..3 {
            // Down by one, or up.
            let change = (2 * self.up[axis]).wrapping_sub(1);
            if self.exits[axis] <= self.exit {
                self.cell[axis] = self.cell[axis].wrapping_add(change);
            }
        }
        self.enter();
    }

    /// The block's brick; `None` if the block is empty.
    #[inline(always)]
    pub(super) fn resident(&self) -> Option<Resident> {
        let IndexEntry::Resident { slot, reach } = self.entry else { return None };
        let [x, y, z] = self.cell.map(|cell| (cell >> reach.0 << reach.0) as f64);
        Some(Resident { slot, level: reach.level_of_brick(), corner: DVec3::new(x, y, z) * (N - 1) as f64 })
    }
}
