//! The f32 renderer against the discrete f64 answer.

mod support;

use brickfield_core::glam::{DMat3, DVec3, UVec2, UVec3};
use brickfield_core::{Aabb, BrickSide, Camera, Grid, Image, Projection, ScalarType, TransferFunction, Volume};
use brickfield_cpu::{CpuBackend, Discrete, discrete};
use brickfield_frame::{Backend, Evaluate, FramePlan, Mode, ShaderFunction};
use brickfield_optics::QuadratureRule;
use proptest::prelude::*;
use support::{Setup, Skip, difference, knot};

fn render(plan: &FramePlan) -> Image<f64> {
    CpuBackend::new().render(plan).unwrap().image.map(f64::from)
}

/// Greatest difference beyond each pixel's ambiguity, and the share of pixels above 1e-5.
fn errors(got: &Image<f64>, expected: &Discrete) -> (f64, f64) {
    let pairs = got.pixels().iter().zip(expected.image.pixels()).zip(&expected.ambiguity);
    let excess: Vec<f64> = pairs.map(|((a, b), slack)| (difference(*a, *b) - slack).max(0.0)).collect();
    let above = excess.iter().filter(|e| **e > 1e-5).count() as f64 / excess.len() as f64;
    (excess.into_iter().fold(0.0, f64::max), above)
}

fn bumps(p: DVec3) -> f64 {
    127.0 + 60.0 * (p.x * 0.31).sin() * (p.y * 0.23).cos() + 60.0 * (p.z * 0.17 + p.x * 0.05).sin()
}

fn ramp() -> TransferFunction {
    TransferFunction::new(vec![
        knot(90.0, 0.0, [1.0, 0.2, 0.0]),
        knot(140.0, 0.3, [0.0, 0.8, 0.3]),
        knot(160.0, 0.0, [0.2, 0.1, 1.0]),
        knot(200.0, 1.5, [1.0, 1.0, 1.0]),
    ])
    .unwrap()
}

fn check(setup: &Setup) {
    let plan = setup.plan();
    let expected = discrete(&plan);
    let (worst, above) = errors(&render(&plan), &expected);
    assert!(worst <= 1e-4 && above <= 1e-3, "{}: {worst:e}, {above} above 1e-5", plan.sampling().rule().name());
}

#[test]
fn every_rule_and_format_is_within_tolerance() {
    for scalar in [ScalarType::U8, ScalarType::I16, ScalarType::F32, ScalarType::F64] {
        let volume = support::volume([40, 33, 50], DVec3::new(1.0, 0.8, 1.3), scalar, bumps);
        for rule in QuadratureRule::ALL {
            for skip in [Skip::Nothing, Skip::Transparent] {
                check(&Setup { rule, skip, ..Setup::new(&volume, ramp()) });
            }
        }
    }
}

#[test]
fn brick_sides_make_no_difference() {
    let volume = support::volume([70, 66, 80], DVec3::ONE, ScalarType::U16, bumps);
    let image = |side| render(&Setup { side, ..Setup::new(&volume, ramp()) }.plan());
    let first = image(BrickSide::S16);
    for side in [BrickSide::S32, BrickSide::S64] {
        let pairs = image(side);
        let worst = first.pixels().iter().zip(pairs.pixels()).map(|(a, b)| difference(*a, *b)).fold(0.0, f64::max);
        assert!(worst < 2e-6, "{side}: {worst:e}");
    }
}

#[test]
fn a_jump_of_the_transfer_function_is_within_its_ambiguity() {
    let volume = support::volume([40, 33, 50], DVec3::ONE, ScalarType::U8, bumps);
    let (red, blue) = ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
    let knots = vec![knot(127.0, 0.0, red), knot(127.0, 0.4, red), knot(150.0, 0.4, red), knot(150.0, 0.05, blue)];
    for rule in QuadratureRule::ALL {
        check(&Setup { rule, ..Setup::new(&volume, TransferFunction::new(knots.clone()).unwrap()) });
    }
}

#[test]
fn a_frame_without_anything_visible_is_empty() {
    let volume = support::volume([40, 33, 50], DVec3::ONE, ScalarType::U8, bumps);
    let tf = TransferFunction::constant(0.0, [1.0; 3]).unwrap();
    let plan = Setup { skip: Skip::Transparent, ..Setup::new(&volume, tf) }.plan();
    assert_eq!(render(&plan), Image::transparent(plan.size()));
    let expected = discrete(&plan);
    assert_eq!((expected.image, expected.n_visible_samples), (Image::transparent(plan.size()), 0));
    assert!(expected.n_samples > 0);
}

#[test]
fn fast_mode_loses_at_most_its_floor() {
    let volume = support::volume([64, 64, 64], DVec3::ONE, ScalarType::U8, bumps);
    let setup = Setup { mode: Mode::FAST, skip: Skip::Transparent, ..Setup::new(&volume, ramp()) };
    let (worst, _) = errors(&render(&setup.plan()), &discrete(&setup.plan()));
    assert!(worst <= 1.0 / 1024.0 + 1e-5, "{worst:e}");
}

#[test]
fn a_picture_beyond_the_limit_is_refused() {
    let volume = support::volume([20, 20, 20], DVec3::ONE, ScalarType::U8, bumps);
    let plan = Setup { size: UVec2::new(1 << 20, 1), ..Setup::new(&volume, ramp()) }.plan();
    assert!(CpuBackend::new().render(&plan).unwrap_err().to_string().contains("1048576 x 1"));
}

/// Extinctions that make one step's depth anything from 1e-12 to 1e12; thin, flat and far volumes; rays along the axes.
#[test]
fn extremes_stay_finite_and_within_the_hull() {
    let color = [0.25, 0.5, 1.0];
    for extinction in [1e-12, 1e-6, 1.0, 1e6, 1e12, 1e30] {
        let tf = TransferFunction::new(vec![knot(60.0, 0.0, color), knot(200.0, extinction, color)]).unwrap();
        for (dims, spacing) in [
            ([1, 1, 40], DVec3::ONE),
            ([40, 1, 1], DVec3::new(1.0, 1.0, 1000.0)),
            ([1, 1, 1], DVec3::ONE),
            ([20, 30, 17], DVec3::new(1.0, 1.0, 1e-3)),
        ] {
            let volume = support::volume(dims, spacing, ScalarType::U8, bumps);
            for from in [DVec3::X, DVec3::NEG_Z, DVec3::new(0.0, 1.0, 1.0), DVec3::new(1.0, 0.3, 0.2)] {
                for rule in QuadratureRule::ALL {
                    extreme(&volume, &tf, from, rule, color);
                }
            }
        }
    }
}

fn extreme(volume: &Volume, tf: &TransferFunction, from: DVec3, rule: QuadratureRule, color: [f64; 3]) {
    let step_world = volume.grid().world_box().diagonal() / 100.0;
    let size = UVec2::new(5, 6);
    for camera in [support::framing(volume, from), support::orthographic(volume, from)] {
        let plan = Setup { camera, rule, step_world, size, ..Setup::new(volume, tf.clone()) }.plan();
        for (image, tolerance) in [(discrete(&plan).image, 1e-14), (render(&plan), 1e-6)] {
            for p in image.pixels() {
                assert!(p.iter().all(|x| x.is_finite()) && (0.0..=1.0).contains(&p[3]), "{p:?}");
                let off = (0..3).map(|c| (p[c] - color[c] * p[3]).abs()).fold(0.0, f64::max);
                assert!(off <= tolerance * p[3].max(1e-300) + 1e-300 || off <= tolerance, "{p:?}");
            }
        }
    }
}

#[test]
fn a_far_origin_changes_nothing() {
    let spacing = DVec3::new(1.0, 1.0, 100.0);
    let picture = |origin: DVec3| {
        let grid = Grid::from_first_sample(UVec3::new(30, 20, 25), spacing, origin, DMat3::IDENTITY).unwrap();
        let volume = support::on_grid(grid, ScalarType::U8, bumps);
        let camera = support::framing(&volume, DVec3::new(1.0, 0.3, 0.2));
        render(&Setup { camera, step_world: 3.3, ..Setup::new(&volume, ramp()) }.plan())
    };
    let (near, far) = (picture(DVec3::ZERO), picture(DVec3::new(1e7, -1e7, 1e7)));
    let worst = near.pixels().iter().zip(far.pixels()).map(|(a, b)| difference(*a, *b)).fold(0.0, f64::max);
    assert!(worst < 1e-5 && near.pixels().iter().any(|p| p[3] > 0.5), "{worst:e}");
}

fn camera_of(volume: &Volume, kind: u8, eye: [f64; 3]) -> Camera {
    let b = volume.grid().world_box();
    let from = DVec3::from(eye) + DVec3::new(0.0, 0.0, 1e-3);
    match kind {
        0 => support::framing(volume, from),
        1 => support::orthographic(volume, from),
        _ => {
            let inside = b.center() + from * 0.3 * b.extent();
            Camera::look_at(inside, b.center(), DVec3::new(0.2, 1.0, 0.3), Projection::Perspective { fov_y: 1.3 })
                .unwrap()
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_plans_are_within_tolerance(
        dims in prop::array::uniform3(1u32..64),
        scalar in 0usize..4,
        rule in 0usize..5,
        kind in 0u8..3,
        eye in prop::array::uniform3(-1.0f64..1.0),
        levels in any::<u64>(),
        step in 0.1f64..3.0,
        low in prop::array::uniform3(-0.1f64..0.6),
        high in prop::array::uniform3(0.4f64..1.1),
        skip in any::<bool>(),
    ) {
        let scalar = [ScalarType::U8, ScalarType::U16, ScalarType::I16, ScalarType::F32][scalar];
        let volume = support::volume(dims, DVec3::new(1.0, 1.2, 0.7), scalar, bumps);
        let extent = volume.grid().dims().as_dvec3();
        let clip = Aabb { min: DVec3::from(low) * extent - 0.5, max: DVec3::from(high) * extent - 0.5 };
        let level = |cell: UVec3| (levels >> ((cell.x * 7 + cell.y * 13 + cell.z * 29) % 32 * 2) & 3) as u8;
        let rule = QuadratureRule::ALL[rule];
        // Transparent bricks beside bricks of another level are not for pre-integration, whose neighbours must be transparent too.
        let skip = if skip && rule != QuadratureRule::PreIntegrated { Skip::Transparent } else { Skip::Nothing };
        check(&Setup {
            rule,
            clip,
            skip,
            camera: camera_of(&volume, kind, eye),
            step_world: step,
            level: &level,
            size: UVec2::new(13, 11),
            ..Setup::new(&volume, ramp())
        });
    }

    #[test]
    fn skipping_transparent_bricks_changes_no_pixel(
        kind in 0u8..3,
        eye in prop::array::uniform3(-1.0f64..1.0),
        rule in 0usize..3,
        step in 0.2f64..2.0,
    ) {
        let ball = |p: DVec3| 255.0 * (-(p - DVec3::new(20.0, 40.0, 33.0)).length_squared() / 60.0).exp();
        let volume = support::volume([61, 50, 47], DVec3::ONE, ScalarType::U8, ball);
        let camera = camera_of(&volume, kind, eye);
        let tf = TransferFunction::new(vec![knot(40.0, 0.0, [1.0, 0.0, 0.0]), knot(200.0, 0.8, [0.0, 0.0, 1.0])]).unwrap();
        let plan = |skip| {
            let rule = QuadratureRule::ALL[rule];
            Setup { skip, camera, rule, step_world: step, ..Setup::new(&volume, tf.clone()) }.plan()
        };
        let (all, skipped) = (plan(Skip::Nothing), plan(Skip::Transparent));
        prop_assert!(skipped.field().slots().n_slots() < all.field().slots().n_slots());
        prop_assert_eq!(discrete(&all).image, discrete(&skipped).image);
        let (a, b) = (render(&all), render(&skipped));
        let worst = a.pixels().iter().zip(b.pixels()).map(|(a, b)| difference(*a, *b)).fold(0.0, f64::max);
        prop_assert!(worst <= 1e-6, "{:e}", worst);
    }
}

/// Specks in the dark: what rays pass over together must hold none of them, whatever the tile's opening.
#[test]
fn beams_miss_no_speck() {
    let tf = TransferFunction::new(vec![knot(40.0, 0.0, [1.0, 0.5, 0.0]), knot(250.0, 0.9, [0.0, 0.5, 1.0])]).unwrap();
    let mut seen = 0;
    for seed in 0..60u32 {
        let speck = |p: DVec3| {
            let [x, y, z] = p.as_uvec3().to_array();
            let hash = (x * 73 + y * 179 + z * 283 + seed * 7919).wrapping_mul(2_654_435_761) >> 12;
            if hash % 9001 < 3 { 255.0 } else { 0.0 }
        };
        let volume = support::volume([75, 60, 66], DVec3::new(1.0, 1.4, 0.8), ScalarType::U8, speck);
        let eye = [0.9, -0.35, 0.2].map(|x| x * f64::from(seed % 7 + 1) / 7.0);
        let bounds = volume.grid().world_box();
        let wide = Projection::Perspective { fov_y: 0.3 + 0.045 * f64::from(seed) };
        let inside = bounds.center() - DVec3::from(eye) * 0.4 * bounds.extent();
        let camera = match seed % 3 {
            0 => Camera::look_at(inside, bounds.center(), DVec3::Z, wide).unwrap(),
            kind => camera_of(&volume, kind as u8 - 1, eye),
        };
        let level = |cell: UVec3| if seed % 4 == 0 { (cell.x & 1) as u8 } else { 0 };
        let plan = Setup {
            camera,
            skip: Skip::Transparent,
            side: BrickSide::ALL[seed as usize % 3],
            rule: QuadratureRule::ALL[[2, 3, 4, 1][seed as usize % 4]],
            step_world: 0.2 + 0.03 * f64::from(seed),
            level: &level,
            size: UVec2::new(37, 30),
            ..Setup::new(&volume, tf.clone())
        }
        .plan();
        let expected = discrete(&plan);
        seen += expected.image.pixels().iter().filter(|p| p[3] > 1e-3).count();
        let (worst, _) = errors(&render(&plan), &expected);
        assert!(worst <= 2e-5, "picture {seed}: {worst:e}");
    }
    assert!(seen > 1000, "{seen}");
}

/// One function at a time, against its equation.
#[test]
fn functions_equal_their_equations() {
    let volume = support::volume([40, 33, 50], DVec3::new(1.0, 0.8, 1.3), ScalarType::U8, bumps);
    for rule in QuadratureRule::ALL {
        let plan = Setup { rule, ..Setup::new(&volume, ramp()) }.plan();
        let inputs: Vec<[f32; 4]> =
            (0..500).map(|i| [i as f32 * 0.51, 255.0 - i as f32 * 0.37, 0.1 + i as f32 * 0.01, 0.0]).collect();
        let got = CpuBackend::new().evaluate(&plan, ShaderFunction::Segment, &inputs).unwrap();
        for (input, got) in inputs.iter().zip(got) {
            let [a, b, length, _] = input.map(f64::from);
            let s = rule.segment(plan.transfer(), &[a, b], length);
            let expected = [s.emission[0], s.emission[1], s.emission[2], s.depth];
            assert!(difference(got.map(f64::from), expected) < 2e-6 * s.depth.max(1.0), "{got:?} {expected:?}");
        }
    }
    let plan = Setup::new(&volume, ramp()).plan();
    let inputs: Vec<[f32; 4]> = (0..200).map(|i| [i as f32 * 0.195, i as f32 * 0.16, i as f32 * 0.245, 0.0]).collect();
    let evaluate = |function| CpuBackend::new().evaluate(&plan, function, &inputs).unwrap();
    for (input, [value, resident, ..]) in inputs.iter().zip(evaluate(ShaderFunction::Sample)) {
        let [x, y, z, _] = input.map(f64::from);
        assert!((f64::from(value) - bumps(DVec3::new(x, y, z))).abs() < 1.5 && resident == 1.0);
    }
    for (input, got) in inputs.iter().zip(evaluate(ShaderFunction::Classify)) {
        let o = plan.transfer().at(f64::from(input[0]));
        assert!(difference(got.map(f64::from), [o.color[0], o.color[1], o.color[2], o.extinction]) < 1e-6);
    }
}

/// Two levels that disagree at their common face, and a ray that runs along it: either side's colour is right, and the
/// ambiguity says so.
#[test]
fn a_ray_along_a_face_between_levels_is_ambiguous_and_others_are_not() {
    // Level 1 takes every other sample: it sees none of the odd ones.
    let volume =
        support::volume([61, 31, 31], DVec3::ONE, ScalarType::U8, |p| if p.y % 2.0 == 1.0 { 200.0 } else { 0.0 });
    let tf = TransferFunction::new(vec![knot(0.0, 0.0, [1.0; 3]), knot(255.0, 0.5, [1.0; 3])]).unwrap();
    let level = |cell: UVec3| u8::from(cell.x >= 2);
    let picture = |x: f64| {
        // The face between the levels lies at sample 30, index 30.5.
        let eye = DVec3::new(x, 15.2, -20.0);
        let camera = Camera::look_at(eye, eye + DVec3::Z, DVec3::Y, Projection::Orthographic { height: 4.0 }).unwrap();
        discrete(&Setup { camera, level: &level, size: UVec2::ONE, ..Setup::new(&volume, tf.clone()) }.plan())
    };
    let (left, face, right) = (picture(30.4), picture(30.5), picture(30.6));
    let jump = difference(left.image.at(0, 0), right.image.at(0, 0));
    assert!(jump > 0.5 && face.ambiguity[0] >= jump, "{jump} {}", face.ambiguity[0]);
    assert_eq!((left.ambiguity[0], right.ambiguity[0]), (0.0, 0.0));
}

/// Rays in the plane of a face, where rounding puts nodes into blocks that the ray has left: no segment is lost.
#[test]
fn rays_along_a_face_between_bricks_see_every_segment() {
    let volume = support::volume([46, 46, 46], DVec3::ONE, ScalarType::U8, bumps);
    let eye = DVec3::new(20.5, 23.0, 30.5);
    let projection = Projection::Perspective { fov_y: 60f64.to_radians() };
    let up = DVec3::new(0.1, 0.2, 1.0);
    let camera = Camera::look_at(eye, eye + DVec3::X * 10.0, up, projection).unwrap();
    let thin = TransferFunction::constant(0.05, [1.0; 3]).unwrap();
    for transfer in [thin, ramp()] {
        check(&Setup { camera, size: UVec2::new(33, 17), ..Setup::new(&volume, transfer) });
    }
}

#[test]
fn a_backend_may_move_to_another_thread() {
    fn check<T: Send>() {}
    check::<CpuBackend>();
}
