//! The continuous f64 answer against closed forms.

mod support;

use brickfield_core::glam::{DMat3, DVec3, UVec2, UVec3};
use brickfield_core::{Aabb, Camera, Grid, Optics, Projection, Ray, ScalarType, TransferFunction, Volume};
use brickfield_cpu::{ContinuousOptions, RayIntegral, closed_form, continuous, continuous_ray};
use proptest::prelude::*;
use support::{difference, knot, whole};

const TIGHT: f64 = 1e-12;

fn options() -> ContinuousOptions {
    ContinuousOptions::default()
}

/// A column of samples along z whose values are their own positions: the field is z.
fn ladder(n: u32) -> Volume {
    support::volume([2, 3, n], DVec3::ONE, ScalarType::F64, |p| p.z)
}

/// A ray up the column, from z = `from` to `to` (sample space), at one voxel per world unit.
fn up(volume: &Volume, transfer: &TransferFunction, from: f64, to: f64) -> RayIntegral {
    let ray = Ray { origin: DVec3::new(0.3, 1.2, -10.0), direction: DVec3::Z };
    let clip = Aabb { min: DVec3::new(-9.0, -9.0, from), max: DVec3::new(9.0, 9.0, to) };
    continuous_ray(volume, transfer, &ray, &clip, &options())
}

fn optics(extinction: f64, color: [f64; 3]) -> Optics {
    Optics { extinction, color }
}

#[track_caller]
fn close(got: RayIntegral, expected: [f64; 4], tolerance: f64) {
    let d = difference(got.rgba, expected);
    assert!(d <= tolerance, "{:?} instead of {expected:?}: {d:e}", got.rgba);
    assert!(got.error <= 1e-10, "error estimate {:e}", got.error);
}

#[test]
fn a_homogeneous_slab() {
    let volume = ladder(20);
    for extinction in [1e-12, 1e-3, 0.1, 3.0, 1e6] {
        let tf = TransferFunction::constant(extinction, [0.2, 0.5, 1.0]).unwrap();
        let medium = optics(extinction, [0.2, 0.5, 1.0]);
        close(up(&volume, &tf, -9.0, 99.0), closed_form::slab(medium, 20.0), 1e-13);
        close(up(&volume, &tf, 3.25, 7.5), closed_form::slab(medium, 4.25), 1e-13);
    }
}

#[test]
fn linear_extinction_of_one_colour() {
    let volume = ladder(20);
    let color = [0.2, 0.5, 1.0];
    let tf = TransferFunction::new(vec![knot(0.0, 0.3, color), knot(19.0, 0.01, color)]).unwrap();
    let at = |z: f64| tf.at(z).extinction;
    close(up(&volume, &tf, 1.5, 17.3), closed_form::linear_extinction(at(1.5), at(17.3), 15.8, color), TIGHT);
}

#[test]
fn linear_extinction_and_colour() {
    let volume = ladder(20);
    for (a, b) in [(0.0, 0.2), (0.3, 0.0), (0.1, 0.1001), (5.0, 0.0), (0.0, 40.0), (1e-9, 0.0), (2.0, 2.0), (1e4, 1e3)]
    {
        let tf = TransferFunction::new(vec![knot(0.0, a, [1.0, 0.0, 0.3]), knot(19.0, b, [0.0, 1.0, 0.4])]).unwrap();
        for (from, to) in [(0.0, 19.0), (2.25, 6.5), (7.1, 7.4)] {
            let expected = closed_form::linear_extinction_and_color(tf.at(from), tf.at(to), to - from);
            close(up(&volume, &tf, from, to), expected, TIGHT);
        }
    }
}

#[test]
fn layers_by_jumps() {
    let volume = ladder(20);
    let (red, green, blue) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    let knots = vec![knot(3.3, 0.1, red), knot(3.3, 0.5, green), knot(8.0, 0.5, green), knot(8.0, 0.02, blue)];
    let tf = TransferFunction::new(knots).unwrap();
    let layers = [(optics(0.1, red), 2.3), (optics(0.5, green), 4.7), (optics(0.02, blue), 11.5)];
    close(up(&volume, &tf, 1.0, 99.0), closed_form::layers(&layers), TIGHT);
}

#[test]
fn a_thin_opaque_shell_is_not_missed() {
    let volume = ladder(20);
    let knots = vec![
        knot(5.0, 0.0, [0.0; 3]),
        knot(5.0, 1e6, [1.0, 0.5, 0.0]),
        knot(5.002, 1e6, [1.0, 0.5, 0.0]),
        knot(5.002, 0.0, [0.0; 3]),
    ];
    close(up(&volume, &TransferFunction::new(knots).unwrap(), 0.0, 19.0), [1.0, 0.5, 0.0, 1.0], TIGHT);
}

#[test]
fn the_clamped_half_voxels_are_constant() {
    let volume = ladder(4);
    let tf = TransferFunction::new(vec![knot(0.0, 0.0, [1.0; 3]), knot(3.0, 3.0, [1.0; 3])]).unwrap();
    let expected = closed_form::one_color(0.5 * 3.0 * 3.0 + 0.5 * 3.0, [1.0; 3]);
    close(up(&volume, &tf, -9.0, 99.0), expected, TIGHT);
}

fn bumps(p: DVec3) -> f64 {
    (p.x * 0.9).sin() * (p.y * 0.7).cos() + (p.z * 1.1 + p.x * 0.4).sin()
}

fn colourful() -> TransferFunction {
    TransferFunction::new(vec![
        knot(-0.5, 0.0, [1.0, 0.2, 0.0]),
        knot(0.1, 0.7, [0.0, 0.8, 0.3]),
        knot(0.3, 0.0, [0.2, 0.1, 1.0]),
        knot(0.6, 0.0, [0.2, 0.1, 1.0]),
        knot(0.6, 2.0, [1.0; 3]),
    ])
    .unwrap()
}

/// Midpoint sums of ever smaller steps, extrapolated: an answer with nothing in common but the model.
fn brute(volume: &Volume, tf: &TransferFunction, ray: &Ray, clip: &Aabb, n: u32) -> [f64; 4] {
    let Some(span) = ray.clip(&whole(volume).intersection(clip)) else { return [0.0; 4] };
    let h = (span.end - span.start) / f64::from(n);
    let mut state = brickfield_optics::RayState::default();
    for k in 0..n {
        let value = trilinear(volume, ray.at(span.start + (f64::from(k) + 0.5) * h));
        state.push(brickfield_optics::QuadratureRule::MidpointExponential.segment(tf, &[value], h));
    }
    state.rgba()
}

fn trilinear(volume: &Volume, q: DVec3) -> f64 {
    let dims = volume.grid().dims();
    let q = q.clamp(DVec3::ZERO, (dims - 1).as_dvec3());
    let low = q.floor();
    let f = q - low;
    let mut sum = 0.0;
    for c in 0..8u32 {
        let up = UVec3::new(c & 1, c >> 1 & 1, c >> 2);
        let at = (low.as_uvec3() + up).min(dims - 1);
        let w = DVec3::select(up.cmpeq(UVec3::ONE), f, 1.0 - f).element_product();
        sum += w * volume.voxels().at((at.x + dims.x * (at.y + dims.y * at.z)) as usize);
    }
    sum
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn brute_force_comes_to_the_same(
        from in prop::array::uniform3(-3.0f64..12.0),
        to in prop::array::uniform3(0.0f64..8.0),
        dims in prop::array::uniform3(1u32..10),
    ) {
        let volume = support::volume(dims, DVec3::ONE, ScalarType::F64, bumps);
        let (from, to) = (DVec3::from(from), DVec3::from(to));
        prop_assume!((to - from).length() > 1.0);
        let ray = Ray { origin: from, direction: (to - from).normalize() };
        let clip = Aabb { min: DVec3::splat(0.2), max: DVec3::splat(7.7) };
        for clip in [clip, whole(&volume)] {
            let expected = brute(&volume, &colourful(), &ray, &clip, 200_000);
            let got = continuous_ray(&volume, &colourful(), &ray, &clip, &options());
            prop_assert!(difference(got.rgba, expected) < 3e-5, "{:?} {:?}", got, expected);
        }
    }

    #[test]
    fn split_at_any_point_equals_the_whole(x in 0.5f64..8.0, z in 0.5f64..9.0) {
        let volume = support::volume([9, 8, 10], DVec3::ONE, ScalarType::F64, bumps);
        let ray = Ray { origin: DVec3::new(x - 1.5, 3.3, -4.0), direction: DVec3::new(0.1, 0.2, 1.0) };
        let part = |low: f64, high: f64| {
            let clip = Aabb { min: DVec3::new(-9.0, -9.0, low), max: DVec3::new(99.0, 99.0, high) };
            continuous_ray(&volume, &colourful(), &ray, &clip, &options()).rgba
        };
        let joined = closed_form::over(part(-9.0, z), part(z, 99.0));
        prop_assert!(difference(joined, part(-9.0, 99.0)) < TIGHT);
    }

    #[test]
    fn skipping_blocks_changes_nothing(x in -1.0f64..1.0, y in -1.0f64..1.0, extinction in 0.01f64..10.0) {
        let ball = |p: DVec3| (-(p - DVec3::new(20.0, 12.0, 17.0)).length_squared() / 30.0).exp();
        let volume = support::volume([37, 25, 33], DVec3::new(1.0, 1.5, 0.7), ScalarType::F64, ball);
        let knots = vec![knot(0.2, 0.0, [1.0, 0.0, 0.0]), knot(0.9, extinction, [0.0, 0.0, 1.0])];
        let tf = TransferFunction::new(knots).unwrap();
        for camera in [support::framing(&volume, DVec3::new(x, y, 0.6)), support::orthographic(&volume, DVec3::new(x, 0.1, y))] {
            let size = UVec2::new(9, 7);
            let picture = continuous(&volume, &tf, &camera, size, &whole(&volume), &options());
            prop_assert!(picture.error < 1e-10);
            let grid = volume.grid();
            for (i, pixel) in picture.image.pixels().iter().enumerate() {
                let world = camera.pixel_rays(size).pixel_ray(i as u32 % 9, i as u32 / 9);
                let origin = brickfield_core::SamplePos::from(grid.index(brickfield_core::WorldPos(world.origin))).0;
                let direction = grid.world_to_index().transform_vector3(world.direction);
                let got = continuous_ray(&volume, &tf, &Ray { origin, direction }, &whole(&volume), &options());
                prop_assert!(difference(got.rgba, *pixel) < 1e-11, "{:?} {:?}", got.rgba, pixel);
            }
        }
    }
}

#[test]
fn one_colour_is_exact_for_any_field() {
    let volume = support::volume([9, 8, 10], DVec3::ONE, ScalarType::F64, bumps);
    let color = [0.25, 0.5, 1.0];
    for scale in [1e-12, 1.0, 1e3, 1e12] {
        let tf = TransferFunction::new(vec![knot(-1.0, 0.0, color), knot(1.5, scale, color)]).unwrap();
        let camera = support::framing(&volume, DVec3::new(1.0, 0.4, 0.2));
        let picture = continuous(&volume, &tf, &camera, UVec2::splat(16), &whole(&volume), &options());
        for [r, g, b, a] in picture.image.pixels() {
            let worst = [(r, 0), (g, 1), (b, 2)].map(|(x, c)| (x - color[c] * a).abs()).into_iter().fold(0.0, f64::max);
            assert!((0.0..=1.0).contains(a) && worst <= 1e-12 * a, "{worst:e} of {a}");
        }
    }
}

#[test]
fn a_far_origin_and_flat_voxels_cost_no_digits() {
    let color = [0.3, 0.6, 1.0];
    let tf = TransferFunction::new(vec![knot(0.0, 0.0, color), knot(11.0, 0.004, color)]).unwrap();
    let spacing = DVec3::new(1.0, 1.0, 1000.0);
    let make = |origin: DVec3| {
        let grid = Grid::from_first_sample(UVec3::new(12, 10, 12), spacing, origin, DMat3::IDENTITY).unwrap();
        support::on_grid(grid, ScalarType::F64, |p| p.z)
    };
    let picture = |origin: DVec3| {
        let volume = make(origin);
        let projection = Projection::Orthographic { height: 1000.0 };
        let center = origin + spacing * 5.0;
        let eye = center + DVec3::new(3e4, 0.0, 0.0);
        let camera = Camera::look_at(eye, center, DVec3::Z, projection).unwrap();
        continuous(&volume, &tf, &camera, UVec2::new(5, 9), &whole(&volume), &options()).image
    };
    let (near, far) = (picture(DVec3::ZERO), picture(DVec3::new(1e7, -1e7, 1e7)));
    assert!(near.pixels().iter().any(|p| p[3] > 0.01));
    for (a, b) in near.pixels().iter().zip(far.pixels()) {
        assert!(difference(*a, *b) < 1e-10);
    }
}
