//! The options of `compare --paper ljung`.

use std::path::PathBuf;

use brickfield::options::values;
use brickfield_core::BlockSide;
use brickfield_core::glam::UVec3;
use clap::{Parser, ValueEnum};

use crate::paper::{PaperArgs, asked_parts};

/// Ljung, Lundstroem and Ynnerman 2006 on this project's data
///
/// Exit status: 0 done, 1 failed, 2 unusable arguments or no data, 3 a required backend is absent, 4 a claim was missed (--check).
#[derive(Parser, Clone, Debug)]
#[command(name = "compare --paper ljung")]
pub struct LjungArgs {
    /// The options that papers share
    #[command(flatten)]
    pub common: PaperArgs,
    /// Parts to run; all by default
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_enum)]
    pub part: Vec<Part>,
    /// Voxels along a block's side: 8, 16 or 32
    #[arg(long, value_name = "N", default_value = "16", value_parser = values::block_side)]
    pub blocks: BlockSide,
    /// Budgets of the table: how many times as many bytes the volume has
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "8,32,143")]
    pub ratios: Vec<f64>,
    /// One more budget, in MiB
    #[arg(long, value_name = "MIB", default_value_t = 4.0)]
    pub budget_mib: f64,
    /// Seeds of random resolutions
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub seeds: u32,
    /// Voxels along a side of the generated volume
    #[arg(long, default_value_t = 512, value_parser = clap::value_parser!(u32).range(32..=1024))]
    pub volume_side: u32,
    /// An OME-Zarr for the part `store`, instead of a generated one in the output folder
    #[arg(long, value_name = "STORE")]
    pub store: Option<PathBuf>,
    /// Voxels of the generated store along x, y, z
    #[arg(long, value_name = "NXxNYxNZ", default_value = "1024x1024x2048", value_parser = dims)]
    pub store_dims: UVec3,
    /// What the voxels of the store may take on the host, and on the device, in MiB
    #[arg(long, value_name = "MIB", default_value_t = 256, value_parser = clap::value_parser!(u64).range(1..1 << 20))]
    pub store_mib: u64,
}

/// The parts of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Part {
    /// Figure 7: a rotated linear gradient in blocks of random resolution
    Gradient,
    /// Figures 4 and 5: weights, read back from each backend
    Weights,
    /// Jumps on faces, edges and corners of blocks
    Continuity,
    /// A ball in the light, whose normals are known
    Light,
    /// Figure 9: the bytes of blocks at given levels
    Accounting,
    /// Error against the full resolution, time and bytes, at several budgets
    Table,
    /// Schemes against the nearest block: time
    Cost,
    /// The estimated error of blocks against the exact one
    Rank,
    /// Levels after an edit of the transfer function: time and bytes
    Reselect,
    /// Classification of averages against prefiltered classification: error and bytes
    Classify,
    /// A store larger than its budget: memory, bytes and error
    Store,
    /// Pictures of each volume, with and without interpolation between blocks
    Figures,
}

impl Part {
    /// A heading.
    pub const fn title(self) -> &'static str {
        match self {
            Part::Gradient => "Figure 7: a rotated linear gradient",
            Part::Weights => "Figures 4 and 5: weights",
            Part::Continuity => "Continuity, and equal resolutions",
            Part::Light => "A ball in the light",
            Part::Accounting => "Figure 9: bytes",
            Part::Table => "Error, time and bytes",
            Part::Cost => "Cost of interpolation between blocks",
            Part::Rank => "Estimated and exact error of blocks",
            Part::Reselect => "Reselection after an edit of the transfer function",
            Part::Classify => "Prefiltered classification",
            Part::Store => "A store larger than its budget",
            Part::Figures => "Pictures",
        }
    }

    /// Whether it reads real volumes.
    pub(super) const fn needs_data(self) -> bool {
        matches!(self, Part::Table | Part::Cost | Part::Rank | Part::Classify | Part::Figures)
    }
}

impl LjungArgs {
    /// The parts to be run, each once.
    pub fn parts(&self) -> Vec<Part> {
        asked_parts(&self.part)
    }
}

/// Three numbers of voxels.
fn dims(text: &str) -> Result<UVec3, String> {
    let spec = values::raw_spec(&format!("{text},u8")).map_err(|e| e.to_string())?;
    Ok(spec.dims)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_come_once_in_their_order() {
        let parse = |words: &str| LjungArgs::try_parse_from(words.split_whitespace());
        let of_the_paper = parse("compare --paper ljung").unwrap();
        assert_eq!((of_the_paper.parts().len(), of_the_paper.seeds), (Part::value_variants().len(), 100));
        assert_eq!((of_the_paper.blocks, of_the_paper.ratios), (BlockSide::V16, vec![8.0, 32.0, 143.0]));
        let some = parse("compare --paper ljung --part cost,gradient,cost --blocks 8").unwrap();
        assert_eq!((some.parts(), some.blocks), (vec![Part::Gradient, Part::Cost], BlockSide::V8));
        assert!(parse("compare --paper ljung --blocks 12").is_err());
    }
}
