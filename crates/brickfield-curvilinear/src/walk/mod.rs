//! Rays through the cells of a curvilinear volume, cell by cell.

mod boundary;
mod faces;
mod inner;
mod lattice;

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Aabb, Ray};

use boundary::BoundarySide;
use faces::{Cell, Half, neighbour, opposite};
use inner::InnerFaces;
use lattice::{Lattice, Line};

use crate::volume::CellMap;
use crate::{CurvilinearVolume, LayoutError};

/// A volume that is ready for rays: its sides have boxes, in which a ray finds the faces where it enters.
///
/// The faces of cells are taken for two triangles each, the same two for both cells at a face. Whether a ray crosses a triangle is decided
/// by integers, in which positions are rounded to 2^-38 of half the longest edge of the volume's box. So a ray that leaves a cell
/// enters the next one, or leaves the volume: none slips between cells, through an edge or a corner. Where it crosses (t) comes from positions
/// that are not rounded.
#[derive(Clone, Debug, PartialEq)]
pub struct CellWalker {
    volume: CurvilinearVolume,
    lattice: Lattice,
    sides: [BoundarySide; 6],
    voids: Voids,
    inner: InnerFaces,
    is_right_handed: bool,
}

/// The cells that a volume is without.
#[derive(Clone, Debug, PartialEq)]
struct Voids {
    n_cells: UVec3,
    /// One mark for each cell; none if there is no void.
    marks: Vec<bool>,
}

impl Voids {
    fn of(volume: &CurvilinearVolume, is_void: impl Fn(UVec3) -> bool) -> Voids {
        let n_cells = volume.n_cells();
        let marks: Vec<bool> = cells(n_cells).map(is_void).collect();
        Voids { n_cells, marks: if marks.contains(&true) { marks } else { Vec::new() } }
    }

    fn contains(&self, cell: UVec3) -> bool {
        let [nx, ny, _] = self.n_cells.to_array().map(|n| n as usize);
        let number = cell.x as usize + nx * (cell.y as usize + ny * cell.z as usize);
        self.marks.get(number).is_some_and(|mark| *mark)
    }
}

/// All cells of a grid, x varying fastest.
fn cells(n: UVec3) -> impl Iterator<Item = UVec3> {
    (0..n.z).flat_map(move |z| (0..n.y).flat_map(move |y| (0..n.x).map(move |x| UVec3::new(x, y, z))))
}

/// The part of a ray in one cell.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct CellSegment {
    pub cell: UVec3,
    /// How often the whole line has entered the volume before: a row of cells that follow each other has one number.
    pub run: u32,
    /// Where the ray enters and leaves, in units of its direction: t_in < t_out. In a row of cells t_in is the t_out before.
    pub t_in: f64,
    pub t_out: f64,
    /// The local coordinates of both ends, by Newton's method, limited to 0 to 1. Exact to rounding where the cell's faces are plane;
    /// elsewhere a triangle may lie beside the face, and the nearest coordinates stand for it.
    pub local_in: DVec3,
    pub local_out: DVec3,
}

/// Why there is no walker.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum CellWalkerError {
    #[error(transparent)]
    Layout(#[from] LayoutError),
    #[error("the cells have a volume of {volume}; they must not be flat")]
    Flat { volume: f64 },
}

/// Why a ray cannot be walked.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("a ray from {} along {}; both must be finite, and the direction not 0", ray.origin, ray.direction)]
#[allow(missing_docs)]
pub struct RayError {
    pub ray: Ray,
}

impl CellWalker {
    /// Makes the boxes of a volume's sides.
    ///
    /// # Errors
    /// Cells without volume.
    pub fn new(volume: CurvilinearVolume) -> Result<CellWalker, CellWalkerError> {
        CellWalker::with_voids(volume, |_| false)
    }

    /// The same of a volume without some of its cells: rays leave it at their faces, and enter it again behind them.
    ///
    /// # Errors
    /// Cells without volume, or no cells at all.
    pub fn with_voids(
        volume: CurvilinearVolume,
        is_void: impl Fn(UVec3) -> bool,
    ) -> Result<CellWalker, CellWalkerError> {
        let extent = Aabb::of_points(volume.positions().iter().copied());
        // Lattices move points by 2^-38 of half the extent, and directions by as much.
        let margin = extent.diagonal() * 2f64.powi(-34);
        let side = |face| BoundarySide::new(&volume, face, margin);
        let sides = [side(0)?, side(1)?, side(2)?, side(3)?, side(4)?, side(5)?];
        let voids = Voids::of(&volume, is_void);
        let inner = InnerFaces::of(&volume, &voids, margin);
        let center = extent.center();
        let of_sides: f64 = sides.iter().map(|side| side.signed_volume(&volume, &voids, center)).sum();
        let signed = 0.0 + of_sides + inner.signed_volume(&volume, center);
        if signed == 0.0 || !signed.is_finite() {
            return Err(CellWalkerError::Flat { volume: signed });
        }
        let is_right_handed = signed > 0.0;
        Ok(CellWalker { lattice: Lattice::over(&extent), sides, voids, inner, is_right_handed, volume })
    }

    /// The volume that is walked.
    pub fn volume(&self) -> &CurvilinearVolume {
        &self.volume
    }

    /// The cells that a ray (t >= 0) passes, in order. Where it leaves the volume and enters it again, t_in jumps.
    ///
    /// # Errors
    /// A ray that is not finite, or has no direction.
    pub fn walk(&self, ray: &Ray) -> Result<CellWalk<'_>, RayError> {
        if !(ray.origin.is_finite() && ray.direction.is_finite() && ray.direction.length_squared() > 0.0) {
            return Err(RayError { ray: *ray });
        }
        let line = self.lattice.line(ray);
        let mut entries = line.as_ref().map_or_else(Vec::new, |line| self.entries(ray, line));
        // The first entry is taken last.
        entries.sort_by(|a, b| b.t.total_cmp(&a.t));
        Ok(CellWalk { walker: self, ray: *ray, line, entries, here: None, t: f64::NEG_INFINITY, n_entered: 0 })
    }

    /// Where the whole line enters the volume.
    fn entries(&self, ray: &Ray, line: &Line) -> Vec<Entry> {
        let (mut entries, near) = (Vec::new(), line.ray());
        let mut visit = |cell, face| {
            let corners = Cell::of(&self.volume, cell, line, ray);
            for half in [0, 1].map(|part| Half { face, part }) {
                let crossing = corners.crossing(line, half);
                if let Some(crossing) = crossing.filter(|crossing| crossing.leaves != self.is_right_handed) {
                    entries.push(Entry { cell, half, t: crossing.t });
                }
            }
        };
        for side in &self.sides {
            side.visit(&near, &mut |cell, face| {
                if !self.voids.contains(cell) {
                    visit(cell, face);
                }
            });
        }
        self.inner.visit(&near, &mut visit);
        entries
    }

    /// Where the line leaves a cell that it enters through a triangle. A cell that is not convex may be entered several times:
    /// the first exit belongs to the first entry, the second to the second.
    fn exit(&self, ray: &Ray, line: &Line, entry: &Entry) -> Option<Entry> {
        let cell = Cell::of(&self.volume, entry.cell, line, ray);
        let [mut entered, mut left] = cell.crossings(line);
        if !self.is_right_handed {
            std::mem::swap(&mut entered, &mut left);
        }
        let turn = entered.iter().position(|crossing| crossing.half == entry.half)?;
        let left = left.get(turn)?;
        Some(Entry { cell: entry.cell, half: left.half, t: left.t })
    }
}

/// A triangle of a cell, and where the line crosses it.
#[derive(Clone, Copy, Debug)]
struct Entry {
    cell: UVec3,
    half: Half,
    t: f64,
}

/// The cells along a ray.
#[derive(Clone, Debug)]
pub struct CellWalk<'a> {
    walker: &'a CellWalker,
    ray: Ray,
    line: Option<Line>,
    entries: Vec<Entry>,
    /// Where the next cell is entered.
    here: Option<Entry>,
    /// Where the last cell was left.
    t: f64,
    n_entered: u32,
}

impl CellWalk<'_> {
    /// The next cell of the whole line, and where it is entered and left.
    fn step(&mut self) -> Option<(UVec3, f64, f64)> {
        let entry = match self.here.take() {
            Some(here) => here,
            None => {
                self.n_entered += 1;
                self.entries.pop()?
            }
        };
        let exit = self.walker.exit(&self.ray, self.line.as_ref()?, &entry)?;
        let t_in = entry.t.max(self.t);
        // In a cell that is folded the exit may come before the entry.
        let t_out = exit.t.max(t_in);
        self.t = t_out;
        let next = neighbour(exit.cell, exit.half.face, self.walker.volume.n_cells());
        let next = next.filter(|cell| !self.walker.voids.contains(*cell));
        self.here = next.map(|cell| Entry { cell, half: opposite(exit.half), t: exit.t });
        Some((entry.cell, t_in, t_out))
    }
}

impl Iterator for CellWalk<'_> {
    type Item = CellSegment;

    fn next(&mut self) -> Option<CellSegment> {
        loop {
            let (cell, t_in, t_out) = self.step()?;
            let t_in = t_in.max(0.0);
            if t_in < t_out {
                let map = CellMap::new(&self.walker.volume.corners(cell));
                let local = |t, guess| map.local_inside(self.ray.at(t), guess);
                let local_in = local(t_in, DVec3::splat(0.5));
                let run = self.n_entered - 1;
                return Some(CellSegment { cell, run, t_in, t_out, local_in, local_out: local(t_out, local_in) });
            }
        }
    }
}
