//! Meshes: surfaces of curvilinear grids, in all ways of drawing them.

use brickfield::SurfaceNormals;
use brickfield::curvilinear::{BudgetSelector, CurvilinearGrid, HeightField, Positions, QuadTree, Selection, View};
use brickfield::frame::{Coloring, MeshLines, MeshView};
use brickfield_core::glam::{DVec3, UVec2};
use brickfield_core::{Camera, Knot, Projection, TransferFunction};
use brickfield_optics::{Light, LightSource, LightTerms};

use super::grids::{GridKind, random_selection};
use super::setup::catches;
use crate::conformance::case::{Case, Check, Mutant};
use crate::conformance::mesh_mutants::MeshMutant::*;
use crate::conformance::meshes::{Covers, MeshTest};
use crate::conformance::shader_mutants as shader;

/// What differs between cases.
#[derive(Clone)]
struct MeshSetup {
    kind: GridKind,
    n_zones: [u32; 2],
    size: UVec2,
    center: DVec3,
    /// The point that is looked at, from the centre.
    target: DVec3,
    /// From the point that is looked at.
    eye: DVec3,
    projection: Projection,
    chosen: Chosen,
    coloring: Coloring,
    light: Option<LightSource>,
    normals: SurfaceNormals,
    lines: Option<f64>,
    covers: Covers,
    /// World units for a unit of all lengths here.
    scale: f64,
    /// Values are tenths, and colours have steps at some of them.
    is_stepped: bool,
}

#[derive(Clone, Copy)]
enum Chosen {
    Random(u64),
    Budget(usize),
    Nothing,
}

const PERSPECTIVE: Projection = Projection::Perspective { fov_y: 0.7 };

impl MeshSetup {
    fn new(kind: GridKind) -> MeshSetup {
        MeshSetup {
            kind,
            n_zones: [19, 26],
            size: UVec2::new(96, 72),
            center: DVec3::ZERO,
            target: DVec3::ZERO,
            eye: DVec3::new(1.0, -5.0, 4.0),
            projection: PERSPECTIVE,
            chosen: Chosen::Random(5),
            coloring: Coloring::Values,
            light: None,
            normals: SurfaceNormals::Triangles,
            lines: None,
            covers: Covers::Part,
            scale: 1.0,
            is_stepped: false,
        }
    }

    fn build(&self) -> MeshTest {
        let tree = QuadTree::build(self.grid());
        let target = (self.center + self.target) * self.scale;
        let camera =
            Camera::look_at(target + self.eye * self.scale, target, DVec3::Y, self.projection).expect("a camera");
        let source = |source| match source {
            LightSource::Place(place) => LightSource::Place(place * self.scale),
            other => other,
        };
        let light = self.light.map(|light| Light::new(source(light), terms(), 1.0).expect("a light"));
        let view = MeshView {
            camera,
            size: self.size,
            colors: if self.is_stepped { steps() } else { colors() },
            coloring: self.coloring,
            light,
            lines: self.lines.map(|width| MeshLines { width, color: [0.02, 0.02, 0.1] }),
        };
        let (grid, selection) = (tree.grid().clone(), self.select(tree, camera));
        MeshTest { grid, selection, view, normals: self.normals, covers: self.covers }
    }

    fn grid(&self) -> CurvilinearGrid {
        let grid = self.kind.grid(self.n_zones, self.center);
        let positions = match grid.positions() {
            Positions::Heights(field) => Positions::Heights(HeightField {
                origin: field.origin * self.scale,
                along_column: field.along_column * self.scale,
                along_row: field.along_row * self.scale,
                along_value: field.along_value * self.scale,
            }),
            Positions::Curvilinear(positions) => {
                Positions::Curvilinear(positions.iter().map(|p| *p * self.scale).collect())
            }
            other => other.clone(),
        };
        let value = |v: &f32| if self.is_stepped { (v * 10.0).round() / 10.0 } else { *v };
        let values = grid.values().iter().map(value).collect();
        let changed =
            CurvilinearGrid::new(grid.n_rows(), grid.n_columns(), positions, values).expect("a grid of waves");
        changed.with_ends(grid.ends()).expect("waves meet themselves")
    }

    fn select(&self, tree: QuadTree, camera: Camera) -> Selection {
        match self.chosen {
            Chosen::Random(seed) => random_selection(&tree, seed),
            Chosen::Nothing => Selection::of_leaves(&tree, []).expect("nothing overlaps"),
            Chosen::Budget(n) => {
                let mut selector = BudgetSelector::new(std::sync::Arc::new(tree));
                selector.update(&View::new(camera, self.size).expect("a view"), n);
                selector.selection().clone()
            }
        }
    }

    fn case(self, name: &str, mutants: Vec<Mutant>) -> Case {
        let name = format!("mesh/{name}");
        Case { name, check: Check::Mesh(Box::new(move || self.build())), mutants }
    }
}

fn terms() -> LightTerms {
    LightTerms { ambient: 0.2, diffuse: 0.7, specular: 0.4, shininess: 11 }
}

/// Blue, green, red as in the paper, with a step.
fn colors() -> TransferFunction {
    let knot = |value: f64, color| Knot { value, extinction: 0.0, color };
    let blue = [0.05, 0.1, 0.8];
    let green = [0.1, 0.7, 0.2];
    let knots = vec![
        knot(-1.2, blue),
        knot(-0.4, [0.0, 0.5, 0.6]),
        knot(-0.4, green),
        knot(0.3, [0.8, 0.8, 0.1]),
        knot(1.2, [0.8, 0.1, 0.1]),
    ];
    TransferFunction::new(knots).expect("ascending knots")
}

/// Steps at values that corners have: at -0.4, which is none of f32, and at 0.5, which is.
fn steps() -> TransferFunction {
    let knot = |value: f64, color| Knot { value, extinction: 0.0, color };
    let (blue, green, red) = ([0.05, 0.1, 0.8], [0.1, 0.7, 0.2], [0.8, 0.1, 0.1]);
    let knots =
        vec![knot(-1.2, blue), knot(-0.4, blue), knot(-0.4, green), knot(0.5, green), knot(0.5, red), knot(1.2, red)];
    TransferFunction::new(knots).expect("ascending knots")
}

pub(super) fn cases() -> Vec<Case> {
    [drawn(), lit(), lined(), viewed(), watertight()].into_iter().flatten().collect()
}

fn drawn() -> Vec<Case> {
    let of = MeshSetup::new;
    vec![
        of(GridKind::Heights).case(
            "values",
            catches![
                TriangleMissing,
                PixelCorner,
                RowsFlipped,
                ValuesOffset,
                OtherColoring,
                CoarsePositions,
                shader::MESH_WEIGHTS_SWAPPED,
                shader::MESH_COLOR_BELOW,
                shader::MESH_DEPTH
            ],
        ),
        MeshSetup { coloring: Coloring::Gouraud, ..of(GridKind::Heights) }
            .case("gouraud", catches![OtherColoring, ValuesOffset]),
        MeshSetup { coloring: Coloring::Gouraud, is_stepped: true, ..of(GridKind::Heights) }
            .case("steps", catches![shader::MESH_COLOR_LEFT]),
        // Whatever is drawn is too much.
        MeshSetup { chosen: Chosen::Nothing, covers: Covers::Nothing, ..of(GridKind::Heights) }
            .case("nothing", catches![Ghost]),
        MeshSetup { chosen: Chosen::Budget(120), ..of(GridKind::Heights) }
            .case("budget", catches![NotConstrained, TriangleMissing]),
        of(GridKind::Torus).case("torus", catches![TriangleMissing, PixelCorner]),
        MeshSetup { coloring: Coloring::Gouraud, lines: Some(1.0), ..of(GridKind::Annulus) }
            .case("annulus", catches![EdgesRotated]),
    ]
}

fn lit() -> Vec<Case> {
    let lit = |kind, source, normals| MeshSetup { light: Some(source), normals, ..MeshSetup::new(kind) };
    let (triangles, grid) = (SurfaceNormals::Triangles, SurfaceNormals::Grid);
    let slant = LightSource::Direction(DVec3::new(2.0, 1.0, 1.5));
    let place = LightSource::Place(DVec3::new(-1.0, 0.5, 2.0));
    vec![
        lit(GridKind::Heights, LightSource::Head, triangles).case("head-light", catches![LightTurned]),
        lit(GridKind::Heights, slant, grid)
            .case("slant-light", catches![LightTurned, shader::MESH_NORMAL_OF_CORNER, shader::MESH_HIGHLIGHT]),
        lit(GridKind::Torus, place, grid).case("light-beside", catches![LightTurned, shader::MESH_PLACE]),
        // Squares of lengths are beyond f32.
        MeshSetup { scale: 3e22, lines: Some(1.5), ..lit(GridKind::Torus, place, triangles) }
            .case("large", catches![LightTurned, shader::MESH_UNIT]),
        MeshSetup { scale: 3e-22, ..lit(GridKind::Heights, place, grid) }
            .case("small", catches![LightTurned, shader::MESH_UNIT]),
        MeshSetup { eye: DVec3::new(0.5, 3.0, -4.0), ..lit(GridKind::Heights, slant, triangles) }
            .case("from-below", catches![shader::MESH_NORMAL_AWAY]),
    ]
}

fn lined() -> Vec<Case> {
    let lined = |kind, width| MeshSetup { lines: Some(width), ..MeshSetup::new(kind) };
    vec![
        lined(GridKind::Heights, 1.5)
            .case("lines", catches![WideLines, EdgesRotated, shader::MESH_LINE_EDGE, shader::MESH_LINE_SLOPE]),
        MeshSetup {
            projection: Projection::Orthographic { height: 4.0 },
            light: Some(LightSource::Head),
            ..lined(GridKind::Sheared, 5.0)
        }
        .case("wide-lines", catches![WideLines]),
    ]
}

fn viewed() -> Vec<Case> {
    let of = MeshSetup::new;
    let inside = DVec3::new(0.4, 1.35, 0.1);
    vec![
        MeshSetup { projection: Projection::Orthographic { height: 5.0 }, ..of(GridKind::Torus) }
            .case("parallel", catches![PixelCorner, RowsFlipped]),
        MeshSetup { eye: inside, lines: Some(2.0), covers: Covers::Everything, ..of(GridKind::Torus) }
            .case("eye-within", catches![TriangleMissing]),
        MeshSetup { eye: DVec3::new(0.3, -6.0, 0.3), light: Some(LightSource::Head), ..of(GridKind::Heights) }
            .case("grazing", catches![PixelCorner]),
        MeshSetup { center: DVec3::new(1e7, -3e7, 2e7), lines: Some(1.0), ..of(GridKind::Torus) }
            .case("far-origin", catches![PixelCorner]),
        MeshSetup {
            eye: DVec3::new(1e4, -5e4, 4e4),
            projection: Projection::Perspective { fov_y: 7e-5 },
            lines: Some(1.0),
            ..of(GridKind::Heights)
        }
        .case("far-eye", catches![PixelCorner]),
    ]
}

/// Close to the surface, so that it fills the picture: a pixel without it is a crack.
fn watertight() -> Vec<Case> {
    let on_ring = DVec3::X * 1.5;
    let near = |kind: GridKind| match kind {
        GridKind::Annulus => (on_ring, DVec3::new(0.1, 0.0, 0.5), 0.7),
        GridKind::Torus => (on_ring, DVec3::new(0.0, 0.1, 1.9), 0.12),
        GridKind::Sheared => (DVec3::X * 0.1, DVec3::new(0.1, 0.0, 2.0), 0.3),
        GridKind::Flat | GridKind::Heights => (DVec3::ZERO, DVec3::new(0.2, -0.6, 3.0), 0.5),
    };
    let mut cases = Vec::new();
    for kind in GridKind::ALL {
        for seed in 1..=3 {
            let (target, eye, fov_y) = near(kind);
            let setup = MeshSetup {
                target,
                eye,
                projection: Projection::Perspective { fov_y },
                n_zones: [33, 47],
                chosen: Chosen::Random(seed),
                covers: Covers::Everything,
                ..MeshSetup::new(kind)
            };
            let mutants = match kind {
                // Cracks in a plane are seen only where vertices lie beside edges.
                GridKind::Heights | GridKind::Torus => catches![TriangleMissing, NotConstrained],
                GridKind::Flat | GridKind::Annulus | GridKind::Sheared => catches![TriangleMissing],
            };
            cases.push(setup.case(&format!("watertight-{}-{seed}", kind.name()), mutants));
        }
    }
    let fine = MeshSetup {
        n_zones: [150, 210],
        size: UVec2::new(512, 384),
        eye: DVec3::new(0.2, -0.6, 3.0),
        projection: Projection::Perspective { fov_y: 0.5 },
        covers: Covers::Everything,
        ..MeshSetup::new(GridKind::Heights)
    };
    cases.push(fine.case("watertight-fine", catches![NotStitched, NotConstrained]));
    cases
}
