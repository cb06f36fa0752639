//! The polygons of one brick.

use brickfield_core::Aabb;
use brickfield_core::glam::{DVec2, DVec3, UVec3};

use super::picture::{GROWN, Projector};
use super::polygon::{Plane, clip, face, slice};
use super::{Lengths, ProxyCorner};
use crate::{FramePlan, Placement};

/// A polygon in the picture.
pub(super) struct Outline {
    pub(super) points: Vec<DVec2>,
    pub(super) surface: f32,
    pub(super) owner: u32,
}

/// Planes gradient . p + offset = k step: surface k, in the order in which a ray meets them.
struct Stack {
    gradient: DVec3,
    offset: f64,
    owner: u32,
    /// The part of the picture, or of space, whose rays meet these planes.
    part: PlanePart,
}

enum PlanePart {
    All,
    /// A triangle of the picture.
    Facet([DVec2; 3]),
    /// The pyramid around an axis, from the eye.
    Pyramid {
        axis: usize,
        eye: DVec3,
    },
}

/// Pyramids are wider than need be by this share: shaders decide, to which one belongs a ray.
const PYRAMID_MARGIN: f64 = 1.002;

/// The polygons of the brick that holds an index cell, from back to front along every ray.
pub(super) fn outlines(plan: &FramePlan, projector: &Projector<'_>, cell: UVec3) -> Vec<Outline> {
    let b = plan.block_box(cell);
    if b.is_empty() || plan.field.index().at(cell).slot().is_none() {
        return Vec::new();
    }
    let step = plan.sampling.step_world() * f64::from(plan.field.level_at(cell).stride());
    let seen = plan.seen_box(cell, step * plan.rays.greatest_stretch());
    if seen.is_empty() {
        return Vec::new();
    }
    let mut outlines = match plan.sampling.lengths() {
        Lengths::True => exits(plan, projector, &b, &seen),
        Lengths::Nominal => Vec::new(),
    };
    // f32 may put a surface into the brick that lies beside it.
    let near = Aabb { min: seen.min - projector.rounding(), max: seen.max + projector.rounding() };
    for stack in stacks(plan, projector, &seen) {
        outlines.extend(stack.outlines(plan, projector, &near, step));
    }
    outlines.retain(|o| !o.points.is_empty());
    outlines
}

/// The faces through which rays leave a box, as far as segments that end there see something.
fn exits(plan: &FramePlan, projector: &Projector<'_>, b: &Aabb, seen: &Aabb) -> Vec<Outline> {
    let forward = plan.rays.direction[0];
    let off = projector.rounding();
    let leaves_up = |axis: usize| projector.eye().map_or(forward[axis] > 0.0, |e| e[axis] < b.max[axis] + off[axis]);
    let leaves_down = |axis: usize| projector.eye().map_or(forward[axis] < 0.0, |e| e[axis] > b.min[axis] - off[axis]);
    let is_seen_up = |axis: &usize| leaves_up(*axis) && seen.max[*axis] == b.max[*axis];
    let is_seen_down = |axis: &usize| leaves_down(*axis) && seen.min[*axis] == b.min[*axis];
    let up = (0..3).filter(is_seen_up).map(|axis| (2 * axis + 1, face(seen, axis, b.max[axis])));
    let down = (0..3).filter(is_seen_down).map(|axis| (2 * axis, face(seen, axis, b.min[axis])));
    let outline = |(owner, polygon): (usize, Vec<DVec3>)| Outline {
        points: projector.project(&polygon, projector.window()),
        surface: ProxyCorner::EXIT,
        owner: owner as u32,
    };
    up.chain(down).map(outline).collect()
}

/// The stacks of planes that rays through a box may meet.
fn stacks(plan: &FramePlan, projector: &Projector<'_>, b: &Aabb) -> Vec<Stack> {
    match plan.rays.placement {
        Placement::Shells => Vec::new(),
        Placement::ViewportPlanes => vec![picture_plane(plan, projector, DVec3::Z, 0, PlanePart::All)],
        Placement::TessellatedShells { .. } => facets_over(plan, projector, b),
        Placement::ObjectPlanes => object_stacks(plan, projector),
    }
}

/// Planes of a normal in the camera's axes (right, down, forward).
fn picture_plane(plan: &FramePlan, projector: &Projector<'_>, normal: DVec3, owner: u32, part: PlanePart) -> Stack {
    let scaled = DVec3::new(normal.x * plan.rays.pixel, normal.y * plan.rays.pixel, normal.z);
    let gradient = (0..3).map(|axis| projector.gradient(axis) * scaled[axis]).sum();
    let at_centre = scaled.dot(projector.camera(DVec3::ZERO));
    Stack { gradient, offset: at_centre + projector.origin_depth() - plan.rays.start, owner, part }
}

/// The facets of the picture's squares that a box may be seen in.
fn facets_over(plan: &FramePlan, projector: &Projector<'_>, b: &Aabb) -> Vec<Stack> {
    let rays = &plan.rays;
    let faces = (0..3).flat_map(|axis| [face(b, axis, b.min[axis]), face(b, axis, b.max[axis])]);
    let seen: Vec<DVec2> = faces.flat_map(|polygon| projector.project(&polygon, projector.window())).collect();
    let (Some(low), Some(high)) = (seen.iter().copied().reduce(DVec2::min), seen.iter().copied().reduce(DVec2::max))
    else {
        return Vec::new();
    };
    let side = f64::from(rays.facet_pixels());
    let last = rays.facet_squares() - 1;
    let square = |p: DVec2| (p / side).floor().max(DVec2::ZERO).as_uvec2().min(last);
    let (low, high) = (square(low), square(high));
    let squares = (low.y..=high.y).flat_map(|y| (low.x..=high.x).map(move |x| (x, y)));
    let facets = squares.flat_map(|(x, y)| [0, 1].map(|half| 2 * (x + y * rays.facet_squares().x) + half));
    let stack = |f| picture_plane(plan, projector, rays.facet_normal(f), f, PlanePart::Facet(rays.facet_corners(f)));
    facets.map(stack).collect()
}

/// The stacks of object-aligned planes; parallel rays all meet one.
fn object_stacks(plan: &FramePlan, projector: &Projector<'_>) -> Vec<Stack> {
    let planes = &plan.rays.planes;
    let stack = |axis: usize, up: bool, part| {
        let (first, sign) = if up { (planes.low[axis], 1.0) } else { (planes.high[axis], -1.0) };
        let per_voxel = sign * planes.voxel_world[axis];
        let owner = 2 * axis as u32 + u32::from(up);
        Stack { gradient: DVec3::AXES[axis] * per_voxel, offset: -first * per_voxel, owner, part }
    };
    match projector.eye() {
        None => {
            let axis = planes.axis(plan.rays.direction[0]);
            vec![stack(axis, plan.rays.direction[0][axis] > 0.0, PlanePart::All)]
        }
        Some(eye) => {
            let both = |axis| [true, false].map(|up| stack(axis, up, PlanePart::Pyramid { axis, eye }));
            (0..3).flat_map(both).collect()
        }
    }
}

impl Stack {
    /// The polygons of the planes in a box, the farthest along the rays first.
    fn outlines(&self, plan: &FramePlan, projector: &Projector<'_>, b: &Aabb, step: f64) -> Vec<Outline> {
        let b = &self.part.bounds(b, self.gradient);
        if b.is_empty() {
            return Vec::new();
        }
        let centre = self.gradient.dot(b.center()) + self.offset;
        let reach = (self.gradient * b.extent()).abs().element_sum() * 0.5;
        let shift = match plan.sampling.lengths() {
            Lengths::True => 0.0,
            Lengths::Nominal => 0.5,
        };
        let first = ((centre - reach) / step - shift).floor() as i64;
        let last = ((centre + reach) / step - shift).ceil() as i64;
        let outline = |k: i64| Outline {
            points: self.seen(plan, projector, b, (k as f64 + shift) * step),
            surface: k as f32,
            owner: self.owner,
        };
        (first.max(0)..=last).rev().map(outline).collect()
    }

    /// Where the plane of this level is seen.
    fn seen(&self, plan: &FramePlan, projector: &Projector<'_>, b: &Aabb, level: f64) -> Vec<DVec2> {
        let polygon = slice(b, Plane { gradient: self.gradient, level: level - self.offset });
        let polygon = match self.part {
            PlanePart::Pyramid { axis, eye } => in_pyramid(plan, polygon, axis, eye, projector.rounding()),
            _ => polygon,
        };
        match self.part {
            PlanePart::Facet(triangle) => {
                in_triangle(projector.project(&polygon, projector.window().around(triangle)), triangle)
            }
            _ => projector.project(&polygon, projector.window()),
        }
    }
}

impl PlanePart {
    /// The part of a box that lies on the stack's side of the eye.
    fn bounds(&self, b: &Aabb, gradient: DVec3) -> Aabb {
        let PlanePart::Pyramid { axis, eye } = *self else { return *b };
        let mut bounds = *b;
        if gradient[axis] > 0.0 {
            bounds.min[axis] = bounds.min[axis].max(eye[axis]);
        } else {
            bounds.max[axis] = bounds.max[axis].min(eye[axis]);
        }
        bounds
    }
}

/// The part of a polygon in a plane across an axis that is seen at a smaller angle to it than to the other two.
fn in_pyramid(plan: &FramePlan, polygon: Vec<DVec3>, axis: usize, eye: DVec3, off: DVec3) -> Vec<DVec3> {
    let Some(first) = polygon.first() else { return polygon };
    let world = plan.rays.planes.voxel_world;
    let height = (first[axis] - eye[axis]).abs() * world[axis] * PYRAMID_MARGIN;
    [(axis + 1) % 3, (axis + 2) % 3].into_iter().fold(polygon, |polygon, other| {
        let reach = height / world[other] + 2.0 * off[other];
        let polygon = clip(&polygon, |p| p[other] - (eye[other] - reach));
        clip(&polygon, |p| eye[other] + reach - p[other])
    })
}

/// The part of a polygon of the picture that lies in a triangle, or beside it by no more than polygons are grown.
fn in_triangle(polygon: Vec<DVec2>, [a, b, c]: [DVec2; 3]) -> Vec<DVec2> {
    let side = (b - a).perp_dot(c - a).signum();
    [(a, b), (b, c), (c, a)].into_iter().fold(polygon, |polygon, (from, to)| {
        let along = to - from;
        clip(&polygon, |p| side * along.perp_dot(p - from) + GROWN * along.length())
    })
}
