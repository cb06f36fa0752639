//! The check of the checks: every case must catch the mutants that it names, and every mutant must be named.
//!
//! A mutant is a backend with one thing wrong, run on the real path. Plan mutants run on the first backend there is, those
//! of meshes on the next ones, too, until one catches them: cracks show best where corners are rounded to fractions of a
//! pixel. Shader mutants run on the first backend that compiles shaders: they change the sources that both share.

use std::collections::{BTreeMap, BTreeSet};

use super::candidate::Candidate;
use super::case::{Case, Mutant};
use super::check::{Judged, Obstacle, Prepared};
use super::outcome::{Outcome, Status};

/// Holds cases against their mutants.
#[derive(Default)]
pub struct SelfCheck {
    patched: BTreeMap<Mutant, Result<Candidate, String>>,
    caught: BTreeSet<Mutant>,
    run: BTreeSet<Mutant>,
}

/// The fate of a mutant in a case.
enum Fate {
    Caught,
    Survived(String),
    NotRun(String),
}

impl SelfCheck {
    /// Runs a case against the mutants that it names. It passes if it catches all mutants that can be run on these
    /// candidates, and at least one.
    pub fn case(
        &mut self,
        case: &Case,
        prepared: &mut Result<Prepared, Obstacle>,
        candidates: &mut [Candidate],
    ) -> Outcome {
        let plain = |status, note: String| Outcome::plain(&case.name, "mutants", status, note);
        if case.mutants.is_empty() {
            return plain(Status::Fail, "names no mutant that it must catch".into());
        }
        let prepared = match prepared {
            Ok(prepared) => prepared,
            Err(Obstacle::NoData(e)) => return plain(Status::NoData, e.to_string()),
            Err(e) => return plain(Status::Fail, e.to_string()),
        };
        let (mut caught, mut survivors, mut not_run) = (Vec::new(), Vec::new(), Vec::new());
        for mutant in &case.mutants {
            match self.fate(prepared, mutant, candidates) {
                Fate::Caught => caught.push(mutant.name()),
                Fate::Survived(how) => survivors.push(format!("{mutant} ({how})")),
                Fate::NotRun(why) => not_run.push(format!("{mutant} ({why})")),
            }
        }
        match (survivors.is_empty(), caught.is_empty()) {
            (false, _) => plain(Status::Fail, format!("survived: {}", survivors.join(", "))),
            (true, true) => plain(Status::NoDevice, format!("not run: {}", not_run.join(", "))),
            (true, false) => plain(Status::Pass, format!("caught {}", caught.join(", "))),
        }
    }

    /// Mutants that no case has caught: one failure each, or no device if it could not be run on these backends.
    pub fn uncaught(&self, candidates: &[Candidate]) -> Vec<Outcome> {
        let missing = Mutant::all().into_iter().filter(|m| !self.caught.contains(m));
        let outcome = |m: Mutant| match self.run.contains(&m) || candidates.iter().any(|c| c.can_run(&m)) {
            true => Outcome::plain(m.name(), "mutants", Status::Fail, "no case has caught it"),
            false => Outcome::plain(m.name(), "mutants", Status::NoDevice, "no backend to run it on"),
        };
        missing.map(outcome).collect()
    }

    /// How many mutants were caught, of how many.
    pub fn n_caught(&self) -> (usize, usize) {
        (self.caught.len(), Mutant::all().len())
    }

    fn fate(&mut self, prepared: &mut Prepared, mutant: &Mutant, candidates: &mut [Candidate]) -> Fate {
        let fate = match mutant {
            Mutant::Plan(_) | Mutant::Mesh(_) | Mutant::Cells(_) => {
                let most = if matches!(mutant, Mutant::Mesh(_)) { usize::MAX } else { 1 };
                let able = candidates.iter_mut().filter(|c| c.can_run(mutant)).take(most);
                let mut fates = able.map(|candidate| fate_of(prepared.run(candidate, Some(mutant))));
                let Some(first) = fates.next() else { return Fate::NotRun("no backend".into()) };
                let is_caught = |fate: &Fate| matches!(fate, Fate::Caught);
                if is_caught(&first) { first } else { fates.find(is_caught).unwrap_or(first) }
            }
            Mutant::Shader(_) => match self.patched(mutant, candidates) {
                Some(Ok(candidate)) => fate_of(prepared.run(candidate, Some(mutant))),
                Some(Err(e)) => return Fate::Survived(e.clone()),
                None => return Fate::NotRun("no backend with shaders".into()),
            },
        };
        self.run.insert(*mutant);
        if matches!(fate, Fate::Caught) {
            self.caught.insert(*mutant);
        }
        fate
    }

    /// A backend that compiles the mutant's shaders, opened once.
    fn patched(&mut self, mutant: &Mutant, candidates: &[Candidate]) -> Option<&mut Result<Candidate, String>> {
        let Mutant::Shader(shader) = mutant else { return None };
        let honest = candidates.iter().find(|c| c.can_run(mutant))?;
        let open = || match shader.apply() {
            Err(e) => Err(e.to_string()),
            Ok(library) => honest.with_library(library).ok_or_else(|| "cannot be opened with other shaders".to_owned()),
        };
        Some(self.patched.entry(*mutant).or_insert_with(open))
    }
}

/// A picture beyond the rule and a function beyond its tolerance are caught. So is a mutant that the backend refuses to
/// compile or run: but that proves nothing about the case, and counts as a survivor.
fn fate_of(judged: Judged) -> Fate {
    match judged {
        Judged::Picture(_, verdict) => match verdict.complaint {
            Some(_) => Fate::Caught,
            None => Fate::Survived(verdict.errors.map_or(String::new(), |e| format!("max {:.1e}", e.worst.difference))),
        },
        Judged::Function(_, Err(_)) => Fate::Caught,
        Judged::Function(_, Ok(worst)) => Fate::Survived(format!("{worst:.2} of the tolerance")),
        Judged::Absent => Fate::NotRun("absent".into()),
        Judged::Unsupported(e) | Judged::Broken(e) => Fate::Survived(e.to_string()),
        Judged::Panicked(words) => Fate::Survived(format!("panicked: {words}")),
    }
}
