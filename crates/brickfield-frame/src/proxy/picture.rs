//! From sample space to the picture.

use brickfield_core::glam::{DMat3, DVec2, DVec3};

use super::polygon::clip;
use crate::RayFrame;

/// Nearer to the eye's plane than this share of a step, nothing is drawn: what a ray sees there is below rounding.
const NEAR: f64 = 1e-9;
/// Polygons are cut this many pixels beyond the picture's border.
const MARGIN: f64 = 1.0;

/// Projects points relative to the frame's centre.
pub(super) struct Projector<'a> {
    rays: &'a RayFrame,
    to_camera: DMat3,
    /// The eye; for parallel rays the anchor of the picture's centre.
    origin: DVec3,
    near: f64,
}

impl<'a> Projector<'a> {
    pub(super) fn new(rays: &'a RayFrame, step_world: f64) -> Projector<'a> {
        let [forward, right, down] = rays.direction;
        let is_parallel = rays.pixel == 0.0;
        let [right, down] = if is_parallel { [rays.anchor[1], rays.anchor[2]] } else { [right, down] };
        Projector {
            rays,
            to_camera: DMat3::from_cols(right, down, forward).inverse(),
            origin: rays.anchor[0] - forward * rays.anchor_depth,
            near: NEAR * step_world,
        }
    }

    /// The eye, if there is one.
    pub(super) fn eye(&self) -> Option<DVec3> {
        (self.rays.pixel != 0.0).then_some(self.origin)
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

    /// A polygon as it is seen in the picture, in pixels, cut a little beyond the border and before the eye.
    pub(super) fn project(&self, polygon: &[DVec3]) -> Vec<DVec2> {
        let camera: Vec<DVec3> = polygon.iter().map(|p| self.camera(*p)).collect();
        let half = 0.5 * self.rays.size.as_dvec2();
        let flat: Vec<DVec2> = match self.rays.pixel {
            0.0 => camera.iter().map(|c| c.truncate() + half).collect(),
            _ => clip(&camera, |c| c.z - self.near).iter().map(|c| c.truncate() / c.z + half).collect(),
        };
        let size = self.rays.size.as_dvec2();
        let flat = clip(&flat, |p| p.x + MARGIN);
        let flat = clip(&flat, |p| size.x + MARGIN - p.x);
        let flat = clip(&flat, |p| p.y + MARGIN);
        clip(&flat, |p| size.y + MARGIN - p.y)
    }
}
