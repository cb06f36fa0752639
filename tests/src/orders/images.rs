//! Small pictures of a field that is linear in space: a smooth problem along every ray, with a truth for every pixel.
//!
//! The volume is clipped to its outer samples, where trilinear interpolation of a linear field is that field, so cells and
//! bricks leave no trace. Extinction and colour are linear in the value: along a ray both are linear in t, and the pixel is
//! a smooth integral that Romberg's method gives to rounding.

use brickfield::bricks::{BuildOptions, Downsampling, build_tree};
use brickfield::cpu::discrete;
use brickfield::frame::{Backend, FramePlan};
use brickfield::{Residency, Scene, Skipping, prepare};
use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{Aabb, BrickSide, Camera, Grid, Image, Knot, ScalarType, TransferFunction, Volume};
use brickfield_optics::QuadratureRule;

use super::fit::OrderRow;
use super::rays::romberg;
use crate::volumes::fill;

const DIMS: UVec3 = UVec3::new(33, 33, 33);
const SIZE: UVec2 = UVec2::new(9, 7);
/// Errors of f32 arithmetic on these rays.
const F32_FLOOR: f64 = 5e-7;

/// Greatest value of the volume.
const GREATEST: f64 = 6.0 * 32.0;

/// The value at a world position: linear in space, and an integer at every sample, so that it is stored exactly.
fn value(p: DVec3) -> f64 {
    (p - 0.5).dot(DVec3::new(1.0, 3.0, 2.0))
}

fn transfer() -> TransferFunction {
    let knots = vec![
        Knot { value: 0.0, extinction: 0.0, color: [0.9, 0.1, 0.3] },
        Knot { value: GREATEST, extinction: 0.6, color: [0.1, 0.9, 0.4] },
    ];
    TransferFunction::new(knots).expect("knots ascend")
}

fn scene(volume: &Volume, rule: QuadratureRule, step_voxels: f64) -> Scene {
    let camera = Camera::framing(&volume.grid().world_box(), DVec3::new(0.6, -1.0, 0.35), DVec3::Z);
    let outer = Aabb { min: DVec3::splat(0.5), max: DIMS.as_dvec3() - 0.5 };
    Scene {
        rule,
        step_voxels,
        clip: Some(outer),
        skipping: Skipping::Off,
        ..Scene::new(camera.expect("a volume has a box"), SIZE, transfer())
    }
}

fn volume() -> Volume {
    let grid = Grid::axis_aligned(DIMS, DVec3::ONE).expect("a grid");
    fill(&grid, ScalarType::U16, value)
}

fn plan(volume: &Volume, rule: QuadratureRule, step: f64) -> FramePlan {
    let options = BuildOptions { side: BrickSide::S16, downsampling: Downsampling::Subsample, max_bytes: None };
    let tree = build_tree(volume, &options).expect("a small octree");
    prepare(&tree, &scene(volume, rule, step), &mut Residency::default()).expect("a scene")
}

/// The integral along every pixel's ray.
fn truth(volume: &Volume) -> Vec<[f64; 4]> {
    let scene = scene(volume, QuadratureRule::MidpointExponential, 1.0);
    let clip = scene.clip.unwrap_or(volume.grid().index_box());
    let rays = scene.camera.pixel_rays(SIZE);
    let pixel = |i: u32| {
        let ray = rays.pixel_ray(i % SIZE.x, i / SIZE.x);
        // Index space is the world here.
        ray.clip(&clip).map_or([0.0; 4], |span| {
            let (near, far) = (value(ray.at(span.start)), value(ray.at(span.end)));
            integral(near, far, span.end - span.start)
        })
    };
    (0..SIZE.x * SIZE.y).map(pixel).collect()
}

/// Values that run linearly from `near` to `far` over `length`.
fn integral(near: f64, far: f64, length: f64) -> [f64; 4] {
    let transfer = transfer();
    let at = |s: f64| transfer.at(near + (far - near) * s);
    // Extinction is linear: its mean up to s is that of its ends.
    let depth = |s: f64| 0.5 * length * s * (at(0.0).extinction + at(s).extinction);
    let emission = |c: usize| romberg(|s| length * at(s).extinction * at(s).color[c] * (-depth(s)).exp());
    [emission(0), emission(1), emission(2), -(-depth(1.0)).exp_m1()]
}

/// The steps, in voxels: seven halvings. At the first the densest segment has optical depth 1.8.
fn steps() -> impl Iterator<Item = f64> {
    (0..8).map(|k| 3.0 * 0.5f64.powi(k))
}

/// The root of the mean squared difference over pixels and channels: single pixels' errors may change sign.
fn error(image: &Image<f64>, truth: &[[f64; 4]]) -> f64 {
    let squares = image.pixels().iter().zip(truth).flat_map(|(a, b)| (0..4).map(move |c| (a[c] - b[c]).powi(2)));
    (squares.sum::<f64>() / (4 * truth.len()) as f64).sqrt()
}

fn row(
    what: &str,
    rule: QuadratureRule,
    floor: f64,
    n_halvings: usize,
    render: &mut dyn FnMut(&FramePlan) -> Image<f64>,
) -> OrderRow {
    let volume = volume();
    let truth = truth(&volume);
    let errors = steps().map(|step| (step, error(&render(&plan(&volume, rule, step)), &truth))).collect();
    OrderRow {
        what: format!("picture, {what}, {}", rule.name()),
        order: f64::from(rule.order()),
        errors,
        floor,
        n_halvings,
    }
}

/// The discrete f64 answer against the integral.
pub fn reference_images() -> Vec<OrderRow> {
    let render = |plan: &FramePlan| discrete(plan).image;
    QuadratureRule::ALL.map(|rule| row("f64", rule, 1e-14, 5, &mut { render })).into()
}

/// A backend in exact mode, as far down as f32 goes: that leaves five halvings of order 2. Of order 4 it leaves none, so
/// there the floor itself is claimed.
pub fn backend_images(name: &str, backend: &mut dyn Backend) -> Vec<OrderRow> {
    let mut render = |plan: &FramePlan| match backend.render(plan) {
        Ok(frame) => frame.image.map(f64::from),
        Err(_) => Image::transparent(SIZE).map(|_: f64| f64::NAN),
    };
    let mut one = |rule: QuadratureRule| {
        let n_halvings = match rule.order() {
            1 | 2 => 5,
            _ => 0,
        };
        row(name, rule, F32_FLOOR, n_halvings, &mut render)
    };
    QuadratureRule::ALL.into_iter().map(&mut one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::median;

    #[test]
    fn the_problem_is_neither_thin_nor_opaque() {
        let pixels = truth(&volume());
        let hit: Vec<f64> = pixels.iter().map(|p| p[3]).filter(|a| *a > 0.0).collect();
        assert!(4 * hit.len() >= pixels.len(), "{} of {} rays meet the volume", hit.len(), pixels.len());
        let alpha = median(hit);
        assert!((0.3..0.999_999_9).contains(&alpha), "{alpha}");
    }
}
