//! Batches of segments, by the eight: classified and composited front to back.

use brickfield_optics::QuadratureRule;

use super::classify::Classifier;
use super::eight::{Eight, F32s, LANES, Mask, Vectorized, With};
use super::scalar::{exp_minus_of, opacities};
use super::segment::Ray32;

/// Some segments, and the values at their nodes: as many eights as hold them (in the lanes behind, any numbers).
pub(super) struct Batch<'a> {
    pub(super) rule: QuadratureRule,
    pub(super) transfer: &'a Classifier,
    pub(super) near: &'a [[f32; LANES]],
    /// Of a rule with two nodes.
    pub(super) far: Option<&'a [[f32; LANES]]>,
    pub(super) n: usize,
    pub(super) length: f32,
}

impl Batch<'_> {
    /// Puts the segments behind the ray's sums. Compiled once for bricks of all kinds: inlined into each, the functions below would take minutes
    /// to compile.
    #[inline(never)]
    pub(super) fn push(self, eight: impl Eight, state: &mut Ray32) {
        eight.vectorize(With { work: Push { batch: self, state }, eight });
    }

    #[inline(always)]
    fn put_behind<V: Eight>(&self, eight: V, state: &mut Ray32) {
        let one = F32s::all(eight, 1.0);
        // Red, green, blue, alpha.
        let mut sums = [F32s::all(eight, 0.0); 4];
        for (i, near) in self.near.iter().enumerate() {
            let near = F32s::new(eight, *near);
            let length = match self.n < (i + 1) * LANES {
                false => F32s::all(eight, self.length),
                true => {
                    let n = F32s::all(eight, (self.n - i * LANES) as f32);
                    F32s::all(eight, self.length).or_zero(F32s::count(eight).is_less(n))
                }
            };
            let seen = match self.far {
                None => self.of_one_node(eight, near, length),
                Some(far) => self.of_two_nodes(eight, [near, F32s::new(eight, far[i])], length),
            };
            let Some((opacities, [red, green, blue])) = seen else { continue };
            // Of each segment and those before it among the eight.
            let mut together = opacities;
            for n in [1, 2, 4] {
                let before = together.moved(n);
                together = together.times_plus(one - before, before);
            }
            let weights = opacities * (one - together.moved(1)) * F32s::all(eight, state.transmittance as f32);
            state.transmittance *= 1.0 - f64::from(together.to_array()[LANES - 1]);
            for (sum, x) in sums.iter_mut().zip([red, green, blue, one]) {
                *sum = weights.times_plus(x, *sum);
            }
        }
        for (sum, x) in state.rgba.iter_mut().zip(F32s::sums(sums)) {
            *sum += f64::from(x);
        }
    }

    #[inline(always)]
    fn of_one_node<V: Eight>(&self, eight: V, values: F32s<V>, length: F32s<V>) -> Option<Seen<V>> {
        let stretches = self.transfer.linear(eight, self.transfer.stretches(eight, values));
        let [red, green, blue, extinction] = stretches.at(eight, values);
        let depths = extinction * length;
        let thickest = depths.greatest();
        if thickest == 0.0 {
            return None;
        }
        let opacities = match self.rule {
            QuadratureRule::LeftRiemann => depths.at_most(F32s::all(eight, 1.0)),
            _ => opacities(eight, depths, thickest),
        };
        Some((opacities, [red, green, blue]))
    }

    #[inline(always)]
    fn of_two_nodes<V: Eight>(&self, eight: V, values: [F32s<V>; 2], length: F32s<V>) -> Option<Seen<V>> {
        match self.rule {
            QuadratureRule::Gauss2 => self.gauss2(eight, values, length),
            _ => self.preintegrated(eight, values, length),
        }
    }

    #[inline(always)]
    fn gauss2<V: Eight>(&self, eight: V, [near, far]: [F32s<V>; 2], length: F32s<V>) -> Option<Seen<V>> {
        let transfer = self.transfer;
        let near = transfer.linear(eight, transfer.stretches(eight, near)).at(eight, near);
        let far = transfer.linear(eight, transfer.stretches(eight, far)).at(eight, far);
        let depths = F32s::all(eight, 0.5) * length * (near[3] + far[3]);
        let thickest = depths.greatest();
        if thickest == 0.0 {
            return None;
        }
        let between = depths * F32s::all(eight, 1.0 / 3f32.sqrt());
        let weights = near[3] + far[3] * exp_minus_of(eight, between);
        // Where both are 0, so is the share.
        let share = near[3] / weights.at_least(F32s::all(eight, f32::MIN_POSITIVE));
        let mut colors = [share; 3];
        for (c, color) in colors.iter_mut().enumerate() {
            *color = share.times_plus(near[c] - far[c], far[c]);
        }
        Some((opacities(eight, depths, thickest), colors))
    }

    /// The transfer function integrated along values that run linearly from near to far ones, stretch by stretch.
    #[inline(always)]
    fn preintegrated<V: Eight>(&self, eight: V, [near, far]: [F32s<V>; 2], length: F32s<V>) -> Option<Seen<V>> {
        let (zero, one) = (F32s::all(eight, 0.0), F32s::all(eight, 1.0));
        let (mut at, last) = (self.transfer.stretches(eight, near), self.transfer.stretches(eight, far));
        let (mut from, per_value) = (near, length / (far - near));
        // Where values hardly change, the first piece is the whole segment.
        let mut changes = (per_value * zero).is_equal(zero);
        let per_value = per_value.or_zero(changes);
        // Of all pieces so far: red, green, blue, alpha.
        let mut seen = [zero; 4];
        loop {
            let stretches = self.transfer.linear(eight, at);
            let (is_last, goes_up) = (at.is_equal(last), at.is_less(last));
            let to = far.or(is_last, stretches.end.or(goes_up, stretches.start));
            let piece = ((to - from) * per_value).or(changes, length);
            let (a, b) = (stretches.at(eight, from), stretches.at(eight, to));
            let total = a[3] + b[3];
            let depths = F32s::all(eight, 0.5) * piece * total;
            let opacity = opacities(eight, depths, depths.greatest());
            let scale = opacity / (F32s::all(eight, 3.0) * total).at_least(F32s::all(eight, f32::MIN_POSITIVE));
            let passes = one - seen[3];
            for c in 0..3 {
                let color = scale * ((total + a[3]) * a[c] + (total + b[3]) * b[c]);
                seen[c] = passes.times_plus(color, seen[c]);
            }
            seen[3] = passes.times_plus(opacity, seen[3]);
            if is_last.has_all(eight) {
                break;
            }
            // Behind the last piece the end is the beginning: nothing is added.
            (from, changes) = (to, Mask::all(eight));
            at = at.one_towards(last);
        }
        let [red, green, blue, opacity] = seen;
        if opacity.greatest() == 0.0 {
            return None;
        }
        let straight = one / opacity.at_least(F32s::all(eight, f32::MIN_POSITIVE));
        Some((opacity, [red * straight, green * straight, blue * straight]))
    }
}

/// Opacity and straight colour of eight segments.
type Seen<V> = (F32s<V>, [F32s<V>; 3]);

/// A batch that is put behind a ray's sums.
struct Push<'a, 'b> {
    batch: Batch<'a>,
    state: &'b mut Ray32,
}

impl Vectorized for Push<'_, '_> {
    #[inline(always)]
    fn run(self, eight: impl Eight) {
        self.batch.put_behind(eight, self.state);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fast::segment::segment;
    use brickfield_core::{Knot, TransferFunction};
    use brickfield_frame::{Decode, ValueScale};
    use proptest::prelude::*;

    const RULES: [QuadratureRule; 5] = [
        QuadratureRule::LeftRiemann,
        QuadratureRule::LeftExponential,
        QuadratureRule::MidpointExponential,
        QuadratureRule::PreIntegrated,
        QuadratureRule::Gauss2,
    ];

    /// A batch's sums, with all instructions that the processor has.
    fn pushed(batch: impl Fn() -> Batch<'static>) -> Vec<Ray32> {
        let push = |push: &dyn Fn(&mut Ray32)| {
            let mut state = Ray32::default();
            push(&mut state);
            state
        };
        let mut rays = vec![push(&|state| batch().push(pulp::Scalar256b, state))];
        #[cfg(target_arch = "x86_64")]
        if let pulp::Arch::V3(v3) = pulp::Arch::new() {
            rays.push(push(&|state| batch().push(v3, state)));
        }
        rays
    }

    proptest! {
        #[test]
        fn batches_see_as_segments_do(
            knots in proptest::collection::vec((0.0f64..100.0, 0.0f64..3.0, 0.0f64..1.0), 1..40),
            values in proptest::array::uniform32(-20.0f32..120.0),
            slow in any::<bool>(),
            n in 1usize..=2 * LANES,
            length in prop_oneof![Just(1e-3f32), Just(0.3), Just(20.0)],
        ) {
            let mut knots = knots;
            knots.sort_by(|a, b| a.0.total_cmp(&b.0));
            let knot = |&(value, extinction, red): &(f64, f64, f64)| Knot { value, extinction, color: [red, 1.0 - red, 0.5] };
            let transfer = TransferFunction::new(knots.iter().map(knot).collect()).unwrap();
            let scale = ValueScale::of(&transfer, Decode { scale: 100.0, offset: 0.0 });
            let classifier: &'static Classifier = Box::leak(Box::new(Classifier::new(&transfer, scale)));
            let number = |v: f32| scale.number(v.into()) as f32;
            let near: [f32; 2 * LANES] = std::array::from_fn(|l| number(values[l]));
            // Far values that are near, or not, and some that are the same.
            let far = |l: usize| if l < 3 { near[l] } else if slow { near[l] * 1.01 } else { number(values[2 * LANES + l]) };
            let far: [f32; 2 * LANES] = std::array::from_fn(far);
            let eights = |x: [f32; 2 * LANES]| -> &'static [[f32; LANES]] { Box::leak(Box::new(x)).as_chunks().0 };
            let (near_of, far_of) = (&eights(near)[..n.div_ceil(LANES)], &eights(far)[..n.div_ceil(LANES)]);
            for rule in RULES {
                let mut expected = Ray32::default();
                for l in 0..n {
                    expected.push(segment(rule, classifier, [Some(near[l]), Some(far[l])], length));
                }
                let far = (rule.nodes().len() > 1).then_some(far_of);
                for got in pushed(|| Batch { rule, transfer: classifier, near: near_of, far, n, length }) {
                    let off = (0..4).map(|c| (got.rgba[c] - expected.rgba[c]).abs()).fold(0.0, f64::max);
                    prop_assert!(off < 3e-6, "{:?}: {:?}, not {:?}", rule, got, expected);
                    prop_assert!((got.transmittance - expected.transmittance).abs() < 3e-6, "{:?}", rule);
                }
            }
        }
    }
}
