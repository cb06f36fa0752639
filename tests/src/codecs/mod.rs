//! Codecs on this project's data.
//!
//! - `table`: ratios and speeds of brickfield-haar next to zstd, pco and standard codecs of pictures.
//! - `upload`: packed bricks, which the device unpacks, next to plain ones: bytes, times, equal pictures.

pub(crate) mod peers;
mod table;
mod upload;

use std::path::PathBuf;

use clap::{Parser, ValueEnum};

use crate::compare::rivals::RivalArgs;
use crate::paper::{Findings, PaperError, asked_parts, data_sets, print};

/// Codecs on this project's data
///
/// Exit status: 0 done, 1 failed, 2 unusable arguments or no data, 3 a required backend is absent, 4 pictures differ, or packed bricks are
/// larger than plain ones.
#[derive(Parser, Clone, Debug)]
#[command(name = "compare --codecs")]
pub struct CodecsArgs {
    /// Compare codecs
    #[arg(long, required = true)]
    pub codecs: bool,
    /// Parts to run; all by default
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_enum)]
    pub part: Vec<Part>,
    /// The folder of real volumes
    #[arg(long, env = "BRICKFIELD_DATA", value_name = "FOLDER")]
    pub data: Option<PathBuf>,
    /// Of the volumes, only those whose path contains this
    #[arg(long, value_name = "TEXT")]
    pub only: Option<String>,
    /// Rounds in which contestants take turns, after one that warms up. Fewer than 6 give no interval of 95 %
    #[arg(long, default_value_t = 6, value_parser = clap::value_parser!(u32).range(1..))]
    pub frames: u32,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub rivals: RivalArgs,
    /// Folder that receives the tables as JSON
    #[arg(long, value_name = "DIR", default_value = "target/codecs")]
    pub out: PathBuf,
}

/// The parts of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Part {
    /// Ratios and speeds, next to other codecs
    Table,
    /// Packed bricks that the device unpacks, next to plain ones
    Upload,
}

impl Part {
    /// A heading.
    pub const fn title(self) -> &'static str {
        match self {
            Part::Table => "Lossless ratios and speeds",
            Part::Upload => "Packed bricks, unpacked by the device",
        }
    }
}

impl CodecsArgs {
    /// The parts to be run, each once.
    pub fn parts(&self) -> Vec<Part> {
        asked_parts(&self.part)
    }

    /// The volumes that are asked for, of some paths below the folder of real volumes: their names, and their paths.
    fn volumes(&self, data: &[&str]) -> Result<Vec<(String, PathBuf)>, PaperError> {
        let wanted = data_sets(self.data.as_ref(), self.only.as_deref(), data)?;
        match wanted.iter().find(|(_, path)| !path.exists()) {
            Some((_, path)) => Err(PaperError::NoVolume { path: path.clone() }),
            None => Ok(wanted),
        }
    }
}

/// Runs the parts that `args` ask for, and prints their findings.
///
/// # Errors
/// Data or a folder that cannot be had, a scene that is refused, a backend that fails.
pub fn codecs(args: &CodecsArgs) -> Result<Findings, PaperError> {
    std::fs::create_dir_all(&args.out).map_err(|source| PaperError::Out { path: args.out.clone(), source })?;
    let mut rivals = args.rivals.open()?;
    let mut findings = Findings::default();
    for part in args.parts() {
        print(&format!("\n## {}\n", part.title()))?;
        findings.missed.extend(match part {
            Part::Table => table::run(args)?,
            Part::Upload => upload::run(args, &mut rivals)?,
        });
    }
    Ok(findings)
}
