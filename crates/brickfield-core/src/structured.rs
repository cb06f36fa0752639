//! Structured grids, as files hold them: nodes with positions and values.

use glam::{DVec3, UVec3};

/// A structured grid: nodes in rows, columns and layers, i varying fastest. A surface has one layer, a line of nodes one row as well.
///
/// All positions are finite. Nodes that the file marks as void, and nodes at which no number is stored, are holes.
#[derive(Clone, Debug, PartialEq)]
pub struct StructuredGrid {
    n_nodes: UVec3,
    points: GridPoints,
    fields: Vec<NodeField>,
    holes: Option<Vec<bool>>,
}

/// Where the nodes of a structured grid lie, in the file's units.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs)]
pub enum GridPoints {
    /// origin + i * steps\[0\] + j * steps\[1\] + k * steps\[2\].
    Even { origin: DVec3, steps: [DVec3; 3] },
    /// The coordinates along x, y and z: one for each i, j and k.
    Rectilinear([Vec<f64>; 3]),
    /// A position for each node.
    Curvilinear(Vec<DVec3>),
}

/// A value for each node.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeField {
    /// The file's name for it.
    pub name: String,
    /// Its unit, if the file states one.
    pub unit: Option<String>,
    /// One for each node, rounded to f32. The value of a hole has no meaning.
    pub values: Vec<f32>,
}

/// Why there is no structured grid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum StructuredGridError {
    #[error("a grid of {} x {} x {} nodes; each axis needs at least 1", n_nodes.x, n_nodes.y, n_nodes.z)]
    Empty { n_nodes: UVec3 },
    #[error("{n} {what}; a grid of {} x {} x {} nodes has {expected}", n_nodes.x, n_nodes.y, n_nodes.z)]
    Count { what: String, n: usize, n_nodes: UVec3, expected: u64 },
    #[error("node ({}, {}, {}) lies at {position}; it must be finite", node.x, node.y, node.z)]
    Position { node: UVec3, position: DVec3 },
}

impl StructuredGrid {
    /// A grid without fields and without holes.
    ///
    /// # Errors
    /// An axis without nodes; not one position for each node; a position that is not finite.
    pub fn new(n_nodes: UVec3, points: GridPoints) -> Result<StructuredGrid, StructuredGridError> {
        if n_nodes.min_element() == 0 {
            return Err(StructuredGridError::Empty { n_nodes });
        }
        let grid = StructuredGrid { n_nodes, points, fields: Vec::new(), holes: None };
        grid.check_points()?;
        Ok(grid)
    }

    /// The same grid with one more field. A node without a finite value is a hole from then on, in all fields.
    ///
    /// # Errors
    /// Not one value for each node.
    pub fn with_field(mut self, field: NodeField) -> Result<StructuredGrid, StructuredGridError> {
        self.check_count(|| format!("values of {}", field.name), field.values.len(), self.n())?;
        if field.values.iter().any(|value| !value.is_finite()) {
            self.add_holes(field.values.iter().map(|value| !value.is_finite()));
        }
        self.fields.push(field);
        Ok(self)
    }

    /// The same grid with more holes (IBLANK = 0 in PLOT3D).
    ///
    /// # Errors
    /// Not one mark for each node.
    pub fn with_holes(mut self, holes: &[bool]) -> Result<StructuredGrid, StructuredGridError> {
        self.check_count(|| "marks of holes".into(), holes.len(), self.n())?;
        if holes.contains(&true) {
            self.add_holes(holes.iter().copied());
        }
        Ok(self)
    }

    /// Nodes along i, j and k.
    pub fn n_nodes(&self) -> UVec3 {
        self.n_nodes
    }

    /// How many nodes there are.
    pub fn n(&self) -> u64 {
        self.n_nodes.to_array().iter().map(|n| u64::from(*n)).product()
    }

    /// Where the nodes lie.
    pub fn points(&self) -> &GridPoints {
        &self.points
    }

    /// The fields, in the order of the file.
    pub fn fields(&self) -> &[NodeField] {
        &self.fields
    }

    /// Whether each node is a hole; `None` if none is.
    pub fn holes(&self) -> Option<&[bool]> {
        self.holes.as_deref()
    }

    /// The number of a node, by which values are found.
    pub fn number(&self, node: UVec3) -> usize {
        let [nx, ny, _] = self.n_nodes.to_array().map(|n| n as usize);
        node.x as usize + nx * (node.y as usize + ny * node.z as usize)
    }

    /// The node with a number.
    pub fn node(&self, number: usize) -> UVec3 {
        let [nx, ny, _] = self.n_nodes.to_array().map(|n| n as usize);
        UVec3::new((number % nx) as u32, (number / nx % ny) as u32, (number / nx / ny) as u32)
    }

    /// Where a node lies.
    pub fn position(&self, node: UVec3) -> DVec3 {
        match &self.points {
            GridPoints::Even { origin, steps } => {
                let n = node.as_dvec3();
                *origin + steps[0] * n.x + steps[1] * n.y + steps[2] * n.z
            }
            GridPoints::Rectilinear([x, y, z]) => {
                DVec3::new(x[node.x as usize], y[node.y as usize], z[node.z as usize])
            }
            GridPoints::Curvilinear(positions) => positions[self.number(node)],
        }
    }

    fn add_holes(&mut self, holes: impl Iterator<Item = bool>) {
        let n = self.n() as usize;
        let all = self.holes.get_or_insert_with(|| vec![false; n]);
        all.iter_mut().zip(holes).for_each(|(all, hole)| *all |= hole);
    }

    fn check_count(&self, what: impl Fn() -> String, n: usize, expected: u64) -> Result<(), StructuredGridError> {
        if n as u64 == expected {
            Ok(())
        } else {
            Err(StructuredGridError::Count { what: what(), n, n_nodes: self.n_nodes, expected })
        }
    }

    fn check_points(&self) -> Result<(), StructuredGridError> {
        let bad = match &self.points {
            GridPoints::Even { .. } => self.corners().find(|node| !self.position(*node).is_finite()),
            GridPoints::Rectilinear(axes) => {
                for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
                    self.check_count(
                        || format!("coordinates along {name}"),
                        axes[axis].len(),
                        self.n_nodes[axis].into(),
                    )?;
                }
                (0..3).find_map(|axis| {
                    let at = axes[axis].iter().position(|x| !x.is_finite())?;
                    Some(UVec3::from(std::array::from_fn(|a| if a == axis { at as u32 } else { 0 })))
                })
            }
            GridPoints::Curvilinear(positions) => {
                self.check_count(|| "positions".into(), positions.len(), self.n())?;
                positions.iter().position(|p| !p.is_finite()).map(|i| self.node(i))
            }
        };
        bad.map_or(Ok(()), |node| Err(StructuredGridError::Position { node, position: self.position(node) }))
    }

    fn corners(&self) -> impl Iterator<Item = UVec3> + use<> {
        let last = self.n_nodes - 1;
        (0..8).map(move |i| last * UVec3::new(i & 1, i >> 1 & 1, i >> 2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn even(n_nodes: UVec3) -> StructuredGrid {
        StructuredGrid::new(n_nodes, GridPoints::Even { origin: DVec3::ONE, steps: DVec3::AXES }).unwrap()
    }

    fn field(values: Vec<f32>) -> NodeField {
        NodeField { name: "density".into(), unit: None, values }
    }

    #[test]
    fn values_that_are_not_finite_are_holes() {
        let grid = even(UVec3::new(3, 1, 1)).with_field(field(vec![1.0, f32::NAN, 2.0])).unwrap();
        assert_eq!(grid.holes(), Some(&[false, true, false][..]));
        let grid = grid.with_holes(&[true, false, false]).unwrap();
        assert_eq!(grid.holes(), Some(&[true, true, false][..]));
    }

    #[test]
    fn wrong_counts_and_positions_are_named() {
        let error = even(UVec3::new(2, 2, 1)).with_field(field(vec![0.0; 3])).unwrap_err();
        assert_eq!(error.to_string(), "3 values of density; a grid of 2 x 2 x 1 nodes has 4");
        let n = UVec3::new(2, 1, 2);
        let positions = vec![DVec3::ZERO, DVec3::ZERO, DVec3::ZERO, DVec3::X * f64::INFINITY];
        let error = StructuredGrid::new(n, GridPoints::Curvilinear(positions)).unwrap_err();
        assert_eq!(error.to_string(), "node (1, 0, 1) lies at [inf, NaN, NaN]; it must be finite");
        let axes = [vec![0.0, 1.0], vec![0.0], vec![0.0]];
        let error = StructuredGrid::new(n, GridPoints::Rectilinear(axes)).unwrap_err();
        assert_eq!(error.to_string(), "1 coordinates along z; a grid of 2 x 1 x 2 nodes has 2");
        let points = GridPoints::Even { origin: DVec3::ZERO, steps: [DVec3::X * f64::MAX; 3] };
        assert!(StructuredGrid::new(n, points).is_err());
    }

    #[test]
    fn a_node_is_found_by_its_number() {
        let grid = even(UVec3::new(3, 4, 5));
        for i in 0..60 {
            assert_eq!(grid.number(grid.node(i)), i);
        }
        assert_eq!(grid.position(UVec3::new(2, 3, 4)), DVec3::new(3.0, 4.0, 5.0));
    }
}
