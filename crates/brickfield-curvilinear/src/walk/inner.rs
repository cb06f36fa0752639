//! Faces between a cell and a void: where lines enter a volume from inside of its sides.

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Aabb, Ray};

use super::boundary::meets;
use super::faces::{Face, Half, neighbour, triangle};
use super::{Voids, cells};
use crate::CurvilinearVolume;

/// Runs of faces that follow each other in the order of cells, each with a box.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct InnerFaces {
    faces: Vec<(UVec3, Face)>,
    /// Around [`RUN`] faces each; grown by more than a lattice moves a line.
    boxes: Vec<Aabb>,
}

const RUN: usize = 16;

impl InnerFaces {
    pub(crate) fn of(volume: &CurvilinearVolume, voids: &Voids, margin: f64) -> InnerFaces {
        let n = volume.n_cells();
        let is_inner = |cell, face| neighbour(cell, face, n).is_some_and(|next| voids.contains(next));
        let faces_of = |cell| (0..6).filter(move |face| is_inner(cell, *face)).map(move |face| (cell, face));
        let kept = cells(n).filter(|cell| !voids.marks.is_empty() && !voids.contains(*cell));
        let faces: Vec<(UVec3, Face)> = kept.flat_map(faces_of).collect();
        let around = |run: &[(UVec3, Face)]| {
            let around = Aabb::of_points(run.iter().flat_map(|(cell, face)| triangles(volume, *cell, *face)).flatten());
            Aabb { min: around.min - margin, max: around.max + margin }
        };
        InnerFaces { boxes: faces.chunks(RUN).map(around).collect(), faces }
    }

    /// Calls `visit` with each cell and face that may be crossed by the whole line of a ray.
    pub(crate) fn visit(&self, ray: &Ray, visit: &mut impl FnMut(UVec3, Face)) {
        let runs = self.faces.chunks(RUN).zip(&self.boxes);
        let met = runs.filter(|(_, around)| meets(ray, around));
        met.flat_map(|(run, _)| run).for_each(|(cell, face)| visit(*cell, *face));
    }

    /// The part of the volume under these faces, as that of sides.
    pub(crate) fn signed_volume(&self, volume: &CurvilinearVolume, center: DVec3) -> f64 {
        let of_face = |(cell, face): &(UVec3, Face)| {
            triangles(volume, *cell, *face).map(|t| under(t, center)).iter().sum::<f64>()
        };
        self.faces.iter().map(of_face).sum()
    }
}

/// The corners of both triangles of a face.
pub(crate) fn triangles(volume: &CurvilinearVolume, cell: UVec3, face: Face) -> [[DVec3; 3]; 2] {
    let corners = volume.corners(cell);
    [0, 1].map(|part| triangle(Half { face, part }).map(|i| corners[i]))
}

/// The volume between a triangle and a point; positive if the triangle is counter-clockwise seen from the other side.
pub(crate) fn under(triangle: [DVec3; 3], center: DVec3) -> f64 {
    let [a, b, c] = triangle.map(|p| p - center);
    a.dot(b.cross(c)) / 6.0
}
