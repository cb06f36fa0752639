//! What the comparisons of papers share: options, claims that are missed, lines and rows.

mod error;
pub(crate) mod panels;
mod subject;

use std::path::{Path, PathBuf};

use brickfield::frame::{Backend, Content, Frame, FramePlan, Resource};
use brickfield::options::values;
use brickfield::{write_exr, write_png};
use brickfield_core::Image;
use brickfield_core::glam::UVec2;
use clap::{Args, ValueEnum};

pub use error::PaperError;
pub(crate) use subject::Subject;

use crate::compare::rivals::{RivalArgs, Rivals};
use crate::compare::say;
use crate::turns::Claim;

/// The options that papers share.
#[derive(Args, Clone, Debug)]
pub struct PaperArgs {
    /// The paper
    #[arg(long, value_enum)]
    pub paper: Paper,
    /// Volume files or folders, in any format that `brickfield render` reads, instead of the paper's data sets
    #[arg(value_name = "FILE", conflicts_with = "only")]
    pub files: Vec<PathBuf>,
    /// The folder of real volumes
    #[arg(long, env = "BRICKFIELD_DATA", value_name = "FOLDER")]
    pub data: Option<PathBuf>,
    /// Of the paper's data sets, only those whose path contains this
    #[arg(long, value_name = "TEXT")]
    pub only: Option<String>,
    /// Size of the pictures in pixels
    #[arg(long, value_name = "WxH", value_parser = values::size, default_value = "192x192")]
    pub size: UVec2,
    /// Distance between samples of level 0, in units of the least voxel spacing
    #[arg(long, value_parser = values::step, default_value = "1")]
    pub step: f64,
    /// Rounds in which contestants take turns, after one that warms up. Fewer than 6 give no interval of 95 %
    #[arg(long, default_value_t = 6, value_parser = clap::value_parser!(u32).range(1..))]
    pub frames: u32,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub rivals: RivalArgs,
    /// Fail (status 4) if a claim does not hold: about pictures, about times (a median ratio above 1), or both
    #[arg(long, value_enum, value_name = "CLAIMS", value_delimiter = ',', require_equals = true, num_args = 0.., default_missing_values = ["pictures", "times"])]
    pub check: Vec<ClaimKind>,
    /// Folder that receives tables as JSON, and pictures
    #[arg(long, value_name = "DIR", default_value = "target/paper")]
    pub out: PathBuf,
}

/// The papers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Paper {
    /// LaMar, Hamann and Joy 1999: multiresolution techniques for interactive texture-based volume visualization.
    Lamar,
    /// Ljung, Lundstroem and Ynnerman 2006: multiresolution interblock interpolation in direct volume rendering.
    Ljung,
    /// Saladi, Pinnamaneni and Meyer 2003: wavelets and textures with illumination for web-based volume rendering.
    Saladi,
    /// Tong, Wang, Tsang and Tang 1999: efficiently rendering large volume data using texture mapping hardware.
    Tong,
    /// Wynn, Barnes, Hamann and Miller 1999: multiresolution and adaptive rendering techniques for structured, curvilinear data.
    Wynn,
}

/// The subject of a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ClaimKind {
    /// Pictures and cuts: the same on every machine.
    Pictures,
    /// Times: which is faster.
    Times,
}

/// The findings of the parts that were asked for.
#[derive(Clone, Debug, Default)]
pub struct Findings {
    /// Claims that do not hold.
    pub missed: Vec<Missed>,
}

/// A claim that does not hold.
#[derive(Clone, Debug)]
pub struct Missed {
    /// Its subject.
    pub kind: ClaimKind,
    /// The claim and the finding, in words.
    pub what: String,
}

impl PaperArgs {
    /// Runs the parts of a paper, each under its heading, and prints their findings.
    pub(crate) fn run<P: Copy>(
        &self,
        parts: Vec<P>,
        title: impl Fn(P) -> &'static str,
        mut run: impl FnMut(P, &mut Rivals) -> Result<Vec<Missed>, PaperError>,
    ) -> Result<Findings, PaperError> {
        let mut rivals = self.begin()?;
        let mut findings = Findings::default();
        for part in parts {
            print(&format!("\n## {}\n", title(part)))?;
            findings.missed.extend(run(part, &mut rivals)?);
        }
        findings.print()?;
        Ok(findings)
    }

    /// Makes the output folder, opens the backends and says which there are.
    fn begin(&self) -> Result<Rivals, PaperError> {
        std::fs::create_dir_all(&self.out).map_err(|source| PaperError::Out { path: self.out.clone(), source })?;
        let rivals = self.rivals.open()?;
        for info in &rivals.infos {
            let state = match (&info.adapter, &info.absent) {
                (Some(adapter), _) => format!("{adapter}, {}", info.driver.as_deref().unwrap_or_default()),
                (None, reason) => format!("absent: {}", reason.as_deref().unwrap_or_default()),
            };
            print(&format!("{}: {state}", info.backend))?;
        }
        Ok(rivals)
    }

    /// Whether the data that parts need are there, of some data sets below the folder of real volumes, and the text of `--only` is in
    /// one of their paths.
    pub(crate) fn check_data(&self, data: &[&str], is_needed: bool) -> Result<(), PaperError> {
        let are_named = self.only.is_some() || !self.files.is_empty();
        if !are_named && !is_needed {
            return Ok(());
        }
        match self.named(data)?.into_iter().find(|(_, path)| !path.exists()) {
            Some((_, path)) => Err(PaperError::NoVolume { path }),
            None => Ok(()),
        }
    }

    /// The volumes that are asked for: their names in the tables, and their paths.
    pub(crate) fn named(&self, data: &[&str]) -> Result<Vec<(String, PathBuf)>, PaperError> {
        if !self.files.is_empty() {
            let name = |path: &PathBuf| path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
            return Ok(self.files.iter().map(|path| (name(path), path.clone())).collect());
        }
        data_sets(self.data.as_ref(), self.only.as_deref(), data)
    }

    /// Rows as a JSON file of the output folder.
    pub(crate) fn write_rows<R: serde::Serialize>(&self, name: &str, rows: &[R]) -> Result<(), PaperError> {
        write_rows(&self.out.join(name), rows)
    }
}

/// The parts that are asked for, each once and in their order; all if none is.
pub(crate) fn asked_parts<P: ValueEnum + PartialEq>(asked: &[P]) -> Vec<P> {
    P::value_variants().iter().filter(|part| asked.is_empty() || asked.contains(part)).cloned().collect()
}

/// The data sets below a folder of which the path has a text: their names in the tables, and their paths.
pub(crate) fn data_sets(
    folder: Option<&PathBuf>,
    only: Option<&str>,
    data: &[&str],
) -> Result<Vec<(String, PathBuf)>, PaperError> {
    let folder = folder.ok_or(PaperError::NoData)?;
    if !folder.is_dir() {
        return Err(PaperError::NoFolder { path: folder.clone() });
    }
    let wanted = |path: &&&str| only.is_none_or(|text| path.contains(text));
    let sets: Vec<_> = data.iter().filter(wanted).map(|path| ((*path).to_owned(), folder.join(path))).collect();
    match sets.is_empty() {
        true => Err(PaperError::NoSuchData { only: only.unwrap_or_default().to_owned(), known: data.join(", ") }),
        false => Ok(sets),
    }
}

/// Rows as a JSON file.
pub(crate) fn write_rows<R: serde::Serialize>(path: &Path, rows: &[R]) -> Result<(), PaperError> {
    let json = serde_json::to_string_pretty(rows).expect("rows are plain data");
    std::fs::write(path, json).map_err(|source| PaperError::Out { path: path.to_owned(), source })
}

/// Behind transparent pixels.
const BACKGROUND: [f64; 3] = [0.02, 0.02, 0.025];

impl PaperArgs {
    /// A picture in the output folder, for measuring and for looking; its place is printed.
    pub(crate) fn write_picture(&self, name: &str, image: &Image<f32>, what: &str) -> Result<(), PaperError> {
        write_exr(&self.out.join(format!("{name}.exr")), image, &[("figure", what.to_owned())])?;
        let path = self.out.join(format!("{name}.png"));
        write_png(&path, image, BACKGROUND)?;
        print(&format!("{}: {what}", path.display()))
    }
}

impl Findings {
    /// The last line.
    fn print(&self) -> Result<(), PaperError> {
        print(&match self.missed.len() {
            0 => "\nEverything that is claimed of these parts holds.".to_owned(),
            n => format!("\nOf what is claimed, {n} does not hold."),
        })
    }
}

impl Missed {
    pub(crate) fn of_pictures(what: String) -> Missed {
        Missed { kind: ClaimKind::Pictures, what }
    }

    pub(crate) fn of_times(what: String) -> Missed {
        Missed { kind: ClaimKind::Times, what }
    }

    /// A claim about times, if it is missed.
    pub(crate) fn of_claim(claim: &Claim) -> Option<Missed> {
        (!claim.kept).then(|| Missed::of_times(claim.to_string()))
    }
}

/// A frame of a backend.
pub(crate) fn frame_of(backend: &mut dyn Backend, plan: &FramePlan) -> Result<Frame, PaperError> {
    let name = backend.describe().backend;
    backend.render(plan).map_err(|source| PaperError::Render { backend: name, source })
}

/// Bytes of everything that a plan brings to a device.
pub(crate) fn device_bytes(plan: &FramePlan) -> u64 {
    let of = |resource: Resource| match plan.content(resource) {
        Some(Content::Bytes(bytes)) => bytes.len() as u64,
        Some(Content::Chunks(chunks)) => chunks.n_bytes(),
        Some(Content::Texture(slots)) => {
            let room = slots.room(None, MOST_TEXELS).expect("a texture that backends take");
            room.shape.texels().as_u64vec3().element_product() * slots.format().n_bytes() as u64
        }
        None => 0,
    };
    Resource::ALL.into_iter().map(of).sum()
}

/// Texels along a side of a texture: every Vulkan device takes so many.
const MOST_TEXELS: u32 = 2048;

/// A line on standard output.
pub(crate) fn print(line: &str) -> Result<(), PaperError> {
    say(&format!("{line}\n")).map_err(PaperError::Print)
}

pub(crate) fn mib(bytes: u64) -> f64 {
    bytes as f64 / f64::from(1 << 20)
}
