//! What both VTK readers share: the arrays of an image, the choice of one, its samples, and the grid.

use std::io::{self, Read};

use brickfield_core::glam::{DMat3, DVec3};
use brickfield_core::{ScalarType, Voxels};

use crate::choice::Entries;
use crate::colour::Colours;
use crate::limits::CheckedShape;
use crate::opened::FileFacts;
use crate::placement::{AXES, GridPlacement, usable_spacing};
use crate::samples::append_binary;
use crate::stored_type::StoredType;
use crate::stored_voxel::StoredVoxel;
use crate::{ByteOrder, ChoiceKind, GridNote, Note, ReadError};

/// Whether values belong to the points of the grid or to its cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Support {
    Points,
    Cells,
}

/// How a sample is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum VtkSample {
    /// Eight to a byte, the first one highest.
    Bit,
    Bytes(StoredType),
}

impl VtkSample {
    pub(crate) fn stored(self) -> StoredType {
        match self {
            VtkSample::Bit => StoredType::Bool,
            VtkSample::Bytes(stored) => stored,
        }
    }

    /// Appends the part that is read of the shape's voxels; `what` names them in errors.
    pub(crate) fn append(
        self,
        voxels: &mut Voxels,
        reader: &mut dyn Read,
        shape: &CheckedShape,
        order: ByteOrder,
        what: &str,
    ) -> Result<(), ReadError> {
        let (n, voxel) = (shape.n_voxels(), shape.voxel);
        match self {
            VtkSample::Bit => append_binary(voxels, &mut Bits::new(reader), n, voxel, order, what),
            VtkSample::Bytes(_) => append_binary(voxels, reader, n, voxel, order, what),
        }
    }

    /// Bytes of so many samples.
    pub(crate) fn n_bytes(self, n_samples: u64) -> u64 {
        match self {
            VtkSample::Bit => n_samples.div_ceil(8),
            VtkSample::Bytes(stored) => n_samples.saturating_mul(stored.n_bytes() as u64),
        }
    }
}

impl From<ScalarType> for VtkSample {
    fn from(scalar: ScalarType) -> VtkSample {
        VtkSample::Bytes(scalar.into())
    }
}

/// An array of an image, without its numbers.
#[derive(Clone, Debug)]
pub(crate) struct VtkArray {
    pub(crate) name: String,
    pub(crate) type_name: String,
    /// None for a type that is not read.
    pub(crate) sample: Option<VtkSample>,
    pub(crate) support: Support,
    pub(crate) n_components: u64,
    /// Names of the components; empty where they have none.
    pub(crate) component_names: Vec<String>,
    /// Whether the file names it as the scalars to show.
    pub(crate) is_active: bool,
}

impl VtkArray {
    /// # Errors
    /// If the type is not read.
    pub(crate) fn sample(&self) -> Result<VtkSample, ReadError> {
        let supported = "8 to 64 bit integers, 32 and 64 bit floats and bits are";
        self.sample.ok_or_else(|| ReadError::unsupported("array type", &self.type_name, supported))
    }

    /// The voxels of the array: the component that is wanted of several; three or four bytes are a colour.
    pub(crate) fn voxel(&self, found: &mut FileFacts) -> Result<StoredVoxel, ReadError> {
        let stored = self.sample()?.stored();
        let colours = Colours::of_channels(self.n_components).filter(|_| stored == ScalarType::U8.into());
        match (self.n_components, colours) {
            (1, _) => Ok(stored.into()),
            (_, Some(colours)) => StoredVoxel::of_colours(stored, colours, found),
            (0, _) => Err(ReadError::field("number of components", 0, "at least 1")),
            (n, None) => StoredVoxel::of_components(stored, ChoiceKind::Channel, self.components(n), found),
        }
    }

    fn components(&self, n_components: u64) -> Entries {
        match self.component_names.len() as u64 == n_components {
            true => Entries::Named(self.component_names.clone()),
            false => Entries::Numbered(n_components),
        }
    }
}

/// The number of the array that is wanted; without a wish the active scalars, else the first array of one component, of
/// points if there are any.
///
/// # Errors
/// `None` if there are no arrays.
pub(crate) fn choose(arrays: &[&VtkArray], found: &mut FileFacts) -> Result<Option<usize>, ReadError> {
    let of_points = |a: &&VtkArray| a.support == Support::Points;
    let support = if arrays.iter().any(of_points) { Support::Points } else { Support::Cells };
    let first = |is_fit: &dyn Fn(&VtkArray) -> bool| arrays.iter().position(|a| a.support == support && is_fit(a));
    let preferred = first(&|a| a.is_active)
        .or_else(|| first(&|a| a.n_components == 1 && a.sample.is_some()))
        .or_else(|| first(&|a| a.sample.is_some()))
        .or_else(|| first(&|_| true));
    let Some(preferred) = preferred else { return Ok(None) };
    let names = arrays.iter().map(|a| a.name.clone()).collect();
    let chosen = found.choose_or(ChoiceKind::Array, Entries::Named(names), preferred as u64)?;
    Ok(Some(chosen as usize))
}

/// VTK's array of marks of points or cells (vtkDataSetAttributes.h).
pub(crate) const GHOSTS: &str = "vtkGhostType";

/// Notes the arrays of cells of a grid.
///
/// # Errors
/// Values of cells only: means at nodes would be other values than the file's.
pub(crate) fn only_points<'a>(
    arrays: impl Iterator<Item = &'a VtkArray>,
    notes: &mut Vec<GridNote>,
) -> Result<(), ReadError> {
    let (of_points, of_cells): (Vec<_>, Vec<_>) = arrays.partition(|array| array.support == Support::Points);
    let names: Vec<_> = of_cells.iter().map(|array| array.name.clone()).collect();
    if of_points.is_empty() && names.iter().any(|name| name != GHOSTS) {
        let supported = "those of points are: bring cell data to points first (ParaView: Cell Data to Point Data)";
        return Err(ReadError::unsupported("arrays of cells only,", names.join(", "), supported));
    }
    if !names.is_empty() {
        notes.push(GridNote::CellDataLeftOut { names });
    }
    Ok(())
}

/// Where the points of an image lie.
#[derive(Clone, Debug)]
pub(crate) struct ImageGeometry {
    /// First and last point along x, y, z.
    pub(crate) extent: [i64; 6],
    pub(crate) origin: [f64; 3],
    pub(crate) spacing: [f64; 3],
    /// Row by row; column i is the direction of axis i.
    pub(crate) direction: [f64; 9],
}

impl Default for ImageGeometry {
    fn default() -> ImageGeometry {
        let direction = DMat3::IDENTITY.to_cols_array();
        ImageGeometry { extent: [0; 6], origin: [0.0; 3], spacing: [1.0; 3], direction }
    }
}

impl ImageGeometry {
    pub(crate) fn placement(&self, support: Support, notes: &mut Vec<Note>) -> GridPlacement {
        let to_sample = match support {
            Support::Points => DVec3::ZERO,
            Support::Cells => DVec3::splat(0.5),
        };
        let [x, _, y, _, z, _] = self.extent.map(|e| e as f64);
        let direction = DMat3::from_cols_array(&self.direction).transpose();
        let spacing = [0, 1, 2].map(|i| usable_spacing(self.spacing[i], AXES[i], notes));
        let steps = direction * DMat3::from_diagonal(DVec3::from(spacing));
        let first_sample = DVec3::from(self.origin) + steps * (DVec3::new(x, y, z) + to_sample);
        GridPlacement { first_sample, steps }
    }
}

/// Points from the first to the last of an extent; cells between them (at least one along a flat axis, as VTK has it).
pub(crate) fn dims(extent: &[i64; 6], support: Support) -> Result<[u64; 3], ReadError> {
    let mut dims = [0; 3];
    for (axis, dim) in dims.iter_mut().enumerate() {
        let [first, last] = [extent[2 * axis], extent[2 * axis + 1]].map(i128::from);
        let n_points = last - first + 1;
        let n = match support {
            Support::Points => n_points,
            Support::Cells if n_points == 1 => 1,
            Support::Cells => n_points - 1,
        };
        *dim =
            u64::try_from(n).map_err(|_| ReadError::field("Extent", format!("{first} to {last}"), "first <= last"))?;
    }
    Ok(dims)
}

/// Packed bits, the highest of a byte first, as bytes of 0 and 1.
struct Bits<'a> {
    reader: &'a mut dyn Read,
    held: u8,
    n_held: u32,
}

impl<'a> Bits<'a> {
    fn new(reader: &'a mut dyn Read) -> Bits<'a> {
        Bits { reader, held: 0, n_held: 0 }
    }
}

impl Read for Bits<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        for (i, bit) in buffer.iter_mut().enumerate() {
            if self.n_held == 0 {
                let mut byte = [0];
                match self.reader.read(&mut byte) {
                    Ok(0) => return Ok(i),
                    Ok(_) => (self.held, self.n_held) = (byte[0], 8),
                    Err(_) if i > 0 => return Ok(i),
                    Err(fault) => return Err(fault),
                }
            }
            self.n_held -= 1;
            *bit = self.held >> self.n_held & 1;
        }
        Ok(buffer.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_become_bytes() {
        let mut source = &[0b1010_0001u8, 0b1000_0000][..];
        let mut bits = vec![9; 9];
        Bits::new(&mut source).read_exact(&mut bits).unwrap();
        assert_eq!(bits, [1, 0, 1, 0, 0, 0, 0, 1, 1]);
        assert_eq!(VtkSample::Bit.n_bytes(9), 2);
    }
}
