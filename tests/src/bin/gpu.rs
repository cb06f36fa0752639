//! Measures a GPU, alone: needs a driver and no other file.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context;
use brickfield_conformance::gpu::{Form, GpuArgs, GpuReport, measure, table};
use clap::Parser;

/// Measures a GPU: conformance, the error of fast mode, contestants by turns, steady frames, texture reads; into one JSON file
///
/// Needs a Vulkan driver, and neither cargo nor another file. What finds no time or memory is left out and listed in the JSON.
/// Exit codes: 0 good, 1 something is wrong (the JSON's `failures` say what), 2 bad arguments, 3 a backend is absent.
#[derive(Parser)]
struct Arguments {
    /// Write the measurement to this file
    #[arg(long, value_name = "FILE", default_value = "gpu.json")]
    out: PathBuf,
    /// Little of everything, for a software driver
    #[arg(long)]
    short: bool,
    /// About so many seconds; 450, or 60 for the short form
    #[arg(long, value_name = "N", value_parser = seconds)]
    seconds: Option<f64>,
    /// A part of the adapter's name, or its number
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// The folder of real volumes, for contestants; conformance looks where BRICKFIELD_DATA says
    #[arg(long, env = "BRICKFIELD_DATA", value_name = "DIR")]
    data: Option<PathBuf>,
    /// The commit that the report names, where git does not tell
    #[arg(long, env = "BRICKFIELD_COMMIT", value_name = "TEXT")]
    commit: Option<String>,
    /// Measure nothing: print these reports as the table of README.md
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with_all = ["short", "seconds"])]
    table: Vec<PathBuf>,
}

fn main() -> anyhow::Result<ExitCode> {
    let options = Arguments::parse();
    if !options.table.is_empty() {
        let reports = options.table.iter().map(|file| read(file)).collect::<anyhow::Result<Vec<_>>>()?;
        write!(std::io::stdout(), "{}", table(&reports))?;
        return Ok(ExitCode::SUCCESS);
    }
    // A file that cannot be written is known before, not after.
    if let Some(folder) = options.out.parent() {
        fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    }
    fs::write(&options.out, "").with_context(|| format!("cannot write {}", options.out.display()))?;
    let form = if options.short { Form::Short } else { Form::Long };
    let args = GpuArgs {
        form,
        seconds: options.seconds.unwrap_or(form.seconds()),
        adapter: options.adapter,
        data: options.data,
        commit: options.commit,
        pictures: options.out.with_extension("failures"),
    };
    let report = measure(&args, &mut |line| eprintln!("gpu: {line}"));
    fs::write(&options.out, serde_json::to_string_pretty(&report)? + "\n")
        .with_context(|| format!("cannot write {}", options.out.display()))?;
    report.failures.iter().for_each(|failure| eprintln!("gpu: WRONG: {failure}"));
    eprintln!("gpu: {} ({:.0} s)", options.out.display(), report.seconds);
    Ok(status(&report))
}

fn status(report: &GpuReport) -> ExitCode {
    match (report.failures.is_empty(), report.devices.iter().all(|d| d.absent.is_none())) {
        (false, _) => ExitCode::FAILURE,
        (true, false) => ExitCode::from(3),
        (true, true) => ExitCode::SUCCESS,
    }
}

fn read(file: &Path) -> anyhow::Result<GpuReport> {
    let text = fs::read_to_string(file).with_context(|| format!("cannot read {}", file.display()))?;
    GpuReport::parse(&text).map_err(|e| anyhow::anyhow!("{}: {e}", file.display()))
}

fn seconds(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|e| format!("{e}"))?;
    match seconds.is_finite() && seconds > 0.0 {
        true => Ok(seconds),
        false => Err("it must be finite and above 0".to_owned()),
    }
}
