//! Observed orders of accuracy of the discrete sum, against the continuous answer and closed forms.

#[path = "support/slope.rs"]
mod slope;
mod support;

use brickfield_core::glam::{DVec3, UVec2};
use brickfield_core::{Camera, Projection, ScalarType, TransferFunction, Volume};
use brickfield_cpu::{ContinuousOptions, closed_form, continuous, discrete};
use brickfield_optics::QuadratureRule;
use slope::slope;
use support::{Setup, difference, knot, whole};

/// Every rule has its order in the step, on rays along an axis through a field that is smooth along them: linear in each
/// cell and the same slope in all, so that no face is a kink, and exact in f32, as bricks store it.
#[test]
fn every_rule_converges_to_the_continuous_answer_with_its_order() {
    let volume = support::volume([3, 3, 17], DVec3::ONE, ScalarType::F64, |p| p.z);
    let tf = TransferFunction::new(vec![knot(-20.0, 0.0, [1.0, 0.1, 0.3]), knot(40.0, 0.9, [0.0, 1.0, 0.4])]).unwrap();
    let b = volume.grid().world_box();
    let eye = b.center() - DVec3::new(0.0, 0.0, 20.0);
    let camera = Camera::look_at(eye, b.center(), DVec3::Y, Projection::Orthographic { height: 2.0 }).unwrap();
    let size = UVec2::new(3, 3);
    // Without the clamped half voxels, which have a kink.
    let clip = brickfield_core::Aabb { min: DVec3::new(0.0, 0.0, 0.25), max: DVec3::new(2.0, 2.0, 15.75) };
    let exact = continuous(&volume, &tf, &camera, size, &clip, &ContinuousOptions::default()).image;
    for rule in QuadratureRule::ALL {
        let error = |halvings: i32| {
            let step_world = 15.5 / 8.0 / 2f64.powi(halvings);
            let image =
                discrete(&Setup { camera, size, clip, step_world, rule, ..Setup::new(&volume, tf.clone()) }.plan())
                    .image;
            let pairs = image.pixels().iter().zip(exact.pixels());
            pairs.map(|(a, b)| difference(*a, *b)).fold(0.0, f64::max)
        };
        let errors: Vec<f64> = (0..6).map(error).collect();
        let order = slope(&errors);
        assert!((order - f64::from(rule.order())).abs() < 0.1, "{}: order {order}, {errors:?}", rule.name());
    }
}

/// A Gaussian ball of unit radius, sampled by n^3 voxels.
fn ball(n: u32) -> Volume {
    let spacing = 8.0 / f64::from(n);
    let at = move |p: DVec3| (-((p + 0.5) * spacing - 4.0).length_squared()).exp();
    support::volume([n; 3], DVec3::splat(spacing), ScalarType::F64, at)
}

/// Grid refinement: the trilinear field is of order 2. The step is so small that it plays no part, the continuous answer has
/// none.
#[test]
fn grid_refinement_is_of_order_two() {
    let color = [1.0, 0.5, 0.25];
    let tf = TransferFunction::new(vec![knot(0.0, 0.0, color), knot(1.0, 0.8, color)]).unwrap();
    let size = UVec2::new(4, 4);
    let (mut sums, mut integrals) = (vec![], vec![]);
    for n in [8, 16, 32, 64, 128] {
        let volume = ball(n);
        let center = volume.grid().world_box().center();
        let camera = Camera::look_at(
            center + DVec3::new(7.0, 5.0, 3.0),
            center,
            DVec3::Z,
            Projection::Orthographic { height: 3.0 },
        )
        .unwrap();
        let rays = camera.pixel_rays(size);
        let exact = |i: usize| {
            let ray = rays.pixel_ray(i as u32 % 4, i as u32 / 4);
            let to = center - ray.origin;
            let impact = (to - ray.direction * to.dot(ray.direction)).length();
            closed_form::one_color(closed_form::gaussian_ball_depth(0.8, 1.0, impact, 4.0), color)
        };
        let error = |image: &brickfield_core::Image<f64>| {
            image.pixels().iter().enumerate().map(|(i, p)| difference(*p, exact(i))).fold(0.0, f64::max)
        };
        let setup = Setup { camera, size, step_world: 2e-3, ..Setup::new(&volume, tf.clone()) };
        sums.push(error(&discrete(&setup.plan()).image));
        integrals.push(error(
            &continuous(&volume, &tf, &camera, size, &whole(&volume), &ContinuousOptions::default()).image,
        ));
    }
    for errors in [&sums[1..], &integrals[1..]] {
        assert!((slope(errors) - 2.0).abs() < 0.1, "order {}, {errors:?}", slope(errors));
    }
}
