//! The rays of a picture in the world, in a form that keeps its digits in f32.

use brickfield_core::glam::{DVec2, DVec3, UVec2};
use brickfield_core::{Camera, Projection};

/// The rays of a picture in the world: of meshes, and of cells that have no grid of voxels.
///
/// A ray is p(t) = center + anchor + direction (t - t_anchor), t the distance from the eye (parallel rays: from the eye's plane). Its
/// anchor is where it meets the plane through `center`, or an eye within `radius` of the centre: no term is much larger than the
/// scene, wherever the eye is. [`RayFrame`](crate::RayFrame) does the same in sample space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewRays {
    /// Width and height of the picture, in pixels.
    pub size: UVec2,
    /// The reference point, in the world.
    pub center: DVec3,
    /// Anchor of the picture's centre, relative to `center`; and its change a pixel to the right, a pixel down.
    pub anchor: [DVec3; 3],
    /// Direction of the picture's centre, of length 1; and its change a pixel to the right, a pixel down (0 of parallel rays).
    pub direction: [DVec3; 3],
    /// Right and down in the picture, a pixel long in the plane at distance 1 (parallel rays: anywhere).
    pub pixel: [DVec3; 2],
    /// Depth of the anchors' plane: its distance from the eye's plane.
    pub anchor_depth: f64,
}

/// One ray of [`ViewRays`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewRay {
    /// Relative to the centre.
    pub anchor: DVec3,
    /// Of length 1.
    pub direction: DVec3,
    /// Distance of the anchor from the eye.
    pub t_anchor: f64,
}

impl ViewRays {
    /// The rays of a camera's picture of what lies within `radius` of `center`.
    pub fn new(camera: &Camera, size: UVec2, center: DVec3, radius: f64) -> ViewRays {
        let is_near = (camera.eye() - center).length() <= radius;
        let is_parallel = matches!(camera.projection(), Projection::Orthographic { .. });
        let depth = if is_near && !is_parallel { 0.0 } else { (center - camera.eye()).dot(camera.forward()) };
        let side = camera.pixel_rays(size).pixel();
        let pixel = [camera.right() * side, camera.up() * -side];
        let along = if is_parallel { [1.0, 0.0] } else { [depth, 1.0] };
        let [anchor_right, anchor_down] = pixel.map(|p| p * along[0]);
        let [right, down] = pixel.map(|p| p * along[1]);
        ViewRays {
            size,
            center,
            anchor: [camera.eye() + camera.forward() * depth - center, anchor_right, anchor_down],
            direction: [camera.forward(), right, down],
            pixel,
            anchor_depth: depth,
        }
    }

    /// Whether all rays have one direction.
    pub fn are_parallel(&self) -> bool {
        self.direction[1] == DVec3::ZERO
    }

    /// The eye relative to the centre; of parallel rays, the picture's centre in the eye's plane.
    pub fn eye(&self) -> DVec3 {
        self.anchor[0] - self.direction[0] * self.anchor_depth
    }

    /// The ray through a picture position; pixel (x, y) has its centre at (x + 1/2, y + 1/2).
    pub fn at(&self, position: DVec2) -> ViewRay {
        let past = position - 0.5 * self.size.as_dvec2();
        let of = |[middle, right, down]: [DVec3; 3]| middle + right * past.x + down * past.y;
        let direction = of(self.direction);
        let length = direction.length();
        ViewRay { anchor: of(self.anchor), direction: direction / length, t_anchor: self.anchor_depth * length }
    }

    /// The ray of pixel (x, y).
    pub fn ray(&self, x: u32, y: u32) -> ViewRay {
        self.at(DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5))
    }

    /// x and y in pixels from the picture's centre (perspective: times the depth), z the depth. `p` is relative to the centre.
    pub fn camera(&self, p: DVec3) -> DVec3 {
        let from_eye = p - self.eye();
        let [x, y] = self.pixel.map(|axis| from_eye.dot(axis) / axis.length_squared());
        DVec3::new(x, y, from_eye.dot(self.direction[0]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cameras() -> Vec<Camera> {
        let target = DVec3::new(1e6 + 3.0, -2.0, 5.0);
        let projections = [Projection::Perspective { fov_y: 0.7 }, Projection::Orthographic { height: 3.0 }];
        let eyes = [DVec3::new(4.0, 1.0, 2.0), DVec3::new(0.2, 0.1, -0.1)];
        let camera = |eye: DVec3, projection| Camera::look_at(target + eye, target, DVec3::Z, projection).unwrap();
        projections.into_iter().flat_map(|projection| eyes.map(|eye| camera(eye, projection))).collect()
    }

    #[test]
    fn a_ray_is_the_cameras() {
        let (size, center) = (UVec2::new(40, 30), DVec3::new(1e6 + 2.5, -2.0, 5.5));
        for camera in cameras() {
            let rays = ViewRays::new(&camera, size, center, 2.0);
            for (x, y) in [(0, 0), (39, 29), (20, 15), (7, 25)] {
                let (ray, expected) = (rays.ray(x, y), camera.pixel_rays(size).pixel_ray(x, y));
                assert!((ray.direction - expected.direction).length() < 1e-12);
                let at = |t: f64| center + ray.anchor + ray.direction * (t - ray.t_anchor);
                assert!((at(3.0) - (expected.origin + expected.direction * 3.0)).length() < 1e-9);
            }
        }
    }

    #[test]
    fn a_point_is_seen_where_its_ray_is() {
        let (size, center) = (UVec2::new(40, 30), DVec3::new(1e6 + 2.5, -2.0, 5.5));
        for camera in cameras() {
            let rays = ViewRays::new(&camera, size, center, 2.0);
            let ray = rays.at(DVec2::new(11.25, 20.5));
            let c = rays.camera(ray.anchor + ray.direction * (2.5 - ray.t_anchor));
            let scale = if rays.are_parallel() { 1.0 } else { c.z };
            assert!((c.truncate() / scale - DVec2::new(11.25 - 20.0, 20.5 - 15.0)).length() < 1e-6, "{c}");
        }
    }
}
