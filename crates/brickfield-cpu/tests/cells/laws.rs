//! Laws: what must not change a picture, and what must.

use std::sync::Arc;

use brickfield_core::glam::{DMat3, DVec3, UVec2, UVec3};
use brickfield_core::{Camera, Grid, Image, Projection, Ray, TransferFunction, Volume};
use brickfield_cpu::{closed_form, discrete, discrete_cells};
use brickfield_frame::{CellsView, Mode, QuadratureRule, Sampling};

use crate::grids::*;
use crate::support::{Setup, Skip};

const FROM: DVec3 = DVec3::new(1.0, 0.7, 0.4);

fn foggy(extinction: f64, length: f64) -> [f64; 4] {
    closed_form::slab(fog(extinction).at(0.0), length)
}

fn waves(p: DVec3) -> f64 {
    (3.0 * p.x).sin() + (4.0 * p.y).cos() * p.z
}

fn peaks() -> TransferFunction {
    let knots = vec![
        knot(-0.5, 0.0, [1.0, 0.1, 0.3]),
        knot(0.2, 3.0, [0.0, 1.0, 0.4]),
        knot(0.4, 0.0, [0.0, 1.0, 0.4]),
        knot(0.7, 0.0, [0.0, 0.0, 1.0]),
        knot(1.0, 8.0, [0.9, 0.9, 1.0]),
    ];
    TransferFunction::new(knots).unwrap()
}

fn greatest_difference(a: &Image<f64>, b: &Image<f64>) -> f64 {
    a.pixels().iter().zip(b.pixels()).map(|(a, b)| distance(*a, *b)).fold(0.0, f64::max)
}

#[test]
fn no_ray_slips_between_bent_cells() {
    let planes = box_planes(UVec3::ONE, DMat3::IDENTITY);
    let expected = |ray: &Ray| chord(ray, &planes).map(|[start, end]| foggy(3.0, end - start));
    for seed in 0..12 {
        let nodes = bent(UVec3::new(5, 6, 4), seed, waves);
        let view = view(framing(&nodes, FROM), 24, fog(3.0), 0.1);
        hold(&plan(&nodes, &view), &view, expected);
    }
}

/// Rays through nodes, along edges and in faces: pixels of 1/16, cells of 1/4 and 1/2, seen along an axis.
#[test]
fn no_ray_slips_through_corners_edges_and_faces() {
    let nodes = Nodes::new(UVec3::new(4, 2, 4), |node| node.as_dvec3() / DVec3::new(4.0, 2.0, 4.0), waves);
    for (axis, up) in [(DVec3::X, DVec3::Y), (DVec3::Y, DVec3::Z), (DVec3::Z, DVec3::X)] {
        let center = DVec3::splat(0.5);
        for shift in [0.0, 1.0 / 32.0] {
            let eye = center + axis * 2.0 + (up + up.cross(axis)) * shift;
            let camera = Camera::look_at(eye, eye - axis, up, Projection::Orthographic { height: 2.0 }).unwrap();
            let view = view(camera, 32, fog(3.0), 0.1);
            let across = |ray: &Ray| {
                let from_center = (ray.at(2.0) - center).abs();
                let across = from_center - from_center * axis.abs();
                // In an outer face a ray is inside or outside.
                let reach = across.max_element();
                ((reach - 0.5).abs() > 1e-9).then(|| foggy(3.0, if reach < 0.5 { 1.0 } else { 0.0 }))
            };
            let plan = plan(&nodes, &view);
            for (image, tolerance) in both(&plan) {
                for (got, ray) in image.pixels().iter().zip(rays(&view)) {
                    if let Some(expected) = across(&ray) {
                        assert!(distance(*got, expected) <= tolerance, "{ray:?}: {got:?} is not {expected:?}");
                    }
                }
            }
        }
    }
}

/// Rays exactly through nodes and edges of cells of all shapes: x and y of nodes, and pixels, are whole sixteenths; the sides are plane.
#[test]
fn no_ray_slips_through_corners_of_skew_cells() {
    let n = UVec3::splat(4);
    for seed in 0..16u32 {
        let noise = |node: UVec3, axis: u32| {
            let bits = (node.x + 5 * node.y + 25 * node.z + 125 * axis + 500 * seed).wrapping_mul(2_654_435_761);
            f64::from((bits ^ bits >> 15) % 3) - 1.0
        };
        let at = |node: UVec3| {
            let is_inner = node.cmpgt(UVec3::ZERO).all() && node.cmplt(n).all();
            let moved = DVec3::new(noise(node, 0), noise(node, 1), 1.3 * noise(node, 2)) / 16.0;
            node.as_dvec3() / 4.0 + if is_inner { moved } else { DVec3::ZERO }
        };
        let nodes = Nodes::new(n, at, waves);
        let eye = DVec3::new(0.5 + 1.0 / 32.0, 0.5 + 1.0 / 32.0, 3.0);
        let camera = Camera::look_at(eye, eye - DVec3::Z, DVec3::Y, Projection::Orthographic { height: 2.0 }).unwrap();
        let view = view(camera, 32, fog(3.0), 0.1);
        for (image, tolerance) in both(&plan(&nodes, &view)) {
            for (got, ray) in image.pixels().iter().zip(rays(&view)) {
                let reach = (ray.origin.truncate() - 0.5).abs().max_element();
                if (reach - 0.5).abs() > 1e-9 {
                    let expected = foggy(3.0, if reach < 0.5 { 1.0 } else { 0.0 });
                    assert!(distance(*got, expected) <= tolerance, "{ray:?}: {got:?} is not {expected:?}");
                }
            }
        }
    }
}

/// A node in the middle lies anywhere, and takes the eight cells around it with it.
#[test]
fn cells_at_holes_are_left_out() {
    let n = UVec3::splat(4);
    let garbage = |node: UVec3| if node == UVec3::splat(2) { DVec3::splat(1e20) } else { node.as_dvec3() };
    let nodes = Nodes::new(n, garbage, |_| 1.0).with_holes(|node| node == UVec3::splat(2));
    let (whole, gone) = (box_planes(n, DMat3::IDENTITY), {
        let shifted = box_planes(UVec3::splat(2), DMat3::IDENTITY);
        shifted.into_iter().map(|(normal, d)| (normal, d + normal.dot(DVec3::ONE))).collect::<Vec<_>>()
    });
    let expected = |ray: &Ray| {
        let [length, gone] = [chord(ray, &whole)?, chord(ray, &gone)?].map(|[start, end]| end - start);
        Some(foggy(0.4, length - gone))
    };
    let solid = Nodes::new(n, |node| node.as_dvec3(), |_| 1.0);
    for from in [FROM, -FROM] {
        let view = view(framing(&solid, from), 24, fog(0.4), 0.3);
        hold(&plan(&nodes, &view), &view, expected);
    }
}

/// A layer of nodes that is there twice, with other cells' values between, has no way in it.
#[test]
fn cells_without_volume_add_nothing() {
    let even = |n: UVec3, layers: [u32; 3]| {
        let at = move |node: UVec3| {
            let index = [0, 1, 2].map(|axis| node[axis] - u32::from(node[axis] > layers[axis]));
            shear() * UVec3::from(index).as_dvec3()
        };
        Nodes::new(n, at, waves)
    };
    let plain = even(UVec3::new(4, 3, 5), [9; 3]);
    let view = view(framing(&plain, FROM), 32, peaks(), 0.05);
    let expected = discrete_cells(&plan(&plain, &view)).image;
    for layers in [[2, 9, 9], [9, 0, 9], [9, 9, 4], [1, 2, 3]] {
        let n = UVec3::new(4, 3, 5) + UVec3::from(layers.map(|layer| u32::from(layer < 9)));
        for (image, _) in both(&plan(&even(n, layers), &view)) {
            assert!(greatest_difference(&image, &expected) < 1e-5, "{layers:?}");
        }
    }
}

#[test]
fn a_left_handed_grid_has_the_picture_of_the_right_handed_one() {
    let nodes = ring(UVec3::new(5, 16, 4), 0.5, waves);
    let view = view(framing(&nodes, FROM), 32, peaks(), 0.05);
    let [a, b] = [&nodes, &nodes.mirrored()].map(|nodes| plan(nodes, &view));
    // The faces of the mirrored grid are cut along their other diagonals; those of a ring are plane but for its bottom and top.
    assert!(greatest_difference(&discrete_cells(&a).image, &discrete_cells(&b).image) < 1e-6);
    assert!(greatest_difference(&fast(&a), &fast(&b)) < 2e-4);
}

#[test]
fn far_origins_change_nothing() {
    let nodes = bent(UVec3::splat(4), 7, waves);
    let near = view(framing(&nodes, FROM), 24, peaks(), 0.05);
    let expected = discrete_cells(&plan(&nodes, &near));
    let away = DVec3::new(1e7, -3e7, 2e7);
    let camera = Camera::look_at(
        near.camera.eye() + away,
        near.camera.eye() + away + near.camera.forward(),
        DVec3::new(0.1, 0.2, 1.0),
        near.camera.projection(),
    )
    .unwrap();
    let plan = plan(&nodes.moved(away), &CellsView { camera, ..near });
    for image in [discrete_cells(&plan).image, fast(&plan)] {
        for (i, (got, at)) in image.pixels().iter().zip(expected.image.pixels()).enumerate() {
            assert!(distance(*got, *at) <= 1e-4 + expected.ambiguity[i], "pixel {i}: {got:?} is not {at:?}");
        }
    }
}

#[test]
fn an_eye_far_away_sees_the_same_lengths() {
    let nodes = sheared(UVec3::new(5, 4, 6), shear(), |_| 1.0);
    let center = nodes.extent().center();
    let eye = center + FROM.normalize() * 1e7;
    let projection = Projection::Perspective { fov_y: 6e-7 };
    let camera = Camera::look_at(eye, center, DVec3::new(0.1, 0.2, 1.0), projection).unwrap();
    let view = view(camera, 16, fog(0.4), 0.3);
    let planes = box_planes(UVec3::new(5, 4, 6), shear());
    let image = fast(&plan(&nodes, &view));
    for (got, ray) in image.pixels().iter().zip(rays(&view)) {
        if let Some([start, end]) = chord(&ray, &planes) {
            assert!(distance(*got, foggy(0.4, end - start)) < 1e-4, "{got:?}");
        }
    }
}

#[test]
fn an_eye_inside_a_cell_sees_what_is_before_it() {
    let n = UVec3::new(5, 4, 6);
    let nodes = sheared(n, shear(), |_| 1.0);
    let planes = box_planes(n, shear());
    for index in [DVec3::new(2.3, 1.6, 3.1), DVec3::new(0.5, 3.5, 5.5)] {
        let eye = shear() * index;
        let projection = Projection::Perspective { fov_y: 1.5 };
        let camera = Camera::look_at(eye, eye + FROM, DVec3::Z, projection).unwrap();
        let view = view(camera, 24, fog(0.4), 0.3);
        hold(&plan(&nodes, &view), &view, |ray| chord(ray, &planes).map(|[start, end]| foggy(0.4, end - start)));
    }
}

#[test]
fn a_surface_behind_or_amid_the_cells_ends_rays() {
    let n = UVec3::new(5, 4, 6);
    let nodes = sheared(n, shear(), |_| 1.0);
    let planes = box_planes(n, shear());
    let view = view(framing(&nodes, FROM), 16, fog(0.4), 0.3);
    let distance_of_surface = view.camera.eye().distance(nodes.extent().center());
    let color = [0.5f32, 0.25, 0.125];
    for t in [0.5 * distance_of_surface, distance_of_surface + 0.3, 10.0 * distance_of_surface] {
        let pixel = |i: u32| if i.is_multiple_of(3) { [0.0; 4] } else { [color[0], color[1], color[2], t as f32] };
        let behind = Image::new(view.size, (0..256).map(pixel).collect()).unwrap();
        let view = CellsView { behind: Some(Arc::new(behind)), ..view.clone() };
        for (image, tolerance) in both(&plan(&nodes, &view)) {
            for (i, (got, ray)) in image.pixels().iter().zip(rays(&view)).enumerate() {
                let Some([start, end]) = chord(&ray, &planes) else { continue };
                let expected = if i.is_multiple_of(3) {
                    foggy(0.4, end - start)
                } else {
                    let front = foggy(0.4, (end.min(t) - start).max(0.0));
                    let [r, g, b] = color.map(f64::from);
                    closed_form::over(front, [r, g, b, 1.0])
                };
                assert!(distance(*got, expected) <= tolerance.max(1e-6), "pixel {i}, {t}: {got:?} is not {expected:?}");
            }
        }
    }
}

/// Between the centres of its outer voxels a volume is a grid of even cells, and its picture theirs: the same nodes of the same segments.
#[test]
fn even_cells_have_the_picture_of_a_volume() {
    let (n, spacing) = (UVec3::new(9, 7, 8), DVec3::new(0.5, 1.0, 0.75));
    let value = |i: UVec3| (waves(i.as_dvec3() * 0.2) * 64.0).round() / 64.0;
    let grid = Grid::axis_aligned(n, spacing).unwrap();
    let volume = Volume::new(grid, indices(n).map(|i| value(i) as f32).collect::<Vec<f32>>()).unwrap();
    let mut nodes = Nodes::new(n - 1, |i| (i.as_dvec3() + 0.5) * spacing, |_| 0.0);
    nodes.values = indices(n).map(|i| value(i) as f32).collect();
    let (camera, size) = (framing(&nodes, FROM), UVec2::splat(20));
    let clip = brickfield_core::Aabb { min: DVec3::ZERO, max: (n - 1).as_dvec3() };
    for rule in QuadratureRule::ALL {
        let step_world = 0.31;
        let setup = Setup { camera, size, clip, step_world, rule, skip: Skip::Nothing, ..Setup::new(&volume, peaks()) };
        let expected = discrete(&setup.plan()).image;
        let view = ruled(view(camera, 20, peaks(), step_world), rule);
        let got = discrete_cells(&plan(&nodes, &view));
        for (i, (a, b)) in got.image.pixels().iter().zip(expected.pixels()).enumerate() {
            assert!(distance(*a, *b) < 1e-6, "{}, pixel {i}: {a:?} is not {b:?}", rule.name());
        }
    }
}

#[test]
fn a_fast_ray_loses_at_most_the_floor() {
    let nodes = ring(UVec3::new(5, 16, 4), 0.5, waves);
    let exact = view(framing(&nodes, FROM), 32, fog(9.0), 0.05);
    let mode = Mode::Fast { transmittance_floor: 1.0 / 64.0 };
    let sampling = Sampling::new(0.05, QuadratureRule::MidpointExponential, mode).unwrap();
    let [a, b] = [exact.clone(), CellsView { sampling, ..exact }].map(|view| fast(&plan(&nodes, &view)));
    let most = greatest_difference(&a, &b);
    assert!(most > 0.0 && most <= 1.0 / 64.0, "{most}");
}

#[test]
fn any_size_and_any_extinction_stay_finite() {
    for size in [1e-25, 1.0, 1e25] {
        let nodes = bent(UVec3::splat(4), 3, |_| 1.0);
        let nodes = Nodes {
            positions: nodes.positions.iter().map(|p| *p * size * DVec3::new(1.0, 1e-3, 1.0)).collect(),
            ..nodes
        };
        for extinction in [1e-12, 1.0 / size, 1e30] {
            let view = view(framing(&nodes, FROM), 16, fog(extinction.min(1e30)), 0.1 * size);
            let image = fast(&plan(&nodes, &view));
            let is_fine = |p: &[f64; 4]| p.iter().all(|x| (0.0..=1.0).contains(x));
            assert!(image.pixels().iter().all(is_fine), "{size}, {extinction}");
            let seen = image.pixels().iter().filter(|p| p[3] > 0.0).count();
            assert!(seen > 20, "{size}, {extinction}: {seen}");
        }
    }
}
