//! The time that is allowed, shared out among the parts, and the measurements that found no time or memory.

use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

/// A measurement that was asked for and not made.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct Unmeasured {
    pub what: String,
    pub reason: String,
}

/// The time that is allowed in all.
#[derive(Clone, Copy, Debug)]
pub(super) struct Budget {
    begin: Instant,
    seconds: f64,
}

/// When a part must end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Deadline(Instant);

impl Unmeasured {
    pub(super) fn new(what: impl Into<String>, reason: impl Into<String>) -> Unmeasured {
        Unmeasured { what: what.into(), reason: reason.into() }
    }
}

impl Budget {
    /// From now on.
    pub(super) fn new(seconds: f64) -> Budget {
        Budget { begin: Instant::now(), seconds: seconds.clamp(0.0, 1e6) }
    }

    /// When `share` of the time is over: a part also gets the time that earlier parts left.
    pub(super) fn until(&self, share: f64) -> Deadline {
        Deadline(self.begin + Duration::from_secs_f64(self.seconds * share))
    }

    /// Seconds since the beginning.
    pub(super) fn seconds(&self) -> f64 {
        self.begin.elapsed().as_secs_f64()
    }
}

impl Deadline {
    /// Seconds that are left; 0 if none are.
    pub(super) fn seconds_left(self) -> f64 {
        self.0.saturating_duration_since(Instant::now()).as_secs_f64()
    }

    /// When so large a share of the time that is left will be over.
    pub(super) fn share(self, share: f64) -> Deadline {
        Deadline(Instant::now() + Duration::from_secs_f64(share * self.seconds_left()))
    }

    /// Whether something that takes about so many seconds may begin.
    pub(super) fn admit(self, what: &str, seconds: f64) -> Result<(), Unmeasured> {
        let left = self.seconds_left();
        match left > seconds {
            true => Ok(()),
            false if seconds == 0.0 => Err(Unmeasured::new(what, "no time was left: allow more --seconds")),
            false => Err(Unmeasured::new(
                what,
                format!("it would take about {seconds:.1} s, {left:.1} s were left: allow more --seconds"),
            )),
        }
    }

    /// How many rounds of `round_seconds` fit into `share` of the time that is left: at least `least`, at most `most`.
    pub(super) fn rounds(self, share: f64, round_seconds: f64, [least, most]: [u32; 2]) -> u32 {
        let fit = share * self.seconds_left() / round_seconds.max(1e-9);
        (fit as u32).clamp(least, most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_finds_no_time_is_told_with_the_time_it_needs() {
        let budget = Budget::new(100.0);
        assert!(budget.until(0.5).seconds_left() > 49.0 && budget.until(0.5).seconds_left() <= 50.0);
        assert_eq!(budget.until(1.0).admit("a frame", 5.0), Ok(()));
        let refused = budget.until(1.0).admit("a frame", 500.0).unwrap_err();
        assert!(refused.what == "a frame" && refused.reason.starts_with("it would take about 500.0 s"), "{refused:?}");
        assert!(budget.until(0.0).admit("a frame", 0.0).unwrap_err().reason.contains("--seconds"));
    }

    #[test]
    fn rounds_fill_their_share_within_bounds() {
        let deadline = Budget::new(100.0).until(1.0);
        assert_eq!(deadline.rounds(0.5, 10.0, [1, 30]), 4);
        assert_eq!(deadline.rounds(0.5, 1e3, [2, 30]), 2);
        assert_eq!(deadline.rounds(0.5, 0.0, [2, 30]), 30);
    }
}
