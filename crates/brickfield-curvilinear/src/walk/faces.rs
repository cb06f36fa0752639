//! The twelve triangles around a cell, and where a line crosses them.

use brickfield_core::Ray;
use brickfield_core::glam::{DVec3, UVec3};

use super::lattice::{Corner, Line};
use crate::CurvilinearVolume;

/// One of the six faces of a cell: 2 * axis for the lower one along an axis, and 2 * axis + 1 for the upper one.
pub(crate) type Face = usize;

/// A triangle of a cell: half of a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Half {
    pub(crate) face: Face,
    /// 0 or 1; both cells at a face count alike.
    pub(crate) part: usize,
}

/// A triangle that the line crosses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossing {
    pub(crate) half: Half,
    /// Where, in units of the ray's direction.
    pub(crate) t: f64,
    /// Whether the line leaves a cell of a right-handed grid here.
    pub(crate) leaves: bool,
}

/// The corners of a cell, as the lattice has them and along the ray.
pub(crate) struct Cell {
    corners: [Corner; 8],
    t: [f64; 8],
}

impl Cell {
    pub(crate) fn of(volume: &CurvilinearVolume, cell: UVec3, line: &Line, ray: &Ray) -> Cell {
        let positions = volume.corners(cell);
        let per_length = ray.direction / ray.direction.length_squared();
        Cell {
            corners: positions.map(|p| line.corner(p)),
            t: positions.map(|p: DVec3| (p - ray.origin).dot(per_length)),
        }
    }

    /// Where the line crosses a triangle.
    pub(crate) fn crossing(&self, line: &Line, half: Half) -> Option<Crossing> {
        let [a, b, c] = triangle(half);
        let [of_c, of_a, of_b] = [(a, b), (b, c), (c, a)].map(|(from, to)| self.side(line, from, to));
        if of_c.0 == 0 || of_c.0 != of_a.0 || of_c.0 != of_b.0 {
            return None;
        }
        // The determinants are the weights of the corners: between 0 and 1 of their sum, which is not 0 where the signs agree.
        let sum = of_a.1 + of_b.1 + of_c.1;
        let t = (of_a.1 * self.t[a] + of_b.1 * self.t[b] + of_c.1 * self.t[c]) / sum;
        Some(Crossing { half, t, leaves: of_c.0 > 0 })
    }

    /// All crossings of one kind, along the ray.
    pub(crate) fn crossings(&self, line: &Line, leaving: bool) -> Vec<Crossing> {
        let halves = (0..6).flat_map(|face| [0, 1].map(|part| Half { face, part }));
        let mut crossings: Vec<Crossing> =
            halves.filter_map(|half| self.crossing(line, half)).filter(|c| c.leaves == leaving).collect();
        crossings.sort_by(|a, b| a.t.total_cmp(&b.t).then(a.half.cmp(&b.half)));
        crossings
    }

    /// The sign and determinant of an edge. Both cells at an edge ask in the same order of its ends: that of their nodes.
    fn side(&self, line: &Line, from: usize, to: usize) -> (i8, f64) {
        let side = line.side(self.corners[from.min(to)], self.corners[from.max(to)]);
        if from < to { (side.sign, side.determinant) } else { (-side.sign, -side.determinant) }
    }
}

/// The corners of a triangle, counter-clockwise seen from outside of a cell of a right-handed grid. The face is cut from its first corner to
/// its last.
pub(crate) fn triangle(half: Half) -> [usize; 3] {
    let axis = half.face / 2;
    let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
    let first = (half.face % 2) << axis;
    let corners = match half.part {
        0 => [first, first + u, first + u + v],
        _ => [first, first + u + v, first + v],
    };
    if half.face % 2 == 1 { corners } else { [corners[0], corners[2], corners[1]] }
}

/// The same triangle as the cell on the other side counts it.
pub(crate) fn opposite(half: Half) -> Half {
    Half { face: half.face ^ 1, ..half }
}

/// The cell on the other side of a face; `None` outside of the volume.
pub(crate) fn neighbour(cell: UVec3, face: Face, n_cells: UVec3) -> Option<UVec3> {
    let mut next = cell;
    let axis = face / 2;
    next[axis] = if face % 2 == 1 { cell[axis] + 1 } else { cell[axis].checked_sub(1)? };
    (next[axis] < n_cells[axis]).then_some(next)
}
