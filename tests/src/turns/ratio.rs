//! The statistics of rounds: spread of times, and the ratio of two contestants with its confidence interval.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::metrics::median;

/// The confidence that an interval is asked for.
pub const CONFIDENCE: f64 = 0.95;

/// Milliseconds over rounds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct Spread {
    pub median: f64,
    pub min: f64,
    pub max: f64,
}

/// How many times as long one contestant takes as another: the median of the ratios of the rounds in which both took turns.
///
/// `low` and `high` are order statistics of the ratios, and enclose the true median with probability `confidence`, whatever
/// the distribution of the ratios, if rounds are independent. With n rounds, the k-th least and the k-th greatest ratio
/// enclose it with probability 1 - 2 P(B < k), B binomial with n tosses of a fair coin (Thompson 1936, Annals of Mathematical
/// Statistics 7; David and Nagaraja 2003, Order Statistics, section 7.1). k is the greatest with at least [`CONFIDENCE`]. Fewer
/// than 6 rounds have no such k: the interval is then the widest one, k = 1, with a confidence of 1 - 2^(1 - n).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[allow(missing_docs)]
pub struct Ratio {
    pub median: f64,
    pub low: f64,
    pub high: f64,
    pub confidence: f64,
    pub n_rounds: usize,
}

/// Where a ratio lies, seen from a bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
#[allow(missing_docs)]
pub enum Standing {
    Above,
    Below,
    /// The bound lies in the interval, or the interval has less than [`CONFIDENCE`].
    Undecided,
}

impl Spread {
    /// Of the times of at least one round.
    ///
    /// # Panics
    /// If there is no time.
    pub fn of(ms: &[f64]) -> Spread {
        let (min, max) = ms.iter().fold((f64::INFINITY, 0.0f64), |(a, b), t| (a.min(*t), b.max(*t)));
        Spread { median: median(ms.to_vec()), min, max }
    }
}

impl Ratio {
    /// The first contestant's times over the second's, round by round.
    ///
    /// # Panics
    /// If there is no round.
    pub fn of(first: &[f64], second: &[f64]) -> Ratio {
        Ratio::of_rounds(first.iter().zip(second).map(|(a, b)| a / b).collect())
    }

    /// Of the ratios of rounds, or of other independent ratios.
    ///
    /// # Panics
    /// If there is no ratio.
    pub fn of_rounds(mut ratios: Vec<f64>) -> Ratio {
        ratios.sort_unstable_by(f64::total_cmp);
        let n_rounds = ratios.len();
        let (rank, confidence) = interval(n_rounds);
        let (low, high) = (ratios[rank - 1], ratios[n_rounds - rank]);
        Ratio { median: median(ratios), low, high, confidence, n_rounds }
    }

    /// Where the ratio lies, seen from a bound.
    pub fn standing(&self, bound: f64) -> Standing {
        match self {
            Ratio { confidence, .. } if *confidence < CONFIDENCE => Standing::Undecided,
            Ratio { low, .. } if *low > bound => Standing::Above,
            Ratio { high, .. } if *high < bound => Standing::Below,
            _ => Standing::Undecided,
        }
    }
}

impl fmt::Display for Ratio {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Ratio { median, low, high, confidence, .. } = self;
        // Rounded down, so that it is no more than true.
        write!(f, "{median:.2} ({low:.2} to {high:.2}, {:.0} %)", (100.0 * confidence).floor())
    }
}

/// The rank k of the interval's ends among `n` values, from 1, and the interval's confidence.
fn interval(n: usize) -> (usize, f64) {
    // P(B = 0), then P(B = k) from P(B = k - 1).
    let (mut probability, mut tail) = (0.5f64.powi(n as i32), 0.0);
    let mut widest = None;
    for rank in 1..=n.div_ceil(2) {
        tail += probability;
        probability *= (n + 1 - rank) as f64 / rank as f64;
        let confidence = 1.0 - 2.0 * tail;
        if confidence < CONFIDENCE {
            return widest.unwrap_or((rank, confidence.max(0.0)));
        }
        widest = Some((rank, confidence));
    }
    widest.unwrap_or((1, 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_those_of_published_tables() {
        // Ranks as in the tables of the sign test at 5 %, two-sided (critical value plus one).
        let ranks = [(6, 1), (8, 1), (9, 2), (11, 2), (12, 3), (15, 4), (20, 6), (25, 8), (30, 10), (50, 18)];
        for (n, rank) in ranks {
            assert_eq!(interval(n).0, rank, "{n} rounds");
            assert!(interval(n).1 >= CONFIDENCE);
        }
        assert!((interval(9).1 - (1.0 - 20.0 / 512.0)).abs() < 1e-12);
        let few = [(1, 0.0), (2, 0.5), (3, 0.75), (4, 0.875), (5, 0.9375)];
        few.iter().for_each(|(n, confidence)| assert_eq!(interval(*n), (1, *confidence)));
    }

    /// Pairs of rounds from a generator, and how often their interval holds the true median, 1.
    #[test]
    fn an_interval_holds_the_median_as_often_as_it_says() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 11) as f64 + 0.5) / (1u64 << 53) as f64
        };
        for n in [5, 9, 30] {
            let trials = 20_000;
            let mut sample = || (0..n).map(|_| 1.0 - random().ln()).collect::<Vec<f64>>();
            let ratios = (0..trials).map(|_| Ratio::of(&sample(), &sample()));
            let held = ratios.filter(|r| r.low <= 1.0 && 1.0 <= r.high).count();
            let expected = interval(n).1;
            assert!((held as f64 / f64::from(trials) - expected).abs() < 0.01, "{n} rounds: {held} of {trials}");
        }
    }

    #[test]
    fn a_ratio_is_decided_by_its_interval() {
        let of = |ratios: &[f64]| Ratio::of(ratios, &vec![1.0; ratios.len()]);
        assert_eq!(of(&[1.1, 1.2, 1.3, 1.4, 1.5, 1.6]).standing(1.0), Standing::Above);
        assert_eq!(of(&[0.8, 0.9, 0.8, 0.9, 0.9, 0.9]).standing(1.0), Standing::Below);
        assert_eq!(of(&[0.9, 1.2, 1.3, 1.4, 1.5, 1.6]).standing(1.0), Standing::Undecided);
        // Three rounds decide nothing.
        assert_eq!(of(&[2.0, 2.0, 2.0]).standing(1.0), Standing::Undecided);
        assert_eq!(of(&[1.0, 2.0, 4.0]).to_string(), "2.00 (1.00 to 4.00, 75 %)");
    }
}
