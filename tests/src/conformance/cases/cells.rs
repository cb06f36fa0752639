//! Curvilinear cells: sheared, polar, bent and mirrored ones, with holes, and with surfaces amid them.

use std::f64::consts::TAU;
use std::sync::Arc;

use brickfield::frame::{CellsView, Mode, QuadratureRule, Sampling};
use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{Camera, Image, Knot, Projection, TransferFunction};

use super::setup::catches;
use crate::conformance::case::{Case, Check, Mutant};
use crate::conformance::cells::CellsMutant::*;
use crate::conformance::cells::CellsTest;
use crate::conformance::shader_mutants as shader;

const SIZE: UVec2 = UVec2::new(64, 48);

/// The shape of cells.
#[derive(Clone, Copy)]
enum Shape {
    Sheared,
    /// Faces at odd multiples of 1/32, if there are 8 cells along each axis.
    Cubes,
    /// Around an axis, at which cells are wedges.
    Polar,
    /// Faces are bent, no two edges are parallel.
    Bent,
    /// Few cells, turned against each other so that a line may enter one several times.
    Twisted,
}

/// What differs between cases.
#[derive(Clone)]
struct CellsSetup {
    shape: Shape,
    n_cells: UVec3,
    center: DVec3,
    /// Along x: -1 mirrors the cells.
    stretch: f64,
    eye: DVec3,
    projection: Projection,
    step: f64,
    rule: QuadratureRule,
    mode: Mode,
    n_holes: usize,
    has_surface: bool,
}

impl CellsSetup {
    fn new(shape: Shape) -> CellsSetup {
        CellsSetup {
            shape,
            n_cells: UVec3::new(7, 9, 6),
            center: DVec3::ZERO,
            stretch: 1.0,
            eye: DVec3::new(1.3, -3.1, 2.2),
            projection: Projection::Perspective { fov_y: 0.7 },
            step: 0.07,
            rule: QuadratureRule::MidpointExponential,
            mode: Mode::Exact,
            n_holes: 0,
            has_surface: false,
        }
    }

    fn build(&self) -> CellsTest {
        let camera = Camera::look_at(self.center + self.eye, self.center, DVec3::Z, self.projection).expect("a camera");
        let shares: Vec<DVec3> = nodes(self.n_cells).map(|node| node.as_dvec3() / self.n_cells.as_dvec3()).collect();
        let position = |p: &DVec3| self.center + self.position(*p) * DVec3::new(self.stretch, 1.0, 1.0);
        let value = |p: &DVec3| ((5.0 * p.x).sin() * (4.0 * p.y + 1.0).cos() + 0.6 * (3.0 * p.z).sin()) as f32;
        let n_holes = self.n_holes;
        CellsTest {
            n_cells: self.n_cells,
            positions: shares.iter().map(position).collect(),
            values: shares.iter().map(value).collect(),
            holes: (n_holes > 0).then(|| (0..shares.len()).map(|i| i % 97 == 41 && i < 97 * n_holes).collect()),
            view: CellsView {
                camera,
                size: SIZE,
                sampling: Sampling::new(self.step, self.rule, self.mode).expect("a step above 0"),
                transfer: transfer(),
                behind: self.has_surface.then(|| Arc::new(slanted(self.eye.length()))),
            },
        }
    }

    fn position(&self, p: DVec3) -> DVec3 {
        let q = p - 0.5;
        match self.shape {
            Shape::Sheared => DVec3::new(1.6 * q.x + 0.5 * q.y - 0.3 * q.z, 1.3 * q.y + 0.2 * q.z, 1.1 * q.z),
            Shape::Cubes => 2.0 * q + 1.0 / 32.0,
            Shape::Polar => {
                let (radius, angle) = (0.9 * p.x, 0.8 * TAU * p.y + 0.3);
                DVec3::new(radius * angle.cos(), radius * angle.sin(), 1.4 * q.z + 0.1 * p.x)
            }
            Shape::Bent => {
                let wave = DVec3::new((7.0 * p.y + p.z).sin(), (6.0 * p.z + 2.0 * p.x).sin(), (5.0 * p.x - p.y).cos());
                1.5 * q + 0.06 * wave
            }
            Shape::Twisted => {
                let (sin, cos) = (2.4 * p.z).sin_cos();
                DVec3::new(1.6 * (q.x * cos - q.y * sin), 1.6 * (q.x * sin + q.y * cos), 1.3 * q.z)
            }
        }
    }

    fn case(self, name: &str, mutants: Vec<Mutant>) -> Case {
        Case { name: format!("cells/{name}"), check: Check::Cells(Box::new(move || self.build())), mutants }
    }
}

fn nodes(n_cells: UVec3) -> impl Iterator<Item = UVec3> {
    let [x, y, z] = (n_cells + 1).to_array();
    (0..z).flat_map(move |z| (0..y).flat_map(move |y| (0..x).map(move |x| UVec3::new(x, y, z))))
}

fn transfer() -> TransferFunction {
    let knot = |value, extinction, color| Knot { value, extinction, color };
    let knots = vec![
        knot(-1.2, 0.0, [0.1, 0.2, 0.9]),
        knot(-0.3, 0.6, [0.1, 0.7, 0.6]),
        knot(0.2, 1.5, [0.9, 0.8, 0.2]),
        knot(1.1, 6.0, [0.9, 0.2, 0.1]),
    ];
    TransferFunction::new(knots).expect("ascending knots")
}

/// A surface that hides a part of the picture, through the middle of the cells.
fn slanted(distance: f64) -> Image<f32> {
    let pixel = |i: u32| {
        let (x, y) = (i % SIZE.x, i / SIZE.x);
        let t = distance - 0.4 + f64::from(x) / f64::from(SIZE.x);
        if (y + x) % 29 < 12 { [0.2, 0.5, 0.1, t as f32] } else { [0.0; 4] }
    };
    Image::new(SIZE, (0..SIZE.x * SIZE.y).map(pixel).collect()).expect("as many pixels")
}

pub(super) fn cases() -> Vec<Case> {
    let of = CellsSetup::new;
    let parallel = Projection::Orthographic { height: 2.6 };
    let far = DVec3::new(1e6, -2e6, 3e6);
    vec![
        of(Shape::Sheared).case(
            "sheared",
            catches![
                StepScaled,
                ValuesShifted,
                KnotMoved,
                NodeMoved,
                shader::CELLS_NEAREST,
                shader::CELLS_LAST_DROPPED
            ],
        ),
        of(Shape::Polar).case("polar", catches![StepScaled]),
        CellsSetup { n_cells: UVec3::new(3, 3, 2), eye: DVec3::new(2.6, -2.9, 0.4), ..of(Shape::Twisted) }
            .case("twisted", catches![NodeMoved, shader::CELLS_WRONG_FACE]),
        of(Shape::Bent).case("bent", catches![NodeMoved, shader::CELLS_GUESS]),
        CellsSetup { stretch: -1.0, ..of(Shape::Bent) }
            .case("mirrored", catches![ValuesShifted, shader::CELLS_HANDEDNESS]),
        CellsSetup { n_holes: 4, ..of(Shape::Sheared) }.case("holes", catches![HolesIgnored, shader::CELLS_VOIDS]),
        CellsSetup { has_surface: true, ..of(Shape::Polar) }
            .case("surface", catches![SurfaceIgnored, SurfaceBehind, shader::CELLS_SURFACE]),
        CellsSetup { projection: parallel, rule: QuadratureRule::Gauss2, ..of(Shape::Bent) }
            .case("parallel-gauss2", catches![StepScaled]),
        CellsSetup { rule: QuadratureRule::PreIntegrated, step: 0.21, ..of(Shape::Sheared) }
            .case("pre-integrated", catches![StepScaled]),
        CellsSetup { rule: QuadratureRule::LeftRiemann, n_cells: UVec3::new(23, 4, 31), ..of(Shape::Polar) }
            .case("left-riemann", catches![StepScaled]),
        CellsSetup { eye: DVec3::new(0.1, 0.2, 0.05), step: 0.03, ..of(Shape::Bent) }
            .case("eye-within", catches![KnotMoved, shader::CELLS_EYE]),
        CellsSetup { center: far, ..of(Shape::Bent) }.case("far-origin", catches![StepScaled]),
        CellsSetup {
            eye: DVec3::new(1.3, -3.1, 2.2) * 1e4,
            projection: Projection::Perspective { fov_y: 7e-5 },
            ..of(Shape::Sheared)
        }
        .case("far-eye", catches![StepScaled]),
        CellsSetup {
            eye: DVec3::new(1.3, -3.1, 2.2) * 1e4,
            projection: Projection::Perspective { fov_y: 7e-5 },
            has_surface: true,
            ..of(Shape::Sheared)
        }
        .case("far-surface", catches![SurfaceIgnored]),
        CellsSetup { mode: Mode::Fast { transmittance_floor: 1e-5 }, step: 0.01, ..of(Shape::Sheared) }
            .case("fast", catches![KnotMoved]),
        // Pixels are 1/16 apart: every fourth column and row of rays runs along faces, and where both do, along edges.
        CellsSetup {
            projection: Projection::Orthographic { height: 3.0 },
            eye: DVec3::new(0.0, -4.0, 0.0),
            n_cells: UVec3::new(8, 8, 8),
            ..of(Shape::Cubes)
        }
        .case("along-faces", catches![ValuesShifted, shader::CELLS_TIES]),
    ]
}
