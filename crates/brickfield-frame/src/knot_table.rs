//! Where the search for a value's knot begins.

use brickfield_core::TransferFunction;

use crate::ValueScale;

/// Bins of equal width over the values of a transfer function's knots, two for each knot, and for each bin the last knot that is at or below all
/// of its values. A search that begins there has few steps to go:
///
/// ```text
/// knots     0       1       2       3
/// bins      |  0 |  1 |  2 |  3 |  4 |  5 |  6 | 7
/// begins at   0    0    0    1    1    2    2    3        and goes on by one knot at most
/// ```
///
/// Values are numbers of a [`ValueScale`], of which 0 is the first knot's. Values below it are in the first bin, and those
/// beyond the last knot in the last.
#[derive(Clone, Debug, PartialEq)]
pub struct KnotTable {
    begins: Vec<u32>,
    bins_per_value: f32,
    most_steps: u32,
}

/// By so much of a bin f32 arithmetic may be wrong about the bin of a value, of up to 512 bins: 512 times three roundings of 2^-24, and some.
const MARGIN: f64 = 1e-3;

impl KnotTable {
    /// The table of a transfer function's knots.
    pub fn of(transfer: &TransferFunction, values: ValueScale) -> KnotTable {
        let numbers: Vec<f32> = transfer.knots().iter().map(|knot| values.number(knot.value) as f32).collect();
        KnotTable::new(&numbers)
    }

    /// The table of knots that have these values, in ascending order, of which the first is 0.
    fn new(knots: &[f32]) -> KnotTable {
        let n_bins = 2 * knots.len();
        let width = width(knots.len(), f64::from(knots.last().copied().unwrap_or_default()));
        let bins_per_value = reciprocal(width);
        if bins_per_value == 0.0 {
            let most_steps = knots.len().saturating_sub(1) as u32;
            return KnotTable { begins: vec![0; n_bins], bins_per_value, most_steps };
        }
        let begins: Vec<u32> = last_below(knots, (0..n_bins).map(|bin| (bin as f64 - MARGIN) * width)).collect();
        let ends = last_below(knots, (1..n_bins).map(|bin| (bin as f64 + MARGIN) * width));
        let ends = ends.chain([knots.len() as u32 - 1]);
        let most_steps = begins.iter().zip(ends).map(|(begin, end)| end - begin).max().unwrap_or_default();
        KnotTable { begins, bins_per_value, most_steps }
    }

    /// Where the search begins in each bin.
    pub fn begins(&self) -> &[u32] {
        &self.begins
    }

    /// Bins per number of the value scale; 0 if there is only one bin.
    pub fn bins_per_value(&self) -> f32 {
        self.bins_per_value
    }

    /// The same of a transfer function's table, which is not made.
    pub(crate) fn bins_per_value_of(transfer: &TransferFunction, values: ValueScale) -> f32 {
        let knots = transfer.knots();
        let last = knots.last().map_or(0.0, |knot| values.number(knot.value) as f32);
        reciprocal(width(knots.len(), f64::from(last)))
    }

    /// How many knots a search goes on, at most.
    pub fn most_steps(&self) -> u32 {
        self.most_steps
    }
}

/// The width of a bin, of `n_knots` knots from 0 to `last`: the last bin begins at the last knot.
fn width(n_knots: usize, last: f64) -> f64 {
    last / (2 * n_knots).saturating_sub(1).max(1) as f64
}

/// 0 if it is no normal number.
fn reciprocal(width: f64) -> f32 {
    let reciprocal = (1.0 / width) as f32;
    if reciprocal.is_normal() { reciprocal } else { 0.0 }
}

/// The last knot at or below each of some values in ascending order, or the first knot.
fn last_below(knots: &[f32], values: impl Iterator<Item = f64>) -> impl Iterator<Item = u32> {
    let mut last = 0;
    values.map(move |value| {
        while knots.get(last + 1).is_some_and(|knot| f64::from(*knot) <= value) {
            last += 1;
        }
        last as u32
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The knot that is found for a value, as shaders look.
    fn found(table: &KnotTable, knots: &[f32], value: f32) -> usize {
        let place = if value > 0.0 { value * table.bins_per_value() } else { 0.0 };
        let bin = place.min((table.begins().len() - 1) as f32) as usize;
        let mut found = table.begins()[bin] as usize;
        for _ in 0..table.most_steps() {
            let next = (found + 1).min(knots.len() - 1);
            found = if knots[next] <= value { next } else { found };
        }
        found
    }

    proptest! {
        #[test]
        fn the_last_knot_at_or_below_a_value_is_found(
            gaps in proptest::collection::vec(prop_oneof![3 => 0f32..2.0, 1 => Just(0f32), 1 => 0f32..1e-5], 8..255),
            values in proptest::collection::vec(-10f32..300.0, 100),
        ) {
            let knots: Vec<f32> = std::iter::once(0.0)
                .chain(gaps.iter().scan(0.0, |sum, gap| { *sum += gap; Some(*sum) }))
                .collect();
            let table = KnotTable::new(&knots);
            let near = knots.iter().flat_map(|k| [*k, k.next_up(), k.next_down()]);
            for value in values.into_iter().chain(near).chain([f32::INFINITY, f32::NEG_INFINITY]) {
                let expected = knots.partition_point(|knot| *knot <= value).saturating_sub(1);
                prop_assert_eq!(found(&table, &knots, value), expected, "{}", value);
            }
        }
    }

    #[test]
    fn even_knots_are_a_step_away() {
        for n in [9u16, 100, 241, 256] {
            let knots: Vec<f32> = (0..n).map(|i| 0.7 * f32::from(i)).collect();
            assert_eq!(KnotTable::new(&knots).most_steps(), 1, "{n}");
        }
        // Two knots of one value, knots without extent, one knot, no knot.
        assert_eq!(KnotTable::new(&[0.0, 1.0, 1.0, 2.0, 3.0]).most_steps(), 2);
        for (n, steps) in [(3, 2), (1, 0), (0, 0)] {
            let table = KnotTable::new(&vec![0.0; n]);
            assert_eq!((table.most_steps(), table.bins_per_value()), (steps, 0.0));
        }
        assert!(found(&KnotTable::new(&[0.0, 1.0]), &[0.0, 1.0], f32::NAN) < 2);
    }
}
