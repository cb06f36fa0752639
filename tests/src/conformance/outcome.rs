//! The outcomes of a run: one line per case and backend, a summary line, JSON.

use std::fmt;

use serde::Serialize;

/// The status of a case on a backend.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// Within the rule.
    Pass,
    /// Not within the rule, or an error that is not a limit of the device.
    Fail,
    /// The device cannot do it, and said so.
    Unsupported,
    /// The backend or its adapter is absent.
    NoDevice,
    /// The data that the case needs is absent.
    NoData,
}

/// The outcome of a case on a backend.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// The case.
    pub case: String,
    /// backend@adapter.
    pub backend: String,
    /// The status.
    pub status: Status,
    /// Numbers, or the reason.
    pub note: String,
    /// Greatest difference in any channel, where pictures were compared.
    pub max_difference: Option<f64>,
    /// The difference that 99.9 % of the pixels do not exceed.
    pub p999: Option<f64>,
    /// Column and row of the greatest difference.
    pub worst_pixel: Option<[u32; 2]>,
    /// How long the case took on this backend, judging included.
    pub milliseconds: f64,
}

/// How many outcomes of each kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[allow(missing_docs)]
pub struct Summary {
    pub passed: usize,
    pub failed: usize,
    pub skipped: usize,
}

impl Status {
    /// The word in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Status::Pass => "pass",
            Status::Fail => "FAIL",
            Status::Unsupported => "unsupported",
            Status::NoDevice => "no-device",
            Status::NoData => "no-data",
        }
    }
}

impl Outcome {
    /// An outcome without numbers.
    pub fn plain(case: &str, backend: &str, status: Status, note: impl Into<String>) -> Outcome {
        Outcome {
            case: case.to_owned(),
            backend: backend.to_owned(),
            status,
            note: note.into(),
            max_difference: None,
            p999: None,
            worst_pixel: None,
            milliseconds: 0.0,
        }
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:<11} {:<36} {}  {}", self.status.name(), self.case, self.backend, self.note)
    }
}

impl Summary {
    /// Counts outcomes.
    pub fn of<'a>(outcomes: impl IntoIterator<Item = &'a Outcome>) -> Summary {
        outcomes.into_iter().fold(Summary::default(), |mut s, o| {
            match o.status {
                Status::Pass => s.passed += 1,
                Status::Fail => s.failed += 1,
                Status::Unsupported | Status::NoDevice | Status::NoData => s.skipped += 1,
            }
            s
        })
    }

    /// Whether anything ran, and nothing failed.
    pub fn is_green(&self) -> bool {
        self.failed == 0 && self.passed > 0
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} passed, {} failed, {} skipped", self.passed, self.failed, self.skipped)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_run_is_not_green() {
        assert!(!Summary::of(&[]).is_green());
        let skipped = Outcome::plain("a", "b", Status::NoDevice, "");
        assert!(!Summary::of([&skipped]).is_green());
        let passed = Outcome::plain("a", "b", Status::Pass, "");
        assert!(Summary::of([&skipped, &passed]).is_green());
        let failed = Outcome::plain("a", "b", Status::Fail, "");
        assert_eq!(Summary::of([&passed, &failed, &skipped]).to_string(), "1 passed, 1 failed, 1 skipped");
        assert!(!Summary::of([&passed, &failed]).is_green());
    }
}
