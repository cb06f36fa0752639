//! Volumes of noise, and their indices.
#![allow(dead_code, reason = "each test file takes what it needs")]

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Grid, Scalar, ScalarType, Volume, Voxels};

pub(crate) fn volume(dims: UVec3, voxels: Voxels) -> Volume {
    Volume::new(Grid::axis_aligned(dims, DVec3::ONE).unwrap(), voxels).unwrap()
}

/// Values all over the type's range, the same for the same seed.
pub(crate) fn noise(dims: UVec3, scalar: ScalarType, seed: u64) -> Volume {
    let hash = |i: u64| {
        let x = (i ^ seed).wrapping_add(0x9e37_79b9_7f4a_7c15).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb) >> 32
    };
    let bits = (0..u64::from(dims.element_product())).map(hash);
    let unit = |h: u64| h as f64 / f64::from(u32::MAX) - 0.3;
    volume(
        dims,
        match scalar {
            ScalarType::U8 => bits.map(|h| h as u8).collect::<Vec<_>>().into(),
            ScalarType::I8 => bits.map(|h| h as i8).collect::<Vec<_>>().into(),
            ScalarType::U16 => bits.map(|h| h as u16).collect::<Vec<_>>().into(),
            ScalarType::I16 => bits.map(|h| h as i16).collect::<Vec<_>>().into(),
            ScalarType::U32 => bits.map(|h| h as u32).collect::<Vec<_>>().into(),
            ScalarType::I32 => bits.map(|h| h as i32).collect::<Vec<_>>().into(),
            ScalarType::F32 => bits.map(|h| 1e3 * unit(h) as f32).collect::<Vec<_>>().into(),
            ScalarType::F64 => bits.map(|h| 1e-3 * unit(h)).collect::<Vec<_>>().into(),
        },
    )
}

/// Index of sample (i, j, k), each kept inside the border.
pub(crate) fn index(dims: UVec3, p: UVec3) -> usize {
    let p = p.min(dims - 1);
    p.x as usize + dims.x as usize * (p.y as usize + dims.y as usize * p.z as usize)
}

pub(crate) fn points(n: UVec3) -> impl Iterator<Item = UVec3> {
    (0..n.z).flat_map(move |z| (0..n.y).flat_map(move |y| (0..n.x).map(move |x| UVec3::new(x, y, z))))
}

/// Numbers in a type, to its nearest.
pub(crate) fn of_type(scalar: ScalarType, values: impl Iterator<Item = f64>) -> Voxels {
    fn of<T: Scalar>(values: impl Iterator<Item = f64>) -> Voxels {
        T::wrap(values.map(T::from_f64).collect())
    }
    match scalar {
        ScalarType::U8 => of::<u8>(values),
        ScalarType::I8 => of::<i8>(values),
        ScalarType::U16 => of::<u16>(values),
        ScalarType::I16 => of::<i16>(values),
        ScalarType::U32 => of::<u32>(values),
        ScalarType::I32 => of::<i32>(values),
        ScalarType::F32 => of::<f32>(values),
        ScalarType::F64 => of::<f64>(values),
    }
}
