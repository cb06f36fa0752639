//! One ray, smooth field: the rules themselves, in f64, against a truth of another origin.

use brickfield_core::{Knot, TransferFunction};
use brickfield_optics::{QuadratureRule, RayState};

use super::fit::OrderRow;

/// A smooth problem: one linear piece of transfer function under a smooth field on [0, 1].
fn transfer() -> TransferFunction {
    let knots = vec![
        Knot { value: -10.0, extinction: 0.0, color: [1.0, 0.0, 0.2] },
        Knot { value: 10.0, extinction: 20.0, color: [0.0, 1.0, 0.4] },
    ];
    TransferFunction::new(knots).expect("knots ascend")
}

fn field(t: f64) -> f64 {
    -7.0 + 3.0 * (4.0 * t).sin() + t
}

/// The pixel of a rule with n segments.
fn discrete(rule: QuadratureRule, n: u32) -> [f64; 4] {
    let (transfer, h) = (transfer(), 1.0 / f64::from(n));
    let mut ray = RayState::default();
    for k in 0..n {
        let values: Vec<f64> = rule.nodes().iter().map(|x| field((f64::from(k) + x) * h)).collect();
        ray.push(rule.segment(&transfer, &values, h));
    }
    ray.rgba()
}

/// The integral itself: depth in closed form, emission by Romberg's method on the trapezoidal rule, which shares nothing
/// with the rules.
fn truth() -> [f64; 4] {
    // tau = value + 10 = 3 + 3 sin 4t + t
    let depth = |t: f64| 3.0 * t + 0.75 * (1.0 - (4.0 * t).cos()) + 0.5 * t * t;
    let share = |t: f64| (field(t) + 10.0) / 20.0;
    let color = |t: f64, c: usize| [1.0 - share(t), share(t), 0.2 + 0.2 * share(t)][c];
    let emission = |c: usize| romberg(|t| (field(t) + 10.0) * color(t, c) * (-depth(t)).exp());
    [emission(0), emission(1), emission(2), -(-depth(1.0)).exp_m1()]
}

/// The integral over [0, 1] of a smooth function, to about 1e-15.
pub(super) fn romberg(f: impl Fn(f64) -> f64) -> f64 {
    const LEVELS: usize = 13;
    let mut row = vec![0.5 * (f(0.0) + f(1.0))];
    for level in 1..LEVELS {
        let n = 1u32 << level;
        let odd: f64 = (0..n / 2).map(|i| f(f64::from(2 * i + 1) / f64::from(n))).sum();
        let mut next = vec![0.5 * row[0] + odd / f64::from(n)];
        for (k, previous) in row.iter().enumerate() {
            let weight = 4f64.powi(k as i32 + 1);
            next.push((weight * next[k] - previous) / (weight - 1.0));
        }
        row = next;
    }
    row[LEVELS - 1]
}

/// A row for every rule: six halvings from 1/16 on.
pub fn rays() -> Vec<OrderRow> {
    let truth = truth();
    let error = |rule, n| {
        let pixel = discrete(rule, n);
        (0..4).map(|c| (pixel[c] - truth[c]).abs()).fold(0.0, f64::max)
    };
    let row = |rule: QuadratureRule| OrderRow {
        what: format!("ray, f64, {}", rule.name()),
        order: f64::from(rule.order()),
        errors: (4..11).map(|k| 1u32 << k).map(|n| (1.0 / f64::from(n), error(rule, n))).collect(),
        floor: 50.0 * f64::EPSILON,
        n_halvings: 5,
    };
    QuadratureRule::ALL.map(row).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_rule_has_its_order() {
        for row in rays() {
            assert!(row.holds(), "{row:?} {:?}", row.observed());
        }
    }

    #[test]
    fn romberg_integrates() {
        assert!((romberg(f64::exp) - (std::f64::consts::E - 1.0)).abs() < 1e-15);
    }
}
