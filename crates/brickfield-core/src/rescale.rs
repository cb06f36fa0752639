//! From stored numbers to data values.

use crate::ValueRange;

/// The linear map from stored numbers to data values: value = slope * stored + intercept.
///
/// Scanners store integers and state the map (DICOM PS3.3, C.7.6.16.2.9; nifti1.h, `scl_slope`): a volume keeps their bytes.
/// The slope is finite and not 0, the intercept finite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rescale {
    slope: f64,
    intercept: f64,
}

/// A map that loses all values.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("rescale by slope {slope} and intercept {intercept}; both must be finite, and the slope not 0")]
#[allow(missing_docs)]
pub struct RescaleError {
    pub slope: f64,
    pub intercept: f64,
}

impl Rescale {
    /// Values are stored as they are.
    pub const IDENTITY: Rescale = Rescale { slope: 1.0, intercept: 0.0 };

    /// A map.
    ///
    /// # Errors
    /// A slope that is 0, a number that is not finite.
    pub fn new(slope: f64, intercept: f64) -> Result<Rescale, RescaleError> {
        match slope.is_finite() && intercept.is_finite() && slope != 0.0 {
            true => Ok(Rescale { slope, intercept }),
            false => Err(RescaleError { slope, intercept }),
        }
    }

    /// Data units per stored unit; may be negative.
    pub fn slope(self) -> f64 {
        self.slope
    }

    /// The value of a stored 0.
    pub fn intercept(self) -> f64 {
        self.intercept
    }

    /// The data value of a stored number: monotone, also in its rounding.
    #[inline]
    pub fn value(self, stored: f64) -> f64 {
        self.slope * stored + self.intercept
    }

    /// The stored number of a data value, to rounding.
    #[inline]
    pub fn stored(self, value: f64) -> f64 {
        (value - self.intercept) / self.slope
    }

    /// The data values of a range of stored numbers.
    pub fn values(self, stored: ValueRange) -> ValueRange {
        let (a, b) = (self.value(stored.min), self.value(stored.max));
        ValueRange { min: a.min(b), max: a.max(b) }
    }

    /// The stored numbers of a range of data values.
    pub fn stored_range(self, values: ValueRange) -> ValueRange {
        let (a, b) = (self.stored(values.min), self.stored(values.max));
        ValueRange { min: a.min(b), max: a.max(b) }
    }
}

impl Default for Rescale {
    fn default() -> Rescale {
        Rescale::IDENTITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_negative_slope_turns_the_range_round() {
        let rescale = Rescale::new(-0.5, 10.0).unwrap();
        let range = rescale.values(ValueRange { min: 0.0, max: 255.0 });
        assert_eq!(range, ValueRange { min: -117.5, max: 10.0 });
        assert_eq!(rescale.stored_range(range), ValueRange { min: 0.0, max: 255.0 });
    }

    #[test]
    fn a_map_that_loses_everything_is_none() {
        for (slope, intercept) in [(0.0, 1.0), (f64::NAN, 0.0), (1.0, f64::INFINITY)] {
            assert!(Rescale::new(slope, intercept).is_err());
        }
    }
}
