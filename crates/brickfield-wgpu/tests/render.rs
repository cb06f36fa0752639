//! The backend against closed forms, and variants against each other. Prints `no device` where there is none.

mod support;

use std::sync::Arc;

use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{Level, TransferFunction};
use brickfield_frame::{
    Backend, Decode, Evaluate, Feature, FeatureSet, Field, FramePlan, Join, Mode, PlanParts, QuadratureRule,
    RenderError, SampleFormat, ShaderFunction, Slots, SpoiltPlan,
};
use brickfield_shaders::ShaderLibrary;
use brickfield_wgpu::WgpuBackend;
use support::{Setup, along_x, backend, knot, oblique, transfer};

const DIMS: UVec3 = UVec3::new(61, 31, 31);

fn pixels(backend: &mut WgpuBackend, plan: &FramePlan) -> Vec<[f32; 4]> {
    backend.render(plan).unwrap().image.pixels().to_vec()
}

fn difference(a: &[[f32; 4]], b: &[[f32; 4]]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter().flatten().zip(b.iter().flatten()).map(|(x, y)| (x - y).abs()).fold(0.0, f32::max)
}

/// From 0 to 1 along x.
fn ramp(q: DVec3) -> f64 {
    q.x / 60.0
}

/// A ball, 0 outside.
fn ball(q: DVec3) -> f64 {
    (1.0 - (q - DVec3::new(40.0, 12.0, 15.0)).length() / 11.0).max(0.0)
}

fn warm() -> TransferFunction {
    transfer(&[knot(0.0, 0.0, [0.1, 0.3, 1.0]), knot(0.4, 0.02, [0.2, 0.9, 0.3]), knot(1.0, 0.3, [1.0, 0.5, 0.1])])
}

#[test]
fn a_homogeneous_slab_has_its_closed_form() {
    let Some(mut backend) = backend() else { return };
    let (tau, color) = (0.03, [0.25, 0.5, 1.0]);
    let constant = TransferFunction::constant(tau, color).unwrap();
    let looked_up = transfer(&[knot(0.0, tau, color), knot(0.5, tau, color), knot(1.0, tau, color)]);
    let alpha = 1.0 - (-tau * 61.0).exp();
    let expected = [color[0] * alpha, color[1] * alpha, color[2] * alpha, alpha].map(|c| c as f32);
    for rule in QuadratureRule::ALL.into_iter().filter(|r| *r != QuadratureRule::LeftRiemann) {
        for transfer in [&constant, &looked_up] {
            // A step that does not divide the slab: the last segment is cut.
            let setup = Setup { camera: along_x(DIMS), rule, step: 0.7, ..Setup::new(DIMS, ramp, transfer.clone()) };
            let found = pixels(&mut backend, &setup.plan());
            assert!(difference(&found, &vec![expected; found.len()]) < 2e-6, "{}: {:?}", rule.name(), found[0]);
        }
    }
}

#[test]
fn a_ramp_has_the_depth_of_its_trapezoids_at_any_level() {
    let Some(mut backend) = backend() else { return };
    let tau = 0.1;
    let linear = transfer(&[knot(0.0, 0.0, [1.0; 3]), knot(1.0, tau, [1.0; 3])]);
    // Half a sample of the last value beyond the ramp; none of the first, which is 0.
    let alpha = (1.0 - (-tau * (30.0 + 0.5)).exp()) as f32;
    let levels: [fn(UVec3) -> Level; 3] = [|_| Level(0), |c| Level(u8::from(c.x >= 2)), |_| Level(1)];
    for level in levels {
        for format in [SampleFormat::Unorm16, SampleFormat::Float32] {
            let setup = Setup { camera: along_x(DIMS), format, level, ..Setup::new(DIMS, ramp, linear.clone()) };
            let found = pixels(&mut backend, &setup.plan());
            assert!(difference(&found, &vec![[alpha; 4]; found.len()]) < 3e-6, "{:?} {alpha}", found[0]);
        }
    }
}

#[test]
fn skipping_changes_no_bit() {
    let Some(mut backend) = backend() else { return };
    for rule in QuadratureRule::ALL.into_iter().filter(|r| *r != QuadratureRule::PreIntegrated) {
        for step in [0.3, 9.0] {
            let setup = Setup { rule, step, ..Setup::new(DIMS, ball, warm()) };
            let all = pixels(&mut backend, &setup.plan());
            let skipping = Setup { skip: true, ..setup }.plan();
            assert!(skipping.features().contains(Feature::SkipEmpty));
            assert_eq!(pixels(&mut backend, &skipping), all, "{} {step}", rule.name());
            assert!(all.iter().any(|p| p[3] > 0.1) && all.iter().any(|p| p[3] == 0.0));
        }
    }
}

#[test]
fn every_variant_renders_what_the_general_one_renders() {
    let Some(mut backend) = backend() else { return };
    let of_maps = [Feature::SkipDark, Feature::SkipBesideBeams];
    let of_light = [Feature::Light, Feature::LightBesideEye, Feature::StoredGradients];
    let unneeded = [Feature::HardwareFilter, Feature::EarlyTermination].into_iter().chain(of_maps).chain(of_light);
    let general = unneeded.fold(FeatureSet::all(), FeatureSet::without);
    for rule in QuadratureRule::ALL {
        for plan in [Setup::new(DIMS, ball, warm()), Setup { skip: true, ..Setup::new(DIMS, ball, warm()) }]
            .map(|setup| Setup { rule, ..setup }.plan())
        {
            let own = pixels(&mut backend, &plan);
            let mut spoilt = SpoiltPlan::of(&plan);
            spoilt.features = general;
            let all = pixels(&mut backend, &spoilt.into_plan());
            assert!(difference(&own, &all) <= 1e-6, "{} {}", rule.name(), difference(&own, &all));
        }
    }
}

#[test]
fn fast_mode_is_near_exact_mode() {
    let Some(mut backend) = backend() else { return };
    for format in [SampleFormat::Unorm8, SampleFormat::Unorm16, SampleFormat::Float32] {
        let exact = Setup { format, ..Setup::new(DIMS, ball, warm()) };
        let fast = Setup { mode: Mode::FAST, ..exact.clone() };
        let (exact, fast) = (pixels(&mut backend, &exact.plan()), pixels(&mut backend, &fast.plan()));
        assert!(difference(&exact, &fast) < 0.01, "{format:?}: {}", difference(&exact, &fast));
    }
}

#[test]
fn nothing_visible_is_a_transparent_picture() {
    let Some(mut backend) = backend() else { return };
    let plan = Setup { skip: true, ..Setup::new(DIMS, |_| 0.0, warm()) }.plan();
    assert_eq!(plan.field().slots().n_slots(), 0);
    assert!(pixels(&mut backend, &plan).iter().all(|p| *p == [0.0; 4]));
    // Functions can still be evaluated: the position is not resident.
    let sampled = backend.evaluate(&plan, ShaderFunction::Sample, &[[1.0, 2.0, 3.0, 0.0]]).unwrap();
    assert_eq!(sampled, [[0.0; 4]]);
}

#[test]
fn pictures_of_any_size_come_back_whole() {
    let Some(mut backend) = backend() else { return };
    let setup = Setup::new(DIMS, ball, warm());
    for size in [UVec2::new(1, 1), UVec2::new(17, 3), UVec2::new(64, 64), UVec2::new(129, 5), UVec2::new(5, 129)] {
        let frame = backend.render(&Setup { size, ..setup.clone() }.plan()).unwrap();
        assert_eq!(frame.image.size(), size);
        assert_eq!(frame.image.pixels().len(), (size.x * size.y) as usize);
        // The first picture of a backend has nothing to reuse.
        let fresh = support::backend().unwrap().render(&Setup { size, ..setup.clone() }.plan()).unwrap();
        assert_eq!(frame.image, fresh.image);
    }
    let limit = backend.describe().capabilities.max_image;
    let size = UVec2::new(limit + 1, 1);
    let plan = Setup { size, ..setup }.plan();
    assert_eq!(backend.render(&plan).unwrap_err(), RenderError::ImageTooLarge { size, limit });
}

#[test]
fn functions_answer_in_the_plans_units() {
    let Some(mut backend) = backend() else { return };
    // Data values far from 0, to which values in shaders are relative.
    let knots = [knot(1000.0, 0.0, [0.0; 3]), knot(1000.5, 0.02, [0.5; 3]), knot(1001.0, 0.3, [1.0; 3])];
    let parts = Setup::new(DIMS, ramp, transfer(&knots)).parts();
    let (slots, decode) = (parts.field.slots(), Decode { scale: 1.0, offset: 1000.0 });
    let slots = Slots::new(slots.format(), decode, slots.places().clone(), slots.all_samples().to_vec()).unwrap();
    let field = Field::new(DIMS, parts.field.index().clone(), Arc::new(slots), Join::Shared).unwrap();
    let plan = FramePlan::new(PlanParts { field, ..parts }).unwrap();
    let sampled = backend.evaluate(&plan, ShaderFunction::Sample, &[[30.0, 7.5, 3.25, 0.0]]).unwrap();
    assert_eq!(sampled, [[1000.5, 1.0, 0.0, 0.0]]);
    let classified = backend.evaluate(&plan, ShaderFunction::Classify, &[[1000.75, 0.0, 0.0, 0.0], [0.0; 4]]).unwrap();
    assert!((classified[0][3] - 0.16).abs() < 1e-6 && classified[1] == [0.0; 4], "{classified:?}");
    let depth = 2.0 * 0.16;
    let segment = backend.evaluate(&plan, ShaderFunction::Segment, &[[1000.75, 0.0, 2.0, 0.0]]).unwrap();
    assert!((segment[0][3] - depth).abs() < 1e-6 && (segment[0][0] - 0.75 * (1.0 - (-depth).exp())).abs() < 1e-6);
    let ray = plan.rays().ray(3, 5);
    let anchor = backend.evaluate(&plan, ShaderFunction::RayAnchor, &[[3.0, 5.0, 0.0, 0.0]]).unwrap()[0];
    let direction = backend.evaluate(&plan, ShaderFunction::RayDirection, &[[3.0, 5.0, 0.0, 0.0]]).unwrap()[0];
    assert!((DVec3::new(anchor[0].into(), anchor[1].into(), anchor[2].into()) - ray.anchor).length() < 1e-4);
    assert!((f64::from(anchor[3]) - ray.t_anchor).abs() < 1e-4);
    assert!((f64::from(direction[1]) - ray.direction.y).abs() < 1e-6 && direction[3] == 0.0);
}

#[test]
fn alpha_and_depth_keep_their_digits() {
    let Some(mut backend) = backend() else { return };
    let plan = Setup::new(DIMS, ramp, warm()).plan();
    let inputs: Vec<[f32; 4]> = (0..600).map(|i| [10f32.powf(i as f32 / 50.0 - 10.0), 0.0, 0.0, 0.0]).collect();
    let found = backend.evaluate(&plan, ShaderFunction::Alpha, &inputs).unwrap();
    for (x, y) in inputs.iter().zip(&found) {
        let expected = -f64::from(-x[0]).exp_m1();
        assert!((f64::from(y[0]) / expected - 1.0).abs() < 1e-6, "alpha({}) = {}", x[0], y[0]);
    }
    let opacities: Vec<[f32; 4]> = inputs.iter().map(|x| [x[0].min(0.99), 0.0, 0.0, 0.0]).collect();
    let found = backend.evaluate(&plan, ShaderFunction::Depth, &opacities).unwrap();
    for (x, y) in opacities.iter().zip(&found) {
        let expected = -f64::from(-x[0]).ln_1p();
        assert!((f64::from(y[0]) / expected - 1.0).abs() < 1e-6, "depth({}) = {}", x[0], y[0]);
    }
    let extremes = backend.evaluate(&plan, ShaderFunction::Alpha, &[[0.0; 4], [1e30, 0.0, 0.0, 0.0]]).unwrap();
    assert_eq!([extremes[0][0], extremes[1][0]], [0.0, 1.0]);
    let extremes = backend.evaluate(&plan, ShaderFunction::Depth, &[[0.0; 4], [1.0, 0.0, 0.0, 0.0]]).unwrap();
    assert_eq!([extremes[0][0], extremes[1][0]], [0.0, 88.0]);
}

#[test]
fn extreme_extinction_stays_finite() {
    let Some(mut backend) = backend() else { return };
    for rule in QuadratureRule::ALL {
        for tau in [1e-30, 1e12, 1e30] {
            let steep = transfer(&[knot(0.0, 0.0, [1.0; 3]), knot(0.5, tau, [1.0; 3]), knot(1.0, tau, [1.0; 3])]);
            let found = pixels(&mut backend, &Setup { rule, ..Setup::new(DIMS, ball, steep) }.plan());
            let sound = |p: &[f32; 4]| p.iter().all(|c| (0.0..=1.0).contains(c)) && (p[0] - p[3]).abs() < 1e-6;
            assert!(found.iter().all(sound), "{} {tau:e}", rule.name());
        }
    }
}

#[test]
fn a_mutant_library_is_rendered_and_a_broken_one_is_an_error() {
    let Some(mut backend) = backend() else { return };
    let plan = Setup { camera: oblique(DIMS), ..Setup::new(DIMS, ball, warm()) }.plan();
    let right = pixels(&mut backend, &plan);
    let library = ShaderLibrary::embedded();
    backend.set_library(library.patched("rays", "let at = pixel + 0.5 -", "let at = pixel -").unwrap());
    assert!(difference(&pixels(&mut backend, &plan), &right) > 1e-3);
    backend.set_library(library.patched("rays", "let at = pixel + 0.5 -", "let at = no_such_thing").unwrap());
    assert!(matches!(backend.render(&plan), Err(RenderError::Shader { .. })));
    backend.set_library(library);
    assert_eq!(pixels(&mut backend, &plan), right);
}
