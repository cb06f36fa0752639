//! `compare`: error against run time, on every backend.

use std::process::ExitCode;

use brickfield_conformance::codecs::{CodecsArgs, codecs};
use brickfield_conformance::compare::{CompareArgs, compare, parse, say, short_of};
use brickfield_conformance::lamar::{LamarArgs, lamar};
use brickfield_conformance::left_out::{LeftOutArgs, left_out};
use brickfield_conformance::ljung::{LjungArgs, ljung};
use brickfield_conformance::report::{Report, absences, table};
use brickfield_conformance::saladi::{SaladiArgs, saladi};
use brickfield_conformance::tong::{TongArgs, tong};
use brickfield_conformance::wynn::{WynnArgs, wynn};
use clap::Parser;

fn main() -> ExitCode {
    if let Some(paper) = paper_of_command_line() {
        return of_paper(&paper);
    }
    if std::env::args().any(|word| word == "--left-out") {
        return of_left_out(&LeftOutArgs::parse());
    }
    if std::env::args().any(|word| word == "--codecs") {
        return of_codecs(&CodecsArgs::parse());
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

/// What follows `--paper`; empty if nothing does.
fn paper_of_command_line() -> Option<String> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let at = words.iter().position(|word| word == "--paper" || word.starts_with("--paper="))?;
    let word = words[at].strip_prefix("--paper=").map(str::to_owned);
    Some(word.or_else(|| words.get(at + 1).cloned()).unwrap_or_default())
}

/// A paper's own comparisons, with options of their own.
fn of_paper(paper: &str) -> ExitCode {
    let (found, check) = match paper {
        "ljung" => {
            let args = LjungArgs::parse();
            (ljung(&args), args.common.check)
        }
        "saladi" => {
            let args = SaladiArgs::parse();
            (saladi(&args), args.common.check)
        }
        "tong" => {
            let args = TongArgs::parse();
            (tong(&args), args.common.check)
        }
        "wynn" => {
            let args = WynnArgs::parse();
            (wynn(&args), args.common.check)
        }
        _ => {
            let args = LamarArgs::parse();
            (lamar(&args), args.common.check)
        }
    };
    match found {
        Ok(findings) => {
            for missed in &findings.missed {
                eprintln!("compare: missed: {}", missed.what);
            }
            let fails = findings.missed.iter().any(|missed| check.contains(&missed.kind));
            ExitCode::from(if fails { 4 } else { 0 })
        }
        Err(e) => {
            eprintln!("compare: {e}");
            ExitCode::from(e.status())
        }
    }
}

/// Codecs on this project's data.
fn of_codecs(args: &CodecsArgs) -> ExitCode {
    match codecs(args) {
        Ok(findings) => {
            findings.missed.iter().for_each(|missed| eprintln!("compare: missed: {}", missed.what));
            ExitCode::from(if findings.missed.is_empty() { 0 } else { 4 })
        }
        Err(e) => {
            eprintln!("compare: {e}");
            ExitCode::from(e.status())
        }
    }
}

/// What shaders leave out.
fn of_left_out(args: &LeftOutArgs) -> ExitCode {
    match left_out(args) {
        Ok(complaints) => {
            complaints.iter().for_each(|complaint| eprintln!("compare: {complaint}"));
            ExitCode::from(if complaints.is_empty() { 0 } else { 4 })
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
    if let Err(e) =
        say(&format!("{}\n* on the Pareto front\n{}{left_out}{places}", table(report), absences(&report.backends)))
    {
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
