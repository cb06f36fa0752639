//! A triangle as it lies in the picture.

use std::ops::Range;

use brickfield_core::glam::{DVec2, DVec3};
use brickfield_frame::MeshPlan;

use super::Hit;

/// A triangle's corners, relative to the mesh's centre.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corners {
    pub(super) triangle: u32,
    pub(super) vertices: [u32; 3],
    pub(super) positions: [DVec3; 3],
}

impl Corners {
    pub(super) fn of(plan: &MeshPlan, triangle: u32) -> Corners {
        let vertices = plan.mesh().triangles()[triangle as usize].corners;
        Corners { triangle, vertices, positions: vertices.map(|vertex| plan.mesh().position(vertex)) }
    }

    /// The corners' positions, mixed.
    pub(super) fn point(&self, weights: [f64; 3]) -> DVec3 {
        self.positions.iter().zip(weights).map(|(p, w)| *p * w).sum()
    }
}

/// The edges of a triangle as lines of the picture, and the box around the part of it that lies before the eye.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outline {
    /// Opposite to each corner: positive on its side, and the weight of the corner up to a common factor.
    edges: [EdgeLine; 3],
    low: DVec2,
    high: DVec2,
}

/// A line in the picture: the plane through the eye and an edge, cut by the picture's plane. Its value at a position is
/// `at_center` + `slope` . (position - centre of the picture).
#[derive(Clone, Copy, Debug)]
pub(super) struct EdgeLine {
    at_center: f64,
    slope: DVec2,
    center: DVec2,
}

impl EdgeLine {
    /// The line through two points in camera space.
    fn through(plan: &MeshPlan, a: DVec3, b: DVec3) -> EdgeLine {
        // Of a perspective picture, a position p is seen along (p.x, p.y, 1); the eye, a and b make a plane with this normal.
        let (at_center, slope) = match plan.rays().are_parallel() {
            false => {
                let normal = a.cross(b);
                (normal.z, normal.truncate())
            }
            true => {
                let (along, a) = ((b - a).truncate(), a.truncate());
                // along x (p - a)
                (a.x * b.y - a.y * b.x, DVec2::new(-along.y, along.x))
            }
        };
        EdgeLine { at_center, slope, center: 0.5 * plan.size().as_dvec2() }
    }

    #[inline]
    fn at(&self, position: DVec2) -> f64 {
        self.at_center + self.slope.dot(position - self.center)
    }

    /// Whether a position lies on the positive side; one on the line is taken for one a little further to the right, or down.
    #[inline]
    fn is_positive(&self, position: DVec2) -> bool {
        let value = self.at(position);
        let decides = [value, self.slope.x, self.slope.y].into_iter().find(|v| *v != 0.0);
        decides.is_some_and(|v| v > 0.0)
    }

    fn turned(self) -> EdgeLine {
        EdgeLine { at_center: -self.at_center, slope: -self.slope, ..self }
    }

    /// How many pixels a position is from the line; infinite if the edge is a point.
    pub(super) fn pixels_from(&self, position: DVec2) -> f64 {
        let length = self.slope.length();
        if length > 0.0 { self.at(position).abs() / length } else { f64::INFINITY }
    }
}

impl Outline {
    /// `None` of a triangle that is not seen: seen from its edge, or behind the eye.
    pub(super) fn of(plan: &MeshPlan, corners: &Corners) -> Option<Outline> {
        let camera = corners.positions.map(|p| plan.rays().camera(p));
        let (low, high) = bounds(plan, &camera)?;
        let mut edges = edge_lines(plan, &camera);
        let volume = match plan.rays().are_parallel() {
            true => (camera[1] - camera[0]).truncate().perp_dot((camera[2] - camera[0]).truncate()),
            false => camera[0].dot(camera[1].cross(camera[2])),
        };
        if volume == 0.0 || !volume.is_finite() {
            return None;
        }
        if volume < 0.0 {
            edges = edges.map(EdgeLine::turned);
        }
        Some(Outline { edges, low, high })
    }

    /// The rows whose pixels may be covered, of some.
    pub(super) fn rows(&self, first: u32, end: u32) -> Range<u32> {
        between(self.low.y, self.high.y, first, end)
    }

    /// The columns.
    pub(super) fn columns(&self, first: u32, end: u32) -> Range<u32> {
        between(self.low.x, self.high.x, first, end)
    }

    /// Whether the triangle covers a position.
    #[inline]
    pub(super) fn covers(&self, position: DVec2) -> bool {
        self.edges.iter().all(|edge| edge.is_positive(position))
    }

    /// How far inside of the outline a position lies, in pixels; negative outside.
    pub(super) fn pixels_inside(&self, position: DVec2) -> f64 {
        let inside = |edge: &EdgeLine| edge.at(position) / edge.slope.length();
        self.edges.iter().map(inside).fold(f64::INFINITY, f64::min)
    }

    /// Where the ray of a position meets the triangle's plane: its depth.
    pub(super) fn depth_in_plane(&self, plan: &MeshPlan, corners: &Corners, position: DVec2) -> f64 {
        let volumes = self.edges.map(|edge| edge.at(position));
        let sum: f64 = volumes.iter().sum();
        plan.rays().camera(corners.point(volumes.map(|v| v / sum))).z
    }

    /// Where the ray of a position meets the triangle, or its nearest point in the picture; `None` before the nearest depth that is drawn.
    pub(super) fn meet(&self, plan: &MeshPlan, corners: &Corners, position: DVec2) -> Option<Hit> {
        let volumes = self.edges.map(|edge| edge.at(position).max(0.0));
        let sum: f64 = volumes.iter().sum();
        let weights = if sum > 0.0 { volumes.map(|v| v / sum) } else { [1.0, 0.0, 0.0] };
        let point = corners.point(weights);
        let depth = plan.rays().camera(point).z;
        let distance = (point - plan.rays().eye()).length();
        let distance = if plan.rays().are_parallel() { depth } else { distance };
        (depth >= plan.near()).then_some(Hit { triangle: corners.triangle, weights, distance })
    }
}

/// The lines along a triangle's edges, each opposite to a corner.
pub(super) fn edge_lines(plan: &MeshPlan, camera: &[DVec3; 3]) -> [EdgeLine; 3] {
    [0, 1, 2].map(|i| EdgeLine::through(plan, camera[(i + 1) % 3], camera[(i + 2) % 3]))
}

/// The pixels whose centres lie between two numbers, of some; one more on each side, for roundings.
fn between(low: f64, high: f64, first: u32, end: u32) -> Range<u32> {
    let clamped = |v: f64| v.clamp(f64::from(first), f64::from(end)) as u32;
    clamped((low - 1.5).floor())..clamped((high + 1.5).ceil())
}

/// The box around the part of a triangle that is not nearer than the nearest depth, in pixels.
fn bounds(plan: &MeshPlan, camera: &[DVec3; 3]) -> Option<(DVec2, DVec2)> {
    let near = plan.near();
    let center = 0.5 * plan.size().as_dvec2();
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    let mut add = |c: DVec3| {
        let p = center + if plan.rays().are_parallel() { c.truncate() } else { c.truncate() / c.z };
        (low, high) = (low.min(p), high.max(p));
    };
    for i in 0..3 {
        let (a, b) = (camera[i], camera[(i + 1) % 3]);
        if a.z >= near {
            add(a);
        }
        if (a.z < near) != (b.z < near) {
            add((a + (b - a) * ((near - a.z) / (b.z - a.z))).with_z(near.max(f64::MIN_POSITIVE)));
        }
    }
    (low.x <= high.x).then_some((low, high))
}
