//! Samples of bricks, and the integers in which they are transformed.

use brickfield_core::Scalar;

/// An integer type whose samples this crate codes: u8, u16, u32, i8, i16, i32.
///
/// Sealed: these six are all there are.
pub trait Sample: Scalar + Eq + std::fmt::Debug + sealed::Sample {
    /// The integer in which samples are transformed. It has room for every coefficient of the Haar kernels.
    type Coefficient: Coefficient;
    /// The sample as a coefficient; exact.
    fn widen(self) -> Self::Coefficient;
    /// Whether a coefficient is in this type's range.
    fn holds(coefficient: Self::Coefficient) -> bool;
    /// A coefficient as a sample, modulo this type's range.
    fn truncate(coefficient: Self::Coefficient) -> Self;
    /// The sample as i64; exact.
    fn to_i64(self) -> i64;
    /// The nearest sample.
    fn saturate(value: i64) -> Self;
}

/// An integer in which samples are transformed: i16, i32, i64. Arithmetic wraps.
///
/// Sealed: these three are all there are.
pub trait Coefficient: Copy + Default + Ord + Send + Sync + std::fmt::Debug + 'static + sealed::Coefficient {
    /// The sum, modulo the type's range.
    fn plus(self, other: Self) -> Self;
    /// The difference, modulo the type's range.
    fn minus(self, other: Self) -> Self;
    /// The floor of the quotient by 2^bits.
    fn shifted(self, bits: u32) -> Self;
    /// The absolute value.
    fn magnitude(self) -> u64;
    /// The value; exact.
    fn to_i64(self) -> i64;
    /// The value modulo the type's range.
    fn wrap_from(value: i64) -> Self;
    /// The absolute value, at most 65,535.
    fn short_magnitude(self) -> u16;
}

mod sealed {
    pub trait Sample {}
    pub trait Coefficient {}
}

macro_rules! coefficients {
    ($($c:ident)*) => { $(
        impl sealed::Coefficient for $c {}
        impl Coefficient for $c {
            #[inline(always)]
            fn plus(self, other: Self) -> Self { self.wrapping_add(other) }
            #[inline(always)]
            fn minus(self, other: Self) -> Self { self.wrapping_sub(other) }
            #[inline(always)]
            fn shifted(self, bits: u32) -> Self { self >> bits }
            #[inline(always)]
            fn magnitude(self) -> u64 { u64::from(self.unsigned_abs()) }
            #[inline(always)]
            fn to_i64(self) -> i64 { i64::from(self) }
            #[inline(always)]
            fn wrap_from(value: i64) -> Self { value as $c }
            #[inline(always)]
            fn short_magnitude(self) -> u16 { u16::try_from(self.unsigned_abs()).unwrap_or(u16::MAX) }
        }
    )* };
}
coefficients! { i16 i32 i64 }

macro_rules! samples {
    ($($t:ident $c:ident;)*) => { $(
        impl sealed::Sample for $t {}
        impl Sample for $t {
            type Coefficient = $c;
            #[inline(always)]
            fn widen(self) -> $c { $c::from(self) }
            #[inline(always)]
            fn holds(coefficient: $c) -> bool { coefficient >= $c::from($t::MIN) && coefficient <= $c::from($t::MAX) }
            #[inline(always)]
            fn truncate(coefficient: $c) -> Self { coefficient as $t }
            #[inline(always)]
            fn to_i64(self) -> i64 { i64::from(self) }
            #[inline(always)]
            fn saturate(value: i64) -> Self { value.clamp(i64::from($t::MIN), i64::from($t::MAX)) as $t }
        }
    )* };
}
samples! { u8 i16; i8 i16; u16 i32; i16 i32; u32 i64; i32 i64; }
