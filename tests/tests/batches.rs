//! Frames in batches show the picture of one batch, bit by bit, on every backend; and shaders that forget what batches owe each other are
//! noticed. Prints `no device` where there is none.

mod devices;

use std::sync::Arc;

use brickfield::core::glam::{DVec3, UVec2, UVec3};
use brickfield::core::{BrickSide, Camera, Grid, Image, Knot, TransferFunction, Volume};
use brickfield::frame::{Backend, Division, Placement, QuadratureRule, Target};
use brickfield::optics::{Light, LightSource, LightTerms};
use brickfield::{
    CacheCounts, CacheOptions, Scene, Technique, TrimCache, TrimResidency, TrimmedVolume, Trimming, prepare_trimmed,
    prepare_trimmed_batches, render_ahead,
};
use brickfield_ash::Options;
use brickfield_shaders::ShaderLibrary;

/// Balls of different values in noise.
fn source() -> TrimmedVolume {
    let grid = Grid::axis_aligned(UVec3::new(61, 50, 44), DVec3::ONE).unwrap();
    let [nx, ny] = [61, 50];
    let voxel = |i: u32| {
        let p = UVec3::new(i % nx, i / nx % ny, i / (nx * ny)).as_dvec3();
        let ball = |center: DVec3, radius: f64| ((radius - (p - center).length()) * 20.0).clamp(0.0, 160.0);
        let noise = f64::from(i.wrapping_mul(2_654_435_761).rotate_left(15).wrapping_mul(2_246_822_519) >> 26);
        (ball(DVec3::new(20.0, 25.0, 20.0), 15.0) + ball(DVec3::new(46.0, 20.0, 30.0), 11.0)).min(190.0) + noise
    };
    let voxels: Vec<u8> = (0..grid.n_voxels() as u32).map(|i| voxel(i) as u8).collect();
    TrimmedVolume::new(Arc::new(Volume::new(grid, voxels).unwrap()), BrickSide::S16)
}

/// Shells of the balls, thin enough to see what lies behind.
fn scene(source: &TrimmedVolume) -> Scene {
    let camera = Camera::framing(&source.volume().grid().world_box(), DVec3::new(1.0, 0.7, 0.4), DVec3::Z).unwrap();
    let knot = |value, extinction, red| Knot { value, extinction, color: [red, 0.5, 0.2] };
    let knots = vec![knot(70.0, 0.0, 0.1), knot(100.0, 0.06, 0.4), knot(140.0, 0.0, 0.9), knot(200.0, 0.02, 1.0)];
    Scene { step_voxels: 1.3, ..Scene::new(camera, UVec2::new(40, 32), TransferFunction::new(knots).unwrap()) }
}

/// Pairs of options: rules and divisions, light and cuts, rays and polygons.
fn scenes(source: &TrimmedVolume) -> Vec<(&'static str, Scene, Trimming)> {
    let lit = Light::new(LightSource::Head, LightTerms::default(), 20.0).unwrap();
    let plain = scene(source);
    let of = |rule, division, light| Scene { rule, division, light, ..plain.clone() };
    let slices = Scene {
        technique: Technique::Polygons(Target::Float32),
        placement: Placement::ViewportPlanes,
        division: Division::Brick,
        ..plain.clone()
    };
    use Division::{Brick, Ray};
    use QuadratureRule::{Gauss2, MidpointExponential, PreIntegrated};
    vec![
        ("midpoint of rays", plain.clone(), Trimming::Packed),
        ("midpoint of bricks", of(MidpointExponential, Brick, None), Trimming::Alone),
        ("lit", of(MidpointExponential, Ray, Some(lit)), Trimming::Packed),
        ("lit in bricks", of(Gauss2, Brick, Some(lit)), Trimming::Visible),
        ("Gauss", of(Gauss2, Ray, None), Trimming::Packed),
        ("Gauss, lit", of(Gauss2, Ray, Some(lit)), Trimming::Conventional),
        ("pre-integrated", of(PreIntegrated, Ray, None), Trimming::Packed),
        ("pre-integrated in bricks", of(PreIntegrated, Brick, None), Trimming::Envelope),
        ("slices", slices.clone(), Trimming::Packed),
        ("slices, lit", Scene { light: Some(lit), ..slices }, Trimming::Alone),
    ]
}

fn whole(backend: &mut dyn Backend, source: &TrimmedVolume, scene: &Scene, trimming: Trimming) -> Image<f32> {
    let plan = prepare_trimmed(source, scene, trimming, &mut TrimResidency::default()).unwrap();
    backend.render(&plan).unwrap().image
}

/// The same through the smallest cache: with light or two nodes it holds a brick and its neighbours.
fn in_batches(
    backend: &mut dyn Backend,
    source: &TrimmedVolume,
    scene: &Scene,
    trimming: Trimming,
) -> (Image<f32>, CacheCounts) {
    let of_pages = |n| TrimCache::new(CacheOptions { page_side: Some(16), ..CacheOptions::of_bytes(n * 4096) });
    let is_enough = |n: &u64| prepare_trimmed_batches(source, scene, trimming, &mut of_pages(*n)).is_ok();
    let mut cache = of_pages((1..28).find(is_enough).unwrap());
    let batches = prepare_trimmed_batches(source, scene, trimming, &mut cache).unwrap();
    let frame = render_ahead(backend, batches.size(), batches).unwrap();
    (frame.image, cache.counts())
}

fn check(backend: &mut dyn Backend) {
    let source = source();
    for (name, scene, trimming) in scenes(&source) {
        let whole = whole(backend, &source, &scene, trimming);
        let (image, counts) = in_batches(backend, &source, &scene, trimming);
        assert!(whole.pixels().iter().any(|pixel| pixel[3] > 0.1) && counts.n_batches > 1, "{name}: {counts:?}");
        assert!(image == whole, "{name}: {counts:?}");
    }
}

#[test]
fn batches_show_the_picture_of_one_with_wgpu() {
    if let Some(mut backend) = devices::wgpu() {
        check(&mut backend);
    }
}

#[test]
fn batches_show_the_picture_of_one_with_ash() {
    if let Some(mut backend) = devices::ash(&Options::default()) {
        check(&mut backend);
    }
}

/// A name, a module and a function of it, what stands there, and what is wrong.
type Mutant = [&'static str; 5];

const MUTANTS: [Mutant; 6] = [
    ["rays forget", "march", "integrate_on", "before = seen_before[slot];", "before = vec4f(0.0);"],
    [
        "rays remember another's",
        "march",
        "march",
        "pixel.x + (pixel.y - first_row() + seen_row()) * frame.size.x",
        "pixel.x + (pixel.y - first_row() + seen_row()) * 8u",
    ],
    ["nothing is remembered", "march", "integrate_on", "seen_before[slot] = seen;", ""],
    ["lent bricks of rays are drawn", "field/placed", "is_lent", "return area.lent;", "return false;"],
    [
        "lent is beside the lower corner",
        "field/placed",
        "patch_of",
        "area.lent = area.resident && kept[2u * slot].w != 0.0;",
        "area.lent = area.resident && kept[2u * slot + 1u].w != 0.0;",
    ],
    ["the first node alone has a segment", "segments", "is_anothers", "is_empty(area) && is_lent(next)", "false"],
];

#[test]
fn shaders_that_forget_what_batches_owe_each_other_are_noticed() {
    let Some(mut backend) = devices::ash(&Options::default()) else { return };
    let source = source();
    let scenes = scenes(&source);
    let expected: Vec<Image<f32>> =
        scenes.iter().map(|(_, scene, trimming)| whole(&mut backend, &source, scene, *trimming)).collect();
    for [name, module, declaration, from, to] in MUTANTS {
        let library = ShaderLibrary::embedded().patched_in(module, declaration, from, to);
        backend.set_library(library.unwrap_or_else(|e| panic!("{name}: {e}")));
        let is_other = |((_, scene, trimming), expected): (&(&str, Scene, Trimming), &Image<f32>)| {
            in_batches(&mut backend, &source, scene, *trimming).0 != *expected
        };
        assert!(scenes.iter().zip(&expected).any(is_other), "{name}: nobody notices");
    }
}
