//! The quadrature rules in f32, and a ray's state.

use brickfield_optics::QuadratureRule;

use super::classify::{Classifier, Optics32};
use super::light::Shade32;
use super::scalar::{alpha, depth, exp_minus};

/// Depth, opacity and emission of a segment.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Segment32 {
    pub(crate) depth: f32,
    pub(crate) alpha: f32,
    pub(crate) emission: [f32; 3],
}

/// A ray's state: transmittance and premultiplied RGBA, accumulated in f64 so that thousands of segments cost no digits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray32 {
    pub(crate) transmittance: f64,
    pub(crate) rgba: [f64; 4],
}

impl Default for Ray32 {
    fn default() -> Self {
        Ray32 { transmittance: 1.0, rgba: [0.0; 4] }
    }
}

impl Ray32 {
    /// Puts a segment behind what has been seen so far.
    #[inline(always)]
    pub(crate) fn push(&mut self, s: Segment32) {
        let t = self.transmittance as f32;
        let [r, g, b] = s.emission;
        for (sum, x) in self.rgba.iter_mut().zip([r, g, b, s.alpha]) {
            *sum += f64::from(t * x);
        }
        self.transmittance *= 1.0 - f64::from(s.alpha);
    }

    /// This ray, and behind it one that goes on.
    pub(crate) fn before(&self, behind: &Ray32) -> Ray32 {
        let sum = |i: usize| self.rgba[i] + self.transmittance * behind.rgba[i];
        Ray32 { transmittance: self.transmittance * behind.transmittance, rgba: std::array::from_fn(sum) }
    }

    /// Whether nothing, or less than a floor, shines through any more.
    #[inline(always)]
    pub(crate) fn has_ended(&self, floor: f64) -> bool {
        self.transmittance < floor || self.transmittance == 0.0
    }

    /// The pixel: alpha at most 1, colours at most `brightest`.
    pub(crate) fn rgba(&self, brightest: f32) -> [f32; 4] {
        let [r, g, b, a] = self.rgba.map(|x| x as f32);
        [r.min(brightest), g.min(brightest), b.min(brightest), a.min(1.0)]
    }
}

/// A segment with the given values at its nodes (`None`: extinction 0), as numbers of the value scale.
#[inline(always)]
pub(crate) fn segment(rule: QuadratureRule, transfer: &Classifier, values: [Option<f32>; 2], length: f32) -> Segment32 {
    match (rule, values) {
        (QuadratureRule::Gauss2, [a, b]) => gauss2(optics(transfer, a), optics(transfer, b), length),
        (QuadratureRule::PreIntegrated, [Some(a), Some(b)]) => preintegrated(transfer, a, b, length),
        (QuadratureRule::LeftRiemann, [Some(v), _]) => euler(transfer.at(v), length),
        (QuadratureRule::LeftExponential | QuadratureRule::MidpointExponential, [Some(v), _]) => {
            exponential(transfer.at(v), length)
        }
        _ => Segment32::default(),
    }
}

/// A segment of nodes with these values and shades (`None`: extinction 0).
pub(super) fn lit_segment(
    rule: QuadratureRule,
    transfer: &Classifier,
    nodes: [Option<(f32, Shade32)>; 2],
    length: f32,
) -> Segment32 {
    match (rule, nodes) {
        (QuadratureRule::PreIntegrated, [Some((a, near)), Some((b, far))]) => {
            let (unlit, shade) = (preintegrated(transfer, a, b, length), near.mean(far));
            Segment32 { emission: unlit.emission.map(|e| e * shade.factor + unlit.alpha * shade.highlight), ..unlit }
        }
        _ => segment_of(rule, nodes.map(|node| node.map(|(v, shade)| shade.on(transfer.at(v)))), length),
    }
}

/// A segment whose nodes have the given optics (`None`: extinction 0), by a rule that looks at nodes alone.
pub(crate) fn segment_of(rule: QuadratureRule, nodes: [Option<Optics32>; 2], length: f32) -> Segment32 {
    match (rule, nodes) {
        (QuadratureRule::Gauss2, [a, b]) => gauss2(a.unwrap_or_default(), b.unwrap_or_default(), length),
        (QuadratureRule::LeftRiemann, [Some(o), _]) => euler(o, length),
        (QuadratureRule::LeftExponential | QuadratureRule::MidpointExponential, [Some(o), _]) => exponential(o, length),
        _ => Segment32::default(),
    }
}

#[inline(always)]
fn optics(transfer: &Classifier, value: Option<f32>) -> Optics32 {
    value.map_or(Optics32::default(), |v| transfer.at(v))
}

#[inline(always)]
fn euler(o: Optics32, length: f32) -> Segment32 {
    let a = (o.extinction * length).min(1.0);
    Segment32 { depth: depth(a), alpha: a, emission: o.color.map(|c| a * c) }
}

#[inline(always)]
pub(crate) fn exponential(o: Optics32, length: f32) -> Segment32 {
    let depth = o.extinction * length;
    let a = alpha(depth);
    Segment32 { depth, alpha: a, emission: o.color.map(|c| a * c) }
}

#[inline(always)]
fn gauss2(near: Optics32, far: Optics32, length: f32) -> Segment32 {
    let total = near.extinction + far.extinction;
    if total == 0.0 {
        return Segment32::default();
    }
    let depth = 0.5 * length * total;
    let far_weight = far.extinction * exp_minus(depth * (1.0 / 3f32.sqrt()));
    let weight = near.extinction + far_weight;
    let share = if weight > 0.0 { near.extinction / weight } else { 0.0 };
    let a = alpha(depth);
    let mix = |c: usize| a * (share * near.color[c] + (1.0 - share) * far.color[c]);
    Segment32 { depth, alpha: a, emission: [mix(0), mix(1), mix(2)] }
}

/// The transfer function integrated along values that run linearly from `near` to `far`, stretch by stretch.
#[inline(always)]
fn preintegrated(transfer: &Classifier, near: f32, far: f32, length: f32) -> Segment32 {
    let (first, last) = (transfer.stretch(near), transfer.stretch(far));
    if near == far {
        return exponential(transfer.on(first, near), length);
    }
    if first == last {
        return linear_piece(transfer.on(first, near), transfer.on(first, far), length);
    }
    across_knots(transfer, (near, first), (far, last), length)
}

/// Values that cross knots: from a value and its stretch to another.
fn across_knots(transfer: &Classifier, near: (f32, usize), far: (f32, usize), length: f32) -> Segment32 {
    let per_value = length / (far.0 - near.0);
    let mut sum = Segment32::default();
    let (mut from, mut i) = near;
    loop {
        let to = match i.cmp(&far.1) {
            std::cmp::Ordering::Equal => far.0,
            std::cmp::Ordering::Less => transfer.end(i),
            std::cmp::Ordering::Greater => transfer.start(i),
        };
        sum = behind(sum, linear_piece(transfer.on(i, from), transfer.on(i, to), (to - from) * per_value));
        if i == far.1 {
            return sum;
        }
        i = if i < far.1 { i + 1 } else { i - 1 };
        from = to;
    }
}

fn behind(front: Segment32, back: Segment32) -> Segment32 {
    let t = 1.0 - front.alpha;
    let add = |c: usize| front.emission[c] + t * back.emission[c];
    Segment32 {
        depth: front.depth + back.depth,
        alpha: front.alpha + t * back.alpha,
        emission: [add(0), add(1), add(2)],
    }
}

#[inline(always)]
fn linear_piece(a: Optics32, b: Optics32, length: f32) -> Segment32 {
    let total = a.extinction + b.extinction;
    if total == 0.0 {
        return Segment32::default();
    }
    let depth = 0.5 * length * total;
    let opacity = alpha(depth);
    let scale = opacity / (3.0 * total);
    let (near, far) = (2.0 * a.extinction + b.extinction, a.extinction + 2.0 * b.extinction);
    let mix = |c: usize| scale * (near * a.color[c] + far * b.color[c]);
    Segment32 { depth, alpha: opacity, emission: [mix(0), mix(1), mix(2)] }
}
