//! Data values as f32 arithmetic takes them.

use brickfield_core::TransferFunction;

use crate::Decode;

/// How data values become the numbers of f32 arithmetic: (value - origin) / unit.
///
/// The origin is the transfer function's first knot, so that f32 spends its digits on the range that is told apart. The unit is
/// a power of two near the greatest magnitude that is left: it changes no digit, and keeps values of any magnitude that f64 has
/// within f32's exponents.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValueScale {
    origin: f64,
    unit: f64,
}

impl ValueScale {
    /// The scale for samples of a decoding under a transfer function.
    pub fn of(transfer: &TransferFunction, decode: Decode) -> ValueScale {
        let knots = transfer.knots();
        let (origin, last) = (knots[0].value, knots[knots.len() - 1].value);
        let samples = (decode.offset - origin).abs() + decode.scale.abs();
        let exponent = (last - origin).max(samples).log2().floor();
        let unit = if exponent.is_finite() { 2f64.powi(exponent.clamp(-1000.0, 1000.0) as i32) } else { 1.0 };
        ValueScale { origin, unit }
    }

    /// The data value that becomes 0.
    #[inline]
    pub fn origin(self) -> f64 {
        self.origin
    }

    /// Data values per number.
    #[inline]
    pub fn unit(self) -> f64 {
        self.unit
    }

    /// The number of a data value.
    #[inline]
    pub fn number(self, value: f64) -> f64 {
        (value - self.origin) / self.unit
    }

    /// The data value of a number.
    #[inline]
    pub fn value(self, number: f64) -> f64 {
        number * self.unit + self.origin
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::Knot;

    #[test]
    fn numbers_are_of_the_order_of_one_whatever_the_values() {
        let knot = |value: f64| Knot { value, extinction: 1.0, color: [1.0; 3] };
        for unit in [1e-300, 1e-40, 1.0, 255.0, 1e40, 1e300] {
            let transfer = TransferFunction::new(vec![knot(-0.5 * unit), knot(unit)]).unwrap();
            let scale = ValueScale::of(&transfer, Decode { scale: 0.5 * unit, offset: 0.5 * unit });
            let last = scale.number(unit);
            assert!((1.0..4.0).contains(&last) && scale.number(-0.5 * unit) == 0.0, "{unit}: {last}");
            assert!((scale.value(last) - unit).abs() <= 1e-15 * unit);
        }
        let nothing =
            ValueScale::of(&TransferFunction::constant(1.0, [1.0; 3]).unwrap(), Decode { scale: 0.0, offset: 0.0 });
        assert_eq!(nothing.unit(), 1.0);
    }
}
