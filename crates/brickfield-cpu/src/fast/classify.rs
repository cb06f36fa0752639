//! The transfer function in f32: extinction and colour of values as numbers of the value scale.

use brickfield_core::{Knot, TransferFunction};
use brickfield_frame::ValueScale;

use super::eight::{Eight, F32s, LANES, U32s};

/// Extinction and straight colour.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Optics32 {
    pub(crate) extinction: f32,
    pub(crate) color: [f32; 3],
}

/// A stretch of values in which the transfer function is linear.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    start: f32,
    /// Reciprocal of the stretch's length; 0 where the function is constant.
    reciprocal: f32,
    /// Red, green, blue and extinction at the lower end, and how much more they are at the upper.
    low: [f32; 4],
    rise: [f32; 4],
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
    /// The stretches once more, if they are eight at most.
    few: Option<FewStretches>,
    bins: Box<[u32; N_BINS]>,
    bins_per_value: f32,
    /// How values are counted.
    pub(crate) values: ValueScale,
}

/// Four times as many as transfer functions mostly have knots: the stretch that a bin names is mostly a value's, or the one before.
const N_BINS: usize = 1024;

/// At most eight stretches, number by number: a register holds the starts of all, another one the ends. Behind the last, its numbers repeat.
#[derive(Clone, Debug)]
struct FewStretches {
    starts: [f32; LANES],
    ends: [f32; LANES],
    reciprocals: [f32; LANES],
    low: [[f32; LANES]; 4],
    rise: [[f32; LANES]; 4],
}

impl FewStretches {
    fn new(stretches: &[Stretch], ends: &[f32]) -> Option<FewStretches> {
        let last = stretches.len() - 1;
        let number = |of: &dyn Fn(&Stretch) -> f32| std::array::from_fn(|i| of(&stretches[i.min(last)]));
        (last < LANES).then(|| FewStretches {
            starts: number(&|s| s.start),
            ends: std::array::from_fn(|i| ends[i.min(last)]),
            reciprocals: number(&|s| s.reciprocal),
            low: std::array::from_fn(|c| number(&|s| s.low[c])),
            rise: std::array::from_fn(|c| number(&|s| s.rise[c])),
        })
    }
}

/// The stretches of eight values.
pub(super) struct Linear<V> {
    pub(super) start: F32s<V>,
    pub(super) end: F32s<V>,
    reciprocal: F32s<V>,
    low: [F32s<V>; 4],
    rise: [F32s<V>; 4],
}

impl<V: Eight> Linear<V> {
    /// Red, green, blue and extinction of values: at the stretches' ends, the limits from within.
    #[inline(always)]
    pub(super) fn at(&self, eight: V, values: F32s<V>) -> [F32s<V>; 4] {
        let place = (values - self.start) * self.reciprocal;
        let place = place.at_least(F32s::all(eight, 0.0)).at_most(F32s::all(eight, 1.0));
        let mut optics = [place; 4];
        for (c, x) in optics.iter_mut().enumerate() {
            *x = place.times_plus(self.rise[c], self.low[c]);
        }
        optics
    }
}

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
        let few = FewStretches::new(&stretches, &ends);
        Classifier { stretches, ends, few, bins: Box::new(bins), bins_per_value, values }
    }

    /// The stretches that eight values lie in; infinity and NaN are in the last.
    #[inline(always)]
    pub(super) fn stretches<V: Eight>(&self, eight: V, values: F32s<V>) -> U32s<V> {
        if let Some(few) = &self.few {
            // The last, less one for each end that a value lies before.
            let mut at = U32s::all(eight, LANES as u32 - 1);
            for end in &few.ends[..LANES - 1] {
                at = at.less_one(values.is_less(F32s::all(eight, *end)));
            }
            return at;
        }
        let mut at = [0; LANES];
        for (at, value) in at.iter_mut().zip(values.to_array()) {
            *at = self.stretch(value) as u32;
        }
        U32s::new(eight, at)
    }

    /// Eight stretches.
    #[inline(always)]
    pub(super) fn linear<V: Eight>(&self, eight: V, at: U32s<V>) -> Linear<V> {
        if let Some(few) = &self.few {
            return Linear {
                start: at.of(&few.starts),
                end: at.of(&few.ends),
                reciprocal: at.of(&few.reciprocals),
                low: [at.of(&few.low[0]), at.of(&few.low[1]), at.of(&few.low[2]), at.of(&few.low[3])],
                rise: [at.of(&few.rise[0]), at.of(&few.rise[1]), at.of(&few.rise[2]), at.of(&few.rise[3])],
            };
        }
        let (mut starts, mut ends, mut reciprocals) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        let (mut low, mut rise) = ([[0.0; LANES]; 4], [[0.0; LANES]; 4]);
        for (l, i) in at.to_array().into_iter().enumerate() {
            let stretch = &self.stretches[i as usize];
            (starts[l], ends[l], reciprocals[l]) = (stretch.start, self.ends[i as usize], stretch.reciprocal);
            for c in 0..4 {
                (low[c][l], rise[c][l]) = (stretch.low[c], stretch.rise[c]);
            }
        }
        let of = |x: [f32; LANES]| F32s::new(eight, x);
        Linear {
            start: of(starts),
            end: of(ends),
            reciprocal: of(reciprocals),
            low: [of(low[0]), of(low[1]), of(low[2]), of(low[3])],
            rise: [of(rise[0]), of(rise[1]), of(rise[2]), of(rise[3])],
        }
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
        // Mostly one step at most, without a branch.
        i += usize::from(self.ends[i] <= value);
        while self.ends[i] <= value {
            i += 1;
        }
        i
    }

    /// The linear function of stretch `i` at a value: at its ends, the limits from within.
    #[inline(always)]
    pub(crate) fn on(&self, i: usize, value: f32) -> Optics32 {
        let s = &self.stretches[i];
        let place = (value - s.start) * s.reciprocal;
        let place = if place > 0.0 { place.min(1.0) } else { 0.0 };
        let at = |c: usize| s.low[c] + s.rise[c] * place;
        Optics32 { extinction: at(3), color: [at(0), at(1), at(2)] }
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

fn constant(knot: &Knot, start: f32) -> Stretch {
    Stretch { start, reciprocal: 0.0, low: rgb_extinction(knot), rise: [0.0; 4] }
}

fn linear(low: &Knot, high: &Knot, values: ValueScale) -> Stretch {
    let length = high.value - low.value;
    let start = values.number(low.value) as f32;
    let reciprocal = if length > 0.0 { (values.unit() / length) as f32 } else { 0.0 };
    let reciprocal = if reciprocal.is_finite() { reciprocal } else { 0.0 };
    let (low, high) = (rgb_extinction(low), rgb_extinction(high));
    Stretch { start, reciprocal, low, rise: std::array::from_fn(|c| high[c] - low[c]) }
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
