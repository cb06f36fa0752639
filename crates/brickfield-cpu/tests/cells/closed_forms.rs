//! Pictures with closed forms, on sheared and polar grids, by both renderers.

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Ray, TransferFunction};
use brickfield_cpu::closed_form;
use brickfield_frame::QuadratureRule;

use crate::grids::*;

const N: UVec3 = UVec3::new(5, 4, 6);
const FROM: [DVec3; 3] = [DVec3::new(1.0, 0.7, 0.4), DVec3::new(-0.3, 1.0, -0.9), DVec3::new(0.0, 0.0, 1.0)];

fn foggy(extinction: f64, length: f64) -> [f64; 4] {
    closed_form::slab(fog(extinction).at(0.0), length)
}

#[test]
fn a_homogeneous_medium_in_sheared_cells_is_beer_lambert_over_the_chord() {
    let nodes = sheared(N, shear(), |p| p.x);
    let planes = box_planes(N, shear());
    let expected = |ray: &Ray| chord(ray, &planes).map(|[start, end]| foggy(0.4, end - start));
    for from in FROM {
        for camera in [framing(&nodes, from), parallel(&nodes, from)] {
            let view = view(camera, 24, fog(0.4), 0.37);
            hold(&plan(&nodes, &view), &view, expected);
        }
    }
}

#[test]
fn a_homogeneous_medium_in_a_ring_is_beer_lambert_over_both_parts_of_the_chord() {
    let (outer, inner) = (prism_planes(12, 2.0), prism_planes(12, 0.75));
    for nodes in [ring(UVec3::new(3, 12, 4), 0.75, |p| p.z), ring(UVec3::new(3, 12, 4), 0.75, |p| p.z).mirrored()] {
        let expected = |ray: &Ray| {
            let [length, gone] = [chord(ray, &outer)?, chord(ray, &inner)?].map(|[start, end]| end - start);
            Some(foggy(0.7, length - gone))
        };
        for from in FROM {
            let view = view(framing(&nodes, from), 24, fog(0.7), 0.2);
            hold_rounded(&nodes, &view, expected);
        }
    }
}

#[test]
fn cells_that_collapse_at_an_axis_have_no_seam_there() {
    let nodes = ring(UVec3::new(4, 12, 3), 0.0, |p| p.x);
    let planes = prism_planes(12, 2.0);
    let expected = |ray: &Ray| chord(ray, &planes).map(|[start, end]| foggy(0.7, end - start));
    for from in FROM {
        let view = view(framing(&nodes, from), 24, fog(0.7), 0.2);
        hold_rounded(&nodes, &view, expected);
    }
}

/// As [`hold`]: nodes of rings are rounded to f32, which moves the outline, and lengths at it, by 1e-7.
fn hold_rounded(nodes: &Nodes, view: &brickfield_frame::CellsView, expected: impl Fn(&Ray) -> Option<[f64; 4]>) {
    for (image, _) in both(&plan(nodes, view)) {
        for (i, (got, ray)) in image.pixels().iter().zip(&rays(view)).enumerate() {
            if let Some(expected) = expected(ray) {
                let off = distance(*got, expected);
                assert!(off <= 1e-5, "pixel {i}: {got:?} is not {expected:?}, off by {off}");
            }
        }
    }
}

/// Extinction and colour run linearly along every ray.
pub(crate) fn linear() -> TransferFunction {
    TransferFunction::new(vec![knot(-20.0, 0.0, [1.0, 0.1, 0.3]), knot(20.0, 0.8, [0.0, 1.0, 0.4])]).unwrap()
}

/// The integral over a chord in which the value is linear in space.
pub(crate) fn linear_over(ray: &Ray, [start, end]: [f64; 2], value: impl Fn(DVec3) -> f64) -> [f64; 4] {
    let optics = |t: f64| linear().at(value(ray.at(t)));
    closed_form::linear_extinction_and_color(optics(start), optics(end), end - start)
}

#[test]
fn a_linear_field_in_sheared_cells_has_its_closed_form() {
    let value = |p: DVec3| 0.5 * p.x - p.y + 0.75 * p.z;
    let nodes = sheared(N, shear(), value);
    let planes = box_planes(N, shear());
    let expected = |ray: &Ray| chord(ray, &planes).map(|span| linear_over(ray, span, value));
    for from in FROM {
        let view = ruled(view(framing(&nodes, from), 16, linear(), 0.02), QuadratureRule::Gauss2);
        hold(&plan(&nodes, &view), &view, expected);
    }
}
