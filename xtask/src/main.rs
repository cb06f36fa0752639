//! `cargo xtask`: the project's commands, each a thin call of cargo or of the conformance crate's programs.

mod architecture;
mod ci;
mod layers;
mod readme;
mod setup;
mod spawn;

use std::process::ExitCode;

use anyhow::Result;
use clap::{Parser, Subcommand};
use spawn::{Tool, cargo};

/// The project's commands
///
/// Start with `cargo xtask setup` on a new machine, then `cargo xtask compare`. Exit codes: 0 good, 1 something failed or
/// is missing, 2 bad arguments; compare, conformance, orders, test and bench pass on what the program that they run says.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask", after_help = ENVIRONMENT)]
struct Options {
    #[command(subcommand)]
    command: Command,
}

const ENVIRONMENT: &str = "\
Environment:
  BRICKFIELD_DATA           folder of volumes that tests and comparisons use; without it they use made-up volumes
                            (with CI=true, ../shared/data where that exists)
  BRICKFIELD_XTASK_PROFILE  `release` (default) or `dev`: how compare, conformance and orders are built.
                            dev shares all its dependencies with `cargo xtask test`: CI compiles wgpu once";

#[derive(Subcommand)]
enum Command {
    /// Say what this machine lacks (Vulkan loader, driver, validation layer, rustfmt, clippy), and install it if asked
    Setup {
        /// Install without asking; by apt-get (with sudo if not root) and rustup
        #[arg(long)]
        yes: bool,
    },
    /// Compare methods and backends: error against run time
    ///
    /// `cargo xtask compare -- --help` shows what can be chosen.
    Compare(Passed),
    /// Run every test and every documentation example of the workspace
    ///
    /// Arguments go to cargo test: `cargo xtask test -p brickfield-optics -- automatic`.
    Test(Passed),
    /// Hold every backend to the f64 answer
    ///
    /// `--require cpu,wgpu,ash` makes an absent backend a failure; `--self-check` lets mutants loose on the cases;
    /// `cargo xtask conformance -- --help` shows the rest.
    Conformance(Passed),
    /// Measure the order of accuracy of every quadrature rule
    Orders(Passed),
    /// Run the benchmarks; arguments go to cargo bench
    Bench(Passed),
    /// Hold the workspace to the arrows and the crate table of ARCHITECTURE.md
    Layers,
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

fn main() -> Result<ExitCode> {
    match Options::parse().command {
        Command::Setup { yes } => setup::setup(if yes { setup::Consent::Given } else { setup::Consent::Ask }),
        Command::Compare(passed) => Tool::Compare.run(&passed.arguments),
        Command::Test(passed) => cargo("test").arg("--workspace").args(&passed.arguments).run(),
        Command::Conformance(passed) => Tool::Conformance.run(&passed.arguments),
        Command::Orders(passed) => Tool::Orders.run(&passed.arguments),
        Command::Bench(passed) => cargo("bench").args(["--workspace", "--benches"]).args(&passed.arguments).run(),
        Command::Layers => layers::layers(),
        Command::Ci => ci::ci(),
    }
}
