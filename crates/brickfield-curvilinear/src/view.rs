//! What a camera sees of boxes, and how much a motion of the camera can change about it.

use brickfield_core::glam::{DVec3, UVec2};
use brickfield_core::{Aabb, Camera, Projection};

/// A camera and its picture, as selections ask for them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    camera: Camera,
    size: UVec2,
    /// The side of a pixel, in world units, at distance 1 (perspective) or everywhere (orthographic).
    pixel: f64,
    /// A point is seen if it lies in front of all planes: normal . (point - eye) + offset >= 0.
    planes: [ViewPlane; 5],
}

/// Why there is no view.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a picture of {} x {} pixels; each side needs at least 1", size.x, size.y)]
#[allow(missing_docs)]
pub struct ViewError {
    pub size: UVec2,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct ViewPlane {
    normal: DVec3,
    offset: f64,
}

/// A yes or no, and how far all points may move relative to the camera before it may change, in world units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Seen {
    pub(crate) is_visible: bool,
    pub(crate) slack: f64,
}

impl View {
    /// A picture of so many pixels.
    ///
    /// # Errors
    /// A picture without pixels.
    pub fn new(camera: Camera, size: UVec2) -> Result<View, ViewError> {
        if size.min_element() == 0 {
            return Err(ViewError { size });
        }
        let pixel = camera.pixel_rays(size).pixel();
        let half = size.as_dvec2() * (0.5 * pixel);
        let side = |across: DVec3, half: f64| match camera.projection() {
            Projection::Perspective { .. } => {
                let normal = camera.forward() * half - across;
                ViewPlane { normal: normal.normalize(), offset: 0.0 }
            }
            Projection::Orthographic { .. } => ViewPlane { normal: -across, offset: half },
        };
        let (right, up) = (camera.right(), camera.up());
        let planes = [
            ViewPlane { normal: camera.forward(), offset: 0.0 },
            side(right, half.x),
            side(-right, half.x),
            side(up, half.y),
            side(-up, half.y),
        ];
        Ok(View { camera, size, pixel, planes })
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Width and height of the picture, in pixels.
    pub fn size(&self) -> UVec2 {
        self.size
    }

    /// Whether a closed box may be seen. A box in front of each plane of the view counts as seen, even where it lies beside a corner.
    pub fn sees(&self, extent: &Aabb) -> bool {
        self.seen(extent).is_visible
    }

    /// How many pixels a length takes at a distance from the eye along the view direction, seen face on. Infinite at the eye and behind
    /// it.
    pub fn pixels(&self, length: f64, depth: f64) -> f64 {
        match self.camera.projection() {
            Projection::Orthographic { .. } => length / self.pixel,
            Projection::Perspective { .. } if depth > 0.0 => length / (self.pixel * depth),
            Projection::Perspective { .. } => f64::INFINITY,
        }
    }

    /// The least distance of a box from the eye along the view direction.
    pub fn nearest(&self, extent: &Aabb) -> f64 {
        -farthest(extent, -self.camera.forward(), self.camera.eye())
    }

    pub(crate) fn seen(&self, extent: &Aabb) -> Seen {
        let eye = self.camera.eye();
        let in_front = |plane: &ViewPlane| farthest(extent, plane.normal, eye) + plane.offset;
        let least = self.planes.iter().map(in_front).fold(f64::INFINITY, f64::min);
        Seen { is_visible: least >= 0.0, slack: least.abs() }
    }

    /// The depth beyond which a length takes less than `granularity` pixels; `None` if depth does not matter.
    pub(crate) fn depth_of(&self, length: f64, granularity: f64) -> Option<f64> {
        match self.camera.projection() {
            Projection::Perspective { .. } => Some(length / (self.pixel * granularity)),
            Projection::Orthographic { .. } => None,
        }
    }

    /// By how much the distance of any point of `extent` from any plane of the view, and its depth, differ at most from those in
    /// another view. Infinite if the views have other projections or pictures.
    pub(crate) fn motion_from(&self, other: &View, extent: &Aabb) -> f64 {
        if self.camera.projection() != other.camera.projection() || self.size != other.size {
            return f64::INFINITY;
        }
        // n'.(x - e') - n.(x - e) = (n' - n).(x - e') + n.(e - e')
        let eye = self.camera.eye();
        let reach = extent.corners().map(|corner| corner.distance(eye)).into_iter().fold(0.0, f64::max);
        let turn = |(now, then): (&ViewPlane, &ViewPlane)| now.normal.distance(then.normal);
        let turned = self.planes.iter().zip(&other.planes).map(turn).fold(0.0, f64::max);
        let motion = eye.distance(other.camera.eye()) + reach * turned;
        // Room for the roundings of this sum and of the distances.
        if self.camera == other.camera { 0.0 } else { motion + 1e-12 * (reach + eye.length()) }
    }
}

/// The greatest normal . (point - from) of a box.
fn farthest(extent: &Aabb, normal: DVec3, from: DVec3) -> f64 {
    let corner = DVec3::select(normal.cmpge(DVec3::ZERO), extent.max, extent.min);
    normal.dot(corner - from)
}
