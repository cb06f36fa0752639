//! Slices in their native type, joined.

use std::ops::Range;

use brickfield_core::Voxels;

/// Appends a range of samples of the same type.
pub(super) fn append(to: &mut Voxels, from: &Voxels, range: Range<usize>) {
    match (to, from) {
        (Voxels::U8(to), Voxels::U8(from)) => to.extend_from_slice(&from[range]),
        (Voxels::I8(to), Voxels::I8(from)) => to.extend_from_slice(&from[range]),
        (Voxels::U16(to), Voxels::U16(from)) => to.extend_from_slice(&from[range]),
        (Voxels::I16(to), Voxels::I16(from)) => to.extend_from_slice(&from[range]),
        (Voxels::U32(to), Voxels::U32(from)) => to.extend_from_slice(&from[range]),
        (Voxels::I32(to), Voxels::I32(from)) => to.extend_from_slice(&from[range]),
        (Voxels::F32(to), Voxels::F32(from)) => to.extend_from_slice(&from[range]),
        (Voxels::F64(to), Voxels::F64(from)) => to.extend_from_slice(&from[range]),
        _ => unreachable!("slices of a level have its type"),
    }
}
