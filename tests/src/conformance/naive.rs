//! A second f64 opinion on a scene, straight from the volume and the camera.
//!
//! It shares neither bricks, nor index, nor ray frame, nor the ray walk with what it judges: if `prepare` cut bricks or
//! anchored rays wrongly, the reference of the wrong plan would agree with every backend, and only this would not.

use brickfield::Scene;
use brickfield_core::glam::DVec3;
use brickfield_core::{Aabb, Image, Ray, Span, Volume};
use brickfield_optics::RayState;
use rayon::prelude::*;

use super::samples::{Samples, VolumeSamples};

/// One segment of a ray, cut to the ray's span.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    start: f64,
    end: f64,
}

impl Piece {
    /// The parameter at fraction `x` of the piece.
    pub(crate) fn at(self, x: f64) -> f64 {
        self.start * (1.0 - x) + self.end * x
    }

    /// World units.
    pub(crate) fn length(self) -> f64 {
        self.end - self.start
    }
}

/// The segments [k h, (k + 1) h) of a span.
pub(crate) fn pieces(span: Span, step: f64) -> impl Iterator<Item = Piece> {
    let (first, last) = ((span.start / step).floor(), (span.end / step).ceil());
    let cut = move |k: f64| Piece { start: span.start.max(k * step), end: span.end.min((k + 1.0) * step) };
    (0..(last - first) as u64).map(move |i| cut(first + i as f64)).filter(|p| p.start < p.end)
}

/// The picture of a scene at full resolution, from the volume's own samples.
pub(crate) fn naive(volume: &Volume, scene: &Scene) -> Image<f64> {
    let size = scene.size;
    let mut image = Image::transparent(size);
    image.pixels_mut().par_iter_mut().enumerate().for_each(|(i, pixel)| {
        *pixel = pixel_of(volume, scene, i as u32 % size.x, i as u32 / size.x);
    });
    image
}

/// The world ray of a pixel and where it runs in what is shown.
pub(crate) fn world_span(volume: &Volume, scene: &Scene, x: u32, y: u32) -> (Ray, Option<Span>) {
    let ray = scene.camera.pixel_rays(scene.size).pixel_ray(x, y);
    let shown = shown(volume, scene);
    (ray, if shown.is_empty() { None } else { in_index_space(volume, &ray).clip(&shown) })
}

fn pixel_of(volume: &Volume, scene: &Scene, x: u32, y: u32) -> [f64; 4] {
    let (world, span) = world_span(volume, scene, x, y);
    let Some(span) = span else { return [0.0; 4] };
    let ray = in_index_space(volume, &world);
    let step = scene.step_voxels * volume.grid().spacing().min_element();
    let value = |t: f64| VolumeSamples(volume).cell(ray.at(t) - 0.5).map_or(0.0, |c| c.value());
    let mut state = RayState::default();
    for piece in pieces(span, step) {
        let values: Vec<f64> = scene.rule.nodes().iter().map(|n| value(piece.at(*n))).collect();
        state.push(scene.rule.segment(&scene.transfer, &values, piece.length()));
    }
    state.rgba()
}

fn in_index_space(volume: &Volume, ray: &Ray) -> Ray {
    let map = volume.grid().world_to_index();
    Ray { origin: map.transform_point3(ray.origin), direction: map.transform_vector3(ray.direction) }
}

fn shown(volume: &Volume, scene: &Scene) -> Aabb {
    let whole = volume.grid().index_box();
    let everywhere = Aabb { min: DVec3::NEG_INFINITY, max: DVec3::INFINITY };
    let clip = scene.clip.unwrap_or(everywhere);
    Aabb { min: whole.min.max(clip.min), max: whole.max.min(clip.max) }
}
