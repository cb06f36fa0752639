//! `frames`: steady frames of a turning camera, and how long each part takes.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;

use brickfield_conformance::frames::{FramesArgs, FramesReport, frames, table};
use brickfield_conformance::report::absences;
use clap::Parser;

fn main() -> ExitCode {
    let args = FramesArgs::parse();
    // A file that cannot be written is known before, not after.
    if let Err(e) = make_folder(&args.out) {
        eprintln!("frames: --out {}: {e}", args.out.display());
        return ExitCode::from(2);
    }
    match frames(&args) {
        Ok(report) => match tell(&args.out, &report) {
            Ok(()) => ExitCode::SUCCESS,
            Err(e) => {
                eprintln!("frames: --out {}: {e}", args.out.display());
                ExitCode::FAILURE
            }
        },
        Err(e) => {
            eprintln!("frames: {}", e.to_string().split_whitespace().collect::<Vec<_>>().join(" "));
            ExitCode::from(e.status())
        }
    }
}

fn make_folder(out: &Path) -> std::io::Result<()> {
    out.parent().map_or(Ok(()), fs::create_dir_all)?;
    fs::OpenOptions::new().append(true).create(true).open(out).map(drop)
}

fn tell(out: &Path, report: &FramesReport) -> std::io::Result<()> {
    fs::write(out, serde_json::to_string_pretty(report)? + "\n")?;
    write!(std::io::stdout(), "{}{}", table(report), absences(&report.backends))
}
