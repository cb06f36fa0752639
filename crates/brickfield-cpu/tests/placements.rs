//! Segments between the surfaces of every placement, of whole rays and of bricks: f32 against f64, and laws of a constant
//! field (LaMar, Hamann and Joy 1999, section 4).

mod support;

use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{BrickSide, Camera, Grid, Image, Projection, ScalarType, TransferFunction, Volume};
use brickfield_cpu::{CpuBackend, discrete};
use brickfield_frame::{Backend, Division, Lengths, Placement};
use brickfield_optics::{QuadratureRule, alpha, depth};
use proptest::prelude::*;
use support::{Setup, difference, knot};

const PLACEMENTS: [Placement; 4] = [
    Placement::Shells,
    Placement::TessellatedShells { facet_pixels: 7 },
    Placement::ViewportPlanes,
    Placement::ObjectPlanes,
];

fn bumps(p: DVec3) -> f64 {
    127.0 + 60.0 * (p.x * 0.31).sin() * (p.y * 0.23).cos() + 60.0 * (p.z * 0.17 + p.x * 0.05).sin()
}

fn ramp() -> TransferFunction {
    let knots = vec![knot(70.0, 0.0, [1.0, 0.2, 0.0]), knot(140.0, 0.1, [0.0, 0.8, 0.3]), knot(220.0, 0.3, [1.0; 3])];
    TransferFunction::new(knots).unwrap()
}

fn cameras(grid: &Grid) -> Vec<Camera> {
    let b = grid.world_box();
    let at = |eye: DVec3, projection| Camera::look_at(eye, b.center(), DVec3::Z, projection).unwrap();
    let wide = Projection::Perspective { fov_y: 1.9 };
    vec![
        at(b.center() + DVec3::new(70.0, 31.0, 44.0), Projection::Perspective { fov_y: 0.7 }),
        at(b.min - DVec3::new(1.0, 0.5, 0.3), wide),
        at(b.min + 0.3 * b.extent(), wide),
        at(b.center() - DVec3::X * 60.0, Projection::Orthographic { height: 50.0 }),
        at(b.center() + DVec3::ONE * 60.0, Projection::Orthographic { height: 50.0 }),
    ]
}

/// Every way of sampling; `f` is told which.
fn each(mut f: impl FnMut(Placement, Division, Lengths)) {
    for placement in PLACEMENTS {
        for division in [Division::Ray, Division::Brick] {
            for lengths in [Lengths::True, Lengths::Nominal] {
                f(placement, division, lengths);
            }
        }
    }
}

/// Levels that change from block to block, by a hash.
fn mixed(cell: UVec3) -> u8 {
    ((cell.x.wrapping_mul(73) ^ cell.y.wrapping_mul(19) ^ cell.z.wrapping_mul(83)) % 4) as u8
}

#[test]
fn f32_is_within_tolerance_of_f64() {
    let volume = support::volume([70, 49, 61], DVec3::new(1.0, 0.8, 1.3), ScalarType::U8, bumps);
    for camera in cameras(volume.grid()) {
        each(|placement, division, lengths| {
            let setup = Setup { placement, division, lengths, camera, level: &mixed, ..Setup::new(&volume, ramp()) };
            let plan = setup.plan();
            let expected = discrete(&plan);
            let got = CpuBackend::new().render(&plan).unwrap().image.map(f64::from);
            for (i, (a, b)) in got.pixels().iter().zip(expected.image.pixels()).enumerate() {
                let off = difference(*a, *b) - expected.ambiguity[i];
                assert!(off < 2e-5, "{placement:?} {division:?} {lengths:?} {camera:?}, pixel {i}: {off:e}");
            }
            // Parallel rays along an axis meet a whole layer of middles on bricks' faces at once.
            let is_parallel = matches!(camera.projection(), Projection::Orthographic { .. });
            let has_layers = is_parallel && division == Division::Brick && placement != Placement::ObjectPlanes;
            let ambiguous = expected.ambiguity.iter().filter(|a| **a > 1e-4).count();
            let most = match lengths {
                Lengths::Nominal if has_layers => expected.ambiguity.len(),
                _ => expected.ambiguity.len() / 100,
            };
            assert!(ambiguous <= most, "{placement:?} {division:?} {lengths:?}: {ambiguous}");
        });
    }
}

#[test]
fn every_rule_divides_bricks() {
    let volume = support::volume([70, 49, 61], DVec3::ONE, ScalarType::U16, bumps);
    for rule in QuadratureRule::ALL {
        let setup = Setup { rule, division: Division::Brick, level: &mixed, ..Setup::new(&volume, ramp()) };
        let plan = setup.plan();
        let (expected, got) = (discrete(&plan), CpuBackend::new().render(&plan).unwrap().image.map(f64::from));
        let worst =
            got.pixels().iter().zip(expected.image.pixels()).map(|(a, b)| difference(*a, *b)).fold(0.0, f64::max);
        assert!(worst < 2e-5, "{}: {worst:e}", rule.name());
    }
}

fn constant(dims: [u32; 3]) -> Volume {
    support::volume(dims, DVec3::new(1.0, 1.2, 0.7), ScalarType::U8, |_| 100.0)
}

fn fog() -> TransferFunction {
    TransferFunction::constant(0.04, [0.9, 0.5, 0.1]).unwrap()
}

fn greatest(a: &Image<f64>, b: &Image<f64>) -> f64 {
    a.pixels().iter().zip(b.pixels()).map(|(a, b)| difference(*a, *b)).fold(0.0, f64::max)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    /// No seam at any mix of levels: depths add up to extinction times length, whatever surfaces cut the ray.
    #[test]
    fn a_constant_field_shows_no_cut(seed in any::<u32>(), step_world in 0.3f64..4.0, camera in 0usize..5) {
        let volume = constant([70, 49, 61]);
        let camera = cameras(volume.grid())[camera];
        let level = |cell: UVec3| (mixed(cell ^ UVec3::splat(seed)).wrapping_add(seed as u8)) % 4;
        let single = discrete(&Setup { camera, step_world, ..Setup::new(&volume, fog()) }.plan()).image;
        for placement in PLACEMENTS {
            let setup = Setup { camera, placement, division: Division::Brick, level: &level, step_world, ..Setup::new(&volume, fog()) };
            let difference = greatest(&discrete(&setup.plan()).image, &single);
            prop_assert!(difference < 1e-13, "{placement:?}: {difference:e}");
        }
    }
}

/// Optical depths of nominal lengths over true ones, at the picture's centre and at its corner.
fn nominal_over_true(placement: Placement, direction: DVec3, projection: Projection) -> [f64; 2] {
    let volume = support::volume([96, 96, 96], DVec3::ONE, ScalarType::U8, |_| 100.0);
    let center = volume.grid().world_box().center();
    let up = if direction.normalize().z.abs() > 0.9 { DVec3::Y } else { DVec3::Z };
    let camera = Camera::look_at(center - direction.normalize() * 10.0, center, up, projection).unwrap();
    let of = |lengths| {
        let setup = Setup {
            camera,
            placement,
            lengths,
            step_world: 1.0 / 64.0,
            size: UVec2::splat(9),
            side: BrickSide::S64,
            ..Setup::new(&volume, fog())
        };
        discrete(&setup.plan()).image
    };
    let (nominal, truth) = (of(Lengths::Nominal), of(Lengths::True));
    [40, 0].map(|i| depth(nominal.pixels()[i][3]) / depth(truth.pixels()[i][3]))
}

/// Figure 8: what uncorrected planes lose, and where.
#[test]
fn nominal_lengths_lose_the_cosine_to_the_planes() {
    let close = |a: f64, b: f64| assert!((a - b).abs() < 2e-3, "{a} {b}");
    let wide = Projection::Perspective { fov_y: 1.2 };
    let parallel = Projection::Orthographic { height: 8.0 };
    let corner_cosine = 1.0 / (1.0 + 2.0 * (0.6f64.tan() * 8.0 / 9.0).powi(2)).sqrt();
    // Shells: right everywhere. Viewport planes: right at the centre, too thin by the cosine towards the corners.
    let [centre, corner] = nominal_over_true(Placement::Shells, DVec3::new(1.0, 0.4, 0.2), wide);
    close(centre, 1.0);
    close(corner, 1.0);
    let [centre, corner] = nominal_over_true(Placement::ViewportPlanes, DVec3::new(1.0, 0.4, 0.2), wide);
    close(centre, 1.0);
    close(corner, corner_cosine);
    let [centre, corner] = nominal_over_true(Placement::ViewportPlanes, DVec3::new(1.0, 0.4, 0.2), parallel);
    close(centre, 1.0);
    close(corner, 1.0);
    // Object planes: worst at 45 degrees (two axes), where they lose 1 - 1 / sqrt 2 of the depth.
    let of_angle = |degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        nominal_over_true(Placement::ObjectPlanes, DVec3::new(cos, sin, 0.0), parallel)[0]
    };
    for degrees in [0.0, 15.0, 30.0, 45.0f64, 60.0, 90.0] {
        let to_nearest_axis = degrees.min(90.0 - degrees).to_radians();
        close(of_angle(degrees), to_nearest_axis.cos());
    }
    assert!([0.0, 20.0, 40.0, 50.0, 70.0, 90.0].into_iter().all(|degrees| of_angle(degrees) > of_angle(45.0)));
    assert!(alpha(of_angle(45.0)) < alpha(1.0), "uncorrected planes are too transparent");
}
