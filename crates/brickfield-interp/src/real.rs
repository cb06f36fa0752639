//! The arithmetic of f32 and f64 that interpolation needs.

use std::ops::{Add, Div, Mul, Sub};

/// f32 or f64.
pub trait Real:
    Copy + PartialOrd + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// Infinity.
    const INFINITY: Self;

    /// The nearest number of this type.
    fn from_f64(value: f64) -> Self;

    /// The value limited to [0, 1]; 0 for NaN.
    fn clamp_01(self) -> Self;

    /// The greatest integer that is not above it, limited to [0, most].
    fn floor_to(self, most: u32) -> u32;

    /// Without sign.
    fn abs(self) -> Self;

    /// The lesser of two.
    fn min(self, other: Self) -> Self;

    /// The greater of two.
    fn max(self, other: Self) -> Self;
}

macro_rules! real {
    ($($t:ident)*) => { $(
        impl Real for $t {
            const ZERO: $t = 0.0;
            const ONE: $t = 1.0;
            const INFINITY: $t = $t::INFINITY;
            #[inline]
            fn from_f64(value: f64) -> $t { value as $t }
            #[inline]
            fn clamp_01(self) -> $t { self.max(0.0).min(1.0) }
            #[inline]
            fn floor_to(self, most: u32) -> u32 { (self.floor() as u32).min(most) }
            #[inline]
            fn abs(self) -> $t { $t::abs(self) }
            #[inline]
            fn min(self, other: $t) -> $t { $t::min(self, other) }
            #[inline]
            fn max(self, other: $t) -> $t { $t::max(self, other) }
        }
    )* };
}
real! { f32 f64 }
