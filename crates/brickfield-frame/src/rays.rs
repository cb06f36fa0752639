//! The rays of a frame in sample space, in a form that keeps its digits in f32.

use brickfield_core::glam::{DVec2, DVec3, UVec2};
use brickfield_core::{Aabb, Camera, Grid, IndexPos, Projection, SamplePos, WorldPos};

/// The rays of a frame in sample space.
///
/// A ray is q(t) = center + anchor + direction (t - t_anchor), t in world units past the frame's `start`. Its anchor is
/// where it meets the plane through the volume's centre; all of it is affine in the picture position but for the length
/// that normalises the direction. So no term is larger than the volume, wherever the eye and the origin are, and f32
/// holds a position to about 1e-7 of the volume's size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayFrame {
    /// Width and height of the picture, in pixels.
    pub size: UVec2,
    /// The reference point, in sample space.
    pub center: DVec3,
    /// Anchor of the picture's centre, relative to `center`; and its change a pixel to the right, a pixel down.
    pub anchor: [DVec3; 3],
    /// Direction before normalisation, voxels per world unit; and its change a pixel to the right, a pixel down.
    pub direction: [DVec3; 3],
    /// Side of a pixel in the plane at distance 1; 0 for parallel rays.
    pub pixel: f64,
    /// Distance from the eye to the anchor of the central ray, less `start`.
    pub anchor_past_start: f64,
    /// Distance from the eye to the plane of the anchors, along the view direction; 0 for parallel rays.
    pub anchor_depth: f64,
    /// Where the frame's parameter begins: this many world units from the eye, a whole number of steps.
    pub start: f64,
    /// Segments from the start to the farthest point of the volume, rounded up.
    pub n_segments: f64,
}

/// One ray of a [`RayFrame`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanRay {
    /// The anchor in sample space, relative to the frame's centre.
    pub anchor: DVec3,
    /// Change of the sample position per world unit.
    pub direction: DVec3,
    /// Parameter of the anchor, in world units past the frame's start.
    pub t_anchor: f64,
}

impl RayFrame {
    /// The rays of a camera's picture of a grid, with sample phase `step_world`.
    ///
    /// `domain` is the part of sample space that is rendered; the frame starts a whole number of steps before it.
    pub fn new(camera: &Camera, grid: &Grid, size: UVec2, domain: &Aabb, step_world: f64) -> RayFrame {
        let to_sample = |p: DVec3| SamplePos::from(grid.index(WorldPos(p))).0;
        let turn = |v: DVec3| grid.world_to_index().transform_vector3(v);
        let center = domain.center();
        let center_world = grid.world(IndexPos::from(SamplePos(center))).0;
        let depth = (center_world - camera.eye()).dot(camera.forward());
        let rays = camera.pixel_rays(size);
        let (right, down) = (turn(camera.right() * rays.pixel()), turn(camera.up() * -rays.pixel()));
        let anchor0 = to_sample(camera.eye() + camera.forward() * depth) - center;
        let forward = turn(camera.forward());
        let start = first_step(camera, grid, domain, step_world) * step_world;
        let frame = RayFrame {
            size,
            center,
            anchor: [anchor0, right, down],
            direction: [forward, DVec3::ZERO, DVec3::ZERO],
            pixel: 0.0,
            anchor_past_start: depth - start,
            anchor_depth: 0.0,
            start,
            n_segments: ((farthest(camera, grid, domain) - start) / step_world).ceil().max(1.0),
        };
        match camera.projection() {
            Projection::Orthographic { .. } => frame,
            Projection::Perspective { .. } => RayFrame {
                anchor: [anchor0, right * depth, down * depth],
                direction: [forward, right, down],
                pixel: rays.pixel(),
                anchor_depth: depth,
                ..frame
            },
        }
    }

    /// The ray through the centre of pixel (x, y).
    #[inline]
    pub fn ray(&self, x: u32, y: u32) -> PlanRay {
        let at = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5) - 0.5 * self.size.as_dvec2();
        let mix = |v: &[DVec3; 3]| v[0] + v[1] * at.x + v[2] * at.y;
        let square = (at * self.pixel).length_squared();
        let length = (1.0 + square).sqrt();
        PlanRay {
            anchor: mix(&self.anchor),
            direction: mix(&self.direction) / length,
            // depth * length = depth + depth * square / (1 + length), without cancellation
            t_anchor: self.anchor_past_start + self.anchor_depth * (square / (1.0 + length)),
        }
    }
}

impl PlanRay {
    /// The sample position, relative to the frame's centre, at `t` world units past the frame's start.
    #[inline]
    pub fn at(&self, t: f64) -> DVec3 {
        self.anchor + self.direction * (t - self.t_anchor)
    }
}

/// Distance to the farthest point of the domain's world box, as rays measure it.
fn farthest(camera: &Camera, grid: &Grid, domain: &Aabb) -> f64 {
    let distance = |v: DVec3| match camera.projection() {
        Projection::Orthographic { .. } => v.dot(camera.forward()),
        Projection::Perspective { .. } => v.length(),
    };
    from_eye(camera, grid, domain).map(distance).into_iter().fold(0.0, f64::max)
}

/// From the eye to the corners of the domain's world box.
fn from_eye(camera: &Camera, grid: &Grid, domain: &Aabb) -> [DVec3; 8] {
    domain.corners().map(|p| grid.world(IndexPos::from(SamplePos(p))).0 - camera.eye())
}

/// Number of whole steps between the eye and the nearest point of the domain's world box; at least 0.
fn first_step(camera: &Camera, grid: &Grid, domain: &Aabb, step_world: f64) -> f64 {
    let nearest_plane =
        from_eye(camera, grid, domain).iter().map(|c| c.dot(camera.forward())).fold(f64::INFINITY, f64::min);
    (nearest_plane / step_world).floor().max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::glam::{DMat3, UVec3};

    fn check(camera: &Camera, grid: &Grid, tolerance: f64) {
        let size = UVec2::new(40, 30);
        let domain = Aabb { min: DVec3::splat(-0.5), max: grid.dims().as_dvec3() - 0.5 };
        let frame = RayFrame::new(camera, grid, size, &domain, 0.5);
        assert_eq!((frame.start / 0.5).fract(), 0.0);
        assert!(frame.n_segments >= 1.0 && frame.n_segments <= 4.0 * grid.world_box().diagonal());
        for (x, y) in [(0, 0), (39, 29), (17, 3)] {
            let (ray, world) = (frame.ray(x, y), camera.pixel_rays(size).pixel_ray(x, y));
            for t in [frame.start, frame.start + 3.0, frame.start + 40.0] {
                let expected = SamplePos::from(grid.index(WorldPos(world.at(t)))).0;
                let got = frame.center + ray.at(t - frame.start);
                assert!((got - expected).length() < tolerance, "{got} {expected}");
            }
        }
    }

    #[test]
    fn rays_equal_the_cameras_rays() {
        let direction = DMat3::from_cols(DVec3::Y, DVec3::X, -DVec3::Z);
        let grid = Grid::from_first_sample(
            UVec3::new(9, 7, 5),
            DVec3::new(1.0, 2.0, 0.5),
            DVec3::new(3.0, -4.0, 5.0),
            direction,
        );
        let grid = grid.unwrap();
        for projection in [Projection::Perspective { fov_y: 0.8 }, Projection::Orthographic { height: 30.0 }] {
            for eye in [DVec3::new(50.0, 20.0, 30.0), grid.world_box().center() + 0.1, DVec3::new(1e4, 3.0, 2.0)] {
                check(&Camera::look_at(eye, DVec3::new(5.0, 1.0, 4.0), DVec3::Z, projection).unwrap(), &grid, 1e-9);
            }
        }
    }
}
