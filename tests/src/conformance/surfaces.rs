//! Where segments end along a world ray, straight from the camera and the volume: the second opinion's own geometry.

use brickfield::Scene;
use brickfield::frame::{Division, Lengths, Placement};
use brickfield_core::glam::{DVec2, DVec3};
use brickfield_core::{BrickSide, IndexPos, Ray, Span, Volume};

/// One segment of a ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct RaySegment {
    start: f64,
    end: f64,
    /// The length that its light is computed for, in world units.
    pub(super) length: f64,
}

impl RaySegment {
    /// The parameter at fraction `x` of the segment.
    pub(super) fn at(self, x: f64) -> f64 {
        self.start * (1.0 - x) + self.end * x
    }
}

/// Surfaces at t = origin + k step, t in world units from the eye.
#[derive(Clone, Copy, Debug)]
struct EvenSurfaces {
    origin: f64,
    step: f64,
}

/// The segments of pixel (x, y)'s ray in `span`, at full resolution, in bricks of `side`.
pub(super) fn segments(
    volume: &Volume,
    side: BrickSide,
    scene: &Scene,
    (x, y): (u32, u32),
    span: Span,
) -> Vec<RaySegment> {
    let nominal = scene.step_voxels * volume.grid().spacing().min_element();
    let ray = scene.camera.pixel_rays(scene.size).pixel_ray(x, y);
    let surfaces = surfaces(volume, scene, (x, y), &ray, nominal);
    let whole = match scene.division {
        Division::Ray => vec![span],
        Division::Brick => across_bricks(volume, side, &ray, span),
    };
    whole.into_iter().flat_map(|span| between(surfaces, span, scene.lengths, nominal)).collect()
}

fn surfaces(volume: &Volume, scene: &Scene, (x, y): (u32, u32), ray: &Ray, nominal: f64) -> EvenSurfaces {
    let along = |normal: DVec3| nominal / ray.direction.dot(normal);
    let step = match scene.placement {
        Placement::Shells => nominal,
        Placement::ViewportPlanes => along(scene.camera.forward()),
        Placement::TessellatedShells { facet_pixels } => along(facet(scene, x, y, facet_pixels)),
        Placement::ObjectPlanes => return object_planes(volume, ray, nominal),
    };
    EvenSurfaces { origin: 0.0, step }
}

/// The normal n of the plane n . p = 1 through the corners of a pixel's facet, in the world from the eye.
fn facet(scene: &Scene, x: u32, y: u32, side: u32) -> DVec3 {
    let low = DVec2::new(f64::from(x / side * side), f64::from(y / side * side));
    let third = if x % side > y % side { DVec2::X } else { DVec2::Y };
    let rays = scene.camera.pixel_rays(scene.size);
    let corner = |by: DVec2| rays.at(low + by * f64::from(side)).direction;
    let (a, b, c) = (corner(DVec2::ZERO), corner(third), corner(DVec2::ONE));
    let normal = (b - a).cross(c - b);
    // Parallel rays: the corners are one point.
    if normal.length() < 1e-12 { scene.camera.forward() } else { normal / normal.dot(a) }
}

/// The stack of grid planes that the ray meets at the steepest angle; ties to 1/4096 go to x before y before z.
fn object_planes(volume: &Volume, ray: &Ray, nominal: f64) -> EvenSurfaces {
    let grid = volume.grid();
    let through = |axis: usize| {
        let (u, v) = (DVec3::AXES[(axis + 1) % 3], DVec3::AXES[(axis + 2) % 3]);
        let to_world = grid.index_to_world().matrix3;
        (to_world * u).cross(to_world * v).normalize()
    };
    let cosines = [0, 1, 2].map(|axis| ray.direction.dot(through(axis)));
    let preferred = [0, 1, 2].map(|axis| cosines[axis].abs() * (1.0 - axis as f64 / 4096.0));
    let axis = (1..3).fold(0, |best, axis| if preferred[axis] > preferred[best] { axis } else { best });
    // A sixth of a voxel before the volume.
    let (low, high) = (DVec3::splat(-1.0 / 6.0), grid.dims().as_dvec3() + 1.0 / 6.0);
    let ahead = grid.world_to_index().transform_vector3(ray.direction)[axis] > 0.0;
    let on_plane = grid.world(IndexPos(if ahead { low } else { high })).0;
    let origin = (on_plane - ray.origin).dot(through(axis)) / cosines[axis];
    EvenSurfaces { origin, step: nominal / cosines[axis].abs() }
}

/// The ray's ways through bricks of level 0.
fn across_bricks(volume: &Volume, side: BrickSide, ray: &Ray, span: Span) -> Vec<Span> {
    let to_index = volume.grid().world_to_index();
    let (origin, direction) = (to_index.transform_point3(ray.origin), to_index.transform_vector3(ray.direction));
    let last = (volume.grid().dims() - 1).as_dvec3();
    let mut cuts = vec![span.start, span.end];
    for axis in (0..3).filter(|axis| direction[*axis] != 0.0) {
        let faces = (1..).map(|i| f64::from(i * side.n_cells())).take_while(|face| *face < last[axis]);
        let at = |face: f64| (face + 0.5 - origin[axis]) / direction[axis];
        cuts.extend(faces.map(at).filter(|t| span.start < *t && *t < span.end));
    }
    cuts.sort_by(f64::total_cmp);
    cuts.windows(2).map(|w| Span { start: w[0], end: w[1] }).collect()
}

fn between(surfaces: EvenSurfaces, span: Span, lengths: Lengths, nominal: f64) -> Vec<RaySegment> {
    let EvenSurfaces { origin, step } = surfaces;
    let (first, last) = (((span.start - origin) / step).floor(), ((span.end - origin) / step).ceil());
    let uncut = (0..(last - first) as u64).map(|i| origin + (first + i as f64) * step);
    let segments = uncut.filter_map(|start| match lengths {
        Lengths::True => {
            let (start, end) = (start.max(span.start), (start + step).min(span.end));
            (start < end).then_some(RaySegment { start, end, length: end - start })
        }
        Lengths::Nominal => {
            let middle = start + 0.5 * step;
            (span.start <= middle && middle < span.end).then_some(RaySegment {
                start,
                end: start + step,
                length: nominal,
            })
        }
    });
    segments.collect()
}
