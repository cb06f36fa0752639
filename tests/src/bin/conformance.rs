//! Runs the conformance cases on the backends of this build and machine.

use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::Context;
use brickfield::{BackendKind, Validation};
use brickfield_conformance::conformance::{Case, Contestant, Outcome, Run, SelfCheck, Summary, cases};
use clap::Parser;
use serde::Serialize;

/// Holds every backend to the f64 answer, case by case; or the cases to their mutants (--self-check)
#[derive(Parser)]
struct Options {
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
    /// Run the mutants: every case must catch those that it names, every mutant must be caught
    #[arg(long)]
    self_check: bool,
    /// Have the driver's validation layer check every call
    #[arg(long)]
    validation: bool,
    /// Write all outcomes to this file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Where pictures of failing cases go
    #[arg(long, value_name = "FOLDER", default_value = "target/conformance")]
    pictures: PathBuf,
    /// List the cases and the mutants that each must catch
    #[arg(long)]
    list: bool,
}

/// The report as JSON.
#[derive(Serialize)]
struct Report {
    summary: Summary,
    outcomes: Vec<Outcome>,
}

fn main() -> anyhow::Result<ExitCode> {
    let options = Options::parse();
    let cases = chosen(&options.case);
    if options.list {
        list(&cases);
        return Ok(ExitCode::SUCCESS);
    }
    let begin = Instant::now();
    let mut outcomes = if options.self_check { self_check(&options, &cases) } else { run(&options, &cases) };
    // With all cases out of sight there is nothing to be green about.
    if outcomes.is_empty() {
        println!("no case matches {:?}", options.case);
    }
    let summary = Summary::of(&outcomes);
    println!("{summary} in {:.1} s", begin.elapsed().as_secs_f64());
    if let Some(path) = &options.json {
        let report = Report { summary, outcomes: std::mem::take(&mut outcomes) };
        let text = serde_json::to_string_pretty(&report)?;
        fs::write(path, text).with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(if summary.is_green() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
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

fn contestants(options: &Options) -> Vec<Contestant> {
    let validation = if options.validation { Validation::On } else { Validation::Off };
    let wanted = |kind: &BackendKind| {
        options.backend.is_empty() || options.backend.contains(kind) || options.require.contains(kind)
    };
    let kinds = BackendKind::ALL.into_iter().filter(wanted);
    kinds.flat_map(|kind| Contestant::all(kind, options.adapter.as_deref(), validation)).collect()
}

fn run(options: &Options, cases: &[Case]) -> Vec<Outcome> {
    let mut run = Run {
        contestants: contestants(options),
        required: options.require.clone(),
        pictures: options.pictures.clone(),
    };
    cases.iter().flat_map(|case| run.case(case, &mut |outcome| println!("{outcome}"))).collect()
}

fn self_check(options: &Options, cases: &[Case]) -> Vec<Outcome> {
    let mut contestants = contestants(options);
    let mut outcomes = absences(options, &contestants);
    let mut check = SelfCheck::new(&mut contestants);
    for case in cases {
        let outcome = check.case(case);
        println!("{outcome}");
        outcomes.push(outcome);
    }
    // A part of the cases need not catch all mutants.
    let uncaught = if options.case.is_empty() { check.uncaught() } else { Vec::new() };
    uncaught.iter().for_each(|o| println!("{o}"));
    outcomes.extend(uncaught);
    let (n_caught, n) = check.n_caught();
    println!("{n_caught} of {n} mutants caught");
    outcomes
}

/// Required backends that are absent fail a self-check, too.
fn absences(options: &Options, contestants: &[Contestant]) -> Vec<Outcome> {
    use brickfield_conformance::conformance::Status;
    let missing = contestants.iter().filter(|c| options.require.contains(&c.kind()));
    let outcomes = missing.filter_map(|c| Some((c, c.absence()?)));
    let outcomes = outcomes.map(|(c, why)| Outcome::plain("required", &c.name(), Status::Fail, why));
    outcomes.inspect(|o| println!("{o}")).collect()
}
