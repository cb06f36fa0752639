//! A ray's line, and nodes as seen along it.

use brickfield_core::glam::{DVec3, Vec3, Vec4};
use brickfield_frame::ViewRay;

use super::scene::Scene;

/// A line, in the scene's unit: u and v across it, w along it from the ray's anchor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    /// The rows that make u, v and w of a position; what is added to each.
    rows: [[f32; 4]; 3],
    anchor: Vec3,
    direction: Vec3,
    pub(super) inverse: Vec3,
}

/// Corners of a cell as seen along a line.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Corners {
    pub(super) u: [f32; 8],
    pub(super) v: [f32; 8],
    pub(super) w: [f32; 8],
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
        let direction = ray.direction.as_vec3();
        Line {
            rows: [row(u), row(v), row(ray.direction)],
            anchor: anchor.as_vec3(),
            direction,
            inverse: direction.recip(),
        }
    }

    /// The position at w.
    #[inline(always)]
    pub(super) fn at(&self, w: f32) -> Vec4 {
        (self.anchor + self.direction * w).extend(0.0)
    }

    pub(super) fn anchor(&self) -> Vec3 {
        self.anchor
    }

    /// The same numbers for the same node, whichever cell asks.
    #[inline(always)]
    fn see(&self, node: Vec4) -> [f32; 3] {
        let of = |[x, y, z, add]: [f32; 4]| ((node.x * x + node.y * y) + node.z * z) + add;
        self.rows.map(of)
    }

    /// All corners of a cell.
    #[inline(always)]
    pub(super) fn corners(&self, scene: &Scene, node: usize) -> Corners {
        let mut corners = Corners::default();
        for i in 0..8 {
            self.see_corner(scene, node, i, &mut corners);
        }
        corners
    }

    /// The corners of the next cell, of which those at `face` are corners of the last one.
    #[inline(always)]
    pub(super) fn follow(&self, scene: &Scene, node: usize, face: usize, corners: &mut Corners) {
        let (bit, side) = (1 << (face >> 1), face & 1);
        for i in FACE_CORNERS[face >> 1] {
            let (near, far) = if side == 0 { (i, i | bit) } else { (i | bit, i) };
            corners.u[near] = corners.u[far];
            corners.v[near] = corners.v[far];
            corners.w[near] = corners.w[far];
            self.see_corner(scene, node, far, corners);
        }
    }

    #[inline(always)]
    fn see_corner(&self, scene: &Scene, node: usize, i: usize, corners: &mut Corners) {
        [corners.u[i], corners.v[i], corners.w[i]] = self.see(scene.nodes[node + scene.corners[i]]);
    }
}

/// The corners of the lower face along each axis.
const FACE_CORNERS: [[usize; 4]; 3] = [[0, 2, 4, 6], [0, 1, 4, 5], [0, 1, 2, 3]];
