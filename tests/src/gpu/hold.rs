//! Both backends against the f64 answer, and against each other to the bit.

use std::collections::BTreeMap;
use std::path::Path;

use brickfield::Validation;

use super::budget::{Deadline, Unmeasured};
use super::devices::KINDS;
use super::report::{CaseCounts, Conformance};
use super::{Form, PartResult};
use crate::conformance::{Candidate, Outcome, Prepared, Run, Status, Summary, cases};

/// Parts of the names of the short form's cases.
const SHORT: [&str; 8] = [
    "function/alpha",
    "function/sample",
    "fast/u8",
    "fast/f32",
    "field/ramp",
    "skip/two-balls",
    "cut/several-levels-sparse",
    "polygons/three-stacks",
];

/// Cases of which every so many are run before their neighbours: if time runs out, some of each kind have run.
const STRIDE: usize = 8;

/// Runs the cases, as many as there is time for.
pub(super) fn hold(
    form: Form,
    adapter: Option<&str>,
    pictures: &Path,
    deadline: Deadline,
    failures: &mut Vec<String>,
) -> PartResult<Conformance> {
    let mut cases = cases();
    let n_cases = cases.len();
    if form == Form::Short {
        cases.retain(|case| SHORT.iter().any(|name| case.name.contains(name)));
    }
    let candidates = KINDS.map(|kind| Candidate::open(kind, adapter, Validation::Off)).into();
    let mut run = Run { candidates, required: Vec::new(), pictures: pictures.to_owned() };
    let (mut outcomes, mut n_cases_run) = (Vec::new(), 0);
    for i in in_strides(cases.len()) {
        if deadline.admit("a case", 0.0).is_err() {
            break;
        }
        outcomes.extend(run.case(&cases[i], &mut Prepared::of(&cases[i]), &mut |_| (), &mut |_| ()));
        n_cases_run += 1;
    }
    failures.extend(outcomes.iter().filter(|o| o.status == Status::Fail).map(|o| o.to_string()));
    let conformance = Conformance { n_cases, n_cases_run, counts: counts(&outcomes) };
    let left_out = left_out(form, &conformance, cases.len(), &outcomes);
    let line = format!("{n_cases_run} of {n_cases} cases, {}", Summary::of(&outcomes));
    PartResult { found: conformance, left_out, line }
}

/// 0 to `n`, every [`STRIDE`]th first.
fn in_strides(n: usize) -> impl Iterator<Item = usize> {
    (0..STRIDE).flat_map(move |first| (first..n).step_by(STRIDE))
}

fn counts(outcomes: &[Outcome]) -> Vec<CaseCounts> {
    let mut by_backend: BTreeMap<&str, Vec<&Outcome>> = BTreeMap::new();
    for outcome in outcomes {
        let (backend, _) = outcome.backend.split_once('@').unwrap_or((&outcome.backend, ""));
        by_backend.entry(backend).or_default().push(outcome);
    }
    let counted = |(backend, outcomes): (&str, Vec<&Outcome>)| {
        let Summary { passed, failed, skipped } = Summary::of(outcomes);
        CaseCounts { backend: backend.to_owned(), passed, failed, skipped }
    };
    by_backend.into_iter().map(counted).collect()
}

fn left_out(form: Form, conformance: &Conformance, n_wanted: usize, outcomes: &[Outcome]) -> Vec<Unmeasured> {
    let mut left_out = Vec::new();
    let Conformance { n_cases, n_cases_run, .. } = *conformance;
    if n_wanted < n_cases {
        let reason = format!("the {} form runs {n_wanted}", form.name());
        left_out.push(Unmeasured::new(format!("{} cases", n_cases - n_wanted), reason));
    }
    if n_cases_run < n_wanted {
        let what = format!("{} cases", n_wanted - n_cases_run);
        left_out.push(Unmeasured::new(what, "no time was left: allow more --seconds"));
    }
    let mut reasons: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    for o in outcomes.iter().filter(|o| !matches!(o.status, Status::Pass | Status::Fail)) {
        *reasons.entry((o.status.name(), &o.note)).or_default() += 1;
    }
    left_out.extend(
        reasons.into_iter().map(|((status, note), n)| Unmeasured::new(format!("{n} outcomes ({status})"), note)),
    );
    left_out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strides_visit_each_case_once_and_neighbours_late() {
        let order: Vec<usize> = in_strides(19).collect();
        assert_eq!(order[..4], [0, 8, 16, 1]);
        assert_eq!(order.iter().copied().collect::<std::collections::BTreeSet<_>>(), (0..19).collect());
        assert_eq!(order.len(), 19);
    }

    #[test]
    fn every_short_case_is_there() {
        let cases = cases();
        assert!(SHORT.iter().all(|name| cases.iter().any(|case| case.name.contains(name))));
    }

    #[test]
    fn pairs_are_counted_apart_and_absence_is_told_once_for_all() {
        let outcome = |backend, status| Outcome::plain("a", backend, status, "note");
        let outcomes = [
            outcome("wgpu@card", Status::Pass),
            outcome("ash@card", Status::Fail),
            outcome("wgpu=ash@card", Status::Pass),
            outcome("ash@card", Status::NoData),
            outcome("ash@card", Status::NoData),
        ];
        let counts = counts(&outcomes);
        let of = |name: &str| counts.iter().find(|c| c.backend == name).map(|c| (c.passed, c.failed, c.skipped));
        assert_eq!((of("wgpu"), of("ash"), of("wgpu=ash")), (Some((1, 0, 0)), Some((0, 1, 2)), Some((1, 0, 0))));
        let conformance = Conformance { n_cases: 9, n_cases_run: 2, counts };
        let left_out = left_out(Form::Short, &conformance, 3, &outcomes);
        let words: Vec<&str> = left_out.iter().map(|l| l.what.as_str()).collect();
        assert_eq!(words, ["6 cases", "1 cases", "2 outcomes (no-data)"]);
    }
}
