//! Where lines enter cells from outside.

use brickfield_core::glam::Vec3;
use brickfield_frame::{CellFace, Handedness};

use super::crossing::{Crossing, Sides};
use super::line::Line;
use super::scene::{Cell, Scene};

/// A cell that a line enters from outside, and where.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    pub(super) cell: Cell,
    pub(super) crossing: Crossing,
}

/// Room for the rounding of slabs, in the scene's unit.
const MARGIN: f32 = 1.0 / (1 << 20) as f32;

/// All entries of a whole line, the last one first.
pub(super) fn entries(scene: &Scene, line: &Line, entries: &mut Vec<Entry>) {
    entries.clear();
    let mut open = [0u32; 64];
    let mut n_open = 1;
    let cells = scene.plan.cells();
    let per_unit = (1.0 / scene.unit) as f32;
    while n_open > 0 {
        n_open -= 1;
        let around = &cells.boxes()[open[n_open] as usize];
        let corner = |p: [f32; 3]| Vec3::from_array(p) * per_unit - line.anchor();
        if !meets(line, corner(around.min) - MARGIN, corner(around.max) + MARGIN) {
            continue;
        }
        if around.n_faces == 0 {
            open[n_open] = around.first;
            open[n_open + 1] = around.first + 1;
            n_open += 2;
        }
        let first = around.first as usize;
        for face in &cells.faces()[first..first + around.n_faces as usize] {
            enter(scene, line, *face, entries);
        }
    }
    entries.sort_unstable_by(|a, b| b.crossing.w.total_cmp(&a.crossing.w));
}

/// Whether the whole line meets a box, relative to the anchor.
#[inline(always)]
fn meets(line: &Line, min: Vec3, max: Vec3) -> bool {
    let (a, b) = (min * line.inverse, max * line.inverse);
    // Along an axis that the line does not move along, a or b may be NaN, which `min` and `max` pass over.
    let start = a.x.min(b.x).max(a.y.min(b.y)).max(a.z.min(b.z));
    let end = a.x.max(b.x).min(a.y.max(b.y)).min(a.z.max(b.z));
    start <= end
}

#[inline(always)]
fn enter(scene: &Scene, line: &Line, face: CellFace, entries: &mut Vec<Entry>) {
    let cell = scene.cell(face.cell());
    let corners = line.corners(scene, cell.node);
    let sides = Sides::of(&corners);
    let enters = scene.handedness == Handedness::Left;
    for triangle in [2 * face.face() as usize, 2 * face.face() as usize + 1] {
        if sides.crosses(triangle) == Some(enters) {
            entries.push(Entry { cell, crossing: sides.crossing(&corners, triangle) });
        }
    }
}
