//! Faces of a volume as surfaces: what the two-dimensional half of this crate draws.

use brickfield_core::glam::{DVec3, UVec3};

use crate::{CellBox, CurvilinearGrid, CurvilinearGridError, CurvilinearVolume, Positions};

/// All nodes with one index in common: the plane of nodes i = 3 is `X(3)`. Columns run along the next axis (x, y, z, x, ...), rows along the one after
/// that.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum IndexPlane {
    X(u32),
    Y(u32),
    Z(u32),
}

/// Why there is no surface.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum SurfaceError {
    #[error("{n_values} values for {n_nodes} nodes")]
    Count { n_values: usize, n_nodes: usize },
    #[error("{plane:?} of cells with nodes from {first} to {last} along that axis")]
    Plane { plane: IndexPlane, first: u32, last: u32 },
    #[error("cells from {first} to {end} of a volume of {n_cells} cells")]
    Cells { first: UVec3, end: UVec3, n_cells: UVec3 },
    #[error(transparent)]
    Grid(#[from] CurvilinearGridError),
}

impl IndexPlane {
    /// The axis that it is across.
    pub fn axis(self) -> usize {
        match self {
            IndexPlane::X(_) => 0,
            IndexPlane::Y(_) => 1,
            IndexPlane::Z(_) => 2,
        }
    }

    /// The axis as indices are named: i, j or k.
    pub fn letter(self) -> char {
        ['i', 'j', 'k'][self.axis()]
    }

    /// The index that all nodes have along it.
    pub fn index(self) -> u32 {
        let (IndexPlane::X(index) | IndexPlane::Y(index) | IndexPlane::Z(index)) = self;
        index
    }

    /// The axes along columns and rows.
    pub fn across(self) -> [usize; 2] {
        [1, 2].map(|next| (self.axis() + next) % 3)
    }

    /// So many nodes along columns and rows, from `first` on, row by row.
    pub(crate) fn nodes(self, first: UVec3, [n_columns, n_rows]: [u32; 2]) -> impl Iterator<Item = UVec3> + Clone {
        let (axis, [column_axis, row_axis]) = (self.axis(), self.across());
        let node = move |(column, row): (u32, u32)| {
            let mut node = first;
            node[axis] = self.index();
            node[column_axis] += column;
            node[row_axis] += row;
            node
        };
        (0..n_rows).flat_map(move |row| (0..n_columns).map(move |column| (column, row))).map(node)
    }
}

impl CellBox {
    /// The planes of the six faces: lower and upper along x, along y, along z.
    pub fn faces(&self) -> [IndexPlane; 6] {
        let (low, high) = (self.first, self.first + self.n);
        [
            IndexPlane::X(low.x),
            IndexPlane::X(high.x),
            IndexPlane::Y(low.y),
            IndexPlane::Y(high.y),
            IndexPlane::Z(low.z),
            IndexPlane::Z(high.z),
        ]
    }
}

impl CurvilinearVolume {
    /// A plane of nodes between some cells, as a grid of zones: a face of a zone of the octree, of the whole volume, or a slice.
    ///
    /// `values` has one value for each node of the volume; NaN is a hole.
    ///
    /// # Errors
    /// Not one value for each node, or infinite ones; no cells, or cells beyond the volume; a plane beyond the cells.
    pub fn surface(&self, values: &[f32], cells: &CellBox, plane: IndexPlane) -> Result<CurvilinearGrid, SurfaceError> {
        self.check(values, cells, plane)?;
        let [n_columns, n_rows] = plane.across().map(|axis| cells.n[axis]);
        let numbers = || plane.nodes(cells.first, [n_columns + 1, n_rows + 1]).map(|node| self.number(node));
        let positions: Vec<DVec3> = numbers().map(|i| self.positions()[i]).collect();
        let values = numbers().map(|i| values[i]).collect();
        Ok(CurvilinearGrid::new(n_rows, n_columns, Positions::Curvilinear(positions), values)?)
    }

    fn check(&self, values: &[f32], cells: &CellBox, plane: IndexPlane) -> Result<(), SurfaceError> {
        let (n_values, n_nodes) = (values.len(), self.positions().len());
        if n_values != n_nodes {
            return Err(SurfaceError::Count { n_values, n_nodes });
        }
        let (first, n_cells) = (cells.first, self.n_cells());
        let end = UVec3::from([0, 1, 2].map(|axis| first[axis].saturating_add(cells.n[axis])));
        if cells.n.min_element() == 0 || end.cmpgt(n_cells).any() {
            return Err(SurfaceError::Cells { first, end, n_cells });
        }
        let (first, last) = (first[plane.axis()], end[plane.axis()]);
        if (first..=last).contains(&plane.index()) { Ok(()) } else { Err(SurfaceError::Plane { plane, first, last }) }
    }
}
