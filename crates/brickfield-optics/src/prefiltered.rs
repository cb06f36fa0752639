//! Prefiltered classification: the optics that are expected of many values.

use brickfield_core::{Knot, Optics, TransferFunction, ValueRange};

/// What is known of many values: their mean, their standard deviation, and a range that holds them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct ValueSpread {
    pub mean: f64,
    pub deviation: f64,
    pub range: ValueRange,
}

impl ValueSpread {
    /// How far a distribution of two uniform halves, which meet at the mean, reaches below and above it.
    ///
    /// ```text
    ///                  +-----+
    ///                  |     |             areas: below : above = b : a, so that the mean is where they meet;
    ///      +-----------+     |             variance: a b / 3
    ///      |           |     |
    ///  ----+-----------+-----+----
    ///     mean - a   mean  mean + b
    /// ```
    ///
    /// Both reach sqrt(3) deviations where the range has room: then it is one uniform distribution. Where one half has less room, the
    /// other reaches farther, so that the variance stays, up to the other end of the range.
    pub fn reach(&self) -> [f64; 2] {
        let wanted = 3f64.sqrt() * self.deviation.max(0.0);
        let room = [self.mean - self.range.min, self.range.max - self.mean].map(|room| room.max(0.0));
        let along = |own: f64, other: f64| match other < wanted {
            // Without any room the quotient is infinite: the half ends where the range does.
            true => (wanted * (wanted / other)).min(own),
            false => wanted.min(own),
        };
        [along(room[0], room[1]), along(room[1], room[0])]
    }
}

/// The optics of many values: the mean extinction, and the mean colour with extinctions for weights.
///
/// Light through a thin layer of such values is that of this extinction and colour. The values are distributed as
/// [`ValueSpread::reach`] says. Exact for a transfer function that is linear from knot to knot, to f64 rounding: all terms are positive.
/// A deviation of 0, or a mean at an end of the range, gives the transfer function itself.
pub fn expected_optics(transfer: &TransferFunction, values: &ValueSpread) -> Optics {
    let [below, above] = values.reach();
    if below.min(above) <= 0.0 {
        return transfer.at(values.mean);
    }
    let mut sum = Sum::default();
    sum.add_uniform(transfer, (values.mean - below, values.mean), above / (below + above));
    sum.add_uniform(transfer, (values.mean, values.mean + above), below / (below + above));
    sum.optics()
}

/// Means over values.
#[derive(Default)]
struct Sum {
    extinction: f64,
    emission: [f64; 3],
}

impl Sum {
    /// Adds values that are evenly distributed between two, with a weight.
    fn add_uniform(&mut self, transfer: &TransferFunction, (low, high): (f64, f64), weight: f64) {
        if low >= high {
            // Nearer than f64 tells apart.
            return self.add(weight, transfer.at(low), transfer.at(low));
        }
        let knots = transfer.knots();
        let (mut from, mut above) = (low, knots.partition_point(|k| k.value <= low));
        loop {
            let to = knots.get(above).map_or(high, |k| k.value.min(high));
            if to > from {
                let share = weight * (to - from) / (high - low);
                self.add(share, on_line(knots, above, from), on_line(knots, above, to));
            }
            if to == high {
                return;
            }
            (from, above) = (to, above + 1);
        }
    }

    /// Adds a piece on which extinction and colour are linear: their product is integrated exactly.
    fn add(&mut self, share: f64, a: Optics, b: Optics) {
        self.extinction += share * 0.5 * (a.extinction + b.extinction);
        let (at_a, at_b) = (2.0 * a.extinction + b.extinction, a.extinction + 2.0 * b.extinction);
        for (sum, (a, b)) in self.emission.iter_mut().zip(a.color.into_iter().zip(b.color)) {
            *sum += share / 6.0 * (at_a * a + at_b * b);
        }
    }

    fn optics(self) -> Optics {
        match self.extinction > 0.0 {
            true => {
                Optics { extinction: self.extinction, color: self.emission.map(|c| (c / self.extinction).min(1.0)) }
            }
            false => Optics::default(),
        }
    }
}

/// The optics at a value on the line that ends at knot `above`: constant before the first knot and behind the last.
fn on_line(knots: &[Knot], above: usize, value: f64) -> Optics {
    match (above.checked_sub(1).map(|below| &knots[below]), knots.get(above)) {
        (Some(low), Some(high)) => {
            let f = (value - low.value) / (high.value - low.value);
            let mix = |a: f64, b: f64| a + (b - a) * f;
            Optics {
                extinction: mix(low.extinction, high.extinction),
                color: std::array::from_fn(|c| mix(low.color[c], high.color[c])),
            }
        }
        (Some(only), None) | (None, Some(only)) => only.optics(),
        (None, None) => Optics::default(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn transfer() -> impl Strategy<Value = TransferFunction> {
        let knot = (0u32..40, 0.0..3.0f64, [0.0..1.0f64, 0.0..1.0, 0.0..1.0]);
        prop::collection::vec(knot, 1..9).prop_map(|mut knots| {
            knots.sort_by_key(|(value, ..)| *value);
            let mut kept: Vec<Knot> = Vec::new();
            for (value, extinction, color) in knots {
                let value = f64::from(value);
                // At most two knots at a value: those are jumps.
                if kept.len() < 2 || kept[kept.len() - 2].value != value {
                    kept.push(Knot { value, extinction, color });
                }
            }
            TransferFunction::new(kept).unwrap()
        })
    }

    /// Spreads of values that there may be: no deviation is greater than that of values at both ends.
    fn spread() -> impl Strategy<Value = ValueSpread> {
        (-5.0..45.0f64, 0.1..40.0f64, 0.0..=1.0f64, 0.0..=1.0f64).prop_map(|(min, width, place, part)| {
            let deviation = part * width * (place * (1.0 - place)).sqrt();
            ValueSpread { mean: min + place * width, deviation, range: ValueRange { min, max: min + width } }
        })
    }

    proptest! {
        #[test]
        fn mean_and_range_are_kept_and_the_variance_where_there_is_room(values in spread()) {
            let [below, above] = values.reach();
            let ValueSpread { mean, deviation, range } = values;
            prop_assert!(mean - below >= range.min - 1e-12 && mean + above <= range.max + 1e-12);
            prop_assert!(below >= 0.0 && above >= 0.0);
            let variance = below * above / 3.0;
            prop_assert!(variance <= deviation * deviation * (1.0 + 1e-12) + 1e-12);
            let has_room = below < mean - range.min || above < range.max - mean;
            prop_assert!(!has_room || (variance - deviation * deviation).abs() < 1e-9, "{variance} for {deviation}^2");
        }

        #[test]
        fn the_mean_of_many_values(transfer in transfer(), values in spread()) {
            let found = expected_optics(&transfer, &values);
            let [below, above] = values.reach();
            let n = 20_000;
            let (mut extinction, mut emission) = (0.0, [0.0; 3]);
            for i in 0..n {
                let part = (f64::from(i) + 0.5) / f64::from(n);
                for (value, weight) in [
                    (values.mean - below * part, above),
                    (values.mean + above * part, below),
                ] {
                    let total = below + above;
                    let weight = if total > 0.0 { weight / total } else { 0.5 } / f64::from(n);
                    let optics = transfer.at(value);
                    extinction += weight * optics.extinction;
                    (0..3).for_each(|c| emission[c] += weight * optics.extinction * optics.color[c]);
                }
            }
            // A jump lies between two of the values.
            prop_assert!((found.extinction - extinction).abs() < 1e-3);
            for (color, emission) in found.color.into_iter().zip(emission) {
                prop_assert!((color * found.extinction - emission).abs() < 1e-3 && (0.0..=1.0).contains(&color));
            }
        }

        #[test]
        fn a_transfer_function_of_one_line_is_as_at_the_mean(values in spread()) {
            let knot = |value: f64| Knot { value, extinction: 0.1 + 0.02 * (value + 100.0), color: [0.3, 0.5, 1.0] };
            let line = TransferFunction::new(vec![knot(-100.0), knot(200.0)]).unwrap();
            let (found, at_mean) = (expected_optics(&line, &values), line.at(values.mean));
            prop_assert!((found.extinction - at_mean.extinction).abs() < 1e-12);
            prop_assert!(found.color.iter().zip(at_mean.color).all(|(a, b)| (a - b).abs() < 1e-12));
        }

        #[test]
        fn no_deviation_is_the_transfer_function(transfer in transfer(), values in spread()) {
            let alike = ValueSpread { deviation: 0.0, ..values };
            prop_assert_eq!(expected_optics(&transfer, &alike), transfer.at(values.mean));
        }
    }
}
