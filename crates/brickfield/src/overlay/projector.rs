//! From the world to a picture.

use brickfield_core::glam::{DVec2, DVec3, UVec2};
use brickfield_core::{Camera, PixelRays};

/// Where a camera's picture shows the world: the inverse of [`PixelRays::at`].
pub(super) struct CameraProjector {
    camera: Camera,
    rays: PixelRays,
    /// Half the size of the window in the plane at distance 1 (parallel rays: in the eye's plane): the picture, and a margin around it.
    half: DVec2,
}

/// Pixels around the picture, for the width of lines.
const MARGIN_PIXELS: f64 = 200.0;
/// The part of a line that is nearer to the eye than this share of its farther end is cut off.
const NEAR: f64 = 1e-6;

impl CameraProjector {
    pub(super) fn new(camera: &Camera, size: UVec2) -> CameraProjector {
        let rays = camera.pixel_rays(size);
        let half = rays.corner().abs() + MARGIN_PIXELS * rays.pixel();
        CameraProjector { camera: *camera, rays, half }
    }

    /// The part of a line in the world that lies before the eye and in the picture or its margin, in pixels from the picture's
    /// upper left corner.
    pub(super) fn line(&self, ends: [DVec3; 2]) -> Option<[DVec2; 2]> {
        let [a, b] = ends.map(|p| self.seen(p));
        let near = if self.is_perspective() { NEAR * a.length().max(b.length()) } else { 0.0 };
        let (mut first, mut last) = (0.0f64, 1.0f64);
        for (at_a, at_b) in self.sides(a, near).into_iter().zip(self.sides(b, near)) {
            let crossing = at_a / (at_a - at_b);
            match (at_a >= 0.0, at_b >= 0.0) {
                (true, true) => {}
                (false, true) => first = first.max(crossing),
                (true, false) => last = last.min(crossing),
                (false, false) => return None,
            }
        }
        (first <= last).then(|| [first, last].map(|t| self.pixel(a.lerp(b, t))))
    }

    fn is_perspective(&self) -> bool {
        self.rays.depth() != 0.0
    }

    /// Along the picture's right and up and the view direction, from the eye.
    fn seen(&self, world: DVec3) -> DVec3 {
        let p = world - self.camera.eye();
        DVec3::new(p.dot(self.camera.right()), p.dot(self.camera.up()), p.dot(self.camera.forward()))
    }

    /// How far a position is inside of each plane around the window.
    fn sides(&self, p: DVec3, near: f64) -> [f64; 5] {
        let limit = self.half * self.scale(p);
        [p.z - near, limit.x - p.x, limit.x + p.x, limit.y - p.y, limit.y + p.y]
    }

    /// The factor of plane coordinates at a position.
    fn scale(&self, p: DVec3) -> f64 {
        if self.is_perspective() { p.z } else { 1.0 }
    }

    fn pixel(&self, p: DVec3) -> DVec2 {
        let across = p.truncate() / self.scale(p) - self.rays.corner();
        DVec2::new(across.x, -across.y) / self.rays.pixel()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::glam::UVec3;
    use brickfield_core::{BrickLayout, BrickSide, Grid, IndexPos, Level, Projection};
    use proptest::prelude::*;

    const SIZE: UVec2 = UVec2::new(90, 60);

    fn projection(is_perspective: bool, width: f64) -> Projection {
        match is_perspective {
            true => Projection::Perspective { fov_y: 0.1 + 2.0 * width },
            false => Projection::Orthographic { height: 1.0 + 100.0 * width },
        }
    }

    proptest! {
        /// From inside and outside of the volume: the ray of a corner's pixel meets the corner, and what is not shown lies behind
        /// the eye or beside the picture.
        #[test]
        fn corners_of_bricks_lie_on_the_rays_of_their_pixels(
            eye in [-60.0..120.0, -60.0..120.0, -60.0..120.0f64],
            target in [0.0..60.0, 0.0..40.0, 0.0..30.0f64],
            is_perspective: bool,
            width in 0.0..1.0,
        ) {
            let layout = BrickLayout::new(UVec3::new(60, 40, 30), BrickSide::S16);
            let grid = Grid::axis_aligned(layout.dims(), DVec3::new(1.0, 1.5, 0.7)).unwrap();
            let (eye, target) = (DVec3::from(eye), DVec3::from(target));
            let camera = Camera::look_at(eye, target, DVec3::new(0.1, 0.2, 1.0), projection(is_perspective, width));
            prop_assume!(camera.is_ok());
            let camera = camera.unwrap();
            let (projector, rays) = (CameraProjector::new(&camera, SIZE), camera.pixel_rays(SIZE));
            for corner in layout.bricks(Level(0)).flat_map(|id| layout.index_box(id).corners()) {
                let corner = grid.world(IndexPos(corner)).0;
                let depth = (corner - camera.eye()).dot(camera.forward());
                match projector.line([corner; 2]) {
                    Some([pixel, same]) => {
                        let ray = rays.at(pixel);
                        let t = (corner - ray.origin).dot(ray.direction);
                        prop_assert!(pixel == same && t >= 0.0 && depth >= 0.0);
                        prop_assert!(ray.at(t).distance(corner) <= 1e-9 * (1.0 + t), "{pixel}: {corner} {t}");
                    }
                    None => {
                        let scale = if is_perspective { depth } else { 1.0 };
                        let (across, p) = (rays.corner().abs() * scale, projector.seen(corner));
                        prop_assert!(depth <= 1e-3 || p.x.abs() > across.x || p.y.abs() > across.y);
                    }
                }
            }
        }

        /// A line's middle is on the line through its ends, and every end lies in the picture and its margin.
        #[test]
        fn a_line_across_the_eye_ends_in_the_margin(
            a in [-9.0..9.0, -9.0..9.0, -9.0..9.0f64],
            b in [-9.0..9.0, -9.0..9.0, -9.0..9.0f64],
            is_perspective: bool,
            width in 0.0..1.0,
        ) {
            let camera = Camera::look_at(DVec3::ZERO, DVec3::X, DVec3::Z, projection(is_perspective, width)).unwrap();
            let projector = CameraProjector::new(&camera, SIZE);
            if let Some(ends) = projector.line([a.into(), b.into()]) {
                let margin = MARGIN_PIXELS + 1e-3;
                for end in ends {
                    let inside = end.cmpge(DVec2::splat(-margin)) & end.cmple(SIZE.as_dvec2() + margin);
                    prop_assert!(inside.all(), "{end}");
                }
            } else if is_perspective {
                prop_assert!(!(a[0] > 0.01 && a[1].abs() < 1e-3 * a[0] && a[2].abs() < 1e-3 * a[0]));
            }
        }
    }

    #[test]
    fn what_lies_behind_the_eye_is_cut_off() {
        for is_perspective in [true, false] {
            let camera = Camera::look_at(DVec3::ZERO, DVec3::X, DVec3::Z, projection(is_perspective, 0.4)).unwrap();
            let line = |a: [f64; 3], b: [f64; 3]| CameraProjector::new(&camera, SIZE).line([a.into(), b.into()]);
            assert_eq!(line([-5.0, 1.0, 1.0], [-1.0, 1.0, 1.0]), None);
            // Through the eye, along the view: its part before the eye is a point.
            let [from, to] = line([-5.0, 0.0, 0.0], [5.0, 0.0, 0.0]).unwrap();
            assert!(from.distance(0.5 * SIZE.as_dvec2()) < 1e-6 && to.distance(from) < 1e-6, "{from} {to}");
            assert!(line([-5.0, 1.0, 0.0], [5.0, 1.0, 0.0]).unwrap().iter().all(|p| p.is_finite()));
        }
    }
}
