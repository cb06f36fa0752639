//! The run: every case on every backend, and backends on one device against each other.

use std::path::PathBuf;
use std::time::Instant;

use brickfield::BackendKind;
use brickfield_core::Image;

use super::candidate::Candidate;
use super::case::Case;
use super::check::{Judged, Obstacle, Prepared};
use super::outcome::{Outcome, Status};
use super::pictures::write_difference;
use super::record::RecordEntry;
use super::rule::Verdict;
use crate::metrics::Worst;

/// The run: candidates, and the options of the user.
pub struct Run {
    /// The backends.
    pub candidates: Vec<Candidate>,
    /// Backends whose absence is a failure.
    pub required: Vec<BackendKind>,
    /// Where pictures of failing cases go.
    pub pictures: PathBuf,
}

impl Run {
    /// Runs a case on every backend; `observe` sees each outcome as it comes, `keep` each answer.
    pub fn case(
        &mut self,
        case: &Case,
        prepared: &mut Result<Prepared, Obstacle>,
        observe: &mut dyn FnMut(&Outcome),
        keep: &mut dyn FnMut(RecordEntry),
    ) -> Vec<Outcome> {
        let prepared = match prepared {
            Ok(prepared) => prepared,
            Err(obstacle) => return self.not_prepared(case, obstacle, observe),
        };
        let mut outcomes = Vec::new();
        let mut images: Vec<Option<Image<f32>>> = Vec::new();
        for candidate in &mut self.candidates {
            let begin = Instant::now();
            let judged = prepared.run(candidate, None);
            judged.answer(&case.name, &candidate.name()).into_iter().for_each(&mut *keep);
            let (mut outcome, image) = told(case, candidate, judged, prepared, &self.required, &self.pictures);
            outcome.milliseconds = begin.elapsed().as_secs_f64() * 1e3;
            observe(&outcome);
            outcomes.push(outcome);
            images.push(image);
        }
        for outcome in self.pairs(case, &images) {
            observe(&outcome);
            outcomes.push(outcome);
        }
        outcomes
    }

    fn not_prepared(&self, case: &Case, obstacle: &Obstacle, observe: &mut dyn FnMut(&Outcome)) -> Vec<Outcome> {
        let status = match obstacle {
            Obstacle::NoData(_) => Status::NoData,
            Obstacle::Refused(_) | Obstacle::Wrong(_) => Status::Fail,
        };
        let outcome = |c: &Candidate| Outcome::plain(&case.name, &c.name(), status, obstacle.to_string());
        let outcomes: Vec<Outcome> = self.candidates.iter().map(outcome).collect();
        outcomes.iter().for_each(observe);
        outcomes
    }

    /// Two backends that compile the same modules for the same adapter must agree to the bit.
    fn pairs(&self, case: &Case, images: &[Option<Image<f32>>]) -> Vec<Outcome> {
        let made = |i: usize| {
            let candidate = &self.candidates[i];
            Some((candidate, candidate.adapter_name()?, images[i].as_ref()?)).filter(|m| m.0.has_shaders())
        };
        let all: Vec<_> = (0..images.len()).filter_map(made).collect();
        let mut outcomes = Vec::new();
        for (i, (a, adapter, first)) in all.iter().enumerate() {
            for (b, _, second) in all[i + 1..].iter().filter(|(b, name, _)| name == adapter && b.kind() != a.kind()) {
                let name = format!("{}={}@{adapter}", a.kind(), b.kind());
                outcomes.push(equal_to_the_bit(&case.name, &name, first, second));
            }
        }
        outcomes
    }
}

fn equal_to_the_bit(case: &str, name: &str, a: &Image<f32>, b: &Image<f32>) -> Outcome {
    let differ = |(p, q): (&[f32; 4], &[f32; 4])| p.map(f32::to_bits) != q.map(f32::to_bits);
    let unequal = a.pixels().iter().zip(b.pixels()).filter(|pair| differ(*pair)).count();
    if a.size() == b.size() && unequal == 0 {
        return Outcome::plain(case, name, Status::Pass, "equal to the bit");
    }
    let most = a.pixels().iter().zip(b.pixels()).flat_map(|(p, q)| (0..4).map(move |c| (p[c] - q[c]).abs()));
    let note = format!("{unequal} of {} pixels differ, by up to {:.2e}", a.pixels().len(), most.fold(0.0, f32::max));
    Outcome::plain(case, name, Status::Fail, note)
}

/// The outcome of a judgement, and the picture where there is one.
fn told(
    case: &Case,
    candidate: &Candidate,
    judged: Judged,
    prepared: &Prepared,
    required: &[BackendKind],
    pictures: &std::path::Path,
) -> (Outcome, Option<Image<f32>>) {
    let backend = candidate.name();
    let plain = |status, note: String| (Outcome::plain(&case.name, &backend, status, note), None);
    match judged {
        Judged::Absent => {
            let reason = candidate.absence().unwrap_or_default();
            if required.contains(&candidate.kind()) {
                return plain(Status::Fail, format!("required, but absent: {reason}"));
            }
            plain(Status::NoDevice, reason.to_owned())
        }
        Judged::Unsupported(e) => plain(Status::Unsupported, e.to_string()),
        Judged::Broken(e) => plain(Status::Fail, e.to_string()),
        Judged::Panicked(words) => plain(Status::Fail, format!("panicked: {words}")),
        Judged::Function(_, Ok(worst)) => plain(Status::Pass, format!("at most {worst:.2} of the tolerance")),
        Judged::Function(_, Err(e)) => plain(Status::Fail, e),
        Judged::Picture(image, verdict) => {
            let mut outcome = of_verdict(case, &backend, &verdict);
            if let (Status::Fail, Some(reference)) = (outcome.status, prepared.reference()) {
                let file = pictures.join(format!("{}-{}.png", case.name.replace('/', "-"), candidate.kind()));
                match write_difference(&file, &image, reference) {
                    Ok(()) => outcome.note += &format!("; see {}", file.display()),
                    Err(e) => outcome.note += &format!("; no picture: {e}"),
                }
            }
            (outcome, Some(image))
        }
    }
}

fn of_verdict(case: &Case, backend: &str, verdict: &Verdict) -> Outcome {
    let numbers = verdict.errors.as_ref().map(|e| {
        let (Worst { difference: max, pixel, .. }, p) = (e.worst, e.p999);
        let (at, bound) = verdict.closest.unwrap_or_default();
        format!(
            "max {max:.2e} at ({}, {}), 99.9 % within {p:.2e}, at most {:.2} of its bound ({bound:.2e} at ({}, {}))",
            pixel.x, pixel.y, verdict.used, at.x, at.y
        )
    });
    let numbers = numbers.unwrap_or_default();
    let (status, note) = match &verdict.complaint {
        None => (Status::Pass, numbers),
        Some(complaint) => (Status::Fail, format!("{complaint}; {numbers}")),
    };
    let mut outcome = Outcome::plain(&case.name, backend, status, note);
    if let Some(e) = &verdict.errors {
        outcome.max_difference = Some(e.worst.difference);
        outcome.p999 = Some(e.p999);
        outcome.worst_pixel = Some(e.worst.pixel.to_array());
    }
    outcome
}
