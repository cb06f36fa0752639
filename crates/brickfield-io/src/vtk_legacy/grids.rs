//! Rectilinear and structured grids from the sections of a legacy VTK file.

use brickfield_core::glam::UVec3;
use brickfield_core::{GridPoints, StructuredGrid, Voxels};

use super::dataset::{Dataset, Wanted};
use super::read_array;
use super::sections::{Sections, StoredArray};
use crate::files::ByteSource;
use crate::grids::{add_array, check_nodes, checked_nodes, n_field_bytes, positions};
use crate::limits::CheckedShape;
use crate::vtk_arrays::{Support, dims, only_points};
use crate::{GridNote, Limits, ReadError};

/// Reads the grid; its meaning is that of [`grids::vtk_legacy`](crate::grids::vtk_legacy).
pub(crate) fn read_grid(
    source: &mut dyn ByteSource,
    limits: &Limits,
) -> Result<(StructuredGrid, Vec<GridNote>), ReadError> {
    let sections = Sections::read(source, Wanted::Grid)?;
    let n_nodes = checked_nodes(dims(&sections.geometry.extent, Support::Points)?)?;
    let mut notes = Vec::new();
    only_points(sections.arrays.iter().map(|array| &array.about), &mut notes)?;
    let of_points = || sections.arrays.iter().filter(|array| array.about.support == Support::Points);
    // Positions as they are kept, and as they are read; a hole.
    let node_bytes = 24 + 24 + 1 + n_field_bytes(of_points().map(|array| &array.about))?;
    check_nodes(&[n_nodes], node_bytes, 0, limits)?;
    let reader = ArrayReader { is_binary: sections.is_binary, limits: *limits };
    let points = read_points(source, &sections, n_nodes, &reader)?;
    let mut grid = StructuredGrid::new(n_nodes, points)?;
    for array in of_points() {
        let numbers = reader.read(source, array, n_nodes)?;
        grid = add_array(grid, &array.about, &numbers)?;
    }
    if let Some(blanking) = &sections.blanking {
        let marks = reader.read(source, blanking, n_nodes)?;
        let holes: Vec<bool> = (0..marks.len()).map(|i| marks.at(i) == 0.0).collect();
        grid = grid.with_holes(&holes)?;
    }
    Ok((grid, notes))
}

fn read_points(
    source: &mut dyn ByteSource,
    sections: &Sections,
    n_nodes: UVec3,
    reader: &ArrayReader,
) -> Result<GridPoints, ReadError> {
    if sections.dataset == Dataset::Structured {
        let points = sections.points.iter().find(|array| array.about.n_components == 3);
        let points = points.ok_or(ReadError::Missing { field: "POINTS" })?;
        return Ok(GridPoints::Curvilinear(positions(&reader.read(source, points, n_nodes)?)?));
    }
    let mut axis = |axis: usize, name: &'static str| -> Result<Vec<f64>, ReadError> {
        let is_named = |array: &&StoredArray| array.about.name.eq_ignore_ascii_case(name);
        let array = sections.points.iter().find(is_named).ok_or(ReadError::Missing { field: name })?;
        let numbers = reader.read(source, array, UVec3::new(n_nodes[axis], 1, 1))?;
        Ok((0..numbers.len()).map(|i| numbers.at(i)).collect())
    };
    Ok(GridPoints::Rectilinear([axis(0, "X_COORDINATES")?, axis(1, "Y_COORDINATES")?, axis(2, "Z_COORDINATES")?]))
}

struct ArrayReader {
    is_binary: bool,
    limits: Limits,
}

impl ArrayReader {
    /// The numbers of an array that has to have a tuple for each node.
    fn read(&self, source: &mut dyn ByteSource, array: &StoredArray, n_nodes: UVec3) -> Result<Voxels, ReadError> {
        let n = n_nodes.to_array().map(u64::from);
        let expected: u64 = n.iter().product();
        if array.n_voxels != expected {
            let expected = format!("{expected}, from the dimensions");
            return Err(ReadError::field(format!("size of {}", array.what()), array.n_voxels, expected));
        }
        let stored = array.about.sample()?.stored();
        let n_x = n[0].saturating_mul(array.about.n_components);
        let shape = CheckedShape::claim([n_x, n[1], n[2]], stored, &self.limits)?;
        read_array(source, array, self.is_binary, &shape)
    }
}
