//! The options of `compare --paper lamar`.

use brickfield::lod::Criterion;
use brickfield::options::values;
use brickfield_core::BrickSide;
use clap::{Parser, ValueEnum};

use crate::paper::{PaperArgs, asked_parts};

/// LaMar, Hamann and Joy 1999 on this project's data
///
/// Exit status: 0 done, 1 failed, 2 unusable arguments or no data, 3 a required backend is absent, 4 a claim was missed (--check).
#[derive(Parser, Clone, Debug)]
#[command(name = "compare --paper lamar")]
pub struct LamarArgs {
    /// The options that papers share
    #[command(flatten)]
    pub common: PaperArgs,
    /// Parts to run; all parts of the paper (everything but views) by default
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_enum)]
    pub part: Vec<Part>,
    /// Only bricks of so many samples a side
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::brick_side)]
    pub sides: Vec<BrickSide>,
    /// Which bricks multiresolution draws, as `brickfield render --lod`. The paper's factor is 1; at that, bricks of 64 in
    /// 256^3 voxels are all of level 0 when seen from inside
    #[arg(long = "lod", value_name = "LIST", value_delimiter = ',', value_parser = values::criterion, default_value = "distance=0.5")]
    pub detail: Vec<Criterion>,
    /// Pixels along a side of the facets of shells
    #[arg(long, default_value_t = 32, value_parser = clap::value_parser!(u32).range(1..=i64::from(brickfield::frame::Placement::MOST_FACET_PIXELS)))]
    pub facet_pixels: u32,
    /// Views of the part `views`
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=200))]
    pub views: u32,
    /// Voxels along a side of the volume of the part `views`
    #[arg(long, default_value_t = 512, value_parser = clap::value_parser!(u32).range(32..=1024))]
    pub volume_side: u32,
}

/// The parts of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Part {
    /// Figures 4 and 5: how many tiles the distance filter selects
    Selection,
    /// Table 1: fixed tiles against multiresolution, time and error
    Table,
    /// Section 3.1: subsampling against averaging
    Downsampling,
    /// Section 3.1: the formula for shared voxels against the stored ones
    Memory,
    /// Figure 8 in numbers: a constant field at random cuts, with and without opacity correction
    Seams,
    /// Tessellated shells against spheres: the order of convergence
    Shells,
    /// Figures 8 and 14 as pictures
    Figures,
    /// A screen-space error of one pixel over views of a generated volume
    Views,
}

impl Part {
    /// A heading.
    pub const fn title(self) -> &'static str {
        match self {
            Part::Selection => "Figures 4 and 5: selection",
            Part::Table => "Table 1: fixed tiles against multiresolution",
            Part::Downsampling => "Downsampling: subsampling against averaging",
            Part::Memory => "Memory: shared voxels by the formula, and what is stored",
            Part::Seams => "A constant field: seams, and light without opacity correction (figure 8)",
            Part::Shells => "Tessellated shells against spheres",
            Part::Figures => "Figures 8 and 14",
            Part::Views => "A screen-space error of one pixel",
        }
    }
}

impl Part {
    /// Whether it reads real volumes.
    pub(super) const fn needs_data(self) -> bool {
        matches!(self, Part::Table | Part::Downsampling | Part::Memory | Part::Figures)
    }
}

impl LamarArgs {
    /// The same with some of the options that papers share changed.
    pub(super) fn with(&self, change: impl FnOnce(&mut PaperArgs)) -> LamarArgs {
        let mut args = self.clone();
        change(&mut args.common);
        args
    }

    /// The parts to be run, each once.
    pub fn parts(&self) -> Vec<Part> {
        let parts = asked_parts(&self.part).into_iter();
        parts.filter(|part| !self.part.is_empty() || *part != Part::Views).collect()
    }
}

#[cfg(test)]
mod tests {
    use brickfield_core::glam::UVec2;

    use super::*;
    use crate::paper::ClaimKind;

    #[test]
    fn parts_come_once_in_their_order() {
        let parse = |words: &str| LamarArgs::try_parse_from(words.split_whitespace()).unwrap();
        let of_the_paper = parse("compare --paper lamar");
        assert_eq!(of_the_paper.parts().len(), Part::value_variants().len() - 1);
        assert!(!of_the_paper.parts().contains(&Part::Views) && of_the_paper.common.check.is_empty());
        assert_eq!(
            parse("compare --paper lamar --check --frames 1").common.check,
            [ClaimKind::Pictures, ClaimKind::Times]
        );
        assert_eq!(parse("compare --paper lamar --check=pictures").common.check, [ClaimKind::Pictures]);
        assert_eq!(parse("compare a.nrrd --paper lamar b.vti").common.files.len(), 2);
        assert!(LamarArgs::try_parse_from("compare --paper lamar a.nrrd --only engine".split_whitespace()).is_err());
        let some = parse("compare --paper lamar --part views,seams,views");
        assert_eq!(some.parts(), [Part::Seams, Part::Views]);
        assert_eq!((some.common.size, some.views, some.volume_side), (UVec2::splat(192), 20, 512));
    }
}
