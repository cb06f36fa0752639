//! A second f64 opinion on a scene, straight from the volume and the camera.
//!
//! It shares neither bricks, nor index, nor ray frame, nor the ray walk with the reference that it judges: if `prepare` cut bricks or
//! anchored rays wrongly, the reference of the wrong plan would agree with every backend, and only this would not.

use brickfield::Scene;
use brickfield_core::glam::DVec3;
use brickfield_core::{Aabb, BrickSide, Image, Ray, Volume};
use brickfield_optics::{Light, LightSource, Normals, RayState, Shade};
use rayon::prelude::*;

use super::samples::{Samples, VolumeSamples, weights_around};
use super::surface_normals::{NormalRule, Values};
use super::surfaces::segments;

/// The picture of a scene at full resolution, from the volume's own samples.
pub(crate) fn naive(volume: &Volume, side: BrickSide, scene: &Scene) -> Image<f64> {
    let size = scene.size;
    let has_surface_normals = scene.light.is_some_and(|light| light.normals() == Normals::Surface);
    let codes = has_surface_normals.then(|| Values::of(volume, &scene.transfer).codes(NormalRule::Weighted));
    let subject = Subject { volume, side, codes };
    let mut image = Image::transparent(size);
    image.pixels_mut().par_iter_mut().enumerate().for_each(|(i, pixel)| {
        *pixel = pixel_of(&subject, scene, (i as u32 % size.x, i as u32 / size.x));
    });
    image
}

/// What is drawn.
struct Subject<'a> {
    volume: &'a Volume,
    side: BrickSide,
    /// The normals of surface voxels, if the light asks for them.
    codes: Option<Vec<[u8; 4]>>,
}

fn pixel_of(subject: &Subject, scene: &Scene, (x, y): (u32, u32)) -> [f64; 4] {
    let (volume, side) = (subject.volume, subject.side);
    let world = scene.camera.pixel_rays(scene.size).pixel_ray(x, y);
    let (ray, shown) = (in_index_space(volume, &world), shown(volume, scene));
    let span = if shown.is_empty() { None } else { ray.clip(&shown) };
    let Some(span) = span else { return [0.0; 4] };
    let value = |t: f64| VolumeSamples(volume).around(ray.at(t) - 0.5).map_or(0.0, |c| c.value());
    let mut state = RayState::default();
    for segment in segments(volume, side, scene, (x, y), span) {
        let node = |x: &f64| {
            let t = segment.at(*x);
            let shade = scene.light.map(|light| shade(subject, &light, &world, t));
            (value(t), shade.unwrap_or(Shade::NONE))
        };
        let nodes: Vec<(f64, Shade)> = scene.rule.nodes().iter().map(node).collect();
        state.push(scene.rule.lit_segment(&scene.transfer, &nodes, segment.length));
    }
    state.rgba()
}

/// The shade at a parameter of a ray in the world.
fn shade(subject: &Subject, light: &Light, ray: &Ray, t: f64) -> Shade {
    let volume = subject.volume;
    let grid = volume.grid();
    let last = (grid.dims() - 1).as_dvec3();
    let q = (grid.world_to_index().transform_point3(ray.at(t)) - 0.5).clamp(DVec3::ZERO, last);
    let value = |q: DVec3| VolumeSamples(volume).around(q).map_or(0.0, |c| c.value());
    let slope = match &subject.codes {
        Some(codes) => slope_of_surface(codes, volume, light, q),
        None => slope_of_values(q, last, value),
    };
    // A step along an axis changes the value by its product with the gradient.
    let gradient = grid.index_to_world().matrix3.transpose().inverse() * slope;
    let to_light = match light.source() {
        LightSource::Head => -ray.direction,
        LightSource::Direction(direction) => direction,
        LightSource::Place(place) => (place - ray.at(t)).normalize_or_zero(),
    };
    light.shade(gradient, to_light, -ray.direction)
}

/// Change of the value along each of the grid's axes.
fn slope_of_values(q: DVec3, last: DVec3, value: impl Fn(DVec3) -> f64) -> DVec3 {
    // Change of the value along each of the grid's axes, a voxel to both sides where there is one.
    DVec3::from([0, 1, 2].map(|axis| {
        let (mut low, mut high) = (q, q);
        low[axis] = (q[axis] - 1.0).max(0.0);
        high[axis] = (q[axis] + 1.0).min(last[axis]);
        if high == low { 0.0 } else { (value(high) - value(low)) / (high[axis] - low[axis]) }
    }))
}

/// The change that the interpolated normals of surface voxels stand for: of length 1, that of a gradient of 64 `flat_below`.
fn slope_of_surface(codes: &[[u8; 4]], volume: &Volume, light: &Light, q: DVec3) -> DVec3 {
    let number = |c: usize| {
        let weighted = weights_around(volume.grid().dims(), q).map(|(i, weight)| weight * f64::from(codes[i][c]));
        weighted.iter().sum::<f64>()
    };
    let length = (number(3) / 255.0).powi(2) * 64.0 * light.flat_below();
    DVec3::new(number(0) - 127.0, number(1) - 127.0, number(2) - 127.0) / 127.0 * length * volume.grid().spacing()
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
