//! The options of `compare --paper tong`.

use brickfield::options::values;
use brickfield_core::BrickSide;
use clap::{Parser, ValueEnum};

use crate::paper::{PaperArgs, asked_parts};

/// Tong, Wang, Tsang and Tang 1999 on this project's data
///
/// Exit status: 0 done, 1 failed, 2 unusable arguments or no data, 3 a required backend is absent, 4 a claim was missed (--check).
#[derive(Parser, Clone, Debug)]
#[command(name = "compare --paper tong")]
pub struct TongArgs {
    /// The options that papers share
    #[command(flatten)]
    pub common: PaperArgs,
    /// Parts to run; all by default
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_enum)]
    pub part: Vec<Part>,
    /// Samples along a brick's side: 16, 32 or 64 (the paper's)
    #[arg(long, value_name = "N", default_value = "32", value_parser = values::brick_side)]
    pub side: BrickSide,
    /// Thresholds of the part `sweep`
    #[arg(long, default_value_t = 33, value_parser = clap::value_parser!(u32).range(2..=1000))]
    pub thresholds: u32,
    /// Voxels along a side of the generated volume of the part `batches`
    #[arg(long, default_value_t = 512, value_parser = clap::value_parser!(u32).range(32..=1024))]
    pub volume_side: u32,
    /// Of the part `memory`, one algorithm alone: in a process of its own
    #[arg(long, value_name = "ALGORITHM", hide = true)]
    pub memory_of: Option<String>,
}

/// The parts of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Part {
    /// Equation 1: the blocks of the paper's data sets
    Counts,
    /// Chunks and padding of trimmed bricks, before and after they are merged
    Merge,
    /// Table 1: algorithms I to IV and their alternatives
    Table,
    /// A threshold that runs over its range: bricks that change, time and bytes
    Sweep,
    /// Caches smaller than the bricks that a view shows
    Batches,
    /// Peaks of memory
    Memory,
}

impl Part {
    /// A heading.
    pub const fn title(self) -> &'static str {
        match self {
            Part::Counts => "Equation 1: blocks",
            Part::Merge => "Merging: chunks and padding",
            Part::Table => "Table 1: algorithms",
            Part::Sweep => "Edits of the threshold",
            Part::Batches => "Frames in batches",
            Part::Memory => "Memory",
        }
    }

    /// Whether it reads real volumes.
    pub(super) const fn needs_data(self) -> bool {
        !matches!(self, Part::Counts)
    }
}

impl TongArgs {
    /// The parts to be run, each once.
    pub fn parts(&self) -> Vec<Part> {
        asked_parts(&self.part)
    }
}
