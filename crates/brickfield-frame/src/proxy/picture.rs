//! From sample space to the picture.

use brickfield_core::glam::{DMat3, DVec2, DVec3};

use super::polygon::{clip, hull};
use crate::{FramePlan, RayFrame};

/// Nothing is drawn nearer to the eye's plane than this share of the rounding of f32.
const NEAR: f64 = 1e-4;
/// By how many pixels polygons are grown: more than rasterisers round.
pub(super) const GROWN: f64 = 0.125;
/// How many pixels around the picture belong to its window.
const MARGIN: f64 = 1.0;

/// Projects points relative to the frame's centre.
pub(super) struct Projector<'a> {
    rays: &'a RayFrame,
    to_camera: DMat3,
    /// The eye; for parallel rays the anchor of the picture's centre.
    origin: DVec3,
    /// How far f32 may put a ray's positions from where they are: in voxels; and as [`Projector::camera`] counts.
    rounding: DVec3,
    camera_rounding: DVec3,
}

impl<'a> Projector<'a> {
    pub(super) fn new(plan: &'a FramePlan) -> Projector<'a> {
        let rays = &plan.rays;
        let [forward, right, down] = rays.direction;
        let is_parallel = rays.pixel == 0.0;
        let [right, down] = if is_parallel { [rays.anchor[1], rays.anchor[2]] } else { [right, down] };
        let to_camera = DMat3::from_cols(right, down, forward).inverse();
        let (low, high) = (plan.domain.min - rays.center, plan.domain.max - rays.center);
        let rounding = rays.most_rounding(low.abs().max(high.abs()));
        let [x, y, z] = [0, 1, 2].map(|axis| to_camera.row(axis).abs().dot(rounding));
        Projector {
            rays,
            to_camera,
            origin: rays.anchor[0] - forward * rays.anchor_depth,
            rounding,
            camera_rounding: DVec3::new(x, y, z),
        }
    }

    /// The eye, if there is one.
    pub(super) fn eye(&self) -> Option<DVec3> {
        (self.rays.pixel != 0.0).then_some(self.origin)
    }

    /// How far f32 may put a ray's positions from where they are, in voxels.
    pub(super) fn rounding(&self) -> DVec3 {
        self.rounding
    }

    /// x and y in pixels from the picture's centre (perspective: times the depth), z the depth in world units past the
    /// origin's plane.
    pub(super) fn camera(&self, p: DVec3) -> DVec3 {
        self.to_camera * (p - self.origin)
    }

    /// The gradient of the camera's x, y or z over positions.
    pub(super) fn gradient(&self, axis: usize) -> DVec3 {
        self.to_camera.row(axis)
    }

    /// Depth of the origin's plane: 0 at an eye.
    pub(super) fn origin_depth(&self) -> f64 {
        if self.rays.pixel == 0.0 { self.rays.anchor_past_start + self.rays.start } else { 0.0 }
    }

    /// The part of a window, in pixels, whose rays may meet a polygon: a little more than where it is seen. The part nearer to the
    /// eye's plane than [`NEAR`] of rounding is left out.
    ///
    /// A ray that f32 puts beside its pixel p by d meets the polygon in a point x that is seen at p + (d.xy - p d.z) / x.z. That is
    /// affine in 1 / x.z, which is affine in the picture: the hull of the offsets of its corners holds all of them.
    pub(super) fn project(&self, polygon: &[DVec3], window: Window) -> Vec<DVec2> {
        let (half, off) = (0.5 * self.rays.size.as_dvec2(), self.camera_rounding);
        let is_parallel = self.rays.pixel == 0.0;
        let camera: Vec<DVec3> = match is_parallel {
            true => polygon.iter().map(|p| self.camera(*p).with_z(1.0)).collect(),
            false => clip(&polygon.iter().map(|p| self.camera(*p)).collect::<Vec<_>>(), |c| c.z - NEAR * off.z),
        };
        let off = if is_parallel { off.truncate() } else { off.truncate() + half * off.z };
        // Cut before it is divided by the depth, which may be next to nothing.
        let (low, high) = (window.low - GROWN - half, window.high + GROWN - half);
        let near = (0..2).fold(camera, |near, axis| {
            let near = clip(&near, |c| c[axis] + off[axis] - low[axis] * c.z);
            clip(&near, |c| high[axis] * c.z - (c[axis] - off[axis]))
        });
        let square = |c: &DVec3| {
            let (p, by) = (c.truncate() / c.z + half, off / c.z + GROWN);
            SQUARE.map(|corner| p + by * corner)
        };
        let grown = hull(near.iter().flat_map(square).collect());
        (0..2).fold(grown, |grown, axis| {
            let grown = clip(&grown, |p| p[axis] - window.low[axis]);
            clip(&grown, |p| window.high[axis] - p[axis])
        })
    }

    /// The picture, and a little around it.
    pub(super) fn window(&self) -> Window {
        Window { low: DVec2::splat(-MARGIN), high: self.rays.size.as_dvec2() + MARGIN }
    }
}

/// A rectangle of the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    pub(super) low: DVec2,
    pub(super) high: DVec2,
}

impl Window {
    /// The part of it that may have fragments of a triangle: the rectangle around that, and a little more.
    pub(super) fn around(self, [a, b, c]: [DVec2; 3]) -> Window {
        Window { low: self.low.max(a.min(b).min(c) - GROWN), high: self.high.min(a.max(b).max(c) + GROWN) }
    }
}

/// The corners of a square of side 2.
const SQUARE: [DVec2; 4] = [DVec2::new(1.0, -1.0), DVec2::new(1.0, 1.0), DVec2::new(-1.0, 1.0), DVec2::new(-1.0, -1.0)];
