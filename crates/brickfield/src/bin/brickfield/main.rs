//! The `brickfield` command: look at a volume file, render it, list the backends.

mod info;
mod render;

use std::path::PathBuf;
use std::process::ExitCode;

use brickfield::options::{InputOptions, SamplingOptions, TreeOptions, ViewOptions};
use brickfield::{BackendKind, BackendStatus, Validation, backends};
use clap::{Args, Parser, Subcommand};

/// Renders scalar volumes by multiresolution bricks, on the CPU, through wgpu and through raw Vulkan.
///
/// Exit status: 0 done, 1 failed (one line on standard error says why), 2 unusable arguments, 3 backend or adapter not
/// available.
#[derive(Parser)]
#[command(
    version,
    after_help = "Examples:
  brickfield info head.nrrd
  brickfield render head.nrrd -o head.png
  brickfield render dicom-folder/ -o head.exr --transfer ct-bone --camera \"front zoom=1.2\"
  brickfield render engine.vti -o inside.png --camera \"eye=80,100,60 target=200,128,60 up=0,0,1 fov=60\" --mode fast"
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Says what a volume file holds: dimensions, type, spacing, values, and what its bricks take
    Info(InfoArgs),
    /// Renders a picture of a volume file
    Render(Box<RenderArgs>),
    /// Lists the backends and their adapters, or why there are none
    Backends,
}

#[derive(Args)]
struct InfoArgs {
    /// Volume file or folder (NRRD, MetaImage, NIfTI, VTI, DICOM series, OME-Zarr, TIFF stack)
    file: PathBuf,
    #[command(flatten)]
    input: InputOptions,
    #[command(flatten)]
    tree: TreeOptions,
}

#[derive(Args)]
struct RenderArgs {
    /// Volume file or folder (NRRD, MetaImage, NIfTI, VTI, DICOM series, OME-Zarr, TIFF stack)
    file: PathBuf,
    /// Picture to write: .exr (linear, for measuring) or .png (sRGB, for looking)
    #[arg(short, long, value_name = "PICTURE")]
    out: PathBuf,
    /// auto (the first GPU, else the CPU; drivers in software are not GPUs), cpu, wgpu or ash
    #[arg(long, default_value = "auto")]
    backend: String,
    /// Adapter: its number or a part of its name, as `brickfield backends` lists them
    #[arg(long)]
    adapter: Option<String>,
    /// Check all calls by the driver's validation layer (ash); what it says is printed and fails the command
    #[arg(long)]
    validation: bool,
    #[command(flatten)]
    input: InputOptions,
    #[command(flatten)]
    tree: TreeOptions,
    #[command(flatten)]
    view: ViewOptions,
    #[command(flatten)]
    sampling: SamplingOptions,
}

/// Why the command failed, by exit status.
enum Failure {
    /// Status 3.
    Backend(brickfield::BackendError),
    /// Status 1: the picture was written, but the validation layer had something to say.
    Validation { n_messages: usize },
    /// Status 1.
    Other(Box<dyn std::error::Error>),
}

impl<E: std::error::Error + 'static> From<E> for Failure {
    fn from(e: E) -> Failure {
        Failure::Other(Box::new(e))
    }
}

fn main() -> ExitCode {
    let result = match Cli::parse().command {
        Command::Info(args) => info::run(&args),
        Command::Render(args) => render::run(&args),
        Command::Backends => {
            print_backends();
            Ok(())
        }
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failure::Backend(e)) => {
            eprintln!("brickfield: {e}");
            ExitCode::from(3)
        }
        Err(Failure::Validation { n_messages }) => {
            eprintln!("brickfield: {n_messages} messages from the validation layer");
            ExitCode::FAILURE
        }
        Err(Failure::Other(e)) => {
            eprintln!("brickfield: {}", one_line(&e.to_string()));
            ExitCode::FAILURE
        }
    }
}

fn one_line(message: &str) -> String {
    message.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn print_backends() {
    for status in brickfield::backends() {
        match status.adapters {
            Ok(adapters) => {
                for a in adapters {
                    println!("{:5} {}: {} ({})", status.kind.name(), a.index, a.name, a.driver);
                }
            }
            Err(reason) => println!("{:5} absent: {reason}", status.kind.name()),
        }
    }
}

impl RenderArgs {
    /// The backends to try, in order.
    fn candidates(&self) -> Result<Vec<BackendKind>, Failure> {
        if self.backend != "auto" {
            return Ok(vec![self.backend.parse().map_err(Failure::Backend)?]);
        }
        if self.adapter.is_some() || self.validation {
            return Ok(vec![BackendKind::Ash, BackendKind::Wgpu, BackendKind::Cpu]);
        }
        // A driver in software is slower than the CPU backend: it is for those who ask for it.
        let is_gpu = |status: &BackendStatus| matches!(&status.adapters, Ok(a) if a.iter().any(|a| !a.is_software));
        let mut kinds: Vec<_> = backends().iter().filter(|status| is_gpu(status)).map(|status| status.kind).collect();
        // `backends` lists ash last; here it comes first.
        kinds.reverse();
        kinds.push(BackendKind::Cpu);
        Ok(kinds)
    }

    fn validation(&self) -> Validation {
        if self.validation { Validation::On } else { Validation::Off }
    }
}
