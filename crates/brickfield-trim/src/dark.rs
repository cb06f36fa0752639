//! Values that are not seen.

use brickfield_core::{Knot, TransferFunction, ValueRange};

/// The values that a classification makes invisible: closed intervals, ascending, that neither meet nor touch.
///
/// Made once for a threshold or a transfer function; whether a range of values is dark is then a binary search among the
/// intervals, however many knots the range has.
#[derive(Clone, Debug, PartialEq)]
pub struct DarkValues {
    intervals: Vec<ValueRange>,
}

/// A threshold that separates no values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the threshold is NaN; it must be a number")]
pub struct ThresholdError;

impl DarkValues {
    /// All values below a threshold, in data units: a voxel with the threshold's value is an object voxel (Tong et al. 1999, section
    /// 3.2.2).
    ///
    /// # Errors
    /// If the threshold is NaN.
    pub fn below(threshold: f64) -> Result<DarkValues, ThresholdError> {
        match threshold.is_nan() {
            true => Err(ThresholdError),
            false => {
                Ok(DarkValues { intervals: vec![ValueRange { min: f64::NEG_INFINITY, max: threshold.next_down() }] })
            }
        }
    }

    /// The values at which a transfer function's extinction is 0.
    ///
    /// A jump is dark only if both of its knots are, as for [`TransferFunction::is_transparent`]: rounding may put an interpolated
    /// value on either side.
    pub fn of(transfer: &TransferFunction) -> DarkValues {
        let mut dark = DarkValues { intervals: Vec::new() };
        let mut below = Below { from: f64::NEG_INFINITY, is_dark: is_dark(&transfer.knots()[0]) };
        for same_value in transfer.knots().chunk_by(|a, b| a.value == b.value) {
            let (first, last, value) = (&same_value[0], &same_value[same_value.len() - 1], same_value[0].value);
            dark.push(below.from, value.next_down(), below.is_dark && is_dark(first));
            dark.push(value, value, is_dark(first) && is_dark(last));
            below = Below { from: value.next_up(), is_dark: is_dark(last) };
        }
        dark.push(below.from, f64::INFINITY, below.is_dark);
        dark
    }

    /// The intervals.
    pub fn intervals(&self) -> &[ValueRange] {
        &self.intervals
    }

    /// Whether all values of a range are dark. A range with NaN is not.
    pub fn covers(&self, range: ValueRange) -> bool {
        let above = self.intervals.partition_point(|interval| interval.min <= range.min);
        above > 0 && range.max <= self.intervals[above - 1].max && range.min <= range.max
    }

    /// Adds an interval above all others; without values if `min` is above `max`.
    fn push(&mut self, min: f64, max: f64, is_dark: bool) {
        if !is_dark || min > max {
            return;
        }
        match self.intervals.last_mut() {
            Some(last) if last.max.next_up() == min => last.max = max,
            _ => self.intervals.push(ValueRange { min, max }),
        }
    }
}

/// The values between the knots so far and the next one.
struct Below {
    from: f64,
    /// Whether the knot at their lower end is dark, from above.
    is_dark: bool,
}

fn is_dark(knot: &Knot) -> bool {
    knot.extinction == 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn transfer(knots: &[(f64, f64)]) -> TransferFunction {
        let knot = |&(value, extinction)| Knot { value, extinction, color: [1.0; 3] };
        TransferFunction::new(knots.iter().map(knot).collect()).unwrap()
    }

    fn intervals(knots: &[(f64, f64)]) -> Vec<(f64, f64)> {
        DarkValues::of(&transfer(knots)).intervals().iter().map(|i| (i.min, i.max)).collect()
    }

    const INF: f64 = f64::INFINITY;

    #[test]
    fn intervals_end_at_knots() {
        assert_eq!(intervals(&[(1.0, 0.0), (2.0, 1.0), (3.0, 0.0)]), [(-INF, 1.0), (3.0, INF)]);
        // Knots inside an interval do not divide it; a zero between two slopes is one value.
        assert_eq!(intervals(&[(0.0, 0.0), (1.0, 0.0), (2.0, 1.0)]), [(-INF, 1.0)]);
        assert_eq!(intervals(&[(0.0, 1.0), (1.0, 0.0), (2.0, 1.0)]), [(1.0, 1.0)]);
        assert_eq!(intervals(&[(5.0, 1.0)]), []);
        assert_eq!(intervals(&[(5.0, 0.0)]), [(-INF, INF)]);
    }

    #[test]
    fn a_jump_is_dark_only_if_both_knots_are() {
        let step = [(1.0, 0.0), (1.0, 2.0), (4.0, 2.0), (4.0, 0.0)];
        assert_eq!(intervals(&step), [(-INF, 1.0f64.next_down()), (4.0f64.next_up(), INF)]);
        assert_eq!(intervals(&[(1.0, 0.0), (1.0, 0.0)]), [(-INF, INF)]);
    }

    #[test]
    fn a_voxel_at_the_threshold_is_an_object_voxel() {
        let dark = DarkValues::below(7.0).unwrap();
        let covers = |min, max| dark.covers(ValueRange { min, max });
        assert!(covers(-3.0, 6.999) && !covers(0.0, 7.0) && !covers(7.0, 7.0) && !covers(f64::NAN, 1.0));
        assert_eq!(DarkValues::below(f64::NAN).unwrap_err().to_string(), "the threshold is NaN; it must be a number");
        assert!(!DarkValues::below(-INF).unwrap().covers(ValueRange { min: -1e300, max: 0.0 }));
    }
}
