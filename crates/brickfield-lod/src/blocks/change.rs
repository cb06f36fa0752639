//! Where two transfer functions differ.

use brickfield_core::{Knot, TransferFunction, ValueRange};

/// A closed interval of values outside of which two transfer functions are equal, bit by bit; `None` if they are everywhere.
///
/// It ends at knots, or at infinity, and may hold values for which both are equal, too. O(knots).
pub fn changed_values(old: &TransferFunction, new: &TransferFunction) -> Option<ValueRange> {
    let (old, new) = (without_constant_ends(old.knots()), without_constant_ends(new.knots()));
    if old == new {
        return None;
    }
    // A piece is equal if the knots at both of its ends are.
    let n_shorter = old.len().min(new.len());
    let n_first = old.iter().zip(new).take_while(|(a, b)| a == b).count();
    let n_last = old.iter().rev().zip(new.iter().rev()).take(n_shorter - n_first).take_while(|(a, b)| a == b).count();
    let (first, last) = ([old[0], new[0]], [old[old.len() - 1], new[new.len() - 1]]);
    let min = match n_first {
        0 if first[0].optics() == first[1].optics() => first[0].value.min(first[1].value),
        0 => f64::NEG_INFINITY,
        n => old[n - 1].value,
    };
    let max = match n_last {
        0 if last[0].optics() == last[1].optics() => last[0].value.max(last[1].value),
        0 => f64::INFINITY,
        n => old[old.len() - n].value,
    };
    Some(ValueRange { min, max })
}

/// The knots without those of a constant piece at either end: they change no value.
fn without_constant_ends(mut knots: &[Knot]) -> &[Knot] {
    while let [first, second, ..] = knots
        && first.optics() == second.optics()
    {
        knots = &knots[1..];
    }
    while let [.., second, last] = knots
        && last.optics() == second.optics()
    {
        knots = &knots[..knots.len() - 1];
    }
    knots
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn transfer(knots: &[(i32, u8)]) -> TransferFunction {
        let knot =
            |&(value, e): &(i32, u8)| Knot { value: f64::from(value), extinction: f64::from(e), color: [1.0; 3] };
        TransferFunction::new(knots.iter().map(knot).collect()).unwrap()
    }

    fn changed(old: &[(i32, u8)], new: &[(i32, u8)]) -> Option<(f64, f64)> {
        changed_values(&transfer(old), &transfer(new)).map(|range| (range.min, range.max))
    }

    #[test]
    fn an_edit_reaches_from_knot_to_knot() {
        let old = [(0, 0), (10, 0), (20, 1), (30, 2), (40, 3), (50, 3)];
        assert_eq!(changed(&old, &old), None);
        assert_eq!(changed(&old, &[(0, 0), (10, 0), (20, 1), (32, 2), (40, 3)]), Some((20.0, 40.0)));
        assert_eq!(changed(&old, &[(10, 0), (20, 1), (30, 2), (40, 3)]), None);
        assert_eq!(changed(&old, &[(10, 0), (20, 1), (30, 2), (40, 4)]), Some((30.0, f64::INFINITY)));
        assert_eq!(changed(&old, &[(10, 1), (20, 1), (30, 2), (40, 3)]), Some((f64::NEG_INFINITY, 20.0)));
        assert_eq!(changed(&[(0, 1)], &[(0, 2)]), Some((f64::NEG_INFINITY, f64::INFINITY)));
        assert_eq!(changed(&[(0, 1)], &[(7, 1)]), Some((0.0, 7.0)));
        assert_eq!(changed(&old, &[(12, 0), (20, 1), (30, 2), (42, 3)]), Some((10.0, 42.0)));
        // A jump becomes higher; a function becomes its constant end.
        assert_eq!(changed(&[(0, 0), (5, 0), (5, 1)], &[(5, 0), (5, 2)]), Some((5.0, f64::INFINITY)));
        assert_eq!(changed(&old, &[(0, 3)]), Some((f64::NEG_INFINITY, 40.0)));
    }

    fn random() -> impl Strategy<Value = TransferFunction> {
        proptest::collection::vec((0i32..12, 0u8..3), 1..7).prop_map(|mut knots| {
            knots.sort_by_key(|k| k.0);
            let mut kept: Vec<(i32, u8)> = Vec::new();
            for knot in knots {
                if kept.iter().filter(|k| k.0 == knot.0).count() < 2 {
                    kept.push(knot);
                }
            }
            transfer(&kept)
        })
    }

    proptest! {
        #[test]
        fn outside_of_the_interval_nothing_has_changed(old in random(), new in random()) {
            let changed = changed_values(&old, &new);
            prop_assert_eq!(changed.map(|c| (c.min, c.max)), changed_values(&new, &old).map(|c| (c.min, c.max)));
            for value in (-8..56).map(|i| f64::from(i) * 0.25) {
                if !changed.is_some_and(|range| range.contains(value)) {
                    prop_assert_eq!(old.at(value), new.at(value));
                }
            }
        }
    }
}
