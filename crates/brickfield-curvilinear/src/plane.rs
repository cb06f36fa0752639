//! Planes of structured grids, as files hold them, as grids of zones.

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{GridPoints, StructuredGrid};

use crate::{CurvilinearGrid, CurvilinearGridError, HeightField, IndexPlane, Positions};

/// Why a plane of a structured grid is no grid of zones.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum GridPlaneError {
    #[error("field {field}; the grid has {n}")]
    NoField { field: usize, n: usize },
    #[error("the plane {axis} = {index}; the grid has {n} nodes along {axis}")]
    NoPlane { axis: char, index: u32, n: u32 },
    #[error("heights over a grid whose nodes are not even: they are heights over a plane of even steps")]
    NotEven,
    #[error(transparent)]
    Grid(#[from] CurvilinearGridError),
}

impl CurvilinearGrid {
    /// A plane of a structured grid, with the values of one of its fields; holes are holes.
    ///
    /// # Errors
    /// No such plane or field; a plane of less than two rows or columns of nodes.
    pub fn of_plane(grid: &StructuredGrid, plane: IndexPlane, field: usize) -> Result<CurvilinearGrid, GridPlaneError> {
        let nodes = PlaneNodes::of(grid, plane)?;
        let positions = nodes.iter().map(|node| grid.position(node)).collect();
        let [n_columns, n_rows] = nodes.n;
        let values = nodes.values(grid, field)?;
        let positions = Positions::Curvilinear(positions);
        Ok(CurvilinearGrid::new(n_rows.saturating_sub(1), n_columns.saturating_sub(1), positions, values)?)
    }

    /// The first plane along k as a height field: values are heights in units of positions, times `exaggeration`, along the normal of the plane.
    ///
    /// # Errors
    /// As [`of_plane`](Self::of_plane); and nodes that are not even.
    pub fn of_heights(
        grid: &StructuredGrid,
        field: usize,
        exaggeration: f64,
    ) -> Result<CurvilinearGrid, GridPlaneError> {
        let GridPoints::Even { origin, steps } = grid.points() else { return Err(GridPlaneError::NotEven) };
        let nodes = PlaneNodes::of(grid, IndexPlane::Z(0))?;
        let [n_columns, n_rows] = nodes.n;
        let heights = HeightField {
            origin: *origin,
            along_column: steps[0],
            along_row: steps[1],
            along_value: steps[0].cross(steps[1]).try_normalize().unwrap_or(DVec3::Z) * exaggeration,
        };
        let (positions, values) = (Positions::Heights(heights), nodes.values(grid, field)?);
        Ok(CurvilinearGrid::new(n_rows.saturating_sub(1), n_columns.saturating_sub(1), positions, values)?)
    }
}

/// The nodes of a plane, row by row.
struct PlaneNodes {
    /// Along columns and rows.
    n: [u32; 2],
    plane: IndexPlane,
}

impl PlaneNodes {
    fn of(grid: &StructuredGrid, plane: IndexPlane) -> Result<PlaneNodes, GridPlaneError> {
        let (n, axis, index) = (grid.n_nodes(), plane.axis(), plane.index());
        if index >= n[axis] {
            return Err(GridPlaneError::NoPlane { axis: plane.letter(), index, n: n[axis] });
        }
        Ok(PlaneNodes { n: plane.across().map(|axis| n[axis]), plane })
    }

    fn iter(&self) -> impl Iterator<Item = UVec3> + use<> {
        self.plane.nodes(UVec3::ZERO, self.n)
    }

    fn values(&self, grid: &StructuredGrid, field: usize) -> Result<Vec<f32>, GridPlaneError> {
        let fields = grid.fields();
        let values = &fields.get(field).ok_or(GridPlaneError::NoField { field, n: fields.len() })?.values;
        let is_hole = |i: usize| grid.holes().is_some_and(|holes| holes[i]);
        let value = |i: usize| if is_hole(i) { f32::NAN } else { values[i] };
        Ok(self.iter().map(|node| value(grid.number(node))).collect())
    }
}

#[cfg(test)]
mod tests {
    use brickfield_core::NodeField;

    use super::*;
    use crate::Node;

    fn grid() -> StructuredGrid {
        let points = GridPoints::Even { origin: DVec3::ONE, steps: [DVec3::X * 2.0, DVec3::Y * 3.0, DVec3::Z * 4.0] };
        let values = (0..24).map(|i| i as f32).collect();
        let field = NodeField { name: "number".into(), unit: None, values };
        let holes: Vec<bool> = (0..24).map(|i| i == 5).collect();
        let grid = StructuredGrid::new(UVec3::new(2, 3, 4), points).unwrap();
        grid.with_field(field).unwrap().with_holes(&holes).unwrap()
    }

    #[test]
    fn planes_have_their_nodes() {
        let node = |row, column| Node { row, column };
        let i = CurvilinearGrid::of_plane(&grid(), IndexPlane::X(1), 0).unwrap();
        assert_eq!((i.n_columns(), i.n_rows()), (2, 3));
        assert_eq!((i.value(node(3, 2)), i.position(node(3, 2))), (23.0, DVec3::new(3.0, 7.0, 13.0)));
        assert!(i.value(node(0, 2)).is_nan());
        let j = CurvilinearGrid::of_plane(&grid(), IndexPlane::Y(0), 0).unwrap();
        assert_eq!((j.n_columns(), j.n_rows(), j.value(node(1, 2))), (3, 1, 13.0));
        let k = CurvilinearGrid::of_plane(&grid(), IndexPlane::Z(2), 0).unwrap();
        assert_eq!((k.n_columns(), k.n_rows(), k.value(node(2, 0))), (1, 2, 16.0));
    }

    #[test]
    fn heights_rise_from_the_plane() {
        let heights = CurvilinearGrid::of_heights(&grid(), 0, 0.5).unwrap();
        assert_eq!(heights.position(Node { row: 1, column: 1 }), DVec3::new(3.0, 4.0, 1.0 + 0.5 * 3.0));
    }

    #[test]
    fn faults_are_named() {
        let error = |plane, field| CurvilinearGrid::of_plane(&grid(), plane, field).unwrap_err().to_string();
        assert_eq!(error(IndexPlane::X(2), 0), "the plane i = 2; the grid has 2 nodes along i");
        assert_eq!(error(IndexPlane::X(1), 3), "field 3; the grid has 1");
    }
}
