//! A second f64 opinion on a scene, straight from the volume and the camera.
//!
//! It shares neither bricks, nor index, nor ray frame, nor the ray walk with the reference that it judges: if `prepare` cut bricks or
//! anchored rays wrongly, the reference of the wrong plan would agree with every backend, and only this would not.

use brickfield::Scene;
use brickfield_core::glam::DVec3;
use brickfield_core::{Aabb, BrickSide, Image, Ray, Volume};
use brickfield_optics::RayState;
use rayon::prelude::*;

use super::samples::{Samples, VolumeSamples};
use super::surfaces::segments;

/// The picture of a scene at full resolution, from the volume's own samples.
pub(crate) fn naive(volume: &Volume, side: BrickSide, scene: &Scene) -> Image<f64> {
    let size = scene.size;
    let mut image = Image::transparent(size);
    image.pixels_mut().par_iter_mut().enumerate().for_each(|(i, pixel)| {
        *pixel = pixel_of(volume, side, scene, (i as u32 % size.x, i as u32 / size.x));
    });
    image
}

fn pixel_of(volume: &Volume, side: BrickSide, scene: &Scene, (x, y): (u32, u32)) -> [f64; 4] {
    let world = scene.camera.pixel_rays(scene.size).pixel_ray(x, y);
    let (ray, shown) = (in_index_space(volume, &world), shown(volume, scene));
    let span = if shown.is_empty() { None } else { ray.clip(&shown) };
    let Some(span) = span else { return [0.0; 4] };
    let value = |t: f64| VolumeSamples(volume).around(ray.at(t) - 0.5).map_or(0.0, |c| c.value());
    let mut state = RayState::default();
    for segment in segments(volume, side, scene, (x, y), span) {
        let values: Vec<f64> = scene.rule.nodes().iter().map(|n| value(segment.at(*n))).collect();
        state.push(scene.rule.segment(&scene.transfer, &values, segment.length));
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
