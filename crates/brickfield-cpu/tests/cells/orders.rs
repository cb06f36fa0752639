//! Observed orders of accuracy: in the step, and in the grid.

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Ray, TransferFunction};
use brickfield_cpu::{closed_form, discrete_cells};
use brickfield_frame::{CellsView, QuadratureRule};

use crate::closed_forms::{linear, linear_over};
use crate::grids::*;
use crate::slope::slope;

/// The mean error of the f64 answer over the pixels with an exact value.
fn error(nodes: &Nodes, view: &CellsView, exact: &[Option<[f64; 4]>]) -> f64 {
    let image = discrete_cells(&plan(nodes, view)).image;
    let pairs = image.pixels().iter().zip(exact).filter_map(|(got, exact)| Some((*got, (*exact)?)));
    let errors: Vec<f64> = pairs.map(|(got, exact)| distance(got, exact)).collect();
    errors.iter().sum::<f64>() / errors.len() as f64
}

/// In sheared cells a linear field is linear along rays, whatever faces they cross.
#[test]
fn every_rule_has_its_order_in_the_step_in_sheared_cells() {
    let n = UVec3::new(5, 4, 6);
    let value = |p: DVec3| p.x - 2.0 * p.y + 1.5 * p.z;
    let nodes = sheared(n, shear(), value);
    let planes = box_planes(n, shear());
    let of = |step: f64| view(framing(&nodes, DVec3::new(1.0, 0.7, 0.4)), 12, linear(), step);
    // Rays whose chord is shorter than the first step see one segment only.
    let exact = |ray: &Ray| {
        let [start, end] = chord(ray, &planes).filter(|[start, end]| end - start > 1.5)?;
        Some(linear_over(ray, [start, end], value))
    };
    let exact: Vec<_> = rays(&of(1.0)).iter().map(exact).collect();
    assert!(exact.iter().flatten().count() >= 8);
    for rule in QuadratureRule::ALL {
        let errors: Vec<f64> =
            (0..6).map(|i| error(&nodes, &ruled(of(0.25 / f64::from(1 << i)), rule), &exact)).collect();
        let order = slope(&errors);
        println!("{}: order {order:.3} in the step, sheared", rule.name());
        assert!((order - f64::from(rule.order())).abs() < 0.1, "{}: order {order}, {errors:?}", rule.name());
    }
}

fn ball(p: DVec3) -> f64 {
    (-(p - DVec3::new(0.9, 0.7, 0.8)).length_squared()).exp()
}

fn thick() -> TransferFunction {
    let color = [1.0, 0.5, 0.25];
    TransferFunction::new(vec![knot(0.0, 0.0, color), knot(1.0, 0.8, color)]).unwrap()
}

/// In polar cells the field has a kink at each face: the midpoint rule is of order 2 over many rays.
#[test]
fn midpoints_are_of_order_two_in_the_step_in_polar_cells() {
    let nodes = ring(UVec3::new(4, 16, 4), 0.5, ball);
    let of = |step: f64| view(framing(&nodes, DVec3::new(1.0, 0.7, 0.4)), 24, thick(), step);
    let fine = discrete_cells(&plan(&nodes, &ruled(of(1.0 / 2048.0), QuadratureRule::Gauss2)));
    let exact: Vec<_> = fine.image.pixels().iter().map(|p| (p[3] > 0.0).then_some(*p)).collect();
    let errors: Vec<f64> = (0..6).map(|i| error(&nodes, &of(0.25 / f64::from(1 << i)), &exact)).collect();
    let order = slope(&errors);
    println!("midpoint: order {order:.3} in the step, polar");
    assert!((order - 2.0).abs() < 0.1, "order {order}, {errors:?}");
}

/// Where a ray is in the true ring between cylinders, along its direction.
fn in_ring(ray: &Ray, inner: f64) -> Option<Vec<[f64; 2]>> {
    let cylinder = |radius: f64| {
        let (o, d) = (ray.origin.truncate(), ray.direction.truncate());
        let (a, b, c) = (d.length_squared(), o.dot(d), o.length_squared() - radius * radius);
        let root = b * b - a * c;
        // Rays near the outline are left out: there the order is that of a root.
        if (root / a).abs() < 0.3 {
            return None;
        }
        Some(if root > 0.0 { [(-b - root.sqrt()) / a, (-b + root.sqrt()) / a] } else { [0.0; 2] })
    };
    let slab = chord(ray, &[(-DVec3::Z, 0.0), (DVec3::Z, 1.5)])?;
    let [outer, inner] = [cylinder(2.0)?, cylinder(inner)?];
    let cut = |[a, b]: [f64; 2]| [a.max(slab[0]), b.min(slab[1])];
    let parts = if inner[1] > inner[0] { vec![[outer[0], inner[0]], [inner[1], outer[1]]] } else { vec![outer] };
    // Nor those through an edge of top or bottom: which face they meet depends on the grid.
    let edges = [outer[0], outer[1], inner[0], inner[1]];
    if edges.iter().any(|t| slab.iter().any(|s| (s - t).abs() < 0.15)) {
        return None;
    }
    Some(parts.into_iter().map(cut).filter(|[a, b]| b > a).collect())
}

/// Composite Gauss-Legendre quadrature: exact to f64 for the ball.
fn depth(ray: &Ray, spans: &[[f64; 2]], extinction: impl Fn(DVec3) -> f64) -> f64 {
    let rule = QuadratureRule::Gauss2.nodes();
    let over = |[a, b]: &[f64; 2]| {
        let h = (b - a) / 512.0;
        let node = |k: i32, x: &f64| extinction(ray.at(a + (f64::from(k) + x) * h));
        (0..512).flat_map(|k| rule.iter().map(move |x| node(k, x) * 0.5 * h)).sum::<f64>()
    };
    spans.iter().map(over).sum()
}

#[test]
fn grid_refinement_is_of_order_two_in_polar_cells() {
    let camera = framing(&ring(UVec3::new(2, 6, 2), 0.5, ball), DVec3::new(1.0, 0.7, 0.4));
    for (name, transfer, value) in [("a ball", thick(), ball as fn(DVec3) -> f64), ("fog", fog(0.5), |_| 0.0)] {
        let view = ruled(view(camera, 8, transfer.clone(), 0.01), QuadratureRule::Gauss2);
        let exact = |ray: &Ray| {
            let spans = in_ring(ray, 0.5)?;
            let depth = depth(ray, &spans, |p| transfer.at(value(p)).extinction);
            Some(closed_form::one_color(depth, transfer.at(1.0).color))
        };
        let exact: Vec<_> = rays(&view).iter().map(exact).collect();
        assert!(exact.iter().flatten().filter(|p| p[3] > 0.01).count() >= 8);
        let errors: Vec<f64> =
            (0..6).map(|i| error(&ring(UVec3::new(2, 8, 2) * (1 << i), 0.5, value), &view, &exact)).collect();
        let order = slope(&errors);
        println!("{name}: order {order:.3} in the grid, {errors:?}");
        assert!((order - 2.0).abs() < 0.1, "{name}: order {order}, {errors:?}");
    }
}
