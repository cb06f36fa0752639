//! The rays of a frame in sample space, in a form that keeps its digits in f32.

use brickfield_core::glam::{DMat3, DVec2, DVec3, UVec2};
use brickfield_core::{Aabb, Camera, Grid, IndexPos, Projection, SamplePos, WorldPos};

use crate::{Placement, PlaneStacks, Steps};

/// The rays of a frame in sample space.
///
/// A ray is q(t) = center + anchor + direction (t - t_anchor), t in world units past its surface 0 ([`Placement`]); surface k is
/// at t = k steps times the ray's stretch. Its anchor is where it meets the plane through the volume's centre, or an eye within
/// the sphere around the volume; all of it is affine in the picture position but for the length that normalises the
/// direction. So no term is much larger than the volume, wherever the eye and the origin are, and f32 holds a position to about 1e-7 of the
/// volume's size. (Rays that meet an anchors' plane at a slant, at the rim of a lens wider than 170 degrees far from the
/// volume, lose the cosine of that angle.)
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
    /// How many voxels a world unit reaches along each axis of the grid, at most.
    pub voxels_per_unit: DVec3,
    /// Side of a pixel in the plane at distance 1; 0 for parallel rays.
    pub pixel: f64,
    /// Distance from the eye to the anchor of the central ray, less `start`.
    pub anchor_past_start: f64,
    /// Distance from the eye to the plane of the anchors, along the view direction; 0 for parallel rays.
    pub anchor_depth: f64,
    /// Where surface 0 lies: this many world units from the eye along the surfaces' normals, a whole number of steps (of the
    /// coarsest level's steps). Object-aligned planes start before the volume instead ([`PlaneStacks`]).
    pub start: f64,
    /// Segments from the start to the farthest point of the volume, rounded up.
    pub n_segments: f64,
    /// The surfaces between segments.
    pub placement: Placement,
    /// The planes of [`Placement::ObjectPlanes`].
    pub planes: PlaneStacks,
}

/// Roundings of a term of a position, times the unit roundoff of f32.
const ROUNDING: f64 = 8.0 / (1u32 << 24) as f64;
/// How many voxels a world unit reaches along each axis, at most: that in the direction across the voxels' faces.
pub(crate) fn voxels_per_unit(grid: &Grid) -> DVec3 {
    let gradient = grid.world_to_index().matrix3.transpose();
    DVec3::from([gradient.x_axis, gradient.y_axis, gradient.z_axis].map(DVec3::length))
}

/// Polygons reach a little beyond the outer pixels' rays.
const STRETCH_MARGIN: f64 = 1.01;

/// One ray of a [`RayFrame`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanRay {
    /// The anchor in sample space, relative to the frame's centre.
    pub anchor: DVec3,
    /// Change of the sample position per world unit.
    pub direction: DVec3,
    /// Parameter of the anchor, in world units past the ray's surface 0.
    pub t_anchor: f64,
    /// Parameter of the eye (parallel rays: the eye's plane): rays begin here.
    pub t_eye: f64,
    /// Distance between two surfaces along the ray, in steps: at least 1 but for tessellated shells, whose facets lie inside.
    pub stretch: f64,
}

impl RayFrame {
    /// The rays of a camera's picture of a grid, with the surfaces of `steps`.
    ///
    /// `domain` is the volume's box in sample space, whatever of it is rendered: the frame starts a whole number of steps before
    /// it, and object-aligned planes a sixth of a voxel.
    pub fn new(camera: &Camera, grid: &Grid, size: UVec2, domain: &Aabb, steps: &Steps) -> RayFrame {
        let to_sample = |p: DVec3| SamplePos::from(grid.index(WorldPos(p))).0;
        let turn = |v: DVec3| grid.world_to_index().transform_vector3(v);
        let center = domain.center();
        let center_world = grid.world(IndexPos::from(SamplePos(center))).0;
        let rays = camera.pixel_rays(size);
        // Near an eye within the volume, rays at the rim of a wide lens are far from all others: the eye is near all.
        let is_near = (to_sample(camera.eye()) - center).length() <= 0.5 * domain.diagonal();
        let depth = match camera.projection() {
            Projection::Perspective { .. } if is_near => 0.0,
            _ => (center_world - camera.eye()).dot(camera.forward()),
        };
        let (right, down) = (turn(camera.right() * rays.pixel()), turn(camera.up() * -rays.pixel()));
        let anchor0 = to_sample(camera.eye() + camera.forward() * depth) - center;
        let forward = turn(camera.forward());
        let frame = RayFrame {
            size,
            center,
            anchor: [anchor0, right, down],
            direction: [forward, DVec3::ZERO, DVec3::ZERO],
            voxels_per_unit: voxels_per_unit(grid),
            pixel: 0.0,
            anchor_past_start: depth,
            anchor_depth: 0.0,
            start: 0.0,
            n_segments: 1.0,
            placement: steps.placement,
            planes: PlaneStacks::default(),
        };
        let frame = match camera.projection() {
            Projection::Orthographic { .. } => frame,
            Projection::Perspective { .. } => RayFrame {
                anchor: [anchor0, right * depth, down * depth],
                direction: [forward, right, down],
                pixel: rays.pixel(),
                anchor_depth: depth,
                ..frame
            },
        };
        let corners = from_eye(camera, grid, domain);
        let nearest = corners.iter().map(|c| c.dot(camera.forward())).fold(f64::INFINITY, f64::min);
        // The surface before the nearest point: no surface is farther from the eye than spheres are.
        let coarsest = steps.coarsest_world;
        let start = ((nearest / coarsest).floor() * coarsest).max(0.0);
        let farthest = farthest(camera, &corners);
        let n_segments = (farthest - start) / steps.step_world;
        let frame =
            RayFrame { start, anchor_past_start: depth - start, n_segments: n_segments.ceil().max(1.0), ..frame };
        match steps.placement {
            Placement::Shells | Placement::ViewportPlanes => frame,
            Placement::TessellatedShells { .. } => {
                let n_segments = (farthest / frame.least_stretch() - start) / steps.step_world;
                RayFrame { n_segments: n_segments.ceil().max(1.0), ..frame }
            }
            Placement::ObjectPlanes => {
                let planes = PlaneStacks::new(grid, domain);
                RayFrame { planes, n_segments: planes.most_segments(steps.step_world), ..frame }
            }
        }
    }

    /// The ray of pixel (x, y) with the planes that it would take if its angles to them were off by `rounding`, in cosines;
    /// `None` if it would take the same ones.
    pub fn ray_across_tie(&self, x: u32, y: u32, rounding: f64) -> Option<PlanRay> {
        if self.placement != Placement::ObjectPlanes {
            return None;
        }
        let shells = RayFrame { placement: Placement::Shells, ..*self }.ray(x, y);
        let axis = self.planes.other_axis(shells.direction, rounding)?;
        Some(self.planes.through(shells, axis))
    }

    /// The least [`stretch`](PlanRay::stretch) that a ray may have.
    pub fn least_stretch(&self) -> f64 {
        match self.placement {
            // The facet in the middle lies deepest in its sphere: its surfaces are the closest.
            Placement::TessellatedShells { .. } => {
                self.facet_normal(self.facet_of(self.size.x / 2, self.size.y / 2)).length().recip()
            }
            _ => 1.0,
        }
    }

    /// How much farther than a step a segment may reach along an axis of space.
    pub(crate) fn greatest_stretch(&self) -> f64 {
        let last = self.size.max(UVec2::ONE) - 1;
        let corners = [(0, 0), (last.x, 0), (0, last.y), (last.x, last.y)];
        let stretch = match self.placement {
            Placement::ViewportPlanes => corners.map(|(x, y)| self.ray(x, y).stretch).into_iter().fold(1.0, f64::max),
            // A ray takes the planes across the axis along which it is steepest.
            Placement::ObjectPlanes | Placement::Shells | Placement::TessellatedShells { .. } => 1.0,
        };
        stretch * STRETCH_MARGIN
    }

    /// How far f32 may put a position of a pixel's ray from where it is, along each axis, in voxels, for parameters up to `far`.
    ///
    /// A position is anchor + direction (t - t_anchor), relative to the centre. Anchor and direction are themselves sums of three
    /// terms, which may cancel; t is one of products. Each term is the result of at most eight roundings (three products and
    /// two sums for the anchor, the same and a normalisation for the direction, a product and a sum for t), each of at most
    /// 2^-24 of the term; so are the shift to the first sample and the division by the brick's cells. So it is off by at
    /// most 8 * 2^-24 * (|center| + anchor + direction (|t| + |t_anchor|)), where anchor and direction are sums of magnitudes.
    pub fn rounding(&self, x: u32, y: u32, ray: &PlanRay, far: f64) -> DVec3 {
        let at = self.past_middle(x, y);
        let length = (1.0 + (at * self.pixel).length_squared()).sqrt();
        let direction = magnitude(&self.direction, at) / length;
        (self.center.abs() + magnitude(&self.anchor, at) + direction * (far + ray.t_anchor.abs())) * ROUNDING
    }

    /// How far f32 may put a position of any ray from where it is, along each axis, in voxels, as far as the ray runs in a box
    /// around the centre of half these extents: no less than [`rounding`](Self::rounding) of all rays.
    pub fn most_rounding(&self, half: DVec3) -> DVec3 {
        let corner = 0.5 * self.size.as_dvec2();
        let anchor = magnitude(&self.anchor, corner);
        let [forward, right, down] = self.direction;
        // Normalised, no part of a direction is longer than 1.
        let direction = match self.pixel {
            0.0 => forward.abs(),
            pixel => magnitude(&self.direction, corner).min(forward.abs() + (right.abs() + down.abs()) / pixel),
        };
        let way = (half.length() + anchor.length()) / self.least_voxels_per_unit();
        let corners = [(0, 0), (self.size.x - 1, 0), (0, self.size.y - 1), (self.size.x - 1, self.size.y - 1)];
        let rays = corners.into_iter().chain([(self.size.x / 2, self.size.y / 2)]).map(|(x, y)| self.ray(x, y));
        // Object-aligned planes are met at a cosine of 1 / sqrt 3 or more.
        let t_anchor = rays.map(|ray| ray.t_anchor.abs()).fold(2.0 * way, f64::max);
        (self.center.abs() + anchor + direction * (way + 2.0 * t_anchor)) * ROUNDING
    }

    /// No ray crosses fewer voxels in a world unit.
    fn least_voxels_per_unit(&self) -> f64 {
        let [forward, right, down] = self.direction;
        match self.pixel {
            0.0 => forward.length(),
            pixel => {
                let to_world = DMat3::from_cols(forward, right / pixel, down / pixel).inverse();
                let columns = [to_world.x_axis, to_world.y_axis, to_world.z_axis];
                columns.into_iter().map(DVec3::length_squared).sum::<f64>().sqrt().recip()
            }
        }
    }

    /// The centre of a pixel, in pixels from the picture's.
    #[inline]
    fn past_middle(&self, x: u32, y: u32) -> DVec2 {
        DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5) - 0.5 * self.size.as_dvec2()
    }

    /// The ray through the centre of pixel (x, y).
    #[inline]
    pub fn ray(&self, x: u32, y: u32) -> PlanRay {
        let at = self.past_middle(x, y);
        let mix = |v: &[DVec3; 3]| v[0] + v[1] * at.x + v[2] * at.y;
        let across = at * self.pixel;
        let square = across.length_squared();
        let length = (1.0 + square).sqrt();
        let (anchor, direction) = (mix(&self.anchor), mix(&self.direction) / length);
        // depth * length = depth + depth * square / (1 + length), without cancellation
        let t_anchor = self.anchor_past_start + self.anchor_depth * (square / (1.0 + length));
        let shells = PlanRay { anchor, direction, t_anchor, t_eye: -self.start, stretch: 1.0 };
        match self.placement {
            Placement::Shells => shells,
            Placement::ViewportPlanes => PlanRay {
                t_anchor: self.anchor_past_start * length,
                t_eye: -self.start * length,
                stretch: length,
                ..shells
            },
            Placement::TessellatedShells { .. } => {
                let normal = self.facet_normal(self.facet_of(x, y));
                // How far the facet's plane is beyond the plane at distance 1, where the ray meets that.
                let beyond = normal.truncate().dot(across) + (normal.z - 1.0);
                let stretch = length / (1.0 + beyond);
                let t_anchor = stretch * (self.anchor_past_start + self.anchor_depth * beyond);
                PlanRay { t_anchor, t_eye: -self.start * stretch, stretch, ..shells }
            }
            Placement::ObjectPlanes => self.planes.through(shells, self.planes.axis(direction)),
        }
    }
}

impl PlanRay {
    /// The sample position, relative to the frame's centre, at `t` world units past the ray's surface 0.
    #[inline]
    pub fn at(&self, t: f64) -> DVec3 {
        self.anchor + self.direction * (t - self.t_anchor)
    }
}

/// The magnitudes of the terms of v0 + v1 x + v2 y, added up.
fn magnitude(v: &[DVec3; 3], at: DVec2) -> DVec3 {
    v[0].abs() + v[1].abs() * at.x.abs() + v[2].abs() * at.y.abs()
}

/// Distance to the farthest of some points, as rays measure it.
fn farthest(camera: &Camera, from_eye: &[DVec3]) -> f64 {
    let distance = |v: &DVec3| match camera.projection() {
        Projection::Orthographic { .. } => v.dot(camera.forward()),
        Projection::Perspective { .. } => v.length(),
    };
    from_eye.iter().map(distance).fold(0.0, f64::max)
}

/// From the eye to the corners of the domain's world box.
fn from_eye(camera: &Camera, grid: &Grid, domain: &Aabb) -> [DVec3; 8] {
    domain.corners().map(|p| grid.world(IndexPos::from(SamplePos(p))).0 - camera.eye())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Division, Mode, QuadratureRule, Sampling};
    use brickfield_core::Level;
    use brickfield_core::glam::{UVec3, Vec3, Vec3Swizzles};

    fn check(camera: &Camera, grid: &Grid, tolerance: f64) {
        let size = UVec2::new(40, 30);
        let domain = Aabb { min: DVec3::splat(-0.5), max: grid.dims().as_dvec3() - 0.5 };
        let frame = RayFrame::new(camera, grid, size, &domain, &Steps::shells(0.5));
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

    #[test]
    fn a_frame_starts_with_a_segment_of_its_coarsest_level() {
        let grid = Grid::axis_aligned(UVec3::new(40, 30, 20), DVec3::ONE).unwrap();
        let domain = Aabb { min: DVec3::splat(-0.5), max: grid.dims().as_dvec3() - 0.5 };
        let sampling = Sampling::new(0.3, QuadratureRule::MidpointExponential, Mode::Exact).unwrap();
        let sampling = sampling.divided(Division::Brick);
        for placement in
            [Placement::Shells, Placement::ViewportPlanes, Placement::TessellatedShells { facet_pixels: 9 }]
        {
            let steps = Steps::of(&sampling, placement, Level(2)).unwrap();
            for distance in 30..60 {
                let eye = grid.world_box().center() + DVec3::new(1.3, 0.2, 0.4) * f64::from(distance);
                let projection = Projection::Perspective { fov_y: 0.8 };
                let camera = Camera::look_at(eye, grid.world_box().center(), DVec3::Z, projection).unwrap();
                let start = RayFrame::new(&camera, &grid, UVec2::new(40, 30), &domain, &steps).start / (4.0 * 0.3);
                assert!((start - start.round()).abs() < 1e-9 && start >= 1.0, "{placement:?}, {distance}: {start}");
            }
        }
    }

    fn frame(placement: Placement, projection: Projection) -> (RayFrame, Camera, Grid) {
        let grid = Grid::from_first_sample(
            UVec3::new(20, 17, 9),
            DVec3::new(1.0, 1.5, 2.0),
            DVec3::new(3.0, -4.0, 5.0),
            DMat3::IDENTITY,
        )
        .unwrap();
        let eye = grid.world_box().center() + DVec3::new(40.0, 25.0, 12.0);
        let camera = Camera::look_at(eye, grid.world_box().center(), DVec3::Z, projection).unwrap();
        let domain = Aabb { min: DVec3::splat(-0.5), max: grid.dims().as_dvec3() - 0.5 };
        let steps = Steps { step_world: 0.7, placement, coarsest_world: 2.8 };
        (RayFrame::new(&camera, &grid, UVec2::new(40, 30), &domain, &steps), camera, grid)
    }

    /// Where surface k of pixel (x, y) lies in the world, from the eye.
    fn surface(placement: Placement, (x, y): (u32, u32), k: f64) -> (DVec3, Camera, Grid) {
        let (frame, camera, grid) = frame(placement, PERSPECTIVE);
        let ray = frame.ray(x, y);
        let q = frame.center + ray.at(k * 0.7 * ray.stretch);
        (grid.world(IndexPos::from(SamplePos(q))).0 - camera.eye(), camera, grid)
    }

    const PERSPECTIVE: Projection = Projection::Perspective { fov_y: 0.8 };

    #[test]
    fn surfaces_lie_where_their_placement_says() {
        for pixel in [(0, 0), (39, 29), (17, 3)] {
            for k in [0.0, 4.0, 9.0] {
                let whole_steps = |world: f64| (world / 0.7 - (world / 0.7).round()).abs() < 1e-9;
                let (p, camera, _) = surface(Placement::ViewportPlanes, pixel, k);
                assert!(whole_steps(p.dot(camera.forward())), "{p}");
                let (p, ..) = surface(Placement::Shells, pixel, k);
                assert!(whole_steps(p.length()), "{p}");
                let (p, camera, grid) = surface(Placement::ObjectPlanes, pixel, k);
                let direction = camera.pixel_rays(UVec2::new(40, 30)).pixel_ray(pixel.0, pixel.1).direction;
                let steepest = direction.abs().to_array().iter().position(|c| *c == direction.abs().max_element());
                let axis = steepest.unwrap();
                let (low, high) = (DVec3::splat(-1.0 / 6.0), grid.dims().as_dvec3() + 1.0 / 6.0);
                let first = grid.world(IndexPos(if direction[axis] > 0.0 { low } else { high })).0;
                assert!(whole_steps((camera.eye() + p - first)[axis]), "{p}");
            }
        }
    }

    #[test]
    fn a_frame_has_segments_for_its_longest_ray_along_any_axis() {
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            let grid = Grid::axis_aligned((axis * 50.0 + 3.0).as_uvec3(), DVec3::ONE).unwrap();
            let domain = Aabb { min: DVec3::splat(-0.5), max: grid.dims().as_dvec3() - 0.5 };
            for placement in [Placement::Shells, Placement::ViewportPlanes, Placement::ObjectPlanes] {
                let steps = Steps { step_world: 0.25, placement, coarsest_world: 0.25 };
                let eye = grid.world_box().center() - axis * 60.0;
                let camera = Camera::look_at(eye, grid.world_box().center(), axis.yzx(), PERSPECTIVE).unwrap();
                let frame = RayFrame::new(&camera, &grid, UVec2::new(41, 31), &domain, &steps);
                let central = frame.ray(20, 15);
                let volume = Aabb { min: domain.min - frame.center, max: domain.max - frame.center };
                let ray = brickfield_core::Ray { origin: central.at(0.0), direction: central.direction };
                let end = ray.clip(&volume).unwrap().end;
                assert!(end <= frame.n_segments * 0.25 + 1e-9, "{placement:?} along {axis}: {end}");
            }
        }
    }

    #[test]
    fn rays_begin_at_the_eye_whatever_their_surfaces() {
        let facets = Placement::TessellatedShells { facet_pixels: 16 };
        for placement in [Placement::Shells, facets, Placement::ViewportPlanes, Placement::ObjectPlanes] {
            let (frame, camera, grid) = frame(placement, PERSPECTIVE);
            let ray = frame.ray(5, 21);
            let eye = grid.world(IndexPos::from(SamplePos(frame.center + ray.at(ray.t_eye)))).0;
            assert!((eye - camera.eye()).length() < 1e-9, "{placement:?}: {eye}");
        }
    }

    #[test]
    fn facets_touch_the_shells_at_their_corners_and_lie_inside_by_a_second_order() {
        let gap = |facet_pixels| {
            let (frame, ..) = frame(Placement::TessellatedShells { facet_pixels }, PERSPECTIVE);
            let gaps = (0..30).flat_map(|y| (0..40).map(move |x| (x, y))).map(|(x, y)| 1.0 - frame.ray(x, y).stretch);
            gaps.fold((f64::MAX, f64::MIN), |(low, high), g| (low.min(g), high.max(g)))
        };
        let (least, most) = gap(16);
        assert!(least > -1e-12 && most < 0.05, "{least} {most}");
        assert!((gap(8).1 / most - 0.25).abs() < 0.05 && (gap(4).1 / most - 1.0 / 16.0).abs() < 0.02);
    }

    #[test]
    fn parallel_rays_see_all_shells_as_planes() {
        let parallel = Projection::Orthographic { height: 30.0 };
        let of = |placement| frame(placement, parallel).0.ray(3, 4);
        for placement in [Placement::ViewportPlanes, Placement::TessellatedShells { facet_pixels: 5 }] {
            assert_eq!(of(placement), of(Placement::Shells));
        }
    }

    /// A pixel's ray as shaders make it (rays.wesl): its position `u` world units past the anchor.
    fn position_in_f32(frame: &RayFrame, (x, y): (u32, u32), u: f64) -> DVec3 {
        let f32s = |v: &[DVec3; 3]| v.map(|v| v.as_vec3());
        let (anchor, direction) = (f32s(&frame.anchor), f32s(&frame.direction));
        let at = frame.past_middle(x, y).as_vec2();
        let across = at * frame.pixel as f32;
        let length = (1.0 + across.dot(across)).sqrt();
        let mix = |v: [Vec3; 3]| v[0] + v[1] * at.x + v[2] * at.y;
        let (anchor, direction) = (mix(anchor), mix(direction) / length);
        (direction * u as f32 + anchor).as_dvec3()
    }

    proptest::proptest! {
        #[test]
        fn f32_is_within_the_rounding_that_is_stated(
            dims in proptest::sample::select(vec![[512, 512, 60], [1000, 1000, 2], [64, 64, 64], [3, 400, 90]]),
            spacing in proptest::array::uniform3(0.2f64..3.0),
            eye in proptest::array::uniform3(-1.0f64..2.0),
            target in proptest::array::uniform3(0.0f64..1.0),
            fov_y in 0.001f64..3.1,
            pixel in (0u32..41, 0u32..31),
            along in 0.0f64..1.0,
        ) {
            let direction = DMat3::from_cols(DVec3::new(0.0, 0.6, 0.8), DVec3::X, DVec3::new(0.0, 0.8, -0.6));
            let grid = Grid::from_first_sample(dims.into(), spacing.into(), DVec3::new(70.0, -20.0, 3.0), direction).unwrap();
            let domain = Aabb { min: DVec3::splat(-0.5), max: grid.dims().as_dvec3() - 0.5 };
            let at = |p: [f64; 3]| grid.world(IndexPos(grid.dims().as_dvec3() * DVec3::from(p))).0;
            let Ok(camera) = Camera::look_at(at(eye), at(target), DVec3::X, Projection::Perspective { fov_y }) else {
                return Ok(());
            };
            let size = UVec2::new(41, 31);
            let frame = RayFrame::new(&camera, &grid, size, &domain, &Steps::shells(1.0));
            let ray = frame.ray(pixel.0, pixel.1);
            let far = grid.world_box().diagonal() * along;
            let off = (position_in_f32(&frame, pixel, far) - (ray.anchor + ray.direction * far)).abs();
            let bound = frame.rounding(pixel.0, pixel.1, &ray, far);
            proptest::prop_assert!(off.cmple(bound).all(), "{off} {bound}");
            let half = 0.5 * domain.extent();
            let within = ray.at(far + ray.t_anchor).abs().cmple(half).all();
            proptest::prop_assert!(!within || bound.cmple(frame.most_rounding(half) * 1.0001).all(), "{bound}");
        }
    }
}
