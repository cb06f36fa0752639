//! Quadrature rules for the emission-absorption integral, as values of one enum.
//!
//! The model: I = integral of tau(t) c(t) exp(-D(t)) dt with D(t) = integral of tau from the eye to t; tau is the
//! extinction, c the straight colour. A ray is cut into segments; a rule looks at a segment through a few nodes and says
//! its optical depth and its emission as seen from its near end.

use brickfield_core::{LinearRgb, Optics, TransferFunction};

use crate::{Shade, alpha, depth, transmittance};

/// How a segment of a ray is integrated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum QuadratureRule {
    /// One node at the near end, alpha = min(tau h, 1): order 1, and an explicit Euler step that saturates at tau h = 1.
    /// It is here to show its error.
    LeftRiemann,
    /// One node at the near end, alpha = 1 - e^(-tau h): order 1, stable for every tau h.
    LeftExponential,
    /// One node in the middle, alpha = 1 - e^(-tau h): order 2, stable. The default.
    MidpointExponential,
    /// Nodes at both ends; the data value runs linearly between them, the transfer function is integrated along it exactly
    /// in extinction, knot by knot, front to back (Engel, Kraus and Ertl 2001, without a table): order 2.
    PreIntegrated,
    /// The two Gauss-Legendre nodes: order 4 on smooth fields. Depth h (tau1 + tau2) / 2; the nodes' colours are weighted by
    /// tau_i e^(-D_i) with the collocation depths D_i, normalised to the segment's exact alpha, so that a constant colour is
    /// exact and the emission stays within the colours' hull at any tau h.
    Gauss2,
}

/// Optical depth of a segment, and its emission (premultiplied, as seen from the segment's near end).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(missing_docs)]
pub struct Segment {
    pub depth: f64,
    pub emission: LinearRgb,
}

/// A ray's state, front to back.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(missing_docs)]
pub struct RayState {
    pub depth: f64,
    pub emission: LinearRgb,
}

/// Position of the Gauss-Legendre nodes in a segment of length 1: 1/2 -+ 1/(2 sqrt 3).
const GAUSS: [f64; 2] = [0.211_324_865_405_187_13, 0.788_675_134_594_812_9];

impl QuadratureRule {
    /// All rules, from the coarsest.
    pub const ALL: [QuadratureRule; 5] = [
        QuadratureRule::LeftRiemann,
        QuadratureRule::LeftExponential,
        QuadratureRule::MidpointExponential,
        QuadratureRule::PreIntegrated,
        QuadratureRule::Gauss2,
    ];

    /// Where the rule's nodes lie in a segment [0, 1].
    pub const fn nodes(self) -> &'static [f64] {
        match self {
            QuadratureRule::LeftRiemann | QuadratureRule::LeftExponential => &[0.0],
            QuadratureRule::MidpointExponential => &[0.5],
            QuadratureRule::PreIntegrated => &[0.0, 1.0],
            QuadratureRule::Gauss2 => &GAUSS,
        }
    }

    /// Order of accuracy in the step on smooth fields and transfer functions.
    pub const fn order(self) -> u32 {
        match self {
            QuadratureRule::LeftRiemann | QuadratureRule::LeftExponential => 1,
            QuadratureRule::MidpointExponential | QuadratureRule::PreIntegrated => 2,
            QuadratureRule::Gauss2 => 4,
        }
    }

    /// The rule's name in reports and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            QuadratureRule::LeftRiemann => "left-riemann",
            QuadratureRule::LeftExponential => "left-exponential",
            QuadratureRule::MidpointExponential => "midpoint",
            QuadratureRule::PreIntegrated => "pre-integrated",
            QuadratureRule::Gauss2 => "gauss2",
        }
    }

    /// The rule of that [`name`](Self::name).
    pub fn from_name(name: &str) -> Option<QuadratureRule> {
        QuadratureRule::ALL.into_iter().find(|r| r.name() == name)
    }

    /// A segment of length `length_world` whose nodes have the data values `values` (one per node).
    ///
    /// # Panics
    /// If there are fewer values than nodes.
    pub fn segment(self, transfer: &TransferFunction, values: &[f64], length_world: f64) -> Segment {
        let node = |i: usize| (values[i], Shade::NONE);
        match self.nodes().len() {
            1 => self.lit_segment(transfer, &[node(0)], length_world),
            _ => self.lit_segment(transfer, &[node(0), node(1)], length_world),
        }
    }

    /// A segment of length `length_world` whose nodes have these data values and shades (one of each per node).
    ///
    /// A node's shade is on its colour. With [`PreIntegrated`](Self::PreIntegrated), which looks at values between the nodes, the nodes'
    /// mean shade is on all of the segment's emission.
    ///
    /// # Panics
    /// If there are fewer than nodes.
    pub fn lit_segment(self, transfer: &TransferFunction, nodes: &[(f64, Shade)], length_world: f64) -> Segment {
        let optics = |i: usize| nodes[i].1.on(transfer.at(nodes[i].0));
        self.classified(optics, length_world).unwrap_or_else(|| {
            let Segment { depth, emission } = preintegrate(transfer, nodes[0].0, nodes[1].0, length_world);
            let Shade { factor, highlight } = nodes[0].1.mean(nodes[1].1);
            Segment { depth, emission: emission.map(|e| e * factor + alpha(depth) * highlight) }
        })
    }

    /// A segment of length `length_world` whose nodes have these optics (one per node), with their shades on them; `None` of
    /// [`PreIntegrated`](Self::PreIntegrated), which looks at the values between its nodes.
    ///
    /// # Panics
    /// If there are fewer optics than nodes.
    pub fn segment_of(self, nodes: &[Optics], length_world: f64) -> Option<Segment> {
        self.classified(|node| nodes[node], length_world)
    }

    fn classified(self, optics: impl Fn(usize) -> Optics, length_world: f64) -> Option<Segment> {
        match self {
            QuadratureRule::LeftRiemann => Some(euler(optics(0), length_world)),
            QuadratureRule::LeftExponential | QuadratureRule::MidpointExponential => {
                Some(exponential(optics(0), length_world))
            }
            QuadratureRule::PreIntegrated => None,
            QuadratureRule::Gauss2 => Some(gauss2(optics(0), optics(1), length_world)),
        }
    }
}

impl RayState {
    /// Puts a segment behind the emission and depth so far.
    #[inline]
    pub fn push(&mut self, segment: Segment) {
        let t = transmittance(self.depth);
        for (sum, e) in self.emission.iter_mut().zip(segment.emission) {
            *sum += t * e;
        }
        self.depth += segment.depth;
    }

    /// The premultiplied RGBA seen from the ray's start.
    pub fn rgba(&self) -> [f64; 4] {
        let [r, g, b] = self.emission;
        [r, g, b, alpha(self.depth)]
    }
}

fn euler(optics: Optics, length: f64) -> Segment {
    let a = (optics.extinction * length).min(1.0);
    Segment { depth: depth(a), emission: optics.color.map(|c| a * c) }
}

fn exponential(optics: Optics, length: f64) -> Segment {
    let depth = optics.extinction * length;
    let a = alpha(depth);
    Segment { depth, emission: optics.color.map(|c| a * c) }
}

fn gauss2(near: Optics, far: Optics, length: f64) -> Segment {
    let total = near.extinction + far.extinction;
    if total == 0.0 {
        return Segment::default();
    }
    let depth = 0.5 * length * total;
    // D_2 - D_1 = depth / sqrt 3 by the Gauss collocation coefficients (Hairer, Norsett and Wanner 1993, table II.7.1).
    let far_weight = far.extinction * (-depth / 3f64.sqrt()).exp();
    let weight = near.extinction + far_weight;
    // Only an underflow makes the weight 0: then the far node, behind nothing, is all there is.
    let share = if weight > 0.0 { near.extinction / weight } else { 0.0 };
    let a = alpha(depth);
    Segment { depth, emission: std::array::from_fn(|c| a * (share * near.color[c] + (1.0 - share) * far.color[c])) }
}

/// A segment along which the data value runs linearly from `near` to `far`.
///
/// The value range is cut at the transfer function's knots. In each piece extinction and colour are linear: the depth is
/// exact, the emission is alpha times the extinction-weighted mean colour; pieces are composited front to back.
pub fn preintegrate(transfer: &TransferFunction, near: f64, far: f64, length_world: f64) -> Segment {
    if near == far {
        return exponential(transfer.at(near), length_world);
    }
    let knots = transfer.knots();
    let above = knots.partition_point(|k| k.value <= near.min(far));
    let below = knots.partition_point(|k| k.value < near.max(far));
    let mut ray = RayState::default();
    let mut from = near;
    let mut advance = |to: f64| {
        if to != from {
            let length = length_world * (to - from) / (far - near);
            ray.push(linear_piece(one_sided(transfer, from, to), one_sided(transfer, to, from), length));
        }
        from = to;
    };
    let inside = &knots[above.min(below)..below];
    if near < far {
        inside.iter().for_each(|k| advance(k.value));
    } else {
        inside.iter().rev().for_each(|k| advance(k.value));
    }
    advance(far);
    Segment { depth: ray.depth, emission: ray.emission }
}

/// The transfer function at `value`, approached from `from`: at a jump the limit on that side.
fn one_sided(transfer: &TransferFunction, value: f64, from: f64) -> Optics {
    let knots = transfer.knots();
    let jump = from < value && knots.windows(2).any(|k| k[0].value == value && k[1].value == value);
    match knots.iter().find(|k| jump && k.value == value) {
        Some(knot) => knot.optics(),
        None => transfer.at(value),
    }
}

fn linear_piece(a: Optics, b: Optics, length: f64) -> Segment {
    let total = a.extinction + b.extinction;
    if total == 0.0 {
        return Segment::default();
    }
    let depth = 0.5 * length * total;
    let scale = alpha(depth) / (3.0 * total);
    let (near, far) = (2.0 * a.extinction + b.extinction, a.extinction + 2.0 * b.extinction);
    Segment { depth, emission: std::array::from_fn(|c| scale * (near * a.color[c] + far * b.color[c])) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::Knot;

    fn integrate(rule: QuadratureRule, transfer: &TransferFunction, field: impl Fn(f64) -> f64, n: u32) -> [f64; 4] {
        let h = 1.0 / f64::from(n);
        let mut ray = RayState::default();
        for k in 0..n {
            let values: Vec<f64> = rule.nodes().iter().map(|x| field((f64::from(k) + x) * h)).collect();
            ray.push(rule.segment(transfer, &values, h));
        }
        ray.rgba()
    }

    fn knot(value: f64, extinction: f64, color: LinearRgb) -> Knot {
        Knot { value, extinction, color }
    }

    /// A smooth problem: one linear piece of transfer function under a smooth field.
    fn smooth() -> (TransferFunction, fn(f64) -> f64) {
        let tf =
            TransferFunction::new(vec![knot(-10.0, 0.0, [1.0, 0.0, 0.2]), knot(10.0, 20.0, [0.0, 1.0, 0.4])]).unwrap();
        (tf, |t| -7.0 + 3.0 * (4.0 * t).sin() + t)
    }

    fn error(a: [f64; 4], b: [f64; 4]) -> f64 {
        a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn every_rule_has_its_order() {
        let (tf, field) = smooth();
        let exact = integrate(QuadratureRule::Gauss2, &tf, field, 1 << 13);
        for rule in QuadratureRule::ALL {
            let e = |n| error(integrate(rule, &tf, field, n), exact);
            let slope = (e(32) / e(1024)).log2() / 5.0;
            assert!((slope - f64::from(rule.order())).abs() < 0.1, "{}: order {slope}", rule.name());
        }
    }

    #[test]
    fn constant_colour_is_exact_at_every_optical_depth() {
        for scale in [1e-12, 1e-6, 1.0, 1e3, 1e12] {
            let c = [0.25, 0.5, 1.0];
            let tf = TransferFunction::new(vec![knot(0.0, 0.0, c), knot(1.0, scale, c)]).unwrap();
            for rule in QuadratureRule::ALL {
                let [r, g, b, a] = integrate(rule, &tf, |t| t * t, 7);
                for (x, c) in [r, g, b].into_iter().zip(c) {
                    assert!((x - c * a).abs() <= 8.0 * f64::EPSILON * a, "{} at {scale}", rule.name());
                }
                assert!((0.0..=1.0).contains(&a));
            }
        }
    }

    #[test]
    fn preintegration_sees_a_peak_between_its_nodes() {
        let white = [1.0; 3];
        let peak = vec![knot(0.4, 0.0, white), knot(0.5, 100.0, white), knot(0.6, 0.0, white)];
        let tf = TransferFunction::new(peak).unwrap();
        let segment = preintegrate(&tf, 0.0, 1.0, 1.0);
        assert!((segment.depth - 10.0).abs() < 1e-12);
        assert_eq!(segment, preintegrate(&tf, 1.0, 0.0, 1.0));
    }

    #[test]
    fn preintegration_takes_jumps_from_their_own_side() {
        let tf = TransferFunction::new(vec![knot(0.5, 0.0, [1.0, 0.0, 0.0]), knot(0.5, 8.0, [0.0, 1.0, 0.0])]).unwrap();
        for (a, b) in [(0.0, 1.0), (1.0, 0.0)] {
            let segment = preintegrate(&tf, a, b, 1.0);
            assert!((segment.depth - 4.0).abs() < 1e-12);
            assert!((segment.emission[1] - alpha(4.0)).abs() < 1e-12 && segment.emission[0] == 0.0);
        }
    }

    #[test]
    fn splitting_a_ray_changes_nothing() {
        let (tf, field) = smooth();
        let rule = QuadratureRule::MidpointExponential;
        let piece = |from: u32, to: u32| {
            let mut ray = RayState::default();
            for k in from..to {
                ray.push(rule.segment(&tf, &[field((f64::from(k) + 0.5) / 64.0)], 1.0 / 64.0));
            }
            ray
        };
        let (front, back, whole) = (piece(0, 20), piece(20, 64), piece(0, 64));
        let mut joined = front;
        joined.push(Segment { depth: back.depth, emission: back.emission });
        assert!(error(joined.rgba(), whole.rgba()) < 1e-14);
    }
}
