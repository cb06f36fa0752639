//! The options of `compare --paper lamar`.

use std::path::PathBuf;

use brickfield::BackendKind;
use brickfield::lod::Criterion;
use brickfield::options::values;
use brickfield_core::BrickSide;
use brickfield_core::glam::UVec2;
use clap::{Parser, ValueEnum};

/// LaMar, Hamann and Joy 1999 on this project's data
///
/// Exit status: 0 done, 1 failed, 2 unusable arguments or no data, 3 a required backend is absent, 4 a claim was missed (--check).
#[derive(Parser, Clone, Debug)]
#[command(name = "compare --paper lamar")]
pub struct LamarArgs {
    /// The paper
    #[arg(long, value_enum)]
    pub paper: Paper,
    /// Parts to run; all parts of the paper (everything but views) by default
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_enum)]
    pub part: Vec<Part>,
    /// Volume files or folders, in any format that `brickfield render` reads, instead of the three data sets
    #[arg(value_name = "FILE", conflicts_with = "only")]
    pub files: Vec<PathBuf>,
    /// The folder of real volumes
    #[arg(long, env = "BRICKFIELD_DATA", value_name = "FOLDER")]
    pub data: Option<PathBuf>,
    /// Of the three data sets, only those whose path contains this
    #[arg(long, value_name = "TEXT")]
    pub only: Option<String>,
    /// Only bricks of so many samples a side
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::brick_side)]
    pub sides: Vec<BrickSide>,
    /// Which bricks multiresolution draws, as `brickfield render --lod`. The paper's factor is 1; at that, bricks of 64 in
    /// 256^3 voxels are all of level 0 when seen from inside
    #[arg(long = "lod", value_name = "LIST", value_delimiter = ',', value_parser = values::criterion, default_value = "distance=0.5")]
    pub detail: Vec<Criterion>,
    /// Size of the pictures in pixels
    #[arg(long, value_name = "WxH", value_parser = values::size, default_value = "192x192")]
    pub size: UVec2,
    /// Distance between samples of level 0, in units of the least voxel spacing
    #[arg(long, value_parser = values::step, default_value = "1")]
    pub step: f64,
    /// Pixels along a side of the facets of shells
    #[arg(long, default_value_t = 32, value_parser = clap::value_parser!(u32).range(1..=i64::from(brickfield::frame::Placement::MOST_FACET_PIXELS)))]
    pub facet_pixels: u32,
    /// Rounds in which contestants take turns, after one that warms up. Fewer than 6 give no interval of 95 %
    #[arg(long, default_value_t = 6, value_parser = clap::value_parser!(u32).range(1..))]
    pub frames: u32,
    /// Backends to compare
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "cpu,wgpu,ash")]
    pub backends: Vec<BackendKind>,
    /// Adapter of wgpu and ash: its number or a part of its name, as `brickfield backends` lists them
    #[arg(long)]
    pub adapter: Option<String>,
    /// Backends without which the comparison fails (status 3)
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub require: Vec<BackendKind>,
    /// Fail (status 4) if a claim does not hold: about pictures, about times (a median ratio above 1), or both
    #[arg(long, value_enum, value_name = "CLAIMS", value_delimiter = ',', require_equals = true, num_args = 0.., default_missing_values = ["pictures", "times"])]
    pub check: Vec<ClaimKind>,
    /// Folder that receives tables as JSON, and pictures
    #[arg(long, value_name = "DIR", default_value = "target/lamar")]
    pub out: PathBuf,
    /// Views of the part `views`
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=200))]
    pub views: u32,
    /// Voxels along a side of the volume of the part `views`
    #[arg(long, default_value_t = 512, value_parser = clap::value_parser!(u32).range(32..=1024))]
    pub volume_side: u32,
}

/// The papers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Paper {
    /// LaMar, Hamann and Joy 1999: multiresolution techniques for interactive texture-based volume visualization.
    Lamar,
}

/// The subject of a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ClaimKind {
    /// Pictures and cuts: the same on every machine.
    Pictures,
    /// Times: which is faster.
    Times,
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
    /// The parts to be run, each once.
    pub fn parts(&self) -> Vec<Part> {
        let all = Part::value_variants().iter().copied();
        match self.part.is_empty() {
            true => all.filter(|part| *part != Part::Views).collect(),
            false => all.filter(|part| self.part.contains(part)).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_come_once_in_their_order() {
        let parse = |words: &str| LamarArgs::try_parse_from(words.split_whitespace()).unwrap();
        let of_the_paper = parse("compare --paper lamar");
        assert_eq!(of_the_paper.parts().len(), Part::value_variants().len() - 1);
        assert!(!of_the_paper.parts().contains(&Part::Views) && of_the_paper.check.is_empty());
        assert_eq!(parse("compare --paper lamar --check --frames 1").check, [ClaimKind::Pictures, ClaimKind::Times]);
        assert_eq!(parse("compare --paper lamar --check=pictures").check, [ClaimKind::Pictures]);
        assert_eq!(parse("compare a.nrrd --paper lamar b.vti").files.len(), 2);
        assert!(LamarArgs::try_parse_from("compare --paper lamar a.nrrd --only engine".split_whitespace()).is_err());
        let some = parse("compare --paper lamar --part views,seams,views");
        assert_eq!(some.parts(), [Part::Seams, Part::Views]);
        assert_eq!((some.size, some.views, some.volume_side), (UVec2::splat(192), 20, 512));
    }
}
