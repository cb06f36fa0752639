//! `cargo xtask`: the project's commands, each a thin call of cargo or of the conformance crate's programs.

mod architecture;
mod ci;
mod deny;
mod kept_out;
mod layers;
mod package;
mod readme;
mod setup;
mod spawn;

use std::process::ExitCode;

use anyhow::Result;
use clap::{Parser, Subcommand};
use spawn::{Spawn, Tool, cargo};

/// The project's commands
///
/// Start with `cargo xtask setup` on a new machine, then `cargo xtask compare`. Exit codes: 0 good, 1 something failed or
/// is missing, 2 bad arguments; compare, conformance, frames, gpu, orders, peers, sheet, speed, test and bench pass on what the program that they run says.
/// `cargo xtask compare --help` shows what can be chosen; so do those of conformance, frames, gpu, orders, peers, sheet and speed. They are built first.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask", after_help = ENVIRONMENT)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

const ENVIRONMENT: &str = "\
Environment:
  BRICKFIELD_DATA: folder of real volumes, for tests and speed. Without it those cases are
    reported as \"no data\" (with CI=true: those in ../shared/data, where that exists).";

#[derive(Subcommand)]
enum Command {
    /// Say what this machine lacks (Vulkan loader, driver, validation layer; for ci rustfmt, clippy, cargo-deny), and install
    /// it if asked
    Setup {
        /// Install without asking; by apt-get (with sudo if not root), rustup and cargo
        #[arg(long)]
        yes: bool,
    },
    /// Compare methods and backends: error against run time
    #[command(disable_help_flag = true)]
    Compare(Passed),
    /// Run every test and every documentation example of the workspace
    ///
    /// Arguments go to cargo test: `cargo xtask test -p brickfield-optics -- automatic`.
    Test(Passed),
    /// Hold every backend to the f64 answer
    ///
    /// `--require cpu,wgpu,ash` makes an absent backend a failure; `--self-check` lets mutants loose on the cases.
    #[command(disable_help_flag = true)]
    Conformance(Passed),
    /// Measure a GPU: conformance, errors, contestants, steady frames, texture reads, into one JSON file
    ///
    /// `--short` for a software driver. The program itself (`gpu`) runs on machines without cargo.
    #[command(disable_help_flag = true)]
    Gpu(Passed),
    /// Render steady frames of a turning camera, and say how long each part takes
    #[command(disable_help_flag = true)]
    Frames(Passed),
    /// Measure the order of accuracy of every quadrature rule
    #[command(disable_help_flag = true)]
    Orders(Passed),
    /// Render the same scenes with VTK, pygfx and vispy, and compare time and error; `--install` brings them
    #[command(disable_help_flag = true)]
    Peers(Passed),
    /// Measure what skipping saves, the CPU path against the GPU paths, an empty frame, the octree's build rate
    #[command(disable_help_flag = true)]
    Speed(Passed),
    /// Render the first picture of every volume of a folder onto one sheet; `--other` puts another build's beside them
    #[command(disable_help_flag = true)]
    Sheet(Passed),
    /// Run the benchmarks; arguments go to cargo bench
    Bench(Passed),
    /// Hold the workspace to the arrows and the crate table of ARCHITECTURE.md, and each crate to what it must not bring
    Layers,
    /// Hold all dependencies to deny.toml: licences, versions, sources, and advisories where their database can be had
    Deny,
    /// Make the packages as a registry would get them, and check that none lacks a licence, a readme or its description
    Package,
    /// Everything that must hold before a merge, in the order of how soon it fails
    Ci,
}

/// Arguments that are passed on.
#[derive(clap::Args)]
struct Passed {
    /// Passed on
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "ARGUMENTS")]
    arguments: Vec<String>,
}

impl Passed {
    /// The arguments as they were typed: clap drops the first `--`, which is cargo's.
    fn typed(self) -> Vec<String> {
        let n_dropped = usize::from(std::env::args_os().len() > 2 + self.arguments.len());
        let typed = std::env::args_os().skip(2).map(|a| a.to_string_lossy().into_owned());
        if n_dropped == 0 { self.arguments } else { typed.collect() }
    }
}

fn main() -> Result<ExitCode> {
    match Arguments::parse().command {
        Command::Setup { yes } => setup::setup(if yes { setup::Consent::Given } else { setup::Consent::Ask }),
        Command::Compare(passed) => Tool::Compare.run(&passed.typed()),
        Command::Test(passed) => of_packages(cargo("test"), &passed.typed()),
        Command::Conformance(passed) => Tool::Conformance.run(&passed.typed()),
        Command::Gpu(passed) => Tool::Gpu.run(&passed.typed()),
        Command::Frames(passed) => Tool::Frames.run(&passed.typed()),
        Command::Orders(passed) => Tool::Orders.run(&passed.typed()),
        Command::Peers(passed) => Tool::Peers.run(&passed.typed()),
        Command::Speed(passed) => Tool::Speed.run(&passed.typed()),
        Command::Sheet(passed) => Tool::Sheet.run(&passed.typed()),
        Command::Bench(passed) => of_packages(cargo("bench").arg("--benches"), &passed.typed()),
        Command::Layers => layers::layers(),
        Command::Deny => deny::deny(),
        Command::Package => package::package(),
        Command::Ci => ci::ci(),
    }
}

/// Runs a cargo command on the packages that the arguments name, or else on all.
fn of_packages(command: Spawn, arguments: &[String]) -> Result<ExitCode> {
    let names_one = |a: &String| a.starts_with("-p") || a.starts_with("--package") || a.starts_with("--manifest-path");
    let all: &[&str] = if arguments.iter().take_while(|a| *a != "--").any(names_one) { &[] } else { &["--workspace"] };
    command.args(all).args(arguments).run()
}
