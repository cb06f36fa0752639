//! Prefiltered classification in f32: the optics that are expected of the values around a node.

use super::classify::{Classifier, Optics32};

/// Values as numbers of the value scale: mean, standard deviation, and a range that holds them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Values32 {
    pub(super) mean: f32,
    pub(super) deviation: f32,
    pub(super) range: [f32; 2],
}

/// Mean emission and extinction.
type Means = [f32; 4];

/// Mean extinction, and mean colour with extinctions for weights, of two uniform halves that meet at the mean
/// ([`brickfield_optics::ValueSpread`]).
pub(super) fn expected(transfer: &Classifier, values: &Values32) -> Optics32 {
    let (mean, wanted) = (values.mean, 3f32.sqrt() * values.deviation);
    let room = [(mean - values.range[0]).max(0.0), (values.range[1] - mean).max(0.0)];
    let reach = |own: f32, other: f32| match other < wanted {
        true => (wanted * (wanted / other)).min(own),
        false => wanted.min(own),
    };
    let (below, above) = (reach(room[0], room[1]), reach(room[1], room[0]));
    if below.min(above) <= 0.0 {
        return transfer.at(mean);
    }
    let (a, b) = (uniform(transfer, mean - below, mean), uniform(transfer, mean, mean + above));
    let of_b = below / (below + above);
    let [r, g, b, extinction] = std::array::from_fn(|c| a[c] + (b[c] - a[c]) * of_b);
    match extinction > 0.0 {
        true => Optics32 { extinction, color: [r, g, b].map(|c: f32| c / extinction) },
        false => Optics32::default(),
    }
}

/// Of values that are evenly distributed between two; stretch by stretch.
fn uniform(transfer: &Classifier, low: f32, high: f32) -> Means {
    let mut sum = Means::default();
    let mut add = |share: f32, a: Optics32, b: Optics32| {
        let (at_a, at_b) = (2.0 * a.extinction + b.extinction, a.extinction + 2.0 * b.extinction);
        for (sum, (a, b)) in sum.iter_mut().zip(a.color.into_iter().zip(b.color)) {
            *sum += share * (1.0 / 6.0) * (at_a * a + at_b * b);
        }
        sum[3] += share * 0.5 * (a.extinction + b.extinction);
    };
    if low >= high {
        let optics = transfer.at(high);
        add(1.0, optics, optics);
        return sum;
    }
    let per_value = 1.0 / (high - low);
    let (mut from, mut i) = (low, transfer.stretch(low));
    loop {
        let to = transfer.end(i).min(high);
        add((to - from) * per_value, transfer.on(i, from), transfer.on(i, to));
        if to >= high {
            return sum;
        }
        (from, i) = (to, i + 1);
    }
}
