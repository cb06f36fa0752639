//! The arithmetic that building needs of each scalar type, and a brick's samples in their native type.

use std::ops::Add;

use brickfield_core::Scalar;

use crate::bins::BinTable;

/// A scalar that bricks can be built of.
pub(crate) trait BrickScalar: Scalar {
    /// Holds 64 times any value.
    type Sum: Copy + Default + Add<Output = Self::Sum> + Send;
    fn widen(self) -> Self::Sum;
    /// A 64th of the sum, rounded to nearest; integer halves go up.
    fn narrow(sum: Self::Sum) -> Self;
    fn bin(self, table: &BinTable) -> usize;
    fn borrow(samples: &[Self]) -> BrickSamples<'_>;
}

/// The samples of one brick in their native type: side^3 of them, x fastest, then y, then z.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub enum BrickSamples<'a> {
    U8(&'a [u8]),
    I8(&'a [i8]),
    U16(&'a [u16]),
    I16(&'a [i16]),
    U32(&'a [u32]),
    I32(&'a [i32]),
    F32(&'a [f32]),
    F64(&'a [f64]),
}

/// Runs one generic expression on the typed slice inside a [`BrickSamples`].
///
/// ```
/// use brickfield_bricks::{BrickSamples, with_brick_samples};
/// let samples = BrickSamples::I16(&[1, -2, 3]);
/// assert_eq!(with_brick_samples!(samples, s => s.len()), 3);
/// ```
#[macro_export]
macro_rules! with_brick_samples {
    ($samples:expr, $s:ident => $body:expr) => {
        match $samples {
            $crate::BrickSamples::U8($s) => $body,
            $crate::BrickSamples::I8($s) => $body,
            $crate::BrickSamples::U16($s) => $body,
            $crate::BrickSamples::I16($s) => $body,
            $crate::BrickSamples::U32($s) => $body,
            $crate::BrickSamples::I32($s) => $body,
            $crate::BrickSamples::F32($s) => $body,
            $crate::BrickSamples::F64($s) => $body,
        }
    };
}

impl BrickSamples<'_> {
    /// Number of samples.
    pub fn len(&self) -> usize {
        with_brick_samples!(self, s => s.len())
    }

    /// Whether there is no sample.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes of all samples.
    pub fn n_bytes(&self) -> usize {
        with_brick_samples!(self, s => size_of_val(*s))
    }

    /// Sample `i` as f64 (exact).
    ///
    /// # Panics
    /// If `i` is not below [`len`](Self::len).
    #[inline]
    pub fn at(&self, i: usize) -> f64 {
        with_brick_samples!(self, s => s[i].to_f64())
    }

    /// Writes the samples as little-endian bytes, ready to upload.
    ///
    /// # Panics
    /// If `out` is not [`n_bytes`](Self::n_bytes) long.
    pub fn copy_le_bytes(&self, out: &mut [u8]) {
        assert_eq!(out.len(), self.n_bytes(), "bytes to write a brick to");
        with_brick_samples!(self, s => Scalar::copy_le_bytes(s, out));
    }
}

macro_rules! sample {
    ($($t:ident $v:ident $sum:ident $widen:expr, $narrow:expr, $bin:expr;)*) => { $(
        impl BrickScalar for $t {
            type Sum = $sum;
            #[inline]
            fn widen(self) -> $sum { $widen(self) }
            #[inline]
            fn narrow(sum: $sum) -> $t { $narrow(sum) as $t }
            #[inline]
            fn bin(self, table: &BinTable) -> usize { $bin(self, table) }
            fn borrow(samples: &[$t]) -> BrickSamples<'_> { BrickSamples::$v(samples) }
        }
    )* };
}
sample! {
    u8 U8 u16 u16::from, |s| (s + 32) >> 6, |v, t: &BinTable| t.at(u16::from(v));
    i8 I8 i16 i16::from, |s| (s + 32) >> 6, |v, t: &BinTable| t.at(u16::from(v as u8));
    u16 U16 u32 u32::from, |s| (s + 32) >> 6, |v, t: &BinTable| t.at(v);
    i16 I16 i32 i32::from, |s| (s + 32) >> 6, |v, t: &BinTable| t.at(v as u16);
    u32 U32 u64 u64::from, |s| (s + 32) >> 6, |v, t: &BinTable| t.of(f64::from(v));
    i32 I32 i64 i64::from, |s| (s + 32) >> 6, |v, t: &BinTable| t.of(f64::from(v));
    f32 F32 f64 f64::from, |s: f64| s / 64.0, |v, t: &BinTable| t.of(f64::from(v));
    f64 F64 f64 |v| v / 64.0, |s: f64| s, |v, t: &BinTable| t.of(v);
}
