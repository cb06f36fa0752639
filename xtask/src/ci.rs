//! The checks before a merge.

use std::fs;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result};

use crate::deny;
use crate::layers::layers;
use crate::package::{package, published};
use crate::readme::xtask_commands;
use crate::spawn::{Spawn, cargo, root};

/// The commands that README.md must show, and that `ci` therefore runs.
const PROMISED: [&str; 2] = ["compare", "test"];

/// The package that asks for features of the others: the others are checked without it.
const FRONT_DOOR: &str = "brickfield";

/// A named check.
struct Step {
    name: String,
    run: Box<dyn FnOnce() -> Result<StepOutcome>>,
}

/// What has become of a step.
enum StepOutcome {
    Held,
    Failed,
    /// The step needs something that is not to be had here. It counts as neither.
    NotChecked(&'static str),
}

/// The command: runs all steps, even after a failure, and sums up.
pub(crate) fn ci() -> Result<ExitCode> {
    let mut lines = vec![];
    let mut all = ExitCode::SUCCESS;
    for step in steps()? {
        eprintln!("\nci: {}", step.name);
        let begin = Instant::now();
        let outcome = (step.run)().unwrap_or_else(|error| {
            eprintln!("ci: {error:#}");
            StepOutcome::Failed
        });
        if let StepOutcome::Failed = outcome {
            all = ExitCode::FAILURE;
        }
        lines.push(format!("ci: {:<7} {:>6.1} s  {}", outcome.word(), begin.elapsed().as_secs_f64(), step.name));
        eprintln!("{}", lines[lines.len() - 1]);
    }
    eprintln!("\n{}", lines.join("\n"));
    Ok(all)
}

/// The steps, cheap ones first. Dependencies are checked once (clippy, doc) and compiled once. Ours are compiled twice: as the
/// tests are, where overflow is checked, and for README.md's first command as a person has them.
fn steps() -> Result<Vec<Step>> {
    let mut steps = vec![
        step("format", || cargo("fmt").args(["--all", "--check"]).run()),
        step("layers", layers),
        step("packages", package),
        step("dependencies", deny::packages),
        step("advisories", || match deny::has_database() {
            true => deny::advisories().map(StepOutcome::from),
            false => Ok(StepOutcome::NotChecked("not checked: no database")),
        }),
        step("clippy", || {
            cargo("clippy").args(["--workspace", "--all-targets", "--all-features", "--", "--deny", "warnings"]).run()
        }),
        step("crates without features", || without_features(|name| name != FRONT_DOOR)),
        step("front door without features", || without_features(|name| name == FRONT_DOOR)),
        step("documentation", || {
            cargo("doc").args(["--workspace", "--no-deps"]).env("RUSTDOCFLAGS", "--deny warnings").run()
        }),
        step("build", || cargo("test").args(["--workspace", "--no-run"]).run()),
    ];
    steps.extend(readme_steps()?);
    steps.push(step("orders of accuracy", || checked("orders", &[]).run()));
    steps.push(step("conformance, of the cases too", || {
        checked("conformance", &["--require", "cpu,wgpu,ash", "--self-check"]).run()
    }));
    steps
        .push(step("a GPU's measurement, in short", || checked("gpu", &["--short", "--out", "target/gpu.json"]).run()));
    let of_lamar = ["--paper", "lamar", "--check=pictures", "--require", "wgpu,ash"];
    let claims = [&of_lamar[..], &["--part", "selection,seams,shells"]].concat();
    steps.push(step("claims of LaMar, Hamann and Joy 1999", move || checked("compare", &claims).run()));
    let views =
        [&of_lamar[..], &["--part", "views", "--views", "4", "--volume-side", "128", "--size", "48x48"]].concat();
    steps.push(step("views of a pixel's error", move || checked("compare", &views).run()));
    let rows = ["--part", "table", "--only", "engine", "--sides", "32", "--size", "96x96", "--frames", "1"];
    let table = [&of_lamar[..], &rows].concat();
    steps.push(step_with_data("rows of LaMar's table", move || checked("compare", &table).run()));
    let of_ljung = ["--paper", "ljung", "--check=pictures", "--require", "wgpu,ash"];
    let claims = [&of_ljung[..], &["--part", "gradient,weights,continuity,light,accounting", "--seeds", "10"]].concat();
    steps.push(step("claims of Ljung, Lundstroem and Ynnerman 2006", move || checked("compare", &claims).run()));
    let store = ["--part", "store", "--store-dims", "160x128x192", "--store-mib", "1", "--out", "target/store"];
    let store = [&of_ljung[..], &store].concat();
    steps.push(step("a store larger than its budget", move || checked("compare", &store).run()));
    let rows =
        ["--part", "table,rank,classify", "--only", "engine", "--ratios", "32", "--size", "96x96", "--frames", "1"];
    let table = [&of_ljung[..], &rows].concat();
    steps.push(step_with_data("rows of Ljung's table", move || checked("compare", &table).run()));
    let of_tong = ["--paper", "tong", "--check=pictures", "--require", "wgpu,ash"];
    let counts = [&of_tong[..], &["--part", "counts"]].concat();
    steps.push(step("claims of Tong, Wang, Tsang and Tang 1999", move || checked("compare", &counts).run()));
    let rows = [
        "--part",
        "merge,table,sweep,batches",
        "--only",
        "engine",
        "--size",
        "64x64",
        "--frames",
        "1",
        "--thresholds",
        "5",
    ];
    let table = [&of_tong[..], &rows].concat();
    steps.push(step_with_data("rows of Tong's table", move || checked("compare", &table).run()));
    let of_saladi = ["--paper", "saladi", "--check=pictures", "--require", "wgpu,ash"];
    let rows = ["--part", "normals", "--only", "engine", "--size", "64x64", "--frames", "1"];
    let normals = [&of_saladi[..], &rows].concat();
    steps.push(step_with_data("normals of surface voxels", move || checked("compare", &normals).run()));
    let rows = ["--part", "stores,bytes,served", "--only", "LIDC2", "--size", "64x64"];
    let delivery = [&of_saladi[..], &rows].concat();
    steps.push(step_with_data("stores that arrive bit by bit", move || checked("compare", &delivery).run()));
    let of_wynn = ["--paper", "wynn", "--check=pictures", "--require", "wgpu,ash"];
    let rows = ["--part", "zoom,cells", "--size", "96x96", "--frames", "1"];
    let surfaces = [&of_wynn[..], &rows].concat();
    steps
        .push(step_with_data("surfaces and volumes of curvilinear grids", move || checked("compare", &surfaces).run()));
    let rows = ["--codecs", "--part", "upload", "--only", "tooth", "--frames", "1", "--require", "wgpu,ash"];
    steps.push(step_with_data("packed uploads", move || checked("compare", &rows).run()));
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

fn step<R: Into<StepOutcome>>(name: &str, run: impl FnOnce() -> Result<R> + 'static) -> Step {
    Step { name: name.to_owned(), run: Box::new(|| run().map(Into::into)) }
}

/// A step that needs real volumes: `BRICKFIELD_DATA` names the folder.
fn step_with_data(name: &str, run: impl FnOnce() -> Result<ExitCode> + 'static) -> Step {
    step(name, || match std::env::var_os("BRICKFIELD_DATA") {
        Some(_) => run().map(StepOutcome::from),
        None => Ok(StepOutcome::NotChecked("no data")),
    })
}

impl StepOutcome {
    fn word(&self) -> &'static str {
        match self {
            StepOutcome::Held => "ok",
            StepOutcome::Failed => "FAILED",
            StepOutcome::NotChecked(why) => why,
        }
    }
}

impl From<ExitCode> for StepOutcome {
    fn from(code: ExitCode) -> StepOutcome {
        if code == ExitCode::SUCCESS { StepOutcome::Held } else { StepOutcome::Failed }
    }
}

/// Checks packages in a build that has none of their default features.
fn without_features(wanted: fn(&str) -> bool) -> Result<ExitCode> {
    let names = published()?.into_iter().filter(|name| wanted(name));
    cargo("check").arg("--no-default-features").args(names.flat_map(|name| ["--package".to_owned(), name])).run()
}

/// A command of ours, as a person would type it.
fn xtask(arguments: &[&str]) -> Spawn {
    cargo("xtask").args(arguments)
}

/// A program of the conformance crate, built as the tests are.
fn checked(program: &str, arguments: &[&str]) -> Spawn {
    cargo("run").args(["--profile", "test", "--bin", program, "--"]).args(arguments)
}
