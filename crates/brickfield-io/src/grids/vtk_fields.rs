//! What both VTK readers of grids share: fields, holes and positions from arrays.

use brickfield_core::glam::DVec3;
use brickfield_core::{NodeField, Scalar, StructuredGrid, Voxels, with_voxels};

use crate::ReadError;
use crate::numbers::with_room;
use crate::vtk_arrays::{GHOSTS, VtkArray};

/// The mark of a point that is left out (vtkDataSetAttributes.h, HIDDENPOINT).
const HIDDEN_POINT: u64 = 2;

/// The grid with the fields of an array, whose numbers lie node after node; vtkGhostType has holes instead.
pub(crate) fn add_array(
    mut grid: StructuredGrid,
    about: &VtkArray,
    numbers: &Voxels,
) -> Result<StructuredGrid, ReadError> {
    let n_components = about.n_components as usize;
    if about.name == GHOSTS && n_components == 1 {
        let mut holes = with_room(numbers.len())?;
        with_voxels!(numbers, v => holes.extend(v.iter().map(|mark| mark.to_f64() as u64 & HIDDEN_POINT != 0)));
        return Ok(grid.with_holes(&holes)?);
    }
    for (component, name) in component_names(about).into_iter().enumerate() {
        let mut values = with_room(numbers.len() / n_components)?;
        with_voxels!(numbers, v => values.extend(v.iter().skip(component).step_by(n_components).map(|x| x.to_f64() as f32)));
        grid = grid.with_field(NodeField { name, unit: None, values })?;
    }
    Ok(grid)
}

/// A name for each component: "p"; "u x", "u y", "u z"; "u 0" to "u 8"; or the names in the file.
fn component_names(about: &VtkArray) -> Vec<String> {
    let VtkArray { name, n_components, component_names, .. } = about;
    let of = |component: &dyn std::fmt::Display| format!("{name} {component}").trim_start().to_owned();
    match n_components {
        1 => vec![name.clone()],
        n if component_names.len() as u64 == *n => component_names.iter().map(|c| of(c)).collect(),
        n @ (2 | 3) => ["x", "y", "z"].iter().take(*n as usize).map(|c| of(c)).collect(),
        n => (0..*n).map(|i| of(&i)).collect(),
    }
}

/// Bytes of the fields of a node, and of the widest array as it is read.
pub(crate) fn n_field_bytes<'a>(arrays: impl Iterator<Item = &'a VtkArray>) -> Result<u128, ReadError> {
    let (mut n_fields, mut widest) = (0u128, 0u128);
    for array in arrays {
        if array.n_components == 0 {
            return Err(ReadError::field(format!("components of array {:?}", array.name), 0, "at least 1"));
        }
        let n = u128::from(array.n_components);
        n_fields = n_fields.saturating_add(n);
        widest = widest.max(n * array.sample()?.stored().read_into().n_bytes() as u128);
    }
    Ok(n_fields.saturating_mul(4).saturating_add(widest))
}

/// Three numbers each.
pub(crate) fn positions(numbers: &Voxels) -> Result<Vec<DVec3>, ReadError> {
    let mut positions = with_room(numbers.len() / 3)?;
    with_voxels!(numbers, v => {
        positions.extend(v.as_chunks::<3>().0.iter().map(|p| DVec3::from(p.map(Scalar::to_f64))));
    });
    Ok(positions)
}
