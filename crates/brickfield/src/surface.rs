//! Surfaces: selections of a curvilinear grid as meshes that backends draw (Wynn, Barnes, Hamann and Miller 1999).
//!
//! ```text
//! StructuredGrid --CurvilinearGrid--> QuadTree --SizeSelector, BudgetSelector--> Selection
//!                                                                                    |  surface_mesh: triangles, patched
//!     MeshFrame <--render_mesh-- MeshPlan <--camera, colours, light, lines-- Mesh <--+
//! ```

use brickfield_core::glam::DVec3;
use brickfield_core::{Knot, Level, TransferError, TransferFunction, ValueRange};
use brickfield_curvilinear::{CurvilinearGrid, Node, OtherGrid, QuadTree, Selection, SurrogateMesh, surrogate_mesh};
use brickfield_frame::{Mesh, MeshError, MeshTriangle};
use rayon::prelude::*;

/// The normals of a surface's vertices.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum SurfaceNormals {
    /// Those of the triangles: each is a plane.
    #[default]
    Triangles,
    /// Those of the grid at the vertices' nodes, from differences to the next nodes: a coarse surface is lit as a fine one.
    Grid,
}

/// Why a selection is no mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum SurfaceError {
    #[error(transparent)]
    OtherGrid(#[from] OtherGrid),
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// Blue, green and red over a range of values, as in Wynn et al. 1999, figure 9. (Its extinctions mean nothing.)
///
/// # Errors
/// A range that is not finite.
pub fn spectrum(range: ValueRange) -> Result<TransferFunction, TransferError> {
    let colors = [[0.0, 0.0, 1.0], [0.0, 1.0, 1.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, 0.0]];
    let value = |i: usize| range.min + (range.max - range.min) * (i as f64 / 4.0);
    if range.max <= range.min {
        return TransferFunction::constant(0.0, colors[0]);
    }
    TransferFunction::new(
        colors.into_iter().enumerate().map(|(i, color)| Knot { value: value(i), extinction: 0.0, color }).collect(),
    )
}

/// The mesh of a selection: zones as triangles without cracks, whose outlines are marked as lines.
///
/// # Errors
/// A selection of another grid; more triangles than a mesh may have.
pub fn surface_mesh(
    grid: &CurvilinearGrid,
    selection: &Selection,
    normals: SurfaceNormals,
) -> Result<Mesh, SurfaceError> {
    Ok(mesh_of(grid, &surrogate_mesh(grid, selection)?, normals)?)
}

/// The mesh of triangles of a grid.
///
/// # Errors
/// More triangles than a mesh may have.
pub fn mesh_of(grid: &CurvilinearGrid, surrogate: &SurrogateMesh, normals: SurfaceNormals) -> Result<Mesh, MeshError> {
    let (triangles, normals) = (triangles(surrogate, 0).collect(), node_normals(grid, surrogate, normals));
    Mesh::new(&surrogate.positions, &surrogate.values, normals.as_deref(), triangles)
}

/// The triangles of a mesh, their corners counted from `first`.
fn triangles(surrogate: &SurrogateMesh, first: u32) -> impl IndexedParallelIterator<Item = MeshTriangle> {
    surrogate.triangles.par_iter().map(move |corners| MeshTriangle {
        corners: corners.map(|corner| corner + first),
        edges: outline(surrogate, *corners),
    })
}

/// The normals of a mesh's nodes, if they are asked for.
fn node_normals(grid: &CurvilinearGrid, surrogate: &SurrogateMesh, normals: SurfaceNormals) -> Option<Vec<DVec3>> {
    match normals {
        SurfaceNormals::Triangles => None,
        SurfaceNormals::Grid => Some(surrogate.nodes.par_iter().map(|node| normal(grid, *node)).collect()),
    }
}

/// The mesh of all final zones of several grids: planes of one volume, say.
///
/// # Errors
/// More triangles than a mesh may have.
pub fn joined_mesh(
    grids: impl IntoIterator<Item = CurvilinearGrid>,
    normals: SurfaceNormals,
) -> Result<Mesh, SurfaceError> {
    let (mut positions, mut values, mut all) = (Vec::new(), Vec::new(), Vec::new());
    let mut of_nodes = (normals == SurfaceNormals::Grid).then(Vec::new);
    for grid in grids {
        let tree = QuadTree::build(grid);
        let finest = 0..tree.layout().n_zones(Level(0));
        let zones = finest.map(|i| tree.layout().zone_at(Level(0), i)).filter(|zone| tree.summary(*zone).is_nice());
        let selection = Selection::of_leaves(&tree, zones).expect("final zones without holes");
        let surrogate = surrogate_mesh(tree.grid(), &selection)?;
        all.par_extend(triangles(&surrogate, positions.len() as u32));
        if let (Some(of_nodes), Some(own)) = (&mut of_nodes, node_normals(tree.grid(), &surrogate, normals)) {
            of_nodes.extend(own);
        }
        positions.extend(surrogate.positions);
        values.extend(surrogate.values);
    }
    Ok(Mesh::new(&positions, &values, of_nodes.as_deref(), all)?)
}

/// The edges of a triangle that are parts of its zone's outline: only those stay within a row or a column of nodes.
fn outline(surrogate: &SurrogateMesh, corners: [u32; 3]) -> u32 {
    let node = |i: usize| surrogate.nodes[corners[i % 3] as usize];
    let is_outline = |i: &usize| node(*i).row == node(i + 1).row || node(*i).column == node(i + 1).column;
    (0..3).filter(is_outline).map(|i| 1 << i).sum()
}

/// The normal of a grid at a node, of length 1: across the differences along its row and its column, or 0 where there are none. A hole is not
/// looked at.
fn normal(grid: &CurvilinearGrid, node: Node) -> DVec3 {
    let along = |rows: i64, columns: i64| {
        let near = |sign: i64| {
            let at = grid.moved(node, sign * rows, sign * columns)?;
            (!grid.value(at).is_nan()).then(|| grid.position(at))
        };
        let own = grid.position(node);
        near(1).unwrap_or(own) - near(-1).unwrap_or(own)
    };
    along(0, 1).cross(along(1, 0)).normalize_or_zero()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use brickfield_curvilinear::{HeightField, Positions, Zone};

    use super::*;

    fn slope() -> CurvilinearGrid {
        let field =
            HeightField { origin: DVec3::ZERO, along_column: DVec3::X, along_row: DVec3::Y, along_value: DVec3::Z };
        let values = (0..25).map(|i| (i % 5) as f32).collect();
        CurvilinearGrid::new(4, 4, Positions::Heights(field), values).unwrap()
    }

    #[test]
    fn outlines_are_marked_and_diagonals_are_not() {
        let tree = Arc::new(QuadTree::build(slope()));
        let zone = |level, row, column| Zone { level: Level(level), row, column };
        let leaves =
            [zone(1, 0, 0), zone(1, 0, 1), zone(1, 1, 0), zone(0, 2, 2), zone(0, 2, 3), zone(0, 3, 2), zone(0, 3, 3)];
        let selection = Selection::of_leaves(&tree, leaves).unwrap();
        let mesh = surface_mesh(tree.grid(), &selection, SurfaceNormals::Grid).unwrap();
        // Seven zones with four sides each; two coarse ones have a side in two pieces.
        let n_sides: u32 = mesh.triangles().iter().map(|t| t.edges.count_ones()).sum();
        assert_eq!((n_sides, mesh.triangles().len()), (4 * 7 + 2, 2 * 7 + 2));
    }

    #[test]
    fn normals_of_the_grid_are_those_of_the_slope() {
        let tree = Arc::new(QuadTree::build(slope()));
        let selection = Selection::of_leaves(&tree, [tree.layout().root()]).unwrap();
        let mesh = surface_mesh(tree.grid(), &selection, SurfaceNormals::Grid).unwrap();
        let expected = DVec3::new(-1.0, 0.0, 1.0).normalize().as_vec3().to_array();
        assert!(mesh.vertices().iter().all(|v| v.normal == expected), "{:?}", mesh.vertices());
        assert!(mesh.has_normals());
        assert!(!surface_mesh(tree.grid(), &selection, SurfaceNormals::Triangles).unwrap().has_normals());
    }
}
