//! The faces through which rays enter cells, with boxes around them.

use brickfield_core::glam::{DVec3, UVec3, Vec3};
use bytemuck::{Pod, Zeroable};

use super::data::{CellNode, corners};
use crate::Chunked;
use crate::content::Pages;

/// A face of a cell as shaders read it: eight times the cell's number, and the face: 2 * axis for the lower one along an axis, and
/// 2 * axis + 1 for the upper one.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Pod, Zeroable)]
pub struct CellFace(pub u32);

/// A box around some faces as shaders read it; a tree's root comes first.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct FaceBox {
    /// Lower corner, relative to the cells' centre.
    pub min: [f32; 3],
    /// With faces: the number of the first one; without: the number of the first of the two boxes inside, one after the other.
    pub first: u32,
    /// Upper corner.
    pub max: [f32; 3],
    /// Faces in the box; 0 if it has boxes inside.
    pub n_faces: u32,
}

impl CellFace {
    /// A face of a cell.
    pub fn new(cell: usize, face: u32) -> CellFace {
        CellFace((cell as u32) << 3 | face)
    }

    /// The cell's number.
    #[inline]
    pub fn cell(self) -> usize {
        (self.0 >> 3) as usize
    }

    /// Which of the cell's faces it is.
    #[inline]
    pub fn face(self) -> u32 {
        self.0 & 7
    }

    /// The two triangles of a face, as corners of the cell: counter-clockwise seen from outside a cell of a right-handed grid. The face is cut
    /// from its first corner to its last, the same way for both cells at it.
    pub const fn triangles(face: u32) -> [[usize; 3]; 2] {
        let axis = face / 2;
        let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
        let a = ((face % 2) << axis) as usize;
        match face % 2 {
            1 => [[a, a + u, a + u + v], [a, a + u + v, a + v]],
            _ => [[a, a + u + v, a + u], [a, a + v, a + u + v]],
        }
    }
}

/// Faces of cells beside nothing, and the tree of boxes around them.
#[derive(Clone, Debug)]
pub(super) struct Boundary {
    faces: Vec<CellFace>,
    boxes: Vec<FaceBox>,
    face_table: Pages,
    box_table: Pages,
}

/// The most faces of a box without boxes inside.
const LEAF_FACES: usize = 4;
const PAGE_BYTES: usize = 1 << 18;

impl Boundary {
    pub(super) fn of(n_cells: UVec3, nodes: &[CellNode], is_void: &impl Fn(usize) -> bool) -> Boundary {
        let faces = outer_faces(n_cells, is_void);
        let mut boxed: Vec<Boxed> = faces.into_iter().map(|face| Boxed::of(n_cells, nodes, face)).collect();
        let mut boxes = vec![FaceBox::default()];
        divide(&mut boxed, 0, 0, &mut boxes);
        let faces: Vec<CellFace> = boxed.iter().map(|boxed| boxed.face).collect();
        Boundary {
            face_table: Pages::of(bytemuck::cast_slice(&faces), PAGE_BYTES),
            box_table: Pages::of(bytemuck::cast_slice(&boxes), PAGE_BYTES),
            faces,
            boxes,
        }
    }

    pub(super) fn faces(&self) -> &[CellFace] {
        &self.faces
    }

    pub(super) fn boxes(&self) -> &[FaceBox] {
        &self.boxes
    }

    pub(super) fn face_table(&self) -> &dyn Chunked {
        &self.face_table
    }

    pub(super) fn box_table(&self) -> &dyn Chunked {
        &self.box_table
    }
}

/// A face with the box around it.
#[derive(Clone, Copy)]
struct Boxed {
    face: CellFace,
    min: Vec3,
    max: Vec3,
}

impl Boxed {
    fn of(n_cells: UVec3, nodes: &[CellNode], face: CellFace) -> Boxed {
        let corners = corners(n_cells, face.cell());
        let points = CellFace::triangles(face.face()).concat().into_iter();
        let points = points.map(|i| Vec3::from_array(nodes[corners[i]].position));
        let (min, max) = points.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(min, max), p| (min.min(p), max.max(p)));
        Boxed { face, min, max }
    }
}

/// Fills the box numbered `at` with faces, of which the first has the number `first`.
fn divide(faces: &mut [Boxed], first: usize, at: usize, boxes: &mut Vec<FaceBox>) {
    let min = faces.iter().fold(Vec3::INFINITY, |min, b| min.min(b.min));
    let max = faces.iter().fold(Vec3::NEG_INFINITY, |max, b| max.max(b.max));
    let (min_corner, max_corner) = (min.to_array(), max.to_array());
    if faces.len() <= LEAF_FACES {
        boxes[at] = FaceBox { min: min_corner, max: max_corner, first: first as u32, n_faces: faces.len() as u32 };
        return;
    }
    let axis = (max - min).max_position();
    let half = faces.len() / 2;
    let middle = |b: &Boxed| b.min[axis] + b.max[axis];
    faces.select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)).then(a.face.0.cmp(&b.face.0)));
    let inside = boxes.len();
    boxes.extend([FaceBox::default(); 2]);
    boxes[at] = FaceBox { min: min_corner, max: max_corner, first: inside as u32, n_faces: 0 };
    let (low, high) = faces.split_at_mut(half);
    divide(low, first, inside, boxes);
    divide(high, first + half, inside + 1, boxes);
}

/// All faces between a cell and nothing: a cell that is left out, or the outside.
fn outer_faces(n_cells: UVec3, is_void: &impl Fn(usize) -> bool) -> Vec<CellFace> {
    let n = n_cells.to_array().map(|n| n as usize);
    let strides = [1, n[0], n[0] * n[1]];
    let is_outer = |cell: usize, face: u32| {
        let axis = face as usize / 2;
        let at = cell / strides[axis] % n[axis];
        match face % 2 {
            0 => at == 0 || is_void(cell - strides[axis]),
            _ => at + 1 == n[axis] || is_void(cell + strides[axis]),
        }
    };
    let cells = (0..n[0] * n[1] * n[2]).filter(|cell| !is_void(*cell));
    cells
        .flat_map(|cell| (0..6).filter(move |face| is_outer(cell, *face)).map(move |face| CellFace::new(cell, face)))
        .collect()
}

/// The volume inside some faces, by the divergence theorem: a sixth of the sum of determinants of their triangles. Negative in a left-handed
/// grid.
pub(super) fn signed_volume(n_cells: UVec3, nodes: &[CellNode], faces: &[CellFace]) -> f64 {
    let of_face = |face: &CellFace| {
        let corners = corners(n_cells, face.cell());
        let position = |i: usize| Vec3::from_array(nodes[corners[i]].position).as_dvec3();
        let of_triangle = |corners: [usize; 3]| {
            let [a, b, c]: [DVec3; 3] = corners.map(position);
            a.dot(b.cross(c)) / 6.0
        };
        CellFace::triangles(face.face()).map(of_triangle).iter().sum::<f64>()
    };
    faces.iter().map(of_face).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_face_is_in_one_leaf_and_in_all_boxes_around_it() {
        let n_cells = UVec3::new(5, 4, 3);
        let node = |i: usize| CellNode { position: [(i % 6) as f32, (i / 6 % 5) as f32, (i / 30) as f32], value: 0.0 };
        let nodes: Vec<CellNode> = (0..120).map(node).collect();
        let boundary = Boundary::of(n_cells, &nodes, &|cell| cell == 26);
        assert_eq!(boundary.faces.len(), 2 * (20 + 15 + 12) + 6);
        assert!((signed_volume(n_cells, &nodes, &boundary.faces) - 59.0).abs() < 1e-12);
        let mut n_seen = 0;
        let mut open = vec![(0, Vec3::NEG_INFINITY, Vec3::INFINITY)];
        while let Some((at, low, high)) = open.pop() {
            let b = boundary.boxes[at];
            let (min, max) = (Vec3::from_array(b.min), Vec3::from_array(b.max));
            assert!(min.cmpge(low).all() && max.cmple(high).all());
            let first = b.first as usize;
            for face in &boundary.faces[first..first + b.n_faces as usize] {
                let own = Boxed::of(n_cells, &nodes, *face);
                assert!(own.min.cmpge(min).all() && own.max.cmple(max).all());
                n_seen += 1;
            }
            if b.n_faces == 0 {
                open.extend([(first, min, max), (first + 1, min, max)]);
            }
        }
        assert_eq!(n_seen, boundary.faces.len());
    }
}
