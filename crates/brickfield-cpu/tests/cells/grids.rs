//! Generated grids, and plans of them.

use std::f64::consts::TAU;
use std::sync::Arc;

use brickfield_core::glam::{DMat3, DVec3, UVec2, UVec3};
use brickfield_core::{Aabb, Camera, Image, Knot, Projection, Ray, TransferFunction};
use brickfield_cpu::{CpuBackend, discrete_cells};
use brickfield_frame::{Cells, CellsBackend, CellsPlan, CellsView, Mode, QuadratureRule, Sampling};

/// Nodes with positions and values.
#[derive(Clone)]
pub(crate) struct Nodes {
    pub(crate) n_cells: UVec3,
    pub(crate) positions: Vec<DVec3>,
    pub(crate) values: Vec<f32>,
    pub(crate) holes: Option<Vec<bool>>,
}

pub(crate) fn indices(n: UVec3) -> impl Iterator<Item = UVec3> {
    (0..n.z).flat_map(move |z| (0..n.y).flat_map(move |y| (0..n.x).map(move |x| UVec3::new(x, y, z))))
}

impl Nodes {
    pub(crate) fn new(n_cells: UVec3, at: impl Fn(UVec3) -> DVec3, value: impl Fn(DVec3) -> f64) -> Nodes {
        let positions: Vec<DVec3> = indices(n_cells + 1).map(at).collect();
        let values = positions.iter().map(|p| value(*p) as f32).collect();
        Nodes { n_cells, positions, values, holes: None }
    }

    pub(crate) fn with_holes(self, is_hole: impl Fn(UVec3) -> bool) -> Nodes {
        Nodes { holes: Some(indices(self.n_cells + 1).map(is_hole).collect()), ..self }
    }

    /// The same cells with x of the index turned round: the other handedness.
    pub(crate) fn mirrored(&self) -> Nodes {
        let n = self.n_cells + 1;
        let from = |i: UVec3| ((n.x - 1 - i.x) + n.x * (i.y + n.y * i.z)) as usize;
        Nodes {
            n_cells: self.n_cells,
            positions: indices(n).map(|i| self.positions[from(i)]).collect(),
            values: indices(n).map(|i| self.values[from(i)]).collect(),
            holes: self.holes.as_ref().map(|holes| indices(n).map(|i| holes[from(i)]).collect()),
        }
    }

    pub(crate) fn moved(mut self, by: DVec3) -> Nodes {
        self.positions.iter_mut().for_each(|p| *p += by);
        self
    }

    pub(crate) fn cells(&self) -> Arc<Cells> {
        Arc::new(Cells::new(self.n_cells, &self.positions, &self.values, self.holes.as_deref()).unwrap())
    }

    pub(crate) fn extent(&self) -> Aabb {
        Aabb::of_points(self.positions.iter().copied())
    }
}

/// Parallelepipeds. The entries of the maps that are used here are exact in f32.
pub(crate) fn sheared(n: UVec3, map: DMat3, value: impl Fn(DVec3) -> f64) -> Nodes {
    Nodes::new(n, |node| map * node.as_dvec3(), value)
}

pub(crate) fn shear() -> DMat3 {
    DMat3::from_cols(DVec3::new(1.0, 0.25, 0.125), DVec3::new(-0.25, 0.75, 0.25), DVec3::new(0.375, -0.125, 0.5))
}

/// A ring around the z axis, from `inner` to radius 2 and from z = 0 to 1.5, closed: its last nodes along y are its first ones.
pub(crate) fn ring(n: UVec3, inner: f64, value: impl Fn(DVec3) -> f64) -> Nodes {
    let at = |node: UVec3| {
        let radius = inner + (2.0 - inner) * f64::from(node.x) / f64::from(n.x);
        let angle = TAU * f64::from(node.y % n.y) / f64::from(n.y);
        DVec3::new(radius * angle.cos(), radius * angle.sin(), 1.5 * f64::from(node.z) / f64::from(n.z))
    };
    Nodes::new(n, at, value)
}

/// A unit cube of cells with bent faces: inner nodes are moved by up to a quarter of a cell.
pub(crate) fn bent(n: UVec3, seed: u64, value: impl Fn(DVec3) -> f64) -> Nodes {
    let at = |node: UVec3| {
        let noise = |axis: u64| {
            let i = u64::from(node.x) + 100 * u64::from(node.y) + 10_000 * u64::from(node.z) + 1_000_000 * axis;
            let bits = (i ^ seed).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            (bits ^ bits >> 31).wrapping_mul(0xbf58_476d_1ce4_e5b9) as f64 / 2f64.powi(64) - 0.5
        };
        let is_inner = node.cmpgt(UVec3::ZERO).all() && node.cmplt(n).all();
        let moved = if is_inner { DVec3::new(noise(0), noise(1), noise(2)) * 0.5 } else { DVec3::ZERO };
        (node.as_dvec3() + moved) / n.as_dvec3()
    };
    Nodes::new(n, at, value)
}

pub(crate) fn knot(value: f64, extinction: f64, color: [f64; 3]) -> Knot {
    Knot { value, extinction, color }
}

pub(crate) fn fog(extinction: f64) -> TransferFunction {
    TransferFunction::constant(extinction, [0.25, 0.5, 1.0]).unwrap()
}

pub(crate) fn view(camera: Camera, size: u32, transfer: TransferFunction, step_world: f64) -> CellsView {
    let sampling = Sampling::new(step_world, QuadratureRule::MidpointExponential, Mode::Exact).unwrap();
    CellsView { camera, size: UVec2::splat(size), sampling, transfer, behind: None }
}

pub(crate) fn ruled(view: CellsView, rule: QuadratureRule) -> CellsView {
    let sampling = Sampling::new(view.sampling.step_world(), rule, view.sampling.mode()).unwrap();
    CellsView { sampling, ..view }
}

/// A camera that sees some nodes from a direction.
pub(crate) fn framing(nodes: &Nodes, from: DVec3) -> Camera {
    Camera::framing(&nodes.extent(), from, DVec3::new(0.1, 0.2, 1.0)).unwrap()
}

pub(crate) fn parallel(nodes: &Nodes, from: DVec3) -> Camera {
    let (center, size) = (nodes.extent().center(), nodes.extent().diagonal());
    let projection = Projection::Orthographic { height: size };
    Camera::look_at(center + from.normalize() * size, center, DVec3::new(0.1, 0.2, 1.0), projection).unwrap()
}

pub(crate) fn plan(nodes: &Nodes, view: &CellsView) -> CellsPlan {
    CellsPlan::new(nodes.cells(), view.clone()).unwrap()
}

pub(crate) fn fast(plan: &CellsPlan) -> Image<f64> {
    CpuBackend::new().render_cells(plan).unwrap().image.map(f64::from)
}

/// The f64 answer and the f32 picture, each with the tolerance that it is held to.
pub(crate) fn both(plan: &CellsPlan) -> [(Image<f64>, f64); 2] {
    [(discrete_cells(plan).image, 1e-8), (fast(plan), 1e-5)]
}

/// The rays of all pixels in the world, from the eye; rows from the top.
pub(crate) fn rays(view: &CellsView) -> Vec<Ray> {
    let rays = view.camera.pixel_rays(view.size);
    (0..view.size.y).flat_map(|y| (0..view.size.x).map(move |x| rays.pixel_ray(x, y))).collect()
}

/// Holds every pixel of both pictures to the expected one of its ray. `None` leaves a pixel out: its ray runs along an outline.
pub(crate) fn hold(plan: &CellsPlan, view: &CellsView, expected: impl Fn(&Ray) -> Option<[f64; 4]>) {
    let rays = rays(view);
    let mut n_held = 0;
    for (image, tolerance) in both(plan) {
        for (i, (got, ray)) in image.pixels().iter().zip(&rays).enumerate() {
            if let Some(expected) = expected(ray) {
                let off = distance(*got, expected);
                assert!(off <= tolerance, "pixel {i}: {got:?} is not {expected:?}, off by {off}");
                n_held += usize::from(expected[3] > 0.0);
            }
        }
    }
    assert!(n_held >= rays.len() / 5, "{n_held} of {} pixels", rays.len());
}

pub(crate) fn distance(a: [f64; 4], b: [f64; 4]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// The length of a ray of length 1 inside of planes n . p <= d; `None` if it grazes their edges.
pub(crate) fn chord(ray: &Ray, planes: &[(DVec3, f64)]) -> Option<[f64; 2]> {
    let (mut start, mut end) = (0.0f64, f64::INFINITY);
    for (normal, distance) in planes {
        let (along, off) = (normal.dot(ray.direction), distance - normal.dot(ray.origin));
        if along < 0.0 {
            start = start.max(off / along);
        } else if along > 0.0 {
            end = end.min(off / along);
        } else if off < 0.0 {
            return Some([0.0; 2]);
        }
    }
    let length = end - start;
    if length.abs() < 1e-4 { None } else { Some(if length > 0.0 { [start, end] } else { [0.0; 2] }) }
}

/// The faces of a parallelepiped of `n` cells.
pub(crate) fn box_planes(n: UVec3, map: DMat3) -> Vec<(DVec3, f64)> {
    let rows = map.inverse().transpose();
    (0..3).flat_map(|axis| [(-rows.col(axis), 0.0), (rows.col(axis), f64::from(n[axis]))]).collect()
}

/// The sides of a prism with `n` corners at a radius around the z axis, up to z = 1.5.
pub(crate) fn prism_planes(n: u32, radius: f64) -> Vec<(DVec3, f64)> {
    let half = 0.5 * TAU / f64::from(n);
    let side = |i: u32| {
        let angle = half * f64::from(2 * i + 1);
        (DVec3::new(angle.cos(), angle.sin(), 0.0), radius * half.cos())
    };
    (0..n).map(side).chain([(-DVec3::Z, 0.0), (DVec3::Z, 1.5)]).collect()
}
