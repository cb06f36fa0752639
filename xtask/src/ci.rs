//! What must hold before a merge.

use std::fs;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result};

use crate::layers::layers;
use crate::readme::xtask_commands;
use crate::spawn::{Spawn, cargo, root};

/// What README.md must show, and `ci` therefore runs.
const PROMISED: [&str; 2] = ["compare", "test"];

/// A named check.
struct Step {
    name: String,
    run: Run,
}

enum Run {
    Does(Box<dyn FnOnce() -> Result<ExitCode>>),
    /// It needs real volumes, and `BRICKFIELD_DATA` names no folder of them.
    NoData,
}

/// The command: runs all steps, whatever fails, and sums up.
pub(crate) fn ci() -> Result<ExitCode> {
    let mut lines = vec![];
    let mut all = ExitCode::SUCCESS;
    for step in steps()? {
        eprintln!("\nci: {}", step.name);
        let begin = Instant::now();
        let good = match step.run {
            Run::NoData => None,
            Run::Does(run) => Some(succeeds(run)),
        };
        if good == Some(false) {
            all = ExitCode::FAILURE;
        }
        let word = match good {
            Some(true) => "ok",
            Some(false) => "FAILED",
            None => "no data",
        };
        lines.push(format!("ci: {word:<7} {:>6.1} s  {}", begin.elapsed().as_secs_f64(), step.name));
        eprintln!("{}", lines[lines.len() - 1]);
    }
    eprintln!("\n{}", lines.join("\n"));
    Ok(all)
}

/// The steps, cheap ones first. Dependencies are checked once (clippy, doc) and compiled once: everything that runs is
/// built in the dev profile, as part of one build of the whole workspace.
fn steps() -> Result<Vec<Step>> {
    let mut steps = vec![
        step("format", || cargo("fmt").args(["--all", "--check"]).run()),
        step("layers", layers),
        step("clippy", || cargo("clippy").args(["--workspace", "--all-targets", "--", "--deny", "warnings"]).run()),
        step("without features", || {
            cargo("check")
                .args(["--package", "brickfield", "--package", "brickfield-io", "--no-default-features"])
                .run()
        }),
        step("documentation", || {
            cargo("doc").args(["--workspace", "--no-deps"]).env("RUSTDOCFLAGS", "--deny warnings").run()
        }),
        step("build", || cargo("build").args(["--workspace", "--all-targets"]).run()),
    ];
    steps.extend(readme_steps()?);
    steps.push(step("orders of accuracy", || xtask(&["orders"]).run()));
    steps.push(step("conformance, of the cases too", || {
        xtask(&["conformance", "--require", "cpu,wgpu,ash", "--self-check"]).run()
    }));
    steps.push(step("a GPU's measurement, in short", || xtask(&["gpu", "--short", "--out", "target/gpu.json"]).run()));
    let of_lamar = ["compare", "--paper", "lamar", "--check=pictures", "--require", "wgpu,ash"];
    let claims = [&of_lamar[..], &["--part", "selection,seams,shells"]].concat();
    steps.push(step("claims of LaMar, Hamann and Joy 1999", move || xtask(&claims).run()));
    let views =
        [&of_lamar[..], &["--part", "views", "--views", "4", "--volume-side", "128", "--size", "48x48"]].concat();
    steps.push(step("views of a pixel's error", move || xtask(&views).run()));
    let rows = ["--part", "table", "--only", "engine", "--sides", "32", "--size", "96x96", "--frames", "1"];
    let table = [&of_lamar[..], &rows].concat();
    steps.push(step_with_data("rows of LaMar's table", move || xtask(&table).run()));
    Ok(steps)
}

/// README.md's commands; that one is missing is a step that fails.
fn readme_steps() -> Result<Vec<Step>> {
    let text = fs::read_to_string(root().join("README.md")).context("cannot read README.md")?;
    let commands = xtask_commands(&text);
    let promised = PROMISED.into_iter().map(|name| {
        let words: Vec<String> = ["cargo", "xtask", name].map(str::to_owned).to_vec();
        let shown = commands.contains(&words);
        step(&format!("README: cargo xtask {name}"), move || {
            anyhow::ensure!(shown, "README.md shows no command `cargo xtask {name}` in a code block");
            xtask(&[name]).run()
        })
    });
    Ok(promised.rev().collect())
}

fn step(name: &str, run: impl FnOnce() -> Result<ExitCode> + 'static) -> Step {
    Step { name: name.to_owned(), run: Run::Does(Box::new(run)) }
}

/// A step that needs real volumes.
fn step_with_data(name: &str, run: impl FnOnce() -> Result<ExitCode> + 'static) -> Step {
    match std::env::var_os("BRICKFIELD_DATA") {
        Some(_) => step(name, run),
        None => Step { name: name.to_owned(), run: Run::NoData },
    }
}

fn succeeds(run: impl FnOnce() -> Result<ExitCode>) -> bool {
    match run() {
        Ok(code) => code == ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("ci: {error:#}");
            false
        }
    }
}

/// A command of ours, as a person would type it.
fn xtask(arguments: &[&str]) -> Spawn {
    cargo("xtask").args(arguments).env("BRICKFIELD_XTASK_PROFILE", "dev")
}
