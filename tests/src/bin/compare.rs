//! `compare`: error against run time, on every backend.

use std::process::ExitCode;

use brickfield_conformance::compare::{CompareArgs, compare, parse, say, short_of};
use brickfield_conformance::lamar::{LamarArgs, lamar};
use brickfield_conformance::report::{Report, absences, table};
use clap::Parser;

fn main() -> ExitCode {
    let is_paper =
        |word: std::ffi::OsString| word.to_str().is_some_and(|w| w == "--paper" || w.starts_with("--paper="));
    if std::env::args_os().skip(1).any(is_paper) {
        return of_paper();
    }
    let args = parse(std::env::args_os().collect()).unwrap_or_else(|e| e.exit());
    match compare(&args) {
        Ok(report) => finish(&args, &report),
        Err(e) => {
            eprintln!("compare: {}", e.to_string().split_whitespace().collect::<Vec<_>>().join(" "));
            ExitCode::from(e.status())
        }
    }
}

/// A paper's own comparisons, with options of their own.
fn of_paper() -> ExitCode {
    let args = LamarArgs::parse();
    match lamar(&args) {
        Ok(findings) => {
            for missed in &findings.missed {
                eprintln!("compare: missed: {}", missed.what);
            }
            let fails = findings.missed.iter().any(|missed| args.check.contains(&missed.kind));
            ExitCode::from(if fails { 4 } else { 0 })
        }
        Err(e) => {
            eprintln!("compare: {e}");
            ExitCode::from(e.status())
        }
    }
}

fn finish(args: &CompareArgs, report: &Report) -> ExitCode {
    let left_out = match report.left_out.len() {
        0 => String::new(),
        n => format!("{n} measurements were left out; report.json says why\n"),
    };
    let out = args.out.display();
    let places = format!("{out}/report.json, {out}/index.html, {out}/images/ ({:.0} s)\n", report.total_seconds);
    if let Err(e) = say(&format!("{}\n* on the Pareto front\n{}{left_out}{places}", table(report), absences(report))) {
        eprintln!("compare: {e}");
        return ExitCode::FAILURE;
    }
    match args.reach.map(|bound| (bound, short_of(report, bound))) {
        Some((bound, short)) if !short.is_empty() => {
            eprintln!("compare: the exact mode of {} does not come below an RMSE of {bound:e}", short.join(", "));
            ExitCode::from(4)
        }
        _ => ExitCode::SUCCESS,
    }
}
