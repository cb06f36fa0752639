//! The nodes of curvilinear cells, as shaders read them.

use brickfield_core::glam::{DVec3, UVec3, Vec3};
use brickfield_core::{Aabb, StructuredGrid, ValueRange};
use bytemuck::{Pod, Zeroable};

use super::boundary::{Boundary, CellFace, FaceBox, signed_volume};
use crate::Chunked;
use crate::content::Pages;

/// Hexahedral cells between nodes with positions and values. They do not change, and backends know them by their identity.
///
/// Nodes are counted from 0 with x varying fastest, one more than cells along each axis; so are cells. A cell's corners are nodes, x varying fastest.
/// Positions are rounded to f32, relative to the centre: every backend, and the reference, draws these.
#[derive(Clone, Debug)]
pub struct Cells {
    n_cells: UVec3,
    extent: Aabb,
    range: ValueRange,
    nodes: Vec<CellNode>,
    /// A bit for each cell; no words if there is no hole.
    voids: Vec<u32>,
    boundary: Boundary,
    handedness: Handedness,
    node_table: Pages,
    void_table: Pages,
}

/// A node as shaders read it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct CellNode {
    /// Relative to the cells' centre, in world units.
    pub position: [f32; 3],
    /// The data value.
    pub value: f32,
}

/// Whether x, y and z of the index make a right-handed system in the world, as the most of the cells' volume has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum Handedness {
    Right,
    Left,
}

/// Why there are no cells.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum CellsError {
    #[error("{} x {} x {} cells; each axis needs at least 1, and all together at most {}", n_cells.x, n_cells.y, n_cells.z, Cells::MAX)]
    Size { n_cells: UVec3 },
    #[error("{n} {what} for {n_nodes} nodes")]
    Count { what: &'static str, n: usize, n_nodes: usize },
    #[error("node ({}, {}, {}) lies at {position}; it must be finite", node.x, node.y, node.z)]
    Position { node: UVec3, position: DVec3 },
    #[error("node ({}, {}, {}) has the value {value}; it must be finite, and at most {} from 0", node.x, node.y, node.z, Cells::MAX_VALUE)]
    Value { node: UVec3, value: f32 },
    #[error(
        "cells that reach {radius} from their centre; from {} to {} is possible",
        Cells::MIN_RADIUS,
        Cells::MAX_RADIUS
    )]
    Radius { radius: f64 },
    #[error("the cells have a volume of {volume}; they must not be flat, nor all be holes")]
    Flat { volume: f64 },
    #[error("field {field} of a grid with {n_fields}")]
    Field { field: usize, n_fields: usize },
}

/// Bytes of a table that are brought together.
const PAGE_BYTES: usize = 1 << 18;

impl Cells {
    /// The most cells, and nearly the most nodes: a number and a face take 31 bits.
    pub const MAX: u64 = 1 << 28;

    /// The greatest distance of a node from the centre, in world units, is at most this,
    pub const MAX_RADIUS: f64 = 1e30;
    /// and at least this.
    pub const MIN_RADIUS: f64 = 1e-30;
    /// The greatest value, and the least below 0.
    pub const MAX_VALUE: f32 = 1e30;

    /// The cells between nodes, of positions in the world and values. A cell that touches a hole is left out.
    ///
    /// A node that no cell is left of lies at the centre, whatever its position and value were.
    ///
    /// # Errors
    /// No cells, or too many; not one position, value (and mark of a hole) for each node; of a node that is used, a number that is not
    /// finite, or a value beyond [`MAX_VALUE`](Self::MAX_VALUE); cells without volume, too small or too large.
    pub fn new(
        n_cells: UVec3,
        positions: &[DVec3],
        values: &[f32],
        holes: Option<&[bool]>,
    ) -> Result<Cells, CellsError> {
        let n_all_cells = n_cells.to_array().iter().map(|n| u128::from(*n)).product::<u128>();
        if n_all_cells == 0 || n_all_cells > u128::from(Cells::MAX) {
            return Err(CellsError::Size { n_cells });
        }
        let n_nodes = n_all(n_cells + 1);
        let counts = [("positions", positions.len()), ("values", values.len())];
        let n_holes = holes.map_or(n_nodes, <[bool]>::len);
        if let Some((what, n)) = counts.into_iter().chain([("marks of holes", n_holes)]).find(|(_, n)| *n != n_nodes) {
            return Err(CellsError::Count { what, n, n_nodes });
        }
        let voids = holes.map_or(Vec::new(), |holes| voids(n_cells, holes));
        let is_used = used(n_cells, &voids);
        let around = extent(n_cells, positions, values, &is_used)?;
        let center = around.0.center();
        let node = |i: usize| match is_used[i] {
            true => CellNode { position: (positions[i] - center).as_vec3().to_array(), value: values[i] },
            false => CellNode::default(),
        };
        Cells::of_nodes(n_cells, around, (0..n_nodes).map(node).collect(), voids)
    }

    /// The cells of a structured grid, with the values of one of its fields.
    ///
    /// # Errors
    /// As [`new`](Self::new): a surface has no cells; no such field.
    pub fn of_grid(grid: &StructuredGrid, field: usize) -> Result<Cells, CellsError> {
        let n_fields = grid.fields().len();
        let values = &grid.fields().get(field).ok_or(CellsError::Field { field, n_fields })?.values;
        let positions: Vec<DVec3> = (0..grid.n() as usize).map(|i| grid.position(grid.node(i))).collect();
        Cells::new(grid.n_nodes().saturating_sub(UVec3::ONE), &positions, values, grid.holes())
    }

    fn of_nodes(
        n_cells: UVec3,
        (extent, range): (Aabb, ValueRange),
        nodes: Vec<CellNode>,
        voids: Vec<u32>,
    ) -> Result<Cells, CellsError> {
        let is_void = |cell: usize| is_set(&voids, cell);
        let boundary = Boundary::of(n_cells, &nodes, &is_void);
        let volume = signed_volume(n_cells, &nodes, boundary.faces());
        if volume == 0.0 || !volume.is_finite() {
            return Err(CellsError::Flat { volume });
        }
        Ok(Cells {
            n_cells,
            extent,
            range,
            boundary,
            handedness: if volume > 0.0 { Handedness::Right } else { Handedness::Left },
            node_table: Pages::of(bytemuck::cast_slice(&nodes), PAGE_BYTES),
            void_table: Pages::of(bytemuck::cast_slice(&voids), PAGE_BYTES),
            nodes,
            voids,
        })
    }

    /// Cells along x, y and z.
    pub fn n_cells(&self) -> UVec3 {
        self.n_cells
    }

    /// The middle of the box around all nodes that are used, in the world.
    pub fn center(&self) -> DVec3 {
        self.extent.center()
    }

    /// The box around all nodes that are used, in the world.
    pub fn extent(&self) -> Aabb {
        self.extent
    }

    /// The values of the nodes that are used.
    pub fn range(&self) -> ValueRange {
        self.range
    }

    /// No node is farther from the centre.
    pub fn radius(&self) -> f64 {
        0.5 * self.extent.diagonal()
    }

    /// All nodes.
    pub fn nodes(&self) -> &[CellNode] {
        &self.nodes
    }

    /// The position of a node relative to the centre, as it is drawn.
    #[inline]
    pub fn position(&self, node: usize) -> DVec3 {
        Vec3::from_array(self.nodes[node].position).as_dvec3()
    }

    /// Whether a cell is left out.
    #[inline]
    pub fn is_void(&self, cell: usize) -> bool {
        is_set(&self.voids, cell)
    }

    /// Bit i % 32 of word i / 32: cell i is left out. No words if none is.
    pub fn voids(&self) -> &[u32] {
        &self.voids
    }

    /// The faces between a cell and nothing, in the order of the leaves of [`boxes`](Self::boxes).
    pub fn faces(&self) -> &[CellFace] {
        self.boundary.faces()
    }

    /// A tree of boxes around the faces, the root first.
    pub fn boxes(&self) -> &[FaceBox] {
        self.boundary.boxes()
    }

    /// Whether the index is right-handed in the world.
    pub fn handedness(&self) -> Handedness {
        self.handedness
    }

    /// The nodes as a device holds them.
    pub fn node_table(&self) -> &dyn Chunked {
        &self.node_table
    }

    /// The cells that are left out, as a device holds them.
    pub fn void_table(&self) -> &dyn Chunked {
        &self.void_table
    }

    /// The faces between a cell and nothing, as a device holds them.
    pub fn face_table(&self) -> &dyn Chunked {
        self.boundary.face_table()
    }

    /// The tree of boxes, as a device holds it.
    pub fn box_table(&self) -> &dyn Chunked {
        self.boundary.box_table()
    }
}

#[inline]
fn is_set(words: &[u32], bit: usize) -> bool {
    words.get(bit / 32).is_some_and(|word| word >> (bit % 32) & 1 == 1)
}

/// The numbers of a cell's corners.
pub(super) fn corners(n_cells: UVec3, cell: usize) -> [usize; 8] {
    let [nx, ny, _] = n_cells.to_array().map(|n| n as usize);
    let [x, y, z] = place(n_cells, cell).to_array().map(|i| i as usize);
    std::array::from_fn(|i| x + (i & 1) + (nx + 1) * (y + (i >> 1 & 1) + (ny + 1) * (z + (i >> 2))))
}

/// Where number `i` is of so many along x, y and z.
fn place(n: UVec3, i: usize) -> UVec3 {
    let [nx, ny] = [n.x as usize, n.y as usize];
    UVec3::new((i % nx) as u32, (i / nx % ny) as u32, (i / nx / ny) as u32)
}

fn n_all(n_cells: UVec3) -> usize {
    n_cells.to_array().iter().map(|n| *n as usize).product()
}

fn voids(n_cells: UVec3, holes: &[bool]) -> Vec<u32> {
    let mut words = vec![0u32; n_all(n_cells).div_ceil(32)];
    for cell in (0..n_all(n_cells)).filter(|cell| corners(n_cells, *cell).iter().any(|node| holes[*node])) {
        words[cell / 32] |= 1 << (cell % 32);
    }
    if words.iter().all(|word| *word == 0) { Vec::new() } else { words }
}

/// Whether a node is a corner of a cell that is not left out.
fn used(n_cells: UVec3, voids: &[u32]) -> Vec<bool> {
    let n_nodes = n_all(n_cells + 1);
    if voids.is_empty() {
        return vec![true; n_nodes];
    }
    let mut used = vec![false; n_nodes];
    for cell in (0..n_all(n_cells)).filter(|cell| !is_set(voids, *cell)) {
        corners(n_cells, cell).into_iter().for_each(|node| used[node] = true);
    }
    used
}

/// The box around the nodes that are used, and the range of their values.
fn extent(
    n_cells: UVec3,
    positions: &[DVec3],
    values: &[f32],
    is_used: &[bool],
) -> Result<(Aabb, ValueRange), CellsError> {
    let all = || (0..positions.len()).filter(|i| is_used[*i]);
    if let Some(i) = all().find(|i| !positions[*i].is_finite()) {
        return Err(CellsError::Position { node: place(n_cells + 1, i), position: positions[i] });
    }
    let is_good = |value: f32| value.abs() <= Cells::MAX_VALUE;
    if let Some(i) = all().find(|i| !is_good(values[*i])) {
        return Err(CellsError::Value { node: place(n_cells + 1, i), value: values[i] });
    }
    let around = Aabb::of_points(all().map(|i| positions[i]));
    if around.min.x > around.max.x {
        return Err(CellsError::Flat { volume: 0.0 });
    }
    let radius = 0.5 * around.diagonal();
    // Cells in one point have no volume, which is said below.
    if !(radius <= Cells::MAX_RADIUS && (radius == 0.0 || radius >= Cells::MIN_RADIUS)) {
        return Err(CellsError::Radius { radius });
    }
    let range = ValueRange::of(all().map(|i| f64::from(values[i])));
    Ok((around, range.expect("nodes that a box is around")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::{GridPoints, NodeField};

    fn grid(n_nodes: UVec3) -> StructuredGrid {
        let points = GridPoints::Even { origin: DVec3::splat(1e9), steps: DVec3::AXES };
        let grid = StructuredGrid::new(n_nodes, points).unwrap();
        let values = (0..grid.n()).map(|i| i as f32).collect();
        grid.with_field(NodeField { name: "number".into(), unit: None, values }).unwrap()
    }

    #[test]
    fn nodes_lie_around_their_centre() {
        let cells = Cells::of_grid(&grid(UVec3::new(3, 4, 5)), 0).unwrap();
        assert_eq!(cells.center(), DVec3::new(1.0, 1.5, 2.0) + 1e9);
        assert_eq!(cells.nodes()[59], CellNode { position: [1.0, 1.5, 2.0], value: 59.0 });
        assert_eq!((cells.n_cells(), cells.handedness()), (UVec3::new(2, 3, 4), Handedness::Right));
        assert_eq!(cells.faces().len(), 2 * (6 + 8 + 12));
        assert_eq!(cells.node_table().n_bytes(), 16 * 60);
    }

    #[test]
    fn a_cell_at_a_hole_is_left_out_and_its_own_nodes_with_it() {
        let mut holes = vec![false; 27];
        holes[0] = true;
        let grid = grid(UVec3::splat(3)).with_holes(&holes).unwrap();
        let cells = Cells::of_grid(&grid, 0).unwrap();
        assert_eq!((0..8).filter(|cell| cells.is_void(*cell)).collect::<Vec<_>>(), [0]);
        assert_eq!(cells.voids(), [1]);
        assert_eq!(cells.nodes()[0], CellNode::default());
        assert_eq!(cells.range(), ValueRange { min: 1.0, max: 26.0 });
        assert_eq!(cells.faces().len(), 24);
    }

    #[test]
    fn a_mirrored_grid_is_left_handed() {
        let positions: Vec<DVec3> =
            (0..8).map(|i| DVec3::new(-f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2))).collect();
        let cells = Cells::new(UVec3::ONE, &positions, &[0.0; 8], None).unwrap();
        assert_eq!(cells.handedness(), Handedness::Left);
    }

    #[test]
    fn faults_are_named() {
        let error = |grid: &StructuredGrid, field| Cells::of_grid(grid, field).unwrap_err().to_string();
        assert_eq!(error(&grid(UVec3::splat(2)), 1), "field 1 of a grid with 1");
        assert!(
            Cells::new(UVec3::splat(1 << 28), &[], &[], None).is_err_and(|e| e.to_string().starts_with("268435456 x"))
        );
        assert!(error(&grid(UVec3::new(2, 2, 1)), 0).starts_with("1 x 1 x 0 cells"));
        let flat = [DVec3::ZERO; 8];
        let error = |positions: &[DVec3], values: &[f32]| {
            Cells::new(UVec3::ONE, positions, values, None).unwrap_err().to_string()
        };
        assert!(error(&flat, &[0.0; 8]).starts_with("the cells have a volume of 0"));
        assert_eq!(error(&flat, &[0.0; 7]), "7 values for 8 nodes");
        assert!(error(&flat, &[f32::NAN; 8]).starts_with("node (0, 0, 0) has the value NaN"));
        assert!(error(&flat, &[2e30; 8]).contains("at most 1000000000000000000000000000000 from 0"));
        assert!(error(&[DVec3::INFINITY; 8], &[0.0; 8]).starts_with("node (0, 0, 0) lies at"));
    }
}
