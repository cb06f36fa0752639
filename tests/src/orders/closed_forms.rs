//! Closed forms, met to 1e-12 in f64 by the discrete sums of the rules.

use brickfield_core::{Knot, LinearRgb, TransferFunction};
use brickfield_optics::{QuadratureRule, RayState, Segment, alpha, depth, rescale_alpha};

/// A closed form, and how far the sum is from it.
#[derive(Clone, Debug, PartialEq)]
pub struct ClosedForm {
    /// What.
    pub what: String,
    /// Absolute difference of any channel.
    pub error: f64,
}

const C: LinearRgb = [0.25, 0.5, 1.0];

impl ClosedForm {
    /// Whether it is met.
    pub fn holds(&self) -> bool {
        self.error <= 1e-12
    }
}

/// All closed forms.
pub fn closed_forms() -> Vec<ClosedForm> {
    let mut all = vec![linear_extinction(), gaussian_ball(), layers(), split(), opacity_correction()];
    all.extend(QuadratureRule::ALL.into_iter().filter(|r| *r != QuadratureRule::LeftRiemann).map(slab));
    all.extend(QuadratureRule::ALL.map(constant_color));
    all
}

fn sum(rule: QuadratureRule, transfer: &TransferFunction, length: f64, n: u32, field: impl Fn(f64) -> f64) -> RayState {
    let h = length / f64::from(n);
    let mut ray = RayState::default();
    for k in 0..n {
        let values: Vec<f64> = rule.nodes().iter().map(|x| field((f64::from(k) + x) * h)).collect();
        ray.push(rule.segment(transfer, &values, h));
    }
    ray
}

fn form(what: impl Into<String>, got: [f64; 4], expected: [f64; 4]) -> ClosedForm {
    let error = (0..4).map(|c| (got[c] - expected[c]).abs()).fold(0.0, f64::max);
    ClosedForm { what: what.into(), error }
}

fn of_depth(depth: f64) -> [f64; 4] {
    let a = alpha(depth);
    [C[0] * a, C[1] * a, C[2] * a, a]
}

/// Extinction is the value, colour constant.
fn identity() -> TransferFunction {
    let knot = |value| Knot { value, extinction: value, color: C };
    TransferFunction::new(vec![knot(0.0), knot(100.0)]).expect("knots ascend")
}

/// Homogeneous slab: A = 1 - e^(-tau L). (The left Riemann rule meets it only as h goes to 0.)
fn slab(rule: QuadratureRule) -> ClosedForm {
    let got = sum(rule, &identity(), 7.0, 91, |_| 0.37);
    form(format!("homogeneous slab, {}", rule.name()), got.rgba(), of_depth(0.37 * 7.0))
}

/// Constant colour: C = c A, whatever the rule makes of A.
fn constant_color(rule: QuadratureRule) -> ClosedForm {
    let rgba = sum(rule, &identity(), 7.0, 50, |t| 0.2 + t.sin().powi(2)).rgba();
    let a = rgba[3];
    form(format!("constant colour C = c A, {}", rule.name()), rgba, [C[0] * a, C[1] * a, C[2] * a, a])
}

/// Linear extinction a + b t: D = a L + b L^2 / 2.
fn linear_extinction() -> ClosedForm {
    let got = sum(QuadratureRule::MidpointExponential, &identity(), 6.0, 200, |t| 0.1 + 0.05 * t);
    form("linear extinction, midpoint", got.rgba(), of_depth(0.1 * 6.0 + 0.05 * 18.0))
}

/// Gaussian ball at impact parameter b: D = tau sigma sqrt(2 pi) e^(-b^2 / 2 sigma^2).
fn gaussian_ball() -> ClosedForm {
    let (tau, sigma, b) = (0.8f64, 1.3f64, 0.9f64);
    let center = 9.0 * sigma;
    let extinction = |t: f64| tau * (-(b * b + (t - center).powi(2)) / (2.0 * sigma * sigma)).exp();
    let got = sum(QuadratureRule::Gauss2, &identity(), 2.0 * center, 4000, extinction);
    let depth = tau * sigma * std::f64::consts::TAU.sqrt() * (-b * b / (2.0 * sigma * sigma)).exp();
    form("Gaussian ball, impact 0.9, gauss2", got.rgba(), of_depth(depth))
}

/// Layers of constant extinction and colour, the step a divisor of their thickness.
fn layers() -> ClosedForm {
    let layers: [(f64, f64, LinearRgb); 4] =
        [(0.3, 2.0, [1.0, 0.0, 0.5]), (5.0, 1.0, [0.0, 1.0, 0.25]), (0.0, 3.0, [1.0; 3]), (1.5, 0.5, [0.5, 0.5, 0.0])];
    let (mut ray, mut expected, mut transmittance) = (RayState::default(), [0.0; 4], 1.0);
    for (tau, thickness, color) in layers {
        let transfer = TransferFunction::constant(tau, color).expect("a constant");
        for _ in 0..64 {
            ray.push(QuadratureRule::MidpointExponential.segment(&transfer, &[0.0], thickness / 64.0));
        }
        let a = alpha(tau * thickness);
        (0..3).for_each(|c| expected[c] += transmittance * a * color[c]);
        transmittance *= 1.0 - a;
    }
    expected[3] = 1.0 - transmittance;
    form("piecewise-constant layers", ray.rgba(), expected)
}

/// [0, m] before [m, L] is [0, L], for every m.
fn split() -> ClosedForm {
    let color = |v: f64| [v, 1.0 - v, 0.5];
    let knots = vec![
        Knot { value: 0.0, extinction: 0.1, color: color(0.0) },
        Knot { value: 1.0, extinction: 3.0, color: color(1.0) },
    ];
    let transfer = TransferFunction::new(knots).expect("knots ascend");
    let piece = |from: u32, to: u32| {
        let mut ray = RayState::default();
        for k in from..to {
            let value = (0.1 * f64::from(k)).sin().powi(2);
            ray.push(QuadratureRule::MidpointExponential.segment(&transfer, &[value], 0.05));
        }
        ray
    };
    let whole = piece(0, 100).rgba();
    let joined = |m: u32| {
        let (mut front, back) = (piece(0, m), piece(m, 100));
        front.push(Segment { depth: back.depth, emission: back.emission });
        form("", front.rgba(), whole).error
    };
    ClosedForm { what: "split at any point".into(), error: (0..=100).map(joined).fold(0.0, f64::max) }
}

/// LaMar's equation 14, and opacities there and back.
fn opacity_correction() -> ClosedForm {
    let error = |a: f64| {
        let twice = (rescale_alpha(a, 2.0) - a * (2.0 - a)).abs();
        let back = (alpha(depth(a)) - a).abs();
        twice.max(back)
    };
    let opacities = (0..=1000).map(|i| f64::from(i) / 1000.0);
    ClosedForm { what: "opacity correction (LaMar eq. 14)".into(), error: opacities.map(error).fold(0.0, f64::max) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_are_met() {
        for form in closed_forms() {
            assert!(form.holds(), "{form:?}");
        }
    }
}
