//! How much a file may claim before anything is allocated for it.

use brickfield_core::glam::UVec3;
use brickfield_core::{ScalarType, Voxels};

use crate::stored_voxel::StoredVoxel;
use crate::{Note, ReadError};

/// The most that a reader may allocate.
///
/// A header is held against the limit before any voxel is allocated, and no decoder expands more than the header
/// claims. Peak memory is the volume, one more copy while values are rescaled or bytes unpacked, and a few MiB.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Most bytes that the voxels of one volume may take, in the file's type and in the type they are read into.
    pub max_bytes: u64,
}

impl Limits {
    /// No limit but that of memory.
    pub(crate) const UNBOUNDED: Limits = Limits { max_bytes: i64::MAX as u64 };
}

impl Default for Limits {
    /// 16 GiB: 2048 x 2048 x 2048 voxels of 16 bits.
    fn default() -> Limits {
        Limits { max_bytes: 16 << 30 }
    }
}

/// A shape that has been held against the limits: the only way to an allocation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CheckedShape {
    pub(crate) dims: UVec3,
    /// The type that samples are read into.
    pub(crate) scalar: ScalarType,
    pub(crate) voxel: StoredVoxel,
    /// What it was held against.
    #[cfg_attr(not(feature = "gzip"), allow(dead_code, reason = "only what is packed or in pieces needs it again"))]
    pub(crate) limits: Limits,
}

impl CheckedShape {
    /// One number of each voxel is held, so that the others count for nothing.
    ///
    /// # Errors
    /// A dimension outside 1..=u32::MAX, too many components, or more bytes than the limit.
    pub(crate) fn claim(
        dims: [u64; 3],
        voxel: impl Into<StoredVoxel>,
        limits: &Limits,
    ) -> Result<CheckedShape, ReadError> {
        let mut checked = [0u32; 3];
        for ((out, value), axis) in checked.iter_mut().zip(dims).zip(['x', 'y', 'z']) {
            let in_range = u32::try_from(value).ok().filter(|v| *v >= 1);
            *out = in_range.ok_or_else(|| ReadError::field(format!("dimension {axis}"), value, "1 to 4294967295"))?;
        }
        let voxel = voxel.into();
        voxel.check()?;
        let (stored, scalar) = (voxel.stored, voxel.stored.read_into());
        let shape = CheckedShape { dims: UVec3::from(checked), scalar, voxel, limits: *limits };
        let what = |part: &str| format!("{part} of {} x {} x {} voxels of {stored}", dims[0], dims[1], dims[2]);
        let n_bytes = scalar.n_bytes().max(stored.n_bytes()) as u128;
        check_bytes(shape.n_voxels_claimed() * n_bytes, limits, || what("a volume"))?;
        let all = Limits::UNBOUNDED;
        check_bytes(shape.n_voxels_claimed() * voxel.n_bytes() as u128, &all, || what("the components"))?;
        Ok(shape)
    }

    fn n_voxels_claimed(&self) -> u128 {
        self.dims.to_array().into_iter().map(u128::from).product()
    }

    pub(crate) fn n_voxels(&self) -> usize {
        self.n_voxels_claimed() as usize
    }

    /// The voxels that were read, in the type that they are to have: see [`StoredType::converted`](crate::stored_type::StoredType::converted).
    pub(crate) fn converted(&self, voxels: Voxels, notes: &mut Vec<Note>) -> Result<Voxels, ReadError> {
        self.voxel.stored.converted(voxels, notes)
    }
}

pub(crate) fn check_bytes(n_bytes: u128, limits: &Limits, what: impl Fn() -> String) -> Result<(), ReadError> {
    let addressable = n_bytes <= isize::MAX as u128;
    if n_bytes > u128::from(limits.max_bytes) || !addressable {
        return Err(ReadError::TooLarge { what: what(), n_bytes, max_bytes: limits.max_bytes });
    }
    Ok(())
}

/// How many samples axes of these sizes have in all.
///
/// # Errors
/// If 64 bits do not hold their number.
pub(crate) fn n_samples(field: &'static str, sizes: &[u64]) -> Result<u128, ReadError> {
    let n = sizes.iter().try_fold(1u64, |n, size| n.checked_mul(*size));
    n.map(u128::from).ok_or_else(|| {
        let all: Vec<_> = sizes.iter().map(u64::to_string).collect();
        ReadError::field(field, all.join(" "), "numbers whose product is below 18446744073709551616")
    })
}
