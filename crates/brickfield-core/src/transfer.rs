//! Transfer functions: piecewise-linear extinction and linear colour over data values.

use crate::ValueRange;

/// Straight (not premultiplied) linear RGB.
pub type LinearRgb = [f64; 3];

/// The optical properties at a point of the medium: extinction per world unit, and the colour emitted per unit of extinction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(missing_docs)]
pub struct Optics {
    pub extinction: f64,
    pub color: LinearRgb,
}

/// A knot of a transfer function.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Knot {
    /// Data value.
    pub value: f64,
    /// Extinction per world unit, 0 or more.
    pub extinction: f64,
    /// Straight linear RGB, each 0 to 1.
    pub color: LinearRgb,
}

/// Piecewise-linear extinction (per world unit) and straight linear colour over data values.
///
/// Between knots both are linear in the value; outside the first and last knot they are constant. Two knots at one value
/// make a jump, continuous from the right.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(try_from = "Raw", into = "Raw"))]
pub struct TransferFunction {
    knots: Vec<Knot>,
}

/// Why knots do not make a transfer function.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum TransferError {
    #[error("a transfer function needs at least one knot")]
    NoKnot,
    #[error("{n_knots} knots; at most {limit} are taken")]
    TooManyKnots { n_knots: usize, limit: usize },
    #[error("knot {knot}: {what} is {value}; it must be finite")]
    NotFinite { knot: usize, what: &'static str, value: f64 },
    #[error("knot {knot}: extinction is {value}; it must be 0 to 1e30 per world unit")]
    Extinction { knot: usize, value: f64 },
    #[error("knot {knot}: colour channel {channel} is {value}; it must be 0 to 1")]
    Color { knot: usize, channel: usize, value: f64 },
    #[error("knot {knot}: value {value} comes after {previous}; values must not fall")]
    Order { knot: usize, value: f64, previous: f64 },
    #[error("knot {knot}: a third knot at value {value}; a jump has two")]
    ThirdKnot { knot: usize, value: f64 },
}

impl TransferFunction {
    /// The greatest extinction per world unit that a knot may have: optical depths stay finite in f32.
    pub const MAX_EXTINCTION: f64 = 1e30;

    /// The most knots: one for each 16-bit value.
    pub const MAX_KNOTS: usize = 1 << 16;

    /// A transfer function from knots in ascending order of value.
    ///
    /// # Errors
    /// No knot or too many, a number that is not finite or out of its range, values that fall, three knots at one value.
    pub fn new(knots: Vec<Knot>) -> Result<TransferFunction, TransferError> {
        if knots.is_empty() {
            return Err(TransferError::NoKnot);
        }
        let (n_knots, limit) = (knots.len(), TransferFunction::MAX_KNOTS);
        if n_knots > limit {
            return Err(TransferError::TooManyKnots { n_knots, limit });
        }
        for (knot, k) in knots.iter().enumerate() {
            check_knot(knot, k)?;
        }
        for (i, pair) in knots.windows(2).enumerate() {
            if pair[1].value < pair[0].value {
                return Err(TransferError::Order { knot: i + 1, value: pair[1].value, previous: pair[0].value });
            }
        }
        for (i, three) in knots.windows(3).enumerate() {
            if three[2].value == three[0].value {
                return Err(TransferError::ThirdKnot { knot: i + 2, value: three[2].value });
            }
        }
        Ok(TransferFunction { knots })
    }

    /// The same extinction and colour for every value.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn constant(extinction: f64, color: LinearRgb) -> Result<TransferFunction, TransferError> {
        TransferFunction::new(vec![Knot { value: 0.0, extinction, color }])
    }

    /// The knots, ascending in value.
    pub fn knots(&self) -> &[Knot] {
        &self.knots
    }

    /// Extinction and colour at a data value.
    #[inline]
    pub fn at(&self, value: f64) -> Optics {
        let above = self.knots.partition_point(|k| k.value <= value);
        if above == 0 {
            return self.knots[0].optics();
        }
        let low = &self.knots[above - 1];
        let Some(high) = self.knots.get(above) else { return low.optics() };
        let f = (value - low.value) / (high.value - low.value);
        let mix = |a: f64, b: f64| a + (b - a) * f;
        Optics {
            extinction: mix(low.extinction, high.extinction),
            color: std::array::from_fn(|c| mix(low.color[c], high.color[c])),
        }
    }

    /// The greatest extinction over a closed range of values; 0 exactly if nothing in the range is visible.
    pub fn max_extinction(&self, range: ValueRange) -> f64 {
        let ends = self.at(range.min).extinction.max(self.at(range.max).extinction);
        self.inside(range).iter().map(|k| k.extinction).fold(ends, f64::max)
    }

    /// The least extinction over a closed range of values; above 0 only if everything in the range is visible.
    pub fn least_extinction(&self, range: ValueRange) -> f64 {
        let ends = self.at(range.min).extinction.min(self.at(range.max).extinction);
        self.inside(range).iter().map(|k| k.extinction).fold(ends, f64::min)
    }

    /// Whether a range of values contributes nothing: its extinction is 0 everywhere.
    pub fn is_transparent(&self, range: ValueRange) -> bool {
        let dark = |value| self.at(value).extinction == 0.0;
        dark(range.min) && dark(range.max) && self.inside(range).iter().all(|k| k.extinction == 0.0)
    }

    /// The knots in a closed range of values.
    fn inside(&self, range: ValueRange) -> &[Knot] {
        let first = self.knots.partition_point(|k| k.value < range.min);
        let end = self.knots.partition_point(|k| k.value <= range.max);
        &self.knots[first..end.max(first)]
    }
}

impl Knot {
    /// The knot's extinction and colour.
    pub fn optics(&self) -> Optics {
        Optics { extinction: self.extinction, color: self.color }
    }
}

fn check_knot(knot: usize, k: &Knot) -> Result<(), TransferError> {
    let numbers = [
        ("value", k.value),
        ("extinction", k.extinction),
        ("red", k.color[0]),
        ("green", k.color[1]),
        ("blue", k.color[2]),
    ];
    if let Some((what, value)) = numbers.into_iter().find(|(_, v)| !v.is_finite()) {
        return Err(TransferError::NotFinite { knot, what, value });
    }
    if !(0.0..=TransferFunction::MAX_EXTINCTION).contains(&k.extinction) {
        return Err(TransferError::Extinction { knot, value: k.extinction });
    }
    match k.color.into_iter().enumerate().find(|(_, c)| !(0.0..=1.0).contains(c)) {
        Some((channel, value)) => Err(TransferError::Color { knot, channel, value }),
        None => Ok(()),
    }
}

/// The form in files.
#[cfg(feature = "serde")]
#[derive(serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Raw {
    knots: Vec<Knot>,
}

#[cfg(feature = "serde")]
impl TryFrom<Raw> for TransferFunction {
    type Error = TransferError;
    fn try_from(raw: Raw) -> Result<Self, TransferError> {
        TransferFunction::new(raw.knots)
    }
}

#[cfg(feature = "serde")]
impl From<TransferFunction> for Raw {
    fn from(tf: TransferFunction) -> Raw {
        Raw { knots: tf.knots }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn knot(value: f64, extinction: f64) -> Knot {
        Knot { value, extinction, color: [extinction.min(1.0), 0.5, 0.0] }
    }

    #[test]
    fn linear_between_constant_outside_and_right_continuous_at_a_jump() {
        let tf =
            TransferFunction::new(vec![knot(0.0, 0.0), knot(10.0, 1.0), knot(10.0, 3.0), knot(20.0, 3.0)]).unwrap();
        let at = |v| tf.at(v).extinction;
        assert_eq!([at(-5.0), at(0.0), at(5.0), at(10.0), at(15.0), at(99.0)], [0.0, 0.0, 0.5, 3.0, 3.0, 3.0]);
        assert!(at(9.999_999) < 1.0);
    }

    #[test]
    fn transparency_looks_at_the_knots_inside() {
        let tf = TransferFunction::new(vec![knot(10.0, 0.0), knot(11.0, 1.0), knot(12.0, 0.0)]).unwrap();
        let transparent = |min, max| tf.is_transparent(ValueRange { min, max });
        assert!(transparent(0.0, 10.0) && transparent(12.0, 99.0));
        assert!(!transparent(0.0, 10.1) && !transparent(0.0, 99.0));
        let least = |min, max| tf.least_extinction(ValueRange { min, max });
        assert_eq!([least(10.5, 11.25), least(10.5, 12.0), least(0.0, 99.0)], [0.5, 0.0, 0.0]);
    }

    #[test]
    fn bad_knots_are_named() {
        let error = |knots: Vec<Knot>| TransferFunction::new(knots).unwrap_err().to_string();
        assert!(error(vec![]).contains("at least one knot"));
        assert!(error(vec![knot(f64::NAN, 0.0)]).contains("knot 0: value is NaN"));
        assert!(error(vec![knot(0.0, -1.0)]).contains("extinction is -1"));
        assert!(error(vec![knot(1.0, 0.0), knot(0.0, 0.0)]).contains("knot 1: value 0 comes after 1"));
        assert!(error(vec![knot(1.0, 0.0); 3]).contains("third knot at value 1"));
        assert!(error(vec![knot(1.0, 0.0); 65_537]).contains("65537 knots; at most 65536"));
    }
}
