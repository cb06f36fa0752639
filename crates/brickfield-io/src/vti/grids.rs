//! Rectilinear and structured grids from the document of a .vtr or .vts file.

use brickfield_core::glam::UVec3;
use brickfield_core::{GridPoints, StructuredGrid, Voxels};

use super::document::{Array, Dataset, Document, Piece};
use super::elements::read_document;
use super::read_array;
use crate::files::ByteSource;
use crate::grids::{add_array, check_nodes, checked_nodes, n_field_bytes, positions};
use crate::limits::CheckedShape;
use crate::vtk_arrays::{Support, VtkArray, dims, only_points};
use crate::{GridNote, Limits, ReadError};

/// Reads the pieces; their meaning is that of [`grids::vtk_xml`](crate::grids::vtk_xml).
pub(crate) fn read_grids(
    source: &mut dyn ByteSource,
    limits: &Limits,
) -> Result<(Vec<StructuredGrid>, Vec<GridNote>), ReadError> {
    let document = read_document(source)?;
    if document.dataset == Dataset::Image {
        let supported = "RectilinearGrid and StructuredGrid are; `open` reads it as a volume";
        return Err(ReadError::unsupported("VTKFile type", "ImageData", supported));
    }
    let (mut sizes, mut node_bytes, mut notes) = (Vec::new(), 0, Vec::new());
    for piece in &document.pieces {
        sizes.push(checked_nodes(dims(&piece.extent, Support::Points)?)?);
        only_points(piece.arrays.iter().map(|array| &array.about), &mut notes)?;
        node_bytes = n_field_bytes(piece.point_arrays().map(|array| &array.about))?.max(node_bytes);
    }
    // Positions as they are kept, and as they are read; a hole.
    check_nodes(&sizes, node_bytes.saturating_add(24 + 24 + 1), 0, limits)?;
    let mut grids = Vec::new();
    for (piece, n_nodes) in document.pieces.iter().zip(sizes) {
        grids.push(read_piece(source, &document, piece, n_nodes, limits)?);
    }
    Ok((grids, notes))
}

impl Piece {
    fn point_arrays(&self) -> impl Iterator<Item = &Array> {
        self.arrays.iter().filter(|array| array.about.support == Support::Points)
    }
}

fn read_piece(
    source: &mut dyn ByteSource,
    document: &Document,
    piece: &Piece,
    n_nodes: UVec3,
    limits: &Limits,
) -> Result<StructuredGrid, ReadError> {
    let points = match document.dataset {
        Dataset::Structured => {
            let array = piece.geometry.first().ok_or_else(|| document.missing("the DataArray in Points"))?;
            check_components(&array.about, 3)?;
            GridPoints::Curvilinear(positions(&read(source, document, array, n_nodes, limits)?)?)
        }
        _ => GridPoints::Rectilinear(read_axes(source, document, piece, n_nodes, limits)?),
    };
    let mut grid = StructuredGrid::new(n_nodes, points)?;
    for array in piece.point_arrays() {
        let numbers = read(source, document, array, n_nodes, limits)?;
        grid = add_array(grid, &array.about, &numbers)?;
    }
    Ok(grid)
}

fn read_axes(
    source: &mut dyn ByteSource,
    document: &Document,
    piece: &Piece,
    n_nodes: UVec3,
    limits: &Limits,
) -> Result<[Vec<f64>; 3], ReadError> {
    let mut axes = [const { Vec::new() }; 3];
    for (axis, coordinates) in axes.iter_mut().enumerate() {
        let missing = || document.missing("a DataArray in Coordinates for each of x, y and z");
        let array = piece.geometry.get(axis).ok_or_else(missing)?;
        check_components(&array.about, 1)?;
        let numbers = read(source, document, array, UVec3::new(n_nodes[axis], 1, 1), limits)?;
        coordinates.extend((0..numbers.len()).map(|i| numbers.at(i)));
    }
    Ok(axes)
}

fn check_components(about: &VtkArray, expected: u64) -> Result<(), ReadError> {
    match about.n_components == expected {
        true => Ok(()),
        false => {
            let field = format!("components of array {:?}", about.name);
            Err(ReadError::field(field, about.n_components, format!("{expected}, of positions")))
        }
    }
}

/// All numbers of an array, a tuple for each node.
fn read(
    source: &mut dyn ByteSource,
    document: &Document,
    array: &Array,
    n_nodes: UVec3,
    limits: &Limits,
) -> Result<Voxels, ReadError> {
    let stored = array.about.sample()?.stored();
    let [x, y, z] = n_nodes.to_array().map(u64::from);
    let shape = CheckedShape::claim([x.saturating_mul(array.about.n_components), y, z], stored, limits)?;
    read_array(source, document, array, &shape)
}
