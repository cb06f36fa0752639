//! The Pareto front of error against time.

use super::Row;

/// The cost of a measurement: time and error.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Cost {
    pub ms: f64,
    pub rmse: f64,
}

/// Whether each cost is on the front: no other has both less time and less error.
///
/// Ties do not exclude each other: of two with equal error (two backends that draw the same bits) both stay, unless a
/// third beats them in both. Costs that are not numbers are never on the front and exclude nothing.
pub fn on_front(costs: &[Cost]) -> Vec<bool> {
    let beaten = |c: &Cost| costs.iter().any(|o| o.ms < c.ms && o.rmse < c.rmse);
    costs.iter().map(|c| !c.ms.is_nan() && !c.rmse.is_nan() && !beaten(c)).collect()
}

/// Sets `on_front` of all rows.
pub fn mark_front(rows: &mut [Row]) {
    let costs: Vec<Cost> = rows.iter().map(|r| Cost { ms: r.median_ms, rmse: r.rmse }).collect();
    for (row, front) in rows.iter_mut().zip(on_front(&costs)) {
        row.on_front = front;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn cost((ms, rmse): (u32, u32)) -> Cost {
        Cost { ms: f64::from(ms), rmse: f64::from(rmse) }
    }

    fn front(costs: &[(u32, u32)]) -> Vec<bool> {
        on_front(&costs.iter().copied().map(cost).collect::<Vec<_>>())
    }

    #[test]
    fn the_front_is_what_nothing_beats_in_both() {
        assert_eq!(front(&[(1, 9), (2, 5), (3, 7), (9, 1), (9, 2)]), [true, true, false, true, true]);
        assert_eq!(front(&[(4, 4), (4, 4), (5, 4), (5, 5)]), [true, true, true, false]);
        assert_eq!(front(&[(7, 7)]), [true]);
        assert!(front(&[]).is_empty());
    }

    #[test]
    fn what_is_no_number_is_not_on_the_front() {
        let costs = [Cost { ms: f64::NAN, rmse: 0.0 }, Cost { ms: 1.0, rmse: f64::NAN }, Cost { ms: 2.0, rmse: 2.0 }];
        assert_eq!(on_front(&costs), [false, false, true]);
    }

    proptest! {
        #[test]
        fn fastest_and_most_exact_are_on_it_and_each_other_row_is_beaten_by_one_that_is(
            costs in prop::collection::vec((0u32..20, 0u32..20), 1..40)
        ) {
            let on = front(&costs);
            let fastest = (0..costs.len()).min_by_key(|i| costs[*i]).unwrap();
            let exactest = (0..costs.len()).min_by_key(|i| (costs[*i].1, costs[*i].0)).unwrap();
            prop_assert!(on[fastest] && on[exactest]);
            for (i, c) in costs.iter().enumerate().filter(|(i, _)| !on[*i]) {
                let beaten = costs.iter().zip(&on).any(|(o, on)| *on && o.0 < c.0 && o.1 < c.1);
                prop_assert!(beaten, "{i}");
            }
        }
    }
}
