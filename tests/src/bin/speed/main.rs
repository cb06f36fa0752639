//! Speed, in one alternating run: contestants take turns, so that other load on the machine hits all of them alike.
//!
//! Times are printed, not asserted, unless `--check` is given: then the ratios that the project promises must hold.

mod builds;
mod promises;
mod volumes;

use std::fs;
use std::io;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context;
use brickfield::frame::Backend;
use brickfield::{BackendKind, Validation, open_backend};
use brickfield_conformance::turns::{Claim, Claims, FrameError, Spread, Turn, serve, take_turns};
use clap::Parser;
use serde::Serialize;

use builds::BuildRatio;
use volumes::{Entrant, Group, TimedVolume};

/// Times skipping, brick sides, backends, an empty frame and the octree's build, contestants alternating; or two builds
/// against each other (--other)
#[derive(Parser)]
struct Arguments {
    /// The folder of real volumes
    #[arg(long, env = "BRICKFIELD_DATA", value_name = "FOLDER")]
    data: PathBuf,
    /// Rounds; every contestant runs once a round. Fewer than 6 give no interval of 95 %
    #[arg(long, default_value_t = 7, value_parser = clap::value_parser!(u32).range(1..=1000))]
    rounds: u32,
    /// Side of the picture in pixels
    #[arg(long, default_value_t = 512)]
    size: u32,
    /// Only contestants whose name contains this; promises need all
    #[arg(long, value_name = "TEXT")]
    only: Option<String>,
    /// A part of the adapter's name, or its number
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// The `speed` program of another build: both builds take turns with each contestant
    #[arg(long, value_name = "PROGRAM")]
    other: Option<PathBuf>,
    /// Time nothing, but render frames on request, for the `speed --other` of another build
    #[arg(long, conflicts_with_all = ["check", "json", "other"])]
    serve: bool,
    /// Fail if a promised ratio is missed; with --other, if a backend takes more than 3 % longer than in the other build
    #[arg(long)]
    check: bool,
    /// Write the table to this file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// The times of a contestant on a backend, in milliseconds.
#[derive(Clone, Debug, Serialize)]
struct EntrantTimes {
    what: String,
    backend: &'static str,
    #[serde(flatten)]
    spread: Spread,
    /// Round by round.
    rounds: Vec<f64>,
}

/// The numbers of a run.
#[derive(Default, Serialize)]
struct Table {
    times: Vec<EntrantTimes>,
    builds: Vec<BuildRatio>,
    claims: Vec<Claim>,
}

type Backends = Vec<(BackendKind, Box<dyn Backend>)>;

fn main() -> anyhow::Result<ExitCode> {
    let options = Arguments::parse();
    anyhow::ensure!(
        options.only.is_none() || options.other.is_some() || !options.check,
        "--check holds promises, and they need all contestants: leave out --only"
    );
    if options.serve {
        serve_frames(&options)?;
        return Ok(ExitCode::SUCCESS);
    }
    let table = match &options.other {
        Some(program) => builds::against(&options, program)?,
        None => alone(&options)?,
    };
    println!("\n{}", Claims(&table.claims));
    if let Some(path) = &options.json {
        let text = serde_json::to_string_pretty(&table)?;
        fs::write(path, text).with_context(|| format!("cannot write {}", path.display()))?;
    }
    let kept = table.claims.iter().all(|claim| claim.kept);
    Ok(if kept || !options.check { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Times all contestants of this build.
fn alone(options: &Arguments) -> anyhow::Result<Table> {
    let mut table = Table::default();
    let mut backends = opened(options, &mut |line| println!("{line}"));
    for volume in volumes::read(options) {
        let volume = volume?;
        for group in [Group::Skipping, Group::Sides] {
            let times = alternate(options, volume.entrants(options, group, &kinds(&backends))?, &mut backends)?;
            if group == Group::Skipping && options.only.is_none() {
                table.claims.extend(promises::of_skipping(options, &volume, &times, &mut backends)?);
            }
            table.times.extend(times);
        }
    }
    if options.only.is_none() {
        table.claims.push(promises::octree(options.rounds.min(3))?);
    }
    Ok(table)
}

/// Opens all backends; `say` is told which, and which are absent.
fn opened(options: &Arguments, say: &mut dyn FnMut(&str)) -> Backends {
    let mut backends = Backends::new();
    for kind in BackendKind::ALL {
        match open_backend(kind, options.adapter.as_deref(), Validation::Off) {
            Ok(backend) => {
                let d = backend.describe();
                say(&format!("{kind}: {}, {}", d.adapter, d.driver));
                backends.push((kind, backend));
            }
            Err(e) => say(&format!("{kind}: absent: {e}")),
        }
    }
    backends
}

fn kinds(backends: &Backends) -> Vec<BackendKind> {
    backends.iter().map(|(kind, _)| *kind).collect()
}

/// Every entrant once a round, with its bricks resident.
fn alternate(
    options: &Arguments,
    mut entrants: Vec<Entrant<'_>>,
    backends: &mut Backends,
) -> Result<Vec<EntrantTimes>, FrameError> {
    let rounds = take_turns(entrants.len(), options.rounds, |turn| {
        let Entrant { contestant, backend, .. } = &mut entrants[turn.contestant];
        contestant.take(turn, backends[*backend].1.as_mut()).map(|frame| frame.ms)
    })?;
    let times = |(entrant, rounds): (Entrant<'_>, Vec<f64>)| {
        let backend = backends[entrant.backend].0.name();
        let spread = Spread::of(&rounds);
        let Spread { median, min, max } = spread;
        println!("{:<32} {backend:<5} {median:>9.2} ms  ({min:.2} to {max:.2})", entrant.what);
        EntrantTimes { what: entrant.what, backend, spread, rounds }
    };
    Ok(entrants.into_iter().zip(rounds).map(times).collect())
}

/// Renders frames on request. Standard output belongs to the program that asks.
fn serve_frames(options: &Arguments) -> anyhow::Result<()> {
    let mut backends = opened(options, &mut |line| eprintln!("{line}"));
    let volumes = volumes::read(options).collect::<anyhow::Result<Vec<TimedVolume>>>()?;
    let mut entrants = Vec::new();
    for volume in &volumes {
        for group in [Group::Skipping, Group::Sides] {
            entrants.extend(volume.entrants(options, group, &kinds(&backends))?);
        }
    }
    let offers: Vec<_> = entrants.iter().map(|entrant| entrant.offer(&backends)).collect();
    // The entrant of each backend's latest frame.
    let mut latest = vec![None; backends.len()];
    serve(&offers, io::stdin().lock(), io::stdout().lock(), |i| -> anyhow::Result<f64> {
        let Entrant { contestant, backend, .. } = &mut entrants[i];
        // Who asks counts the rounds: here every turn is timed.
        let turn = Turn { contestant: i, round: 1, again: latest[*backend].replace(i) == Some(i) };
        Ok(contestant.take(turn, backends[*backend].1.as_mut())?.ms)
    })
}
