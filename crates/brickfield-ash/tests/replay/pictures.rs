//! Pictures against closed forms.

use brickfield_ash::{Options, Validation};
use brickfield_core::{Aabb, Image, TransferFunction, glam::DVec3};
use brickfield_frame::{Backend, Feature, FeatureSet, Mode, Placement, QuadratureRule, SampleFormat, Target};

use crate::plans::{bumps, nothing, plan, polygons, ramp, rising, with_features, with_visible};
use crate::{connect, connect_with};

const PLACEMENTS: [Placement; 3] =
    [Placement::ObjectPlanes, Placement::ViewportPlanes, Placement::TessellatedShells { facet_pixels: 4 }];
const FORMATS: [SampleFormat; 3] = [SampleFormat::Unorm8, SampleFormat::Unorm16, SampleFormat::Float32];
const FAST: Mode = Mode::Fast { transmittance_floor: 0.0 };

fn assert_close(image: &Image<f32>, expected: [f64; 4], tolerance: f64, what: &str) {
    for pixel in image.pixels() {
        for (got, expected) in pixel.iter().zip(expected) {
            assert!((f64::from(*got) - expected).abs() <= tolerance, "{what}: {pixel:?}, expected {expected}");
        }
    }
}

fn layer(depth: f64, color: [f64; 3]) -> [f64; 4] {
    let alpha = -(-depth).exp_m1();
    [color[0] * alpha, color[1] * alpha, color[2] * alpha, alpha]
}

#[test]
fn a_homogeneous_slab_has_its_closed_form_in_every_rule() {
    let Some(mut backend) = connect(Validation::Off) else { return };
    let transfer = TransferFunction::constant(0.07, [0.2, 0.4, 0.8]).unwrap();
    for rule in QuadratureRule::ALL.into_iter().filter(|r| *r != QuadratureRule::LeftRiemann) {
        let plan = plan(ramp(SampleFormat::Unorm8), transfer.clone(), rule, Mode::Exact);
        // Nothing is dark here, and the plan has neither a map of macrocells nor beams nor light.
        let unneeded = [Feature::HardwareFilter, Feature::SkipDark, Feature::SkipBesideBeams];
        let of_light = [Feature::Light, Feature::LightBesideEye, Feature::StoredGradients];
        let general = unneeded.into_iter().chain(of_light).fold(FeatureSet::all(), FeatureSet::without);
        for plan in [&plan, &with_features(&plan, general)] {
            let frame = backend.render(plan).unwrap();
            assert_close(&frame.image, layer(0.07 * 16.0, [0.2, 0.4, 0.8]), 1e-6, rule.name());
        }
    }
}

#[test]
fn a_ramp_has_its_closed_form_in_every_format_and_mode() {
    let Some(mut backend) = connect(Validation::Off) else { return };
    // The field is 0 for half a voxel, z for fifteen, 15 for half a voxel.
    let expected = layer(0.01 * (112.5 + 7.5), [1.0, 0.5, 0.25]);
    for format in FORMATS {
        for (mode, tolerance) in [(Mode::Exact, 1e-6), (FAST, 1e-2)] {
            for rule in [QuadratureRule::MidpointExponential, QuadratureRule::PreIntegrated] {
                let frame = backend.render(&plan(ramp(format), rising(0.01), rule, mode)).unwrap();
                assert_close(&frame.image, expected, tolerance, &format!("{format:?} {mode:?} {}", rule.name()));
            }
        }
    }
}

#[test]
fn a_frame_without_anything_visible_is_transparent() {
    let Some(mut backend) = connect(Validation::Off) else { return };
    let full = plan(bumps(SampleFormat::Unorm8), rising(0.1), QuadratureRule::MidpointExponential, FAST);
    let transparent = Image::transparent(full.size());
    assert_eq!(backend.render(&nothing(&full)).unwrap().image, transparent);
    // By such a box rays are marched through the index, which is empty.
    let marched = with_visible(&nothing(&full), *full.domain());
    assert_eq!(backend.render(&marched).unwrap().image, transparent);
    assert_ne!(backend.render(&full).unwrap().image, transparent);
}

#[test]
fn a_replay_is_the_same_to_the_bit() {
    let Some(mut backend) = connect(Validation::Off) else { return };
    for mode in [Mode::Exact, FAST] {
        let plan = plan(bumps(SampleFormat::Unorm16), rising(0.02), QuadratureRule::Gauss2, mode);
        let first = backend.render(&plan).unwrap();
        let again = backend.render(&plan).unwrap();
        assert_eq!(first.image, again.image);
        assert!(first.timing.device_ms.is_none_or(|ms| ms > 0.0) && first.timing.wall_ms > 0.0);
    }
}

#[test]
fn a_picture_in_many_submits_is_the_same_to_the_bit() {
    let Some(mut backend) = connect(Validation::Off) else { return };
    let plan = plan(bumps(SampleFormat::Unorm16), rising(0.02), QuadratureRule::MidpointExponential, Mode::Exact);
    let whole = backend.render(&plan).unwrap();
    // By such a box a ray has 10^8 segments, and a row of workgroups is a submit of its own.
    let visible = Aabb { min: DVec3::splat(-1e8), max: DVec3::splat(1e8) };
    let bands = backend.render(&with_visible(&plan, visible)).unwrap();
    assert_eq!(whole.image, bands.image);
}

#[test]
fn a_slab_of_polygons_has_its_closed_form() {
    let Some(mut backend) = connect(Validation::Off) else { return };
    let transfer = TransferFunction::constant(0.07, [0.2, 0.4, 0.8]).unwrap();
    let rays = plan(ramp(SampleFormat::Unorm8), transfer, QuadratureRule::MidpointExponential, Mode::Exact);
    for placement in PLACEMENTS {
        for (target, tolerance) in [(Target::Float32, 2e-6), (Target::Float16, 1e-2)] {
            let frame = backend.render(&polygons(&rays, placement, target)).unwrap();
            let what = format!("{} {}", placement.name(), target.name());
            assert_close(&frame.image, layer(0.07 * 16.0, [0.2, 0.4, 0.8]), tolerance, &what);
        }
    }
}

#[test]
fn a_picture_of_many_small_copies_and_batches_is_the_same_to_the_bit() {
    let Some(mut whole) = connect(Validation::Off) else { return };
    let rays = plan(bumps(SampleFormat::Unorm16), rising(0.02), QuadratureRule::MidpointExponential, Mode::Exact);
    // One and two bricks at a time; three rows of pixels, and all; buffers in many pieces, and in one.
    for copy_bytes in [1000, 20_000] {
        let mut pieces = connect_with(&Options { copy_bytes, ..Options::default() }).unwrap();
        assert_eq!(whole.render(&rays).unwrap().image, pieces.render(&rays).unwrap().image);
        for target in [Target::Float32, Target::Float16] {
            let polygons = polygons(&rays, Placement::ViewportPlanes, target);
            let batches = polygons.clone().in_batches_of(7);
            assert!(batches.proxy().is_some_and(|proxy| proxy.batches().len() > 9));
            assert_eq!(whole.render(&polygons).unwrap().image, pieces.render(&batches).unwrap().image);
        }
    }
}
