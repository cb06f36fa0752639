//! Claims: a statement about a number, the number as it was measured, its bound, and whether the claim is kept.

use std::fmt;

use serde::Serialize;

use super::ratio::{Ratio, Standing};

/// Where a number must lie.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
#[allow(missing_docs)]
pub enum Bound {
    AtLeast(f64),
    AtMost(f64),
    Above(f64),
}

/// A statement about a number. It is kept if the number, or a ratio's median, is within the bound; a ratio whose confidence
/// interval holds the bound is undecided besides: other rounds may say the opposite.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Claim {
    /// The statement, or the compared quantities.
    pub what: String,
    /// The number.
    pub measured: f64,
    /// Its bound.
    pub bound: Bound,
    /// Whether it is within the bound; NaN is not.
    pub kept: bool,
    /// The ratio, where the number is one.
    pub ratio: Option<Ratio>,
}

/// Claims, of which each has a line.
pub struct Claims<'a>(pub &'a [Claim]);

impl Bound {
    /// Whether a number is within the bound.
    pub fn holds(self, measured: f64) -> bool {
        match self {
            Bound::AtLeast(bound) => measured >= bound,
            Bound::AtMost(bound) => measured <= bound,
            Bound::Above(bound) => measured > bound,
        }
    }

    const fn value(self) -> f64 {
        match self {
            Bound::AtLeast(bound) | Bound::AtMost(bound) | Bound::Above(bound) => bound,
        }
    }
}

impl Claim {
    /// About a plain number.
    pub fn of(what: impl Into<String>, measured: f64, bound: Bound) -> Claim {
        Claim { what: what.into(), measured, bound, kept: bound.holds(measured), ratio: None }
    }

    /// About a ratio of times.
    pub fn of_ratio(what: impl Into<String>, ratio: Ratio, bound: Bound) -> Claim {
        Claim { ratio: Some(ratio), ..Claim::of(what, ratio.median, bound) }
    }

    /// Whether other rounds may say the opposite.
    pub fn is_undecided(&self) -> bool {
        self.ratio.is_some_and(|ratio| ratio.standing(self.bound.value()) == Standing::Undecided)
    }
}

impl fmt::Display for Bound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Bound::AtLeast(bound) => write!(f, "at least {bound}"),
            Bound::AtMost(bound) => write!(f, "at most {bound}"),
            Bound::Above(bound) => write!(f, "above {bound}"),
        }
    }
}

impl Claim {
    fn number(&self) -> String {
        self.ratio.map_or_else(|| format!("{:.2}", self.measured), |ratio| ratio.to_string())
    }

    const fn verdict(&self) -> &'static str {
        if self.kept { "kept" } else { "MISSED" }
    }

    fn doubt(&self) -> &'static str {
        if self.is_undecided() { ", undecided" } else { "" }
    }
}

impl fmt::Display for Claim {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}, {}: {}{}", self.what, self.number(), self.bound, self.verdict(), self.doubt())
    }
}

impl fmt::Display for Claims<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = self.0.iter().map(|claim| claim.what.len()).max().unwrap_or(0);
        self.0.iter().try_for_each(|claim| {
            let (number, bound) = (claim.number(), claim.bound.to_string());
            let (verdict, doubt) = (claim.verdict(), claim.doubt());
            writeln!(f, "{:<width$}  {number:>28}  {bound:<12} {verdict}{doubt}", claim.what)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_keeps_a_claim_and_the_interval_decides_it() {
        let claim = |ratios: &[f64]| {
            let ratio = Ratio::of(ratios, &vec![1.0; ratios.len()]);
            Claim::of_ratio("a is slower than b", ratio, Bound::Above(1.0))
        };
        let words = |claim: Claim| (claim.kept, claim.is_undecided());
        assert_eq!(words(claim(&[1.1; 9])), (true, false));
        assert_eq!(words(claim(&[0.8, 0.8, 0.8, 1.2, 1.2, 1.2, 1.2])), (true, true));
        assert_eq!(words(claim(&[1.0; 9])), (false, true));
        assert_eq!(words(claim(&[0.9; 9])), (false, false));
        assert!(claim(&[0.9, 1.2]).to_string().ends_with("b: 1.05 (0.90 to 1.20, 50 %), above 1: kept, undecided"));
    }

    #[test]
    fn a_number_that_is_none_misses_every_bound() {
        let bounds = [Bound::AtLeast(0.0), Bound::AtMost(0.0), Bound::Above(0.0)];
        assert!(bounds.into_iter().all(|bound| !Claim::of("nothing", f64::NAN, bound).kept));
        assert!(
            Claim::of("as much", 2.0, Bound::AtLeast(2.0)).kept && !Claim::of("as much", 2.0, Bound::Above(2.0)).kept
        );
    }
}
