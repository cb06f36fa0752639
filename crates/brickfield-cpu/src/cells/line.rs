//! A ray's line, and nodes as seen along it.

use brickfield_core::glam::{DVec3, Vec3, Vec4};
use brickfield_frame::ViewRay;

use super::lanes::{FACE_CORNERS, Lanes, Rows};
use super::scene::Scene;

/// A line, in the scene's unit: u and v across it, w along it from the ray's anchor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    rows: Rows,
    anchor: Vec3,
    direction: Vec3,
    inverse: Vec3,
}

/// Corners of a cell as seen along a line.
#[derive(Clone, Copy)]
pub(super) struct Corners<L: Lanes> {
    pub(super) lanes: L,
    pub(super) u: L::Eight,
    pub(super) v: L::Eight,
    pub(super) w: L::Eight,
}

impl Line {
    pub(super) fn of(ray: &ViewRay, unit: f64) -> Line {
        let anchor = ray.anchor / unit;
        let u = ray.direction.any_orthonormal_vector();
        // u, v and the direction are right-handed.
        let v = ray.direction.cross(u);
        let row = |axis: DVec3| {
            let [x, y, z] = axis.as_vec3().to_array();
            [x, y, z, -axis.dot(anchor) as f32]
        };
        let (rows, direction) = ([row(u), row(v), row(ray.direction)], ray.direction.as_vec3());
        Line { rows, anchor: anchor.as_vec3(), direction, inverse: direction.recip() }
    }

    /// The position at w.
    #[inline(always)]
    pub(super) fn at(&self, w: f32) -> Vec4 {
        (self.anchor + self.direction * w).extend(0.0)
    }

    /// Whether the whole line meets a box.
    #[inline(always)]
    pub(super) fn meets(&self, min: Vec3, max: Vec3) -> bool {
        let (a, b) = ((min - self.anchor) * self.inverse, (max - self.anchor) * self.inverse);
        // Along an axis that the line does not move along, a or b may be NaN, which `min` and `max` pass over.
        let start = a.x.min(b.x).max(a.y.min(b.y)).max(a.z.min(b.z));
        let end = a.x.max(b.x).min(a.y.max(b.y)).min(a.z.max(b.z));
        start <= end
    }
}

impl<L: Lanes> Corners<L> {
    /// The corners of a cell.
    #[inline(always)]
    pub(super) fn of(lanes: L, scene: &Scene, line: &Line, node: usize) -> Corners<L> {
        let see = |corners: [usize; 4]| lanes.see(&line.rows, corners.map(|i| scene.nodes[node + scene.corners[i]]));
        let (low, high) = (see([0, 1, 2, 3]), see([4, 5, 6, 7]));
        let [u, v, w] = std::array::from_fn(|i| lanes.join(low[i], high[i]));
        Corners { lanes, u, v, w }
    }

    /// The corners of the next cell, of which those at `face` are corners of this one.
    #[inline(always)]
    pub(super) fn follow(&mut self, scene: &Scene, line: &Line, node: usize, face: usize) {
        let beyond = node + if face & 1 == 0 { scene.node_strides[face >> 1] } else { 0 };
        let new = FACE_CORNERS[face >> 1].map(|i| scene.nodes[beyond + scene.corners[i]]);
        let [u, v, w] = self.lanes.see(&line.rows, new);
        self.u = self.lanes.follow(self.u, u, face);
        self.v = self.lanes.follow(self.v, v, face);
        self.w = self.lanes.follow(self.w, w, face);
    }
}
