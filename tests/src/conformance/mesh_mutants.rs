//! Plans of meshes with one thing wrong.

use std::sync::Arc;

use brickfield::curvilinear::{Node, SurrogateMesh};
use brickfield::frame::{Coloring, Mesh, MeshLines, MeshPlan, MeshTriangle, MeshView};
use brickfield_core::glam::{DVec3, UVec2};
use brickfield_core::{Camera, Projection};
use brickfield_optics::{Light, LightSource};

use super::meshes::PreparedMesh;

/// One thing wrong with the plan of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum MeshMutant {
    /// Vertices of finer zones stay at their nodes: the first patching pass is skipped.
    NotConstrained,
    /// Coarse zones do not take up the vertices on their edges: the second patching pass is skipped.
    NotStitched,
    /// A triangle in front is missing.
    TriangleMissing,
    /// Rays pass the pixels' corners, not their centres: the camera is half a pixel off.
    PixelCorner,
    /// The picture is upside down.
    RowsFlipped,
    /// Values are 2 % of their range too high.
    ValuesOffset,
    /// Colours are interpolated instead of values, or values instead of colours.
    OtherColoring,
    /// The light comes from the other side.
    LightTurned,
    /// Lines are half a pixel too wide.
    WideLines,
    /// Lines are along other edges.
    EdgesRotated,
    /// Vertices are rounded to 1/1024 of the mesh.
    CoarsePositions,
    /// The whole grid is drawn as one zone, though nothing was selected.
    Ghost,
}

impl MeshMutant {
    /// All of them.
    pub const ALL: [MeshMutant; 12] = [
        MeshMutant::NotConstrained,
        MeshMutant::NotStitched,
        MeshMutant::TriangleMissing,
        MeshMutant::PixelCorner,
        MeshMutant::RowsFlipped,
        MeshMutant::ValuesOffset,
        MeshMutant::OtherColoring,
        MeshMutant::LightTurned,
        MeshMutant::WideLines,
        MeshMutant::EdgesRotated,
        MeshMutant::CoarsePositions,
        MeshMutant::Ghost,
    ];

    /// The mutant's name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            MeshMutant::NotConstrained => "mesh/not-constrained",
            MeshMutant::NotStitched => "mesh/not-stitched",
            MeshMutant::TriangleMissing => "mesh/triangle-missing",
            MeshMutant::PixelCorner => "mesh/pixel-corner",
            MeshMutant::RowsFlipped => "mesh/rows-flipped",
            MeshMutant::ValuesOffset => "mesh/values-offset",
            MeshMutant::OtherColoring => "mesh/other-coloring",
            MeshMutant::LightTurned => "mesh/light-turned",
            MeshMutant::WideLines => "mesh/wide-lines",
            MeshMutant::EdgesRotated => "mesh/edges-rotated",
            MeshMutant::CoarsePositions => "mesh/coarse-positions",
            MeshMutant::Ghost => "mesh/ghost",
        }
    }

    /// The plan with this thing wrong.
    pub(super) fn apply(self, honest: &PreparedMesh) -> MeshPlan {
        let PreparedMesh { test, surrogate, plan, .. } = honest;
        let view = test.view.clone();
        match self {
            MeshMutant::NotConstrained => test.plan(&unconstrained(honest), view),
            MeshMutant::NotStitched => test.plan(&unstitched(honest), view),
            MeshMutant::TriangleMissing => {
                let mut surrogate = surrogate.clone();
                surrogate.triangles.remove(conspicuous(plan));
                test.plan(&surrogate, view)
            }
            MeshMutant::PixelCorner => {
                let camera = half_a_pixel_off(&test.view.camera, plan.size());
                test.plan(surrogate, MeshView { camera, ..test.view.clone() })
            }
            MeshMutant::RowsFlipped => {
                let mut rays = *plan.rays();
                (rays.anchor[2], rays.direction[2], rays.pixel[1]) =
                    (-rays.anchor[2], -rays.direction[2], -rays.pixel[1]);
                plan.clone().with_rays(rays)
            }
            MeshMutant::ValuesOffset => {
                let range = |pick: fn(f32, f32) -> f32, start| surrogate.values.iter().copied().fold(start, pick);
                let by = 0.02 * (range(f32::max, f32::MIN) - range(f32::min, f32::MAX));
                let values = surrogate.values.iter().map(|v| v + by).collect();
                test.plan(&SurrogateMesh { values, ..surrogate.clone() }, view)
            }
            MeshMutant::OtherColoring => {
                let coloring = match view.coloring {
                    Coloring::Values => Coloring::Gouraud,
                    Coloring::Gouraud => Coloring::Values,
                };
                test.plan(surrogate, MeshView { coloring, ..view })
            }
            MeshMutant::LightTurned => test.plan(surrogate, MeshView { light: view.light.map(turned), ..view }),
            MeshMutant::WideLines => {
                let lines = view.lines.map(|lines| MeshLines { width: lines.width + 0.5, ..lines });
                test.plan(surrogate, MeshView { lines, ..view })
            }
            MeshMutant::EdgesRotated => {
                with_triangles(plan, view, |t| MeshTriangle { edges: (t.edges << 1 | t.edges >> 2) & 7, ..t })
            }
            MeshMutant::CoarsePositions => {
                let grain = plan.mesh().radius() / 1024.0;
                let positions = surrogate.positions.iter().map(|p| (*p / grain).round() * grain).collect();
                test.plan(&SurrogateMesh { positions, ..surrogate.clone() }, view)
            }
            MeshMutant::Ghost => test.plan(&whole(honest), view),
        }
    }
}

/// Two triangles over the whole grid.
fn whole(honest: &PreparedMesh) -> SurrogateMesh {
    let grid = &honest.test.grid;
    let (row, column) = (grid.n_rows(), grid.n_columns());
    let nodes = [[0, 0], [0, column], [row, column], [row, 0]].map(|[row, column]| Node { row, column });
    SurrogateMesh {
        positions: nodes.map(|node| grid.position(node)).into(),
        values: nodes.map(|node| grid.value(node)).into(),
        nodes: nodes.into(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        n_moved: 0,
    }
}

/// A large triangle among those nearest to the eye, in the middle of the picture.
fn conspicuous(plan: &MeshPlan) -> usize {
    let half = 0.5 * plan.size().as_dvec2();
    let seen = |(i, t): (usize, &MeshTriangle)| {
        let [a, b, c] = t.corners.map(|corner| plan.rays().camera(plan.mesh().position(corner)));
        let depth = (a.z + b.z + c.z) / 3.0;
        let pixel = |p: DVec3| p.truncate() / if plan.rays().are_parallel() { 1.0 } else { p.z };
        let middle = (pixel(a) + pixel(b) + pixel(c)) / 3.0;
        let area = (pixel(b) - pixel(a)).perp_dot(pixel(c) - pixel(a)).abs();
        let is_before = a.z.min(b.z).min(c.z) > plan.near();
        (is_before && middle.abs().cmplt(0.8 * half).all()).then_some((depth, area, i))
    };
    let mut seen: Vec<_> = plan.mesh().triangles().iter().enumerate().filter_map(seen).collect();
    seen.sort_by(|a, b| a.0.total_cmp(&b.0));
    seen.truncate(seen.len().div_ceil(20));
    seen.iter().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(_, _, i)| *i)
}

/// All vertices at their nodes, with their nodes' values.
fn unconstrained(honest: &PreparedMesh) -> SurrogateMesh {
    let (grid, surrogate) = (&honest.test.grid, &honest.surrogate);
    let positions = surrogate.nodes.iter().map(|node| grid.position(*node)).collect();
    let values = surrogate.nodes.iter().map(|node| grid.value(*node)).collect();
    SurrogateMesh { positions, values, ..surrogate.clone() }
}

/// Two triangles for each zone.
fn unstitched(honest: &PreparedMesh) -> SurrogateMesh {
    let (grid, surrogate) = (&honest.test.grid, &honest.surrogate);
    let vertex = |row: u32, column: u32| {
        let node = grid.canonical(Node { row, column });
        surrogate.nodes.iter().position(|n| *n == node).expect("a corner of a leaf is a vertex") as u32
    };
    let mut triangles = Vec::new();
    for leaf in honest.test.selection.leaves() {
        let range = grid.layout().descendants(leaf);
        let (rows, columns) = ([range.rows.start, range.rows.end], [range.columns.start, range.columns.end]);
        let [a, b] = [vertex(rows[0], columns[0]), vertex(rows[0], columns[1])];
        let [c, d] = [vertex(rows[1], columns[1]), vertex(rows[1], columns[0])];
        triangles.extend([[a, b, c], [a, c, d]]);
    }
    SurrogateMesh { triangles, ..surrogate.clone() }
}

/// A camera whose picture lies half a pixel to the right and below.
fn half_a_pixel_off(camera: &Camera, size: UVec2) -> Camera {
    let way = 0.5 * camera.pixel_rays(size).pixel() * (camera.up() - camera.right());
    let (eye, target) = match camera.projection() {
        Projection::Orthographic { .. } => (camera.eye() + way, camera.eye() + way + camera.forward()),
        Projection::Perspective { .. } => (camera.eye(), camera.eye() + camera.forward() + way),
    };
    Camera::look_at(eye, target, camera.up(), camera.projection()).expect("half a pixel turns no camera over")
}

fn with_triangles(plan: &MeshPlan, view: MeshView, edit: impl Fn(MeshTriangle) -> MeshTriangle) -> MeshPlan {
    let mesh = plan.mesh();
    let vector = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    let positions: Vec<DVec3> = (0..mesh.vertices().len() as u32).map(|i| mesh.center() + mesh.position(i)).collect();
    let values: Vec<f32> = mesh.vertices().iter().map(|v| v.value).collect();
    let normals: Vec<DVec3> = mesh.vertices().iter().map(|v| vector(v.normal)).collect();
    let triangles = mesh.triangles().iter().map(|t| edit(*t)).collect();
    let normals = mesh.has_normals().then_some(normals.as_slice());
    let edited = Mesh::new(&positions, &values, normals, triangles).expect("the same vertices");
    MeshPlan::new(Arc::new(edited), view).expect("the same view")
}

fn turned(light: Light) -> Light {
    let source = match light.source() {
        LightSource::Head => LightSource::Direction(DVec3::new(0.2, -0.5, 0.7)),
        LightSource::Direction(direction) => LightSource::Direction(-direction),
        LightSource::Place(place) => LightSource::Place(-place),
    };
    Light::new(source, light.terms(), light.flat_below()).expect("a light's terms make a light")
}
