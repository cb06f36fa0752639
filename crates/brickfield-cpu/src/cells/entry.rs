//! Where lines enter cells from outside.

use brickfield_core::glam::Vec3;
use brickfield_frame::{CellFace, FaceBox, Handedness};

use super::crossing::{Crossing, Sides};
use super::lanes::{FACE_CORNERS, Lanes};
use super::line::{Corners, Line};
use super::scene::{Cell, Scene};

/// A cell that a line enters from outside, and where.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    pub(super) cell: Cell,
    pub(super) crossing: Crossing,
}

/// Room for the rounding of slabs, in the scene's unit.
const MARGIN: f32 = 1.0 / (1 << 20) as f32;

/// Most boxes that wait at a time: the tree of 2^31 faces has 30 levels.
const MAX_OPEN: usize = 64;

/// All entries of a whole line, the last one first.
#[inline(always)]
pub(super) fn entries(lanes: impl Lanes, scene: &Scene, line: &Line, entries: &mut Vec<Entry>) {
    entries.clear();
    let (mut open, mut n_open) = ([0u32; MAX_OPEN], 1);
    let cells = scene.plan.cells();
    let (boxes, faces) = (cells.boxes(), cells.faces());
    while n_open > 0 {
        n_open -= 1;
        let around = &boxes[open[n_open] as usize];
        if !meets(scene, line, around) {
            continue;
        }
        if around.n_faces == 0 {
            open[n_open] = around.first;
            open[n_open + 1] = around.first + 1;
            n_open += 2;
        }
        let first = around.first as usize;
        for face in &faces[first..first + around.n_faces as usize] {
            enter(lanes, scene, line, *face, entries);
        }
    }
    if entries.len() > 1 {
        entries.sort_unstable_by(|a, b| b.crossing.w.total_cmp(&a.crossing.w));
    }
}

#[inline(always)]
fn meets(scene: &Scene, line: &Line, around: &FaceBox) -> bool {
    let corner = |p: [f32; 3]| Vec3::from_array(p) * scene.per_unit;
    line.meets(corner(around.min) - MARGIN, corner(around.max) + MARGIN)
}

#[inline(always)]
fn enter(lanes: impl Lanes, scene: &Scene, line: &Line, face: CellFace, entries: &mut Vec<Entry>) {
    let (cell, face) = (scene.cell(face.cell()), face.face() as usize);
    let corners = Corners::of(lanes, scene, line, cell.node);
    if !corners.surround(ON_FACE[face]) {
        return;
    }
    let sides = Sides::of(&corners);
    let enters = scene.handedness == Handedness::Left;
    for triangle in [2 * face, 2 * face + 1] {
        if sides.crosses(triangle) == Some(enters) {
            entries.push(Entry { cell, crossing: sides.crossing(triangle) });
        }
    }
}

/// A bit for each corner of a face.
const ON_FACE: [u32; 6] = {
    let mut bits = [0; 6];
    let mut i = 0;
    while i < 24 {
        let (face, lower) = (i / 4, FACE_CORNERS[i / 8][i % 4]);
        bits[face] |= 1 << (lower | ((face % 2) << (face / 2)));
        i += 1;
    }
    bits
};
