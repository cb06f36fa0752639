//! Scalar types of volumes, and voxels in their native type.

use std::fmt;

/// A scalar type that a volume can hold natively.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs)]
pub enum ScalarType {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    F32,
    F64,
}

impl ScalarType {
    /// All scalar types, in ascending width, unsigned first.
    pub const ALL: [ScalarType; 8] = [
        ScalarType::U8,
        ScalarType::I8,
        ScalarType::U16,
        ScalarType::I16,
        ScalarType::U32,
        ScalarType::I32,
        ScalarType::F32,
        ScalarType::F64,
    ];

    /// Bytes of one sample.
    pub const fn n_bytes(self) -> usize {
        match self {
            ScalarType::U8 | ScalarType::I8 => 1,
            ScalarType::U16 | ScalarType::I16 => 2,
            ScalarType::U32 | ScalarType::I32 | ScalarType::F32 => 4,
            ScalarType::F64 => 8,
        }
    }

    /// The type's Rust name: `u8`, `f32`, ...
    pub const fn name(self) -> &'static str {
        match self {
            ScalarType::U8 => "u8",
            ScalarType::I8 => "i8",
            ScalarType::U16 => "u16",
            ScalarType::I16 => "i16",
            ScalarType::U32 => "u32",
            ScalarType::I32 => "i32",
            ScalarType::F32 => "f32",
            ScalarType::F64 => "f64",
        }
    }
}

impl fmt::Display for ScalarType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A Rust number that is one of the [`ScalarType`]s.
///
/// Sealed: the eight types are all there are.
pub trait Scalar: Copy + Default + PartialOrd + Send + Sync + 'static + sealed::Sealed {
    /// The matching [`ScalarType`].
    const TYPE: ScalarType;
    /// The value as f64; exact for every scalar type.
    fn to_f64(self) -> f64;
    /// The nearest value of this type: integers round half away from zero and saturate.
    fn from_f64(value: f64) -> Self;
    /// Whether the value is neither infinite nor NaN.
    fn is_finite(self) -> bool;
    /// Wraps a vector of this type.
    fn wrap(values: Vec<Self>) -> Voxels;
    /// Writes numbers one after the other, little endian, as far as there are both.
    fn copy_le_bytes(values: &[Self], out: &mut [u8]);
}

mod sealed {
    pub trait Sealed {}
}

macro_rules! scalar {
    ($($t:ident $v:ident $from:expr, $is_finite:expr;)*) => { $(
        impl sealed::Sealed for $t {}
        impl Scalar for $t {
            const TYPE: ScalarType = ScalarType::$v;
            #[inline]
            fn to_f64(self) -> f64 { f64::from(self) }
            #[inline]
            fn from_f64(value: f64) -> Self { $from(value) as $t }
            #[inline]
            fn is_finite(self) -> bool { $is_finite(self) }
            fn wrap(values: Vec<Self>) -> Voxels { Voxels::$v(values) }
            fn copy_le_bytes(values: &[Self], out: &mut [u8]) {
                let (chunks, _) = out.as_chunks_mut::<{ size_of::<$t>() }>();
                for (chunk, value) in chunks.iter_mut().zip(values) {
                    *chunk = value.to_le_bytes();
                }
            }
        }
        impl From<Vec<$t>> for Voxels {
            fn from(values: Vec<$t>) -> Voxels { Voxels::$v(values) }
        }
    )* };
}
scalar! {
    u8 U8 f64::round, |_| true; i8 I8 f64::round, |_| true;
    u16 U16 f64::round, |_| true; i16 I16 f64::round, |_| true;
    u32 U32 f64::round, |_| true; i32 I32 f64::round, |_| true;
    f32 F32 std::convert::identity, f32::is_finite; f64 F64 std::convert::identity, f64::is_finite;
}

/// Voxels in their native type; x varies fastest, then y, then z.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs)]
pub enum Voxels {
    U8(Vec<u8>),
    I8(Vec<i8>),
    U16(Vec<u16>),
    I16(Vec<i16>),
    U32(Vec<u32>),
    I32(Vec<i32>),
    F32(Vec<f32>),
    F64(Vec<f64>),
}

/// Runs one generic expression on the typed vector inside a [`Voxels`].
///
/// ```
/// use brickfield_core::{Voxels, with_voxels};
/// let voxels = Voxels::from(vec![1u8, 2, 3]);
/// assert_eq!(with_voxels!(&voxels, v => v.len()), 3);
/// ```
#[macro_export]
macro_rules! with_voxels {
    ($voxels:expr, $v:ident => $body:expr) => {
        match $voxels {
            $crate::Voxels::U8($v) => $body,
            $crate::Voxels::I8($v) => $body,
            $crate::Voxels::U16($v) => $body,
            $crate::Voxels::I16($v) => $body,
            $crate::Voxels::U32($v) => $body,
            $crate::Voxels::I32($v) => $body,
            $crate::Voxels::F32($v) => $body,
            $crate::Voxels::F64($v) => $body,
        }
    };
}

impl Voxels {
    /// The scalar type held.
    pub fn scalar_type(&self) -> ScalarType {
        fn of<T: Scalar>(_: &[T]) -> ScalarType {
            T::TYPE
        }
        with_voxels!(self, v => of(v))
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        with_voxels!(self, v => v.len())
    }

    /// Whether there is no sample at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Sample `i` as f64 (exact).
    ///
    /// # Panics
    /// If `i` is not below [`len`](Self::len).
    #[inline]
    pub fn at(&self, i: usize) -> f64 {
        with_voxels!(self, v => v[i].to_f64())
    }
}
