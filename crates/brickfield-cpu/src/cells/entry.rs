//! Where lines enter cells from outside.

use brickfield_core::glam::{DVec2, DVec3, UVec2, Vec2, Vec3};
use brickfield_frame::{CellFace, Handedness, ViewRays};

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

/// The faces that the lines of a tile may enter cells by.
#[derive(Debug, Default)]
pub(super) struct TileFaces {
    faces: Vec<TileFace>,
}

/// A face, and a rectangle around it in the picture, in pixels.
#[derive(Clone, Copy, Debug)]
struct TileFace {
    min: Vec2,
    max: Vec2,
    cell: Cell,
    face: usize,
}

/// Room for the rounding of lines, in the scene's unit.
const MARGIN: f64 = 1.0 / (1 << 20) as f64;

/// Most boxes that wait at a time: the tree of 2^31 faces has 30 levels.
const MAX_OPEN: usize = 64;

impl TileFaces {
    /// The faces of the tile of `side` pixels at a corner.
    pub(super) fn find(&mut self, scene: &Scene, corner: UVec2, side: u32) {
        self.faces.clear();
        let rays = scene.plan.rays();
        let (low, high) = (corner.as_vec2(), (corner + side).as_vec2());
        let middle = rays.at(0.5 * (low + high).as_dvec2());
        let line = Line::of(&middle, scene.unit);
        let room = (MARGIN + reach(scene, rays, side)) as f32;
        let cells = scene.plan.cells();
        let (mut open, mut n_open) = ([0u32; MAX_OPEN], 1);
        while n_open > 0 {
            n_open -= 1;
            let around = &cells.boxes()[open[n_open] as usize];
            let corner = |p: [f32; 3]| Vec3::from_array(p) * scene.per_unit;
            if !line.meets(corner(around.min) - room, corner(around.max) + room) {
                continue;
            }
            let first = around.first as usize;
            if around.n_faces == 0 {
                open[n_open..n_open + 2].copy_from_slice(&[around.first, around.first + 1]);
                n_open += 2;
            }
            let faces = &cells.faces()[first..first + around.n_faces as usize];
            let seen = faces.iter().map(|face| TileFace::of(scene, rays, *face));
            self.faces.extend(seen.filter(|face| face.min.cmple(high).all() && face.max.cmpge(low).all()));
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.faces.is_empty()
    }

    /// All entries of the whole line through a pixel, the last one first.
    #[inline(always)]
    pub(super) fn entries(&self, lanes: impl Lanes, scene: &Scene, line: &Line, at: UVec2, entries: &mut Vec<Entry>) {
        entries.clear();
        let at = at.as_vec2() + 0.5;
        for face in &self.faces {
            if face.min.x <= at.x && face.max.x >= at.x && face.min.y <= at.y && face.max.y >= at.y {
                face.enter(lanes, scene, line, entries);
            }
        }
        if entries.len() > 1 {
            entries.sort_unstable_by(|a, b| b.crossing.w.total_cmp(&a.crossing.w));
        }
    }
}

/// How far lines of a tile are from its middle one, at most, anywhere among the cells; in the scene's unit.
fn reach(scene: &Scene, rays: &ViewRays, side: u32) -> f64 {
    let distance = if rays.are_parallel() { 1.0 } else { rays.eye().length() + scene.plan.cells().radius() };
    f64::from(side) * rays.pixel[0].length() * distance / scene.unit
}

impl TileFace {
    fn of(scene: &Scene, rays: &ViewRays, face: CellFace) -> TileFace {
        let (cell, face) = (scene.cell(face.cell()), face.face() as usize);
        let up = (face & 1) << (face >> 1);
        let corners = FACE_CORNERS[face >> 1].map(|lower| cell.node + scene.corners[lower | up]);
        let points = corners.map(|node| rays.camera(scene.plan.cells().position(node)));
        let (min, max) = rectangle(scene, rays, &points).unwrap_or((DVec2::NEG_INFINITY, DVec2::INFINITY));
        TileFace { min: min.as_vec2(), max: max.as_vec2(), cell, face }
    }

    #[inline(always)]
    fn enter(&self, lanes: impl Lanes, scene: &Scene, line: &Line, entries: &mut Vec<Entry>) {
        let corners = Corners::of(lanes, scene, line, self.cell.node);
        let sides = Sides::of(&corners);
        let enters = scene.handedness == Handedness::Left;
        for triangle in [2 * self.face, 2 * self.face + 1] {
            if sides.crosses(triangle) == Some(enters) {
                entries.push(Entry { cell: self.cell, crossing: sides.crossing(triangle) });
            }
        }
    }
}

/// A rectangle around points as a camera sees them, or would behind it: whole lines count. `None` if it reaches to infinity.
fn rectangle(scene: &Scene, rays: &ViewRays, points: &[DVec3; 4]) -> Option<(DVec2, DVec2)> {
    let depths = points.map(|point| if rays.are_parallel() { 1.0 } else { point.z });
    let nearest = 1e-3 * scene.unit;
    let lie = |beyond: fn(f64, f64) -> bool| depths.iter().all(|depth| beyond(*depth, nearest));
    if !(rays.are_parallel() || lie(|depth, nearest| depth > nearest) || lie(|depth, nearest| depth < -nearest)) {
        return None;
    }
    let half = 0.5 * rays.size.as_dvec2();
    let margin = 2.0 * MARGIN * scene.unit / rays.pixel[0].length();
    let (mut min, mut max) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for (point, depth) in points.iter().zip(depths) {
        let (at, room) = (point.truncate() / depth + half, 0.01 + margin / depth.abs());
        (min, max) = (min.min(at - room), max.max(at + room));
    }
    Some((min, max))
}
