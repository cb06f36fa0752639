//! Volumes made by code: analytic fields with known integrals, and the phantom.
//!
//! A field is a function of the world position. [`fill`] samples it at the voxel centres of a grid; [`fill_unit`] first
//! spreads [0, 1] over the whole range of an integer type, so that one field serves every scalar type.

mod enlarge;
mod field;
mod phantom;
mod shape;

pub use enlarge::enlarge;
pub use field::FieldFormula;
pub use phantom::{
    PHANTOM_DIMS, Phantom, PhantomSlices, pack_phantom, phantom, phantom_camera, phantom_of, phantom_transfer,
};
pub use shape::Shape;

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{
    Grid, IndexPos, Knot, Scalar, ScalarType, TransferError, TransferFunction, ValueRange, Volume, Voxels,
};
use rayon::prelude::*;

/// The volume whose samples are `field` at the voxel centres, each the nearest value of `scalar` (integers saturate).
pub fn fill(grid: &Grid, scalar: ScalarType, field: impl Fn(DVec3) -> f64 + Sync) -> Volume {
    let voxels = match scalar {
        ScalarType::U8 => samples::<u8>(grid, &field),
        ScalarType::I8 => samples::<i8>(grid, &field),
        ScalarType::U16 => samples::<u16>(grid, &field),
        ScalarType::I16 => samples::<i16>(grid, &field),
        ScalarType::U32 => samples::<u32>(grid, &field),
        ScalarType::I32 => samples::<i32>(grid, &field),
        ScalarType::F32 => samples::<f32>(grid, &field),
        ScalarType::F64 => samples::<f64>(grid, &field),
    };
    Volume::new(*grid, voxels).expect("one sample was taken per voxel")
}

/// As [`fill`], for a field with values in [0, 1] that is spread over [`unit_range`].
pub fn fill_unit(grid: &Grid, scalar: ScalarType, field: impl Fn(DVec3) -> f64 + Sync) -> Volume {
    let range = unit_range(scalar);
    fill(grid, scalar, |p| range.min + field(p) * (range.max - range.min))
}

/// Where [`fill_unit`] puts 0 and 1: the whole range of integers of up to 16 bits, a million steps of wider ones, [0, 1] of
/// floats.
pub fn unit_range(scalar: ScalarType) -> ValueRange {
    let (min, max) = match scalar {
        ScalarType::U8 => (0.0, f64::from(u8::MAX)),
        ScalarType::I8 => (f64::from(i8::MIN), f64::from(i8::MAX)),
        ScalarType::U16 => (0.0, f64::from(u16::MAX)),
        ScalarType::I16 => (f64::from(i16::MIN), f64::from(i16::MAX)),
        ScalarType::U32 => (0.0, 1e6),
        ScalarType::I32 => (-5e5, 5e5),
        ScalarType::F32 | ScalarType::F64 => (0.0, 1.0),
    };
    ValueRange { min, max }
}

/// A transfer function over [0, 1], moved to the values of [`fill_unit`].
///
/// # Errors
/// Knots that [`TransferFunction::new`] refuses.
pub fn spread(knots: &[Knot], scalar: ScalarType) -> Result<TransferFunction, TransferError> {
    let range = unit_range(scalar);
    let moved = knots.iter().map(|k| Knot { value: range.min + k.value * (range.max - range.min), ..*k });
    TransferFunction::new(moved.collect())
}

/// No samples.
fn empty(scalar: ScalarType) -> Voxels {
    match scalar {
        ScalarType::U8 => Voxels::U8(Vec::new()),
        ScalarType::I8 => Voxels::I8(Vec::new()),
        ScalarType::U16 => Voxels::U16(Vec::new()),
        ScalarType::I16 => Voxels::I16(Vec::new()),
        ScalarType::U32 => Voxels::U32(Vec::new()),
        ScalarType::I32 => Voxels::I32(Vec::new()),
        ScalarType::F32 => Voxels::F32(Vec::new()),
        ScalarType::F64 => Voxels::F64(Vec::new()),
    }
}

fn samples<T: Scalar>(grid: &Grid, field: &(impl Fn(DVec3) -> f64 + Sync)) -> Voxels {
    let dims = grid.dims();
    let row = |i: usize| UVec3::new(0, i as u32 % dims.y, i as u32 / dims.y);
    let value = |x: u32, at: UVec3| field(grid.world(IndexPos(at.with_x(x).as_dvec3() + 0.5)).0);
    let mut values = vec![T::default(); grid.n_voxels()];
    values.par_chunks_mut(dims.x as usize).enumerate().for_each(|(i, voxels)| {
        for (x, v) in (0..).zip(voxels) {
            *v = T::from_f64(value(x, row(i)));
        }
    });
    T::wrap(values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::glam::DMat3;

    #[test]
    fn samples_lie_at_voxel_centres_x_fastest() {
        let (dims, spacing, first) = (UVec3::new(3, 2, 2), DVec3::new(1.0, 2.0, 4.0), DVec3::new(10.0, 0.0, 0.0));
        let grid = Grid::from_first_sample(dims, spacing, first, DMat3::IDENTITY).unwrap();
        let volume = fill(&grid, ScalarType::U8, |p| p.x + 10.0 * p.y + 5.0 * p.z);
        let expected = vec![10u8, 11, 12, 30, 31, 32, 30, 31, 32, 50, 51, 52];
        assert_eq!(volume.voxels(), &Voxels::U8(expected));
    }

    #[test]
    fn every_type_spans_its_unit_range() {
        let grid = Grid::axis_aligned(UVec3::new(2, 1, 1), DVec3::ONE).unwrap();
        for scalar in ScalarType::ALL {
            let volume = fill_unit(&grid, scalar, |p| if p.x < 1.0 { 0.0 } else { 1.0 });
            assert_eq!((volume.scalar_type(), volume.range()), (scalar, unit_range(scalar)));
        }
    }
}
