//! The transfer function in f32: extinction and colour of values as numbers of the value scale.

use brickfield_core::{Knot, TransferFunction};
use brickfield_frame::ValueScale;

/// Extinction and straight colour.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Optics32 {
    pub(crate) extinction: f32,
    pub(crate) color: [f32; 3],
}

/// A stretch of values in which the transfer function is linear.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stretch {
    start: f32,
    /// Reciprocal of the stretch's length; 0 where the function is constant.
    reciprocal: f32,
    low: [f32; 4],
    high: [f32; 4],
}

/// A transfer function, ready for f32 look-up.
///
/// Stretch i lies between knots i - 1 and i: the first and the last reach to infinity and are constant. A table over the
/// values says where the search for a value's stretch begins.
#[derive(Clone, Debug)]
pub(crate) struct Classifier {
    stretches: Vec<Stretch>,
    /// The knots' values, and infinity.
    ends: Vec<f32>,
    bins: [u32; N_BINS],
    bins_per_value: f32,
    /// How values are counted.
    pub(crate) values: ValueScale,
}

const N_BINS: usize = 256;

impl Classifier {
    pub(crate) fn new(transfer: &TransferFunction, values: ValueScale) -> Classifier {
        let knots = transfer.knots();
        let relative = |k: &Knot| values.number(k.value) as f32;
        let (first, last) = (&knots[0], &knots[knots.len() - 1]);
        let mut stretches = vec![constant(first, relative(first))];
        stretches.extend(knots.windows(2).map(|k| linear(&k[0], &k[1], values)));
        stretches.push(constant(last, relative(last)));
        let mut ends: Vec<f32> = knots.iter().map(relative).collect();
        ends.push(f32::INFINITY);
        let extent = relative(last);
        let bins_per_value = if extent > 0.0 { (N_BINS - 1) as f32 / extent } else { 0.0 };
        // One bin early, so that rounding cannot begin the search too late.
        let start = |bin: usize| (bin as f32 - 1.0) / bins_per_value;
        let bins = std::array::from_fn(|bin| ends.partition_point(|e| *e <= start(bin)) as u32);
        Classifier { stretches, ends, bins, bins_per_value, values }
    }

    /// Extinction and colour at a value; right-continuous at jumps.
    #[inline(always)]
    pub(crate) fn at(&self, value: f32) -> Optics32 {
        self.on(self.stretch(value), value)
    }

    /// The stretch that a value lies in; infinity and NaN are in the last.
    #[inline(always)]
    pub(crate) fn stretch(&self, value: f32) -> usize {
        let value = value.min(f32::MAX);
        let bin = (value * self.bins_per_value).clamp(0.0, (N_BINS - 1) as f32) as usize;
        let mut i = self.bins[bin & (N_BINS - 1)] as usize;
        while self.ends[i] <= value {
            i += 1;
        }
        i
    }

    /// The linear function of stretch `i` at a value: at its ends, the limits from within.
    #[inline(always)]
    pub(crate) fn on(&self, i: usize, value: f32) -> Optics32 {
        let s = &self.stretches[i];
        let f = s.place(value);
        let [r, g, b, _] = s.rgba(1.0 - f, f);
        Optics32 { extinction: s.extinction(f), color: [r, g, b] }
    }

    /// Stretch `i`.
    #[inline(always)]
    pub(crate) fn linear(&self, i: usize) -> &Stretch {
        &self.stretches[i]
    }

    /// Whether nothing of stretch `i` is visible.
    #[inline(always)]
    pub(crate) fn is_dark(&self, i: usize) -> bool {
        self.stretches[i].low[3] + self.stretches[i].high[3] == 0.0
    }

    /// The value at the lower end of stretch `i`, which is not the first.
    #[inline(always)]
    pub(crate) fn start(&self, i: usize) -> f32 {
        self.stretches[i].start
    }

    /// The value at the upper end of stretch `i`; infinity for the last.
    #[inline(always)]
    pub(crate) fn end(&self, i: usize) -> f32 {
        self.ends[i]
    }
}

impl Stretch {
    /// Where a value lies, from 0 at the lower end to 1 at the upper.
    #[inline(always)]
    pub(crate) fn place(&self, value: f32) -> f32 {
        let f = (value - self.start) * self.reciprocal;
        let f = if f > 0.0 { f } else { 0.0 };
        if f < 1.0 { f } else { 1.0 }
    }

    /// Extinction at a place.
    #[inline(always)]
    pub(crate) fn extinction(&self, place: f32) -> f32 {
        self.channel(3, place)
    }

    /// Red, green, blue or extinction at a place.
    #[inline(always)]
    pub(crate) fn channel(&self, i: usize, place: f32) -> f32 {
        self.low[i] * (1.0 - place) + self.high[i] * place
    }

    /// The ends' colours with the given weights, and the weights' sum.
    #[inline(always)]
    pub(crate) fn rgba(&self, low: f32, high: f32) -> [f32; 4] {
        let mix = |c: usize| self.low[c] * low + self.high[c] * high;
        [mix(0), mix(1), mix(2), low + high]
    }
}

fn constant(knot: &Knot, start: f32) -> Stretch {
    Stretch { start, reciprocal: 0.0, low: rgb_extinction(knot), high: rgb_extinction(knot) }
}

fn linear(low: &Knot, high: &Knot, values: ValueScale) -> Stretch {
    let length = high.value - low.value;
    let start = values.number(low.value) as f32;
    let reciprocal = if length > 0.0 { (values.unit() / length) as f32 } else { 0.0 };
    let reciprocal = if reciprocal.is_finite() { reciprocal } else { 0.0 };
    Stretch { start, reciprocal, low: rgb_extinction(low), high: rgb_extinction(high) }
}

fn rgb_extinction(k: &Knot) -> [f32; 4] {
    [k.color[0] as f32, k.color[1] as f32, k.color[2] as f32, k.extinction as f32]
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_frame::Decode;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn classification_is_the_transfer_functions(
            values in proptest::collection::vec(-100.0f64..100.0, 1..12),
            jump in any::<bool>(),
            at in -150.0f64..150.0,
        ) {
            let mut values = values;
            values.sort_by(f64::total_cmp);
            if jump {
                let last = values[values.len() - 1];
                values.push(last);
            }
            let knot = |(i, v): (usize, &f64)| Knot { value: *v, extinction: (i * 7 % 5) as f64, color: [0.1 * (i % 10) as f64, 0.5, 1.0] };
            let tf = TransferFunction::new(values.iter().enumerate().map(knot).collect()).unwrap();
            let scale = ValueScale::of(&tf, Decode { scale: 100.0, offset: 0.0 });
            let classifier = Classifier::new(&tf, scale);
            let (got, expected) = (classifier.at(scale.number(at) as f32), tf.at(at));
            let slope = values.windows(2).map(|v| v[1] - v[0]).filter(|d| *d > 0.0).fold(1.0, f64::min);
            prop_assert!((f64::from(got.extinction) - expected.extinction).abs() < 1e-4 / slope);
            prop_assert!((f64::from(got.color[0]) - expected.color[0]).abs() < 1e-4 / slope);
        }
    }
}
