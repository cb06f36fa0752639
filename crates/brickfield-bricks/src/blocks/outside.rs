//! The values that a transfer function makes transparent.

use brickfield_core::{TransferFunction, ValueRange};

/// Values with extinction 0: closed intervals, ascending, that neither meet nor touch.
///
/// A voxel has one value, so that at a jump the transfer function's own answer counts: it is continuous from the right.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct OutsideValues {
    intervals: Vec<ValueRange>,
}

impl OutsideValues {
    pub(super) fn of(transfer: &TransferFunction) -> OutsideValues {
        let knots = transfer.knots();
        let mut outside = OutsideValues::default();
        let (mut from, mut is_dark_below) = (f64::NEG_INFINITY, knots[0].extinction == 0.0);
        for same_value in knots.chunk_by(|a, b| a.value == b.value) {
            let [first, last] = [0, same_value.len() - 1].map(|i| same_value[i].extinction == 0.0);
            let value = same_value[0].value;
            outside.push(from, value.next_down(), is_dark_below && first);
            outside.push(value, value, last);
            (from, is_dark_below) = (value.next_up(), last);
        }
        outside.push(from, f64::INFINITY, is_dark_below);
        outside
    }

    /// Whether it has a value.
    #[inline]
    pub(super) fn contains(&self, value: f64) -> bool {
        let above = self.intervals.partition_point(|interval| interval.min <= value);
        above > 0 && value <= self.intervals[above - 1].max
    }

    /// Whether it has all values of a range.
    pub(super) fn covers(&self, range: ValueRange) -> bool {
        let above = self.intervals.partition_point(|interval| interval.min <= range.min);
        above > 0 && range.max <= self.intervals[above - 1].max
    }

    /// Whether it has any value of a range.
    pub(super) fn meets(&self, range: ValueRange) -> bool {
        let first = self.intervals.partition_point(|interval| interval.max < range.min);
        self.intervals.get(first).is_some_and(|interval| interval.min <= range.max)
    }

    /// The values that one of the two has, and the other has not.
    pub(super) fn differing(&self, other: &OutsideValues) -> OutsideValues {
        // Where a set begins, and right above its end, a value is in it or out of it from there on.
        let turns = |set: &OutsideValues| set.intervals.iter().flat_map(|i| [i.min, i.max.next_up()]).collect();
        let mut all: Vec<f64> = turns(self);
        all.extend::<Vec<f64>>(turns(other));
        all.sort_by(f64::total_cmp);
        let mut differing = OutsideValues::default();
        all.as_chunks().0.iter().for_each(|[from, to]: &[f64; 2]| differing.push(*from, to.next_down(), true));
        differing
    }

    /// Adds an interval above all others; without values if `min` is above `max`.
    fn push(&mut self, min: f64, max: f64, is_outside: bool) {
        if !is_outside || min > max {
            return;
        }
        match self.intervals.last_mut() {
            Some(last) if last.max.next_up() == min => last.max = max,
            _ => self.intervals.push(ValueRange { min, max }),
        }
    }
}

#[cfg(test)]
mod tests {
    use brickfield_core::Knot;
    use proptest::prelude::*;

    use super::*;

    fn transfer(knots: &[(f64, f64)]) -> TransferFunction {
        let knot = |&(value, extinction)| Knot { value, extinction, color: [1.0; 3] };
        TransferFunction::new(knots.iter().map(knot).collect()).unwrap()
    }

    /// Few values and extinctions: many jumps, and many zeros.
    fn transfers() -> impl Strategy<Value = TransferFunction> {
        prop::collection::vec((0u8..12, 0u8..2), 1..9).prop_map(|mut knots| {
            knots.sort_by_key(|knot| knot.0);
            let mut kept: Vec<(f64, f64)> = Vec::new();
            for (value, extinction) in knots {
                let value = f64::from(value);
                if kept.iter().filter(|knot| knot.0 == value).count() < 2 {
                    kept.push((value, f64::from(extinction)));
                }
            }
            transfer(&kept)
        })
    }

    fn probes() -> impl Iterator<Item = f64> {
        (-3..30).map(|i| 0.5 * f64::from(i))
    }

    proptest! {
        #[test]
        fn a_value_is_outside_if_its_extinction_is_0(one in transfers(), other in transfers()) {
            let [a, b] = [&one, &other].map(OutsideValues::of);
            let differing = a.differing(&b);
            for value in probes() {
                prop_assert_eq!(a.contains(value), one.at(value).extinction == 0.0, "{}", value);
                prop_assert_eq!(differing.contains(value), a.contains(value) != b.contains(value), "{}", value);
            }
            for (min, max) in probes().flat_map(|min| probes().filter(move |max| *max >= min).map(move |max| (min, max))) {
                let inside = || probes().filter(|value| (min..=max).contains(value));
                let range = ValueRange { min, max };
                prop_assert_eq!(a.covers(range), inside().all(|value| a.contains(value)), "{:?}", range);
                prop_assert_eq!(a.meets(range), inside().any(|value| a.contains(value)), "{:?}", range);
            }
        }
    }

    #[test]
    fn at_a_jump_the_value_from_above_counts() {
        let step = OutsideValues::of(&transfer(&[(1.0, 0.0), (1.0, 2.0), (4.0, 2.0), (4.0, 0.0)]));
        assert!(step.contains(1.0f64.next_down()) && !step.contains(1.0));
        assert!(!step.contains(4.0f64.next_down()) && step.contains(4.0));
    }
}
