//! The six sides of a volume, with boxes around their faces: where lines enter.

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Aabb, Level, Ray};

use super::Voids;
use super::faces::Face;
use super::inner::{triangles, under};
use crate::{CurvilinearVolume, QuadLayout, Zone};

/// The faces of one side, in the levels of a quadtree, each zone with a box.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct BoundarySide {
    face: Face,
    layout: QuadLayout,
    n_cells: UVec3,
    /// Level 0 first; grown by more than a lattice moves a line.
    boxes: Vec<Vec<Aabb>>,
}

impl BoundarySide {
    pub(crate) fn new(volume: &CurvilinearVolume, face: Face, margin: f64) -> Result<BoundarySide, crate::LayoutError> {
        let n_cells = volume.n_cells();
        let [u, v] = across(face);
        let layout = QuadLayout::new(n_cells[v], n_cells[u])?;
        let mut side = BoundarySide { face, layout, n_cells, boxes: Vec::new() };
        for level in layout.levels() {
            let zones = (0..layout.n_zones(level)).map(|i| layout.zone_at(level, i));
            let boxes = zones.map(|zone| side.box_of(volume, zone, margin)).collect();
            side.boxes.push(boxes);
        }
        Ok(side)
    }

    /// Calls `visit` with each cell whose face on this side may be crossed by the whole line of a ray.
    pub(crate) fn visit(&self, ray: &Ray, visit: &mut impl FnMut(UVec3, Face)) {
        let mut open = vec![self.layout.root()];
        while let Some(zone) = open.pop() {
            if !meets(ray, &self.boxes[usize::from(zone.level.0)][self.layout.address(zone)]) {
                continue;
            }
            if zone.level == Level(0) {
                visit(self.cell(zone), self.face);
            }
            open.extend(self.layout.children(zone));
        }
    }

    /// The part of the volume under this side, by the divergence theorem: a sixth of the sum of determinants of its triangles.
    pub(crate) fn signed_volume(&self, volume: &CurvilinearVolume, voids: &Voids, center: DVec3) -> f64 {
        let zones = (0..self.layout.n_zones(Level(0))).map(|i| self.layout.zone_at(Level(0), i));
        let kept = zones.map(|zone| self.cell(zone)).filter(|cell| !voids.contains(*cell));
        kept.flat_map(|cell| triangles(volume, cell, self.face)).map(|triangle| under(triangle, center)).sum()
    }

    /// The cell at a face of the side.
    fn cell(&self, zone: Zone) -> UVec3 {
        let mut cell = UVec3::ZERO;
        let ([u, v], axis) = (across(self.face), self.face / 2);
        (cell[u], cell[v]) = (zone.column, zone.row);
        cell[axis] = if self.face % 2 == 1 { self.n_cells[axis] - 1 } else { 0 };
        cell
    }

    fn box_of(&self, volume: &CurvilinearVolume, zone: Zone, margin: f64) -> Aabb {
        if zone.level == Level(0) {
            let around = Aabb::of_points(triangles(volume, self.cell(zone), self.face).into_iter().flatten());
            return Aabb { min: around.min - margin, max: around.max + margin };
        }
        let below = &self.boxes[usize::from(zone.level.0) - 1];
        let boxes = self.layout.children(zone).map(|child| below[self.layout.address(child)]);
        boxes.reduce(|a, b| a.union(&b)).unwrap_or(Aabb::of_points([]))
    }
}

fn across(face: Face) -> [usize; 2] {
    let axis = face / 2;
    [(axis + 1) % 3, (axis + 2) % 3]
}

/// Whether the line through a ray meets a box, on either side of the ray's origin.
pub(crate) fn meets(ray: &Ray, around: &Aabb) -> bool {
    let (mut start, mut end) = (f64::NEG_INFINITY, f64::INFINITY);
    for axis in 0..3 {
        let (o, d) = (ray.origin[axis], ray.direction[axis]);
        let (low, high) = (around.min[axis] - o, around.max[axis] - o);
        if d == 0.0 {
            if low > 0.0 || high < 0.0 {
                return false;
            }
            continue;
        }
        let (a, b) = (low / d, high / d);
        (start, end) = (start.max(a.min(b)), end.min(a.max(b)));
    }
    start <= end
}
