//! Runs the conformance cases on the backends of this build and machine.

use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::Context;
use brickfield::{BackendKind, Validation};
use brickfield_conformance::conformance::{
    Candidate, Case, Comparison, Outcome, RecordEntry, RecordError, RecordWriter, Run, SelfCheck, Summary, cases,
    for_each_prepared, read_record,
};
use clap::Parser;
use serde::Serialize;

/// Holds every backend to the f64 answer, case by case; with --self-check also the cases to their mutants
#[derive(Parser)]
struct Arguments {
    /// Backends whose absence is a failure, separated by commas: cpu, wgpu, ash
    #[arg(long, value_delimiter = ',', value_name = "BACKENDS")]
    require: Vec<BackendKind>,
    /// Backends to run, separated by commas; all by default
    #[arg(long, value_delimiter = ',', value_name = "BACKENDS")]
    backend: Vec<BackendKind>,
    /// A part of the adapter's name, or its number; all adapters by default
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Only cases whose name holds this text; may be repeated
    #[arg(long, value_name = "TEXT")]
    case: Vec<String>,
    /// Run the mutants, too: every case must catch the mutants that it names, every mutant must be caught
    #[arg(long)]
    self_check: bool,
    /// Have the driver's validation layer check every call
    #[arg(long)]
    validation: bool,
    /// Write all outcomes to this file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Keep all pictures and function values in this file, a record to compare a later run with
    #[arg(long, value_name = "FILE")]
    digests: Option<PathBuf>,
    /// Compare all pictures and function values with an earlier run's record; a changed one fails the run
    #[arg(long, value_name = "FILE")]
    against: Option<PathBuf>,
    /// Where pictures of failing cases go
    #[arg(long, value_name = "FOLDER", default_value = "target/conformance")]
    pictures: PathBuf,
    /// List the cases and the mutants that each must catch
    #[arg(long)]
    list: bool,
}

/// The report as JSON.
#[derive(Serialize)]
struct ConformanceReport {
    summary: Summary,
    outcomes: Vec<Outcome>,
}

fn main() -> anyhow::Result<ExitCode> {
    let options = Arguments::parse();
    let cases = chosen(&options.case);
    if options.list {
        list(&cases);
        return Ok(ExitCode::SUCCESS);
    }
    let begin = Instant::now();
    let mut keeper = Keeper::new(&options)?;
    let mut outcomes = run(&options, &cases, &mut keeper);
    // With all cases out of sight there is nothing to be green about.
    if outcomes.is_empty() {
        println!("no case matches {:?}", options.case);
    }
    let summary = Summary::of(&outcomes);
    println!("{summary} in {:.1} s", begin.elapsed().as_secs_f64());
    if let Some(path) = &options.json {
        let report = ConformanceReport { summary, outcomes: std::mem::take(&mut outcomes) };
        let text = serde_json::to_string_pretty(&report)?;
        fs::write(path, text).with_context(|| format!("cannot write {}", path.display()))?;
    }
    let has_changes = keeper.finish(&options)?;
    Ok(if summary.is_green() && !has_changes { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Keeps answers: writes them to a record, compares them with an earlier record, or both.
struct Keeper {
    writer: Option<RecordWriter>,
    comparison: Option<Comparison>,
    /// The first failure of writing.
    failed: Result<(), RecordError>,
}

impl Keeper {
    /// Reads the earlier record before it creates one: both may be one file.
    fn new(options: &Arguments) -> Result<Keeper, RecordError> {
        let earlier = options.against.as_deref().map(read_record).transpose()?;
        let writer = options.digests.as_deref().map(RecordWriter::create).transpose()?;
        Ok(Keeper { writer, comparison: earlier.map(Comparison::with), failed: Ok(()) })
    }

    fn keep(&mut self, answer: &RecordEntry) {
        if let (Some(writer), true) = (&mut self.writer, self.failed.is_ok()) {
            self.failed = writer.write(answer);
        }
        if let Some(line) = self.comparison.as_mut().and_then(|comparison| comparison.hold(answer)) {
            println!("{line}");
        }
    }

    /// Completes the record and sums up the comparison; whether an answer has changed.
    fn finish(self, options: &Arguments) -> Result<bool, RecordError> {
        self.failed?;
        if let (Some(writer), Some(path)) = (self.writer, &options.digests) {
            println!("record {}: {:.1} MB", path.display(), writer.finish()? as f64 / 1e6);
        }
        let Some(mut comparison) = self.comparison else { return Ok(false) };
        comparison.gone(|answer| is_asked_for(options, answer)).iter().for_each(|line| println!("{line}"));
        println!("against the record: {comparison}");
        Ok(comparison.has_changes())
    }
}

/// Whether a run with these options gives this answer, if the code still has its case and the machine its backend.
fn is_asked_for(options: &Arguments, answer: &RecordEntry) -> bool {
    let kind = BackendKind::ALL.into_iter().find(|kind| answer.backend.starts_with(&format!("{kind}@")));
    let is_case = options.case.is_empty() || options.case.iter().any(|text| answer.case.contains(text.as_str()));
    is_case && kind.is_none_or(|kind| is_wanted(options, kind))
}

fn is_wanted(options: &Arguments, kind: BackendKind) -> bool {
    options.backend.is_empty() || options.backend.contains(&kind) || options.require.contains(&kind)
}

fn chosen(texts: &[String]) -> Vec<Case> {
    let matches = |case: &Case| texts.is_empty() || texts.iter().any(|t| case.name.contains(t.as_str()));
    cases().into_iter().filter(matches).collect()
}

fn list(cases: &[Case]) {
    for case in cases {
        let mutants: Vec<&str> = case.mutants.iter().map(|m| m.name()).collect();
        println!("{:<36} {}", case.name, mutants.join(" "));
    }
}

fn candidates(options: &Arguments) -> Vec<Candidate> {
    let validation = if options.validation { Validation::On } else { Validation::Off };
    let kinds = BackendKind::ALL.into_iter().filter(|kind| is_wanted(options, *kind));
    kinds.flat_map(|kind| Candidate::all(kind, options.adapter.as_deref(), validation)).collect()
}

/// Runs each case on all backends, and then, if asked for, against its mutants.
fn run(options: &Arguments, cases: &[Case], keeper: &mut Keeper) -> Vec<Outcome> {
    let mut run =
        Run { candidates: candidates(options), required: options.require.clone(), pictures: options.pictures.clone() };
    let mut check = options.self_check.then(SelfCheck::default);
    let mut outcomes = Vec::new();
    for_each_prepared(cases, |case, mut prepared| {
        let mut keep = |answer: RecordEntry| keeper.keep(&answer);
        outcomes.extend(run.case(case, &mut prepared, &mut |outcome| println!("{outcome}"), &mut keep));
        if let Some(check) = &mut check {
            let outcome = check.case(case, &mut prepared, &mut run.candidates);
            println!("{outcome}");
            outcomes.push(outcome);
        }
    });
    if let Some(check) = check {
        outcomes.extend(uncaught(options, &check, &run.candidates));
    }
    outcomes
}

/// Mutants that no case has caught; a part of the cases need not catch all.
fn uncaught(options: &Arguments, check: &SelfCheck, candidates: &[Candidate]) -> Vec<Outcome> {
    let uncaught = if options.case.is_empty() { check.uncaught(candidates) } else { Vec::new() };
    uncaught.iter().for_each(|outcome| println!("{outcome}"));
    let (n_caught, n) = check.n_caught();
    println!("{n_caught} of {n} mutants caught");
    uncaught
}
