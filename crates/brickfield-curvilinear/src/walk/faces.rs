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
    /// Relative to the ray's origin.
    positions: [DVec3; 8],
    direction: DVec3,
}

impl Cell {
    pub(crate) fn of(volume: &CurvilinearVolume, cell: UVec3, line: &Line, ray: &Ray) -> Cell {
        let positions = volume.corners(cell);
        Cell {
            corners: positions.map(|p| line.corner(p)),
            positions: positions.map(|p| p - ray.origin),
            direction: ray.direction,
        }
    }

    /// Where the line crosses a triangle.
    pub(crate) fn crossing(&self, line: &Line, half: Half) -> Option<Crossing> {
        self.crossing_by(&mut Sides::default(), line, half)
    }

    /// Where the line enters a cell of a right-handed grid, and where it leaves it, each along the ray.
    pub(crate) fn crossings(&self, line: &Line) -> [Vec<Crossing>; 2] {
        let mut sides = Sides::default();
        let mut crossings = [Vec::new(), Vec::new()];
        for half in (0..6).flat_map(|face| [0, 1].map(|part| Half { face, part })) {
            if let Some(crossing) = self.crossing_by(&mut sides, line, half) {
                crossings[usize::from(crossing.leaves)].push(crossing);
            }
        }
        for of_kind in &mut crossings {
            of_kind.sort_by(|a, b| a.t.total_cmp(&b.t).then(a.half.cmp(&b.half)));
        }
        crossings
    }

    fn crossing_by(&self, sides: &mut Sides, line: &Line, half: Half) -> Option<Crossing> {
        let [a, b, c] = triangle(half);
        let of_c = self.side(sides, line, a, b);
        let of_a = self.side(sides, line, b, c);
        if of_c == 0 || of_c != of_a {
            return None;
        }
        let is_crossed = self.side(sides, line, c, a) == of_c;
        is_crossed.then(|| Crossing { half, t: self.t([a, b, c]), leaves: of_c > 0 })
    }

    /// Where the ray meets the plane of a triangle, from positions that are not rounded to the lattice; not before the first of its
    /// corners along the ray, nor behind the last, where the ray nearly runs in the plane.
    fn t(&self, corners: [usize; 3]) -> f64 {
        let [a, b, c] = corners.map(|i| self.positions[i]);
        let normal = (b - a).cross(c - a);
        let along = [a, b, c].map(|p| p.dot(self.direction) / self.direction.length_squared());
        let (first, last) = (along[0].min(along[1]).min(along[2]), along[0].max(along[1]).max(along[2]));
        let t = a.dot(normal) / self.direction.dot(normal);
        if t.is_nan() { 0.5 * (first + last) } else { t.max(first).min(last) }
    }

    /// The side of an edge. Both cells at an edge ask in the same order of its ends: that of their nodes.
    fn side(&self, sides: &mut Sides, line: &Line, from: usize, to: usize) -> i8 {
        let (low, high) = (from.min(to), from.max(to));
        let side = *sides.0[8 * low + high].get_or_insert_with(|| line.side(self.corners[low], self.corners[high]));
        if from < to { side } else { -side }
    }
}

/// The edges of a cell, and diagonals of its faces, that were looked at: by eight times the lower corner, and the upper one.
struct Sides([Option<i8>; 64]);

impl Default for Sides {
    fn default() -> Sides {
        Sides([None; 64])
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
