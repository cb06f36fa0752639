//! The options of `compare --paper saladi`.

use brickfield::options::values;
use brickfield_core::BlockSide;
use clap::{Parser, ValueEnum};

use crate::paper::{PaperArgs, asked_parts};

/// Saladi, Pinnamaneni and Meyer 2003 on this project's data
///
/// Exit status: 0 done, 1 failed, 2 unusable arguments or no data, 3 a required backend is absent, 4 a claim was missed (--check).
#[derive(Parser, Clone, Debug)]
#[command(name = "compare --paper saladi")]
pub struct SaladiArgs {
    /// The options that papers share
    #[command(flatten)]
    pub common: PaperArgs,
    /// Parts to run; all by default
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_enum)]
    pub part: Vec<Part>,
    /// Voxels along a side of a flat block: 8, 16 or 32
    #[arg(long, value_name = "N", default_value = "16", value_parser = values::block_side)]
    pub blocks: BlockSide,
    /// Where objects begin, in percent of the range of values
    #[arg(long, value_name = "PERCENT", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..=95))]
    pub threshold: u32,
}

/// The parts of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Part {
    /// Figures 9 and 10: pictures on normals of every kind, and edits of the transfer function
    Normals,
    /// Tables 1 and 2: loading, processing without and with light, rendering by the number of slices
    Tables,
    /// Stores with level 0 as details, next to ordinary ones
    Stores,
    /// Bytes against error, in several orders
    Bytes,
    /// A store that is served over a slow link, and over one that fails
    Served,
}

impl Part {
    /// A heading.
    pub const fn title(self) -> &'static str {
        match self {
            Part::Normals => "Figures 9 and 10: normals of surface voxels",
            Part::Tables => "Tables 1 and 2: times by the number of slices",
            Part::Stores => "Stores: level 0 as details of level 1",
            Part::Bytes => "Progressive delivery: bytes against error",
            Part::Served => "Progressive delivery: over a slow link, and over one that fails",
        }
    }

    /// The volumes that it reads, as paths below the folder of real volumes.
    pub(super) const fn data(self) -> &'static [&'static str] {
        match self {
            Part::Normals | Part::Tables => &super::data::DATA,
            Part::Stores | Part::Bytes | Part::Served => &super::stores::DATA,
        }
    }
}

impl SaladiArgs {
    /// The parts to be run, each once.
    pub fn parts(&self) -> Vec<Part> {
        asked_parts(&self.part)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_come_once_in_their_order() {
        let parse = |words: &str| SaladiArgs::try_parse_from(words.split_whitespace());
        let of_the_paper = parse("compare --paper saladi").unwrap();
        assert_eq!((of_the_paper.parts().len(), of_the_paper.threshold), (Part::value_variants().len(), 30));
        let some = parse("compare --paper saladi --part tables,normals,tables --blocks 8").unwrap();
        assert_eq!((some.parts(), some.blocks), (vec![Part::Normals, Part::Tables], BlockSide::V8));
        assert!(parse("compare --paper saladi --threshold 0").is_err());
    }
}
