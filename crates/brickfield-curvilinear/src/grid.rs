//! Curvilinear grids: nodes in rows and columns, with positions and values.

use std::ops::Range;

use brickfield_core::glam::{DVec3, Vec3};
use brickfield_core::{Aabb, ValueRange};

use crate::{LayoutError, QuadLayout};

/// A structured grid of quadrilateral zones: (rows + 1) x (columns + 1) nodes, each with a position in the world and a value.
///
/// Nodes are stored row by row. A node whose value is NaN is a hole: a zone with such a corner is not drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct CurvilinearGrid {
    layout: QuadLayout,
    positions: Positions,
    values: Vec<f32>,
    ends: GridEnds,
}

/// Where the nodes lie, in world units.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs)]
pub enum Positions {
    /// A position for each node, row by row: 24 bytes a node.
    Curvilinear(Vec<DVec3>),
    /// An offset from a common origin for each node, row by row: 12 bytes a node.
    Offsets { origin: DVec3, offsets: Vec<Vec3> },
    /// No stored positions: values are heights over an even grid.
    Heights(HeightField),
}

/// Positions over an even grid: origin + column * along_column + row * along_row + value * along_value.
///
/// `along_column` leads from a column to the next. With `along_value` = 0 the grid is flat, and values are seen as colours only.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct HeightField {
    pub origin: DVec3,
    pub along_column: DVec3,
    pub along_row: DVec3,
    pub along_value: DVec3,
}

/// What lies beyond the last row or column.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum End {
    /// Nothing.
    #[default]
    Open,
    /// The first one: the nodes of the last row (or column) are those of the first, stored twice.
    Closed,
}

/// The ends of both axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[allow(missing_docs)]
pub struct GridEnds {
    pub rows: End,
    pub columns: End,
}

/// Row and column of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs)]
pub struct Node {
    pub row: u32,
    pub column: u32,
}

/// Why there is no grid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum CurvilinearGridError {
    #[error(transparent)]
    Layout(#[from] LayoutError),
    #[error("{n} {what}; a grid of {n_rows} x {n_columns} zones has {n_nodes} nodes")]
    Count { what: &'static str, n: usize, n_rows: u32, n_columns: u32, n_nodes: usize },
    #[error("the node of row {} and column {} lies at {position}; it must be finite", node.row, node.column)]
    Position { node: Node, position: DVec3 },
    #[error("the node of row {} and column {} has the value {value}; it must be finite, or NaN for a hole", node.row, node.column)]
    Value { node: Node, value: f32 },
    #[error("the {what} of a height field is {value}; it must be finite")]
    HeightField { what: &'static str, value: DVec3 },
    #[error("a closed axis of {n} {what}; it needs at least 3")]
    ClosedShort { what: &'static str, n: u32 },
    #[error(
        "the {what} are closed, but the node of row {} and column {} is another one than that of row {} and column {}",
        last.row, last.column, first.row, first.column
    )]
    Seam { what: &'static str, first: Node, last: Node },
}

impl CurvilinearGrid {
    /// A grid of n_rows x n_columns zones, with open ends.
    ///
    /// # Errors
    /// No zones; not one position and one value for each node; a position that is not finite, even that of a hole; an infinite
    /// value.
    pub fn new(
        n_rows: u32,
        n_columns: u32,
        positions: Positions,
        values: Vec<f32>,
    ) -> Result<CurvilinearGrid, CurvilinearGridError> {
        let layout = QuadLayout::new(n_rows, n_columns)?;
        let n_nodes = (n_rows as usize + 1) * (n_columns as usize + 1);
        let n_positions = positions.n_stored().unwrap_or(n_nodes);
        for (what, n) in [("values", values.len()), ("positions", n_positions)] {
            if n != n_nodes {
                return Err(CurvilinearGridError::Count { what, n, n_rows, n_columns, n_nodes });
            }
        }
        let grid = CurvilinearGrid { layout, positions, values, ends: GridEnds::default() };
        grid.check_numbers()?;
        Ok(grid)
    }

    /// The same grid with rows, columns, or both closed: zones on both sides of a seam are neighbours.
    ///
    /// # Errors
    /// A closed axis of less than three zones; a node of the seam that has not the same position and value, bit by bit, on both sides.
    pub fn with_ends(self, ends: GridEnds) -> Result<CurvilinearGrid, CurvilinearGridError> {
        let (n_rows, n_columns) = (self.n_rows(), self.n_columns());
        for (what, n, end) in [("rows", n_rows, ends.rows), ("columns", n_columns, ends.columns)] {
            if end == End::Closed && n < 3 {
                return Err(CurvilinearGridError::ClosedShort { what, n });
            }
        }
        let node = |row, column| Node { row, column };
        if ends.rows == End::Closed {
            self.check_seam("rows", (0..=n_columns).map(|c| (node(0, c), node(n_rows, c))))?;
        }
        if ends.columns == End::Closed {
            self.check_seam("columns", (0..=n_rows).map(|r| (node(r, 0), node(r, n_columns))))?;
        }
        Ok(CurvilinearGrid { ends, ..self })
    }

    /// The same grid with holes where `is_hole` says so, by the number of a node in the order of rows (IBLANK = 0 in PLOT3D). A node of
    /// a seam is a hole if one of its copies is.
    pub fn with_holes(mut self, is_hole: impl Fn(usize) -> bool) -> CurvilinearGrid {
        for i in 0..self.values.len() {
            let copies = self.copies(self.canonical(self.node(i)));
            if copies.map(|node| self.number(node)).any(&is_hole) {
                self.values[i] = f32::NAN;
            }
        }
        self
    }

    /// The levels of zones over this grid.
    pub fn layout(&self) -> &QuadLayout {
        &self.layout
    }

    /// Rows of final zones.
    pub fn n_rows(&self) -> u32 {
        self.layout.rows().n_final()
    }

    /// Columns of final zones.
    pub fn n_columns(&self) -> u32 {
        self.layout.columns().n_final()
    }

    /// Where the nodes lie.
    pub fn positions(&self) -> &Positions {
        &self.positions
    }

    /// The value of each node, row by row; NaN for a hole.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The ends of both axes.
    pub fn ends(&self) -> GridEnds {
        self.ends
    }

    /// Bytes of positions and values.
    pub fn n_bytes(&self) -> usize {
        let positions = match &self.positions {
            Positions::Curvilinear(p) => size_of_val(p.as_slice()),
            Positions::Offsets { offsets, .. } => size_of_val(offsets.as_slice()),
            Positions::Heights(_) => 0,
        };
        positions + size_of_val(self.values.as_slice())
    }

    /// The value of a node; NaN for a hole.
    ///
    /// # Panics
    /// Beyond the last row, as [`position`](Self::position) does.
    #[inline]
    pub fn value(&self, node: Node) -> f32 {
        self.values[self.number(node)]
    }

    /// Where a node lies in the world. A hole of a height field lies at the height of value 0.
    #[inline]
    pub fn position(&self, node: Node) -> DVec3 {
        match &self.positions {
            Positions::Curvilinear(positions) => positions[self.number(node)],
            Positions::Offsets { origin, offsets } => *origin + offsets[self.number(node)].as_dvec3(),
            Positions::Heights(field) => {
                let value = self.value(node);
                field.at(node, if value.is_nan() { 0.0 } else { f64::from(value) })
            }
        }
    }

    /// The range of the values of all nodes that are no holes; `None` if all are.
    pub fn range(&self) -> Option<ValueRange> {
        ValueRange::of(self.values.iter().map(|value| f64::from(*value)))
    }

    /// The box around all nodes that are no holes; `None` if all are.
    pub fn extent(&self) -> Option<Aabb> {
        let nodes = (0..self.values.len()).filter(|i| !self.values[*i].is_nan()).map(|i| self.position(self.node(i)));
        let around = Aabb::of_points(nodes);
        (around.min.x <= around.max.x).then_some(around)
    }

    /// The node that stands for a node and, if it lies on a seam, for its copies.
    #[inline]
    pub fn canonical(&self, node: Node) -> Node {
        let wrap = |i: u32, n: u32, end: End| if end == End::Closed && i == n { 0 } else { i };
        Node {
            row: wrap(node.row, self.n_rows(), self.ends.rows),
            column: wrap(node.column, self.n_columns(), self.ends.columns),
        }
    }

    /// A canonical node and its copies on the other sides of seams.
    pub(crate) fn copies(&self, node: Node) -> impl Iterator<Item = Node> + Clone + use<> {
        let along =
            |i: u32, n: u32, end: End| [Some(i), (end == End::Closed && i == 0).then_some(n)].into_iter().flatten();
        let columns = along(node.column, self.n_columns(), self.ends.columns);
        along(node.row, self.n_rows(), self.ends.rows)
            .flat_map(move |row| columns.clone().map(move |column| Node { row, column }))
    }

    /// The node so many rows and columns further; `None` beyond an open end. At most a whole closed axis further.
    pub fn moved(&self, node: Node, rows: i64, columns: i64) -> Option<Node> {
        let step = |i: u32, by: i64, n: u32, end: End| {
            let i = i64::from(i) + by;
            match end {
                End::Closed => Some(i.rem_euclid(i64::from(n)) as u32),
                End::Open => (0..=i64::from(n)).contains(&i).then_some(i as u32),
            }
        };
        Some(Node {
            row: step(node.row, rows, self.n_rows(), self.ends.rows)?,
            column: step(node.column, columns, self.n_columns(), self.ends.columns)?,
        })
    }

    /// The values of some columns of nodes in a row of nodes.
    #[inline]
    pub(crate) fn row_values(&self, row: u32, columns: Range<u32>) -> &[f32] {
        let first = self.number(Node { row, column: columns.start });
        &self.values[first..first + columns.len()]
    }

    #[inline]
    fn number(&self, node: Node) -> usize {
        node.row as usize * (self.n_columns() as usize + 1) + node.column as usize
    }

    fn node(&self, number: usize) -> Node {
        let n = self.n_columns() as usize + 1;
        Node { row: (number / n) as u32, column: (number % n) as u32 }
    }

    fn check_numbers(&self) -> Result<(), CurvilinearGridError> {
        if let Some(i) = self.values.iter().position(|v| v.is_infinite()) {
            return Err(CurvilinearGridError::Value { node: self.node(i), value: self.values[i] });
        }
        let bad = match &self.positions {
            Positions::Curvilinear(p) => p.iter().position(|p| !p.is_finite()),
            Positions::Offsets { origin, offsets } => {
                offsets.iter().position(|p| !(*origin + p.as_dvec3()).is_finite())
            }
            Positions::Heights(field) => return field.check(),
        };
        bad.map_or(Ok(()), |i| {
            let node = self.node(i);
            Err(CurvilinearGridError::Position { node, position: self.position(node) })
        })
    }

    fn check_seam(
        &self,
        what: &'static str,
        mut pairs: impl Iterator<Item = (Node, Node)>,
    ) -> Result<(), CurvilinearGridError> {
        let bits = |node| (self.position(node).to_array().map(f64::to_bits), self.value(node).to_bits());
        match pairs.find(|(first, last)| bits(*first) != bits(*last)) {
            Some((first, last)) => Err(CurvilinearGridError::Seam { what, first, last }),
            None => Ok(()),
        }
    }
}

impl Positions {
    fn n_stored(&self) -> Option<usize> {
        match self {
            Positions::Curvilinear(positions) => Some(positions.len()),
            Positions::Offsets { offsets, .. } => Some(offsets.len()),
            Positions::Heights(_) => None,
        }
    }
}

impl HeightField {
    /// Where a node with this value lies. Along each axis of space the position is monotone in row, column and value, roundings
    /// included.
    #[inline]
    pub fn at(&self, node: Node, value: f64) -> DVec3 {
        let flat = self.origin + self.along_column * f64::from(node.column) + self.along_row * f64::from(node.row);
        flat + self.along_value * value
    }

    fn check(&self) -> Result<(), CurvilinearGridError> {
        let named = [
            ("origin", self.origin),
            ("step along a column", self.along_column),
            ("step along a row", self.along_row),
            ("step along the value", self.along_value),
        ];
        match named.into_iter().find(|(_, value)| !value.is_finite()) {
            Some((what, value)) => Err(CurvilinearGridError::HeightField { what, value }),
            None => Ok(()),
        }
    }
}
