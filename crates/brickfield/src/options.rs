//! The options that the `brickfield` command shares with the conformance runs.

use std::path::{Path, PathBuf};

use brickfield_bricks::{BrickTree, BuildOptions, Downsampling, build_tree_observed};
use brickfield_core::glam::{DVec3, UVec2};
use brickfield_core::{Aabb, BrickSide, Level, LinearRgb, ScalarType, TransferFunction, Volume};
use brickfield_frame::Mode;
use brickfield_io::{ByteOrder, Limits, Opened, RawSpec, WorldFrame};
use brickfield_lod::Criterion;
use brickfield_optics::QuadratureRule;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};

use crate::{Scene, Skipping, Viewpoint};

/// How a file is read.
#[derive(Args, Clone, Debug)]
pub struct InputOptions {
    /// Most bytes that the voxels may take, in MiB
    #[arg(long, value_name = "MIB", default_value_t = Limits::default().max_bytes >> 20)]
    pub max_mib: u64,
    /// Read FILE as raw voxels: `NXxNYxNZ,TYPE` with TYPE u8 to f64; then, each if needed, `,big` `,skip=BYTES`
    /// `,spacing=SX:SY:SZ`
    #[arg(long, value_name = "SPEC", value_parser = raw_spec)]
    pub raw: Option<RawSpec>,
}

/// How the octree is built.
#[derive(Args, Clone, Debug)]
pub struct TreeOptions {
    /// Samples along a brick's side: 16, 32 or 64
    #[arg(long, value_name = "N", default_value = "32", value_parser = brick_side)]
    pub brick: BrickSide,
    /// How coarser levels come about: subsample (sharper) or average (no aliasing)
    #[arg(long, value_name = "HOW", default_value = "subsample", value_parser = downsampling)]
    pub downsampling: Downsampling,
}

/// What of a volume is shown, and how.
#[derive(Args, Clone, Debug)]
pub struct ViewOptions {
    /// Size of the picture in pixels
    #[arg(long, value_name = "WxH", default_value = "512x512", value_parser = size)]
    pub size: UVec2,
    /// Where the picture is taken from: oblique, front, back, left, right, top, bottom, and/or fields:
    /// from=X,Y,Z eye=X,Y,Z target=X,Y,Z up=X,Y,Z (world units), fov=DEGREES or height=UNITS (orthographic), zoom=FACTOR
    #[arg(long, value_name = "VIEW", default_value = "oblique")]
    pub camera: Viewpoint,
    /// Transfer function: "auto" (from the histogram), a preset's name, or a JSON or TOML file
    #[arg(long, value_name = "TF", default_value = "auto")]
    pub transfer: String,
    /// Which resolution: "full", a level (0 is the finest), or "distance[=FACTOR]" (finer the nearer)
    #[arg(long, value_name = "LOD", default_value = "full", value_parser = detail)]
    pub lod: Criterion,
    /// Show only a part, in voxels: X0:X1,Y0:Y1,Z0:Z1
    #[arg(long, value_name = "BOX", value_parser = clip)]
    pub clip: Option<Aabb>,
    /// Background behind the picture in PNG files, linear: R,G,B or one number for grey
    #[arg(long, value_name = "RGB", default_value = "0", value_parser = background)]
    pub background: Background,
}

/// A linear background colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Background(pub LinearRgb);

/// How rays are sampled.
#[derive(Args, Clone, Debug)]
pub struct SamplingOptions {
    /// exact (f32 arithmetic, held to the reference) or fast (hardware filter, early end of rays)
    #[arg(long, default_value = "exact", value_parser = mode)]
    pub mode: Mode,
    /// Distance between samples, in units of the least voxel spacing
    #[arg(long, value_name = "VOXELS", default_value_t = 0.5)]
    pub step: f64,
    /// Quadrature rule: left-riemann, left-exponential, midpoint, pre-integrated or gauss2
    #[arg(long, default_value = "midpoint", value_parser = rule)]
    pub rule: QuadratureRule,
    /// Upload and sample transparent bricks too (to measure what leaving them out saves)
    #[arg(long)]
    pub no_skip: bool,
}

/// A volume that is ready to be rendered.
#[derive(Debug)]
pub struct Subject {
    /// What is known of the world's axes.
    pub frame: WorldFrame,
    /// The volume at all resolutions.
    pub tree: BrickTree,
    /// The transfer function that was asked for.
    pub transfer: TransferFunction,
}

/// Why options cannot be met.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum OptionError {
    #[error(transparent)]
    Open(#[from] brickfield_io::OpenError),
    #[error(transparent)]
    Build(#[from] brickfield_bricks::BuildError),
    #[error("--transfer: {0}")]
    Preset(#[from] brickfield_core::TransferError),
    #[error("--transfer: {0}")]
    Transfer(#[from] brickfield_optics::ReadTransferError),
    #[error("--transfer {name:?} is neither auto, nor a file, nor a preset; the presets are {presets}")]
    NoSuchTransfer { name: String, presets: String },
    #[error(transparent)]
    Camera(#[from] brickfield_core::CameraError),
}

impl InputOptions {
    /// Opens a volume, with a progress display on the terminal.
    ///
    /// # Errors
    /// What the reader says.
    pub fn open(&self, path: &Path) -> Result<Opened, OptionError> {
        let bar = spinner(format!("reading {}", path.display()));
        let limits = Limits { max_bytes: self.max_mib.saturating_mul(1 << 20) };
        let opened = match &self.raw {
            Some(raw) => brickfield_io::open_raw(path, raw, &limits),
            None => brickfield_io::open(path, &limits),
        };
        bar.finish_and_clear();
        Ok(opened?)
    }
}

impl TreeOptions {
    /// Builds the octree, with a progress bar on the terminal.
    ///
    /// # Errors
    /// What the builder says.
    pub fn build(&self, volume: &Volume) -> Result<BrickTree, OptionError> {
        let options = BuildOptions { side: self.brick, downsampling: self.downsampling, ..BuildOptions::default() };
        let bar = progress_bar("building bricks");
        let tree = build_tree_observed(volume, &options, &|p| {
            bar.set_length(p.n_total as u64);
            bar.inc(1);
        });
        bar.finish_and_clear();
        Ok(tree?)
    }
}

impl ViewOptions {
    /// The transfer function that is asked for.
    ///
    /// # Errors
    /// An unknown name, or what is wrong in the file.
    pub fn transfer(&self, volume: &Volume) -> Result<TransferFunction, OptionError> {
        if self.transfer == "auto" {
            return Ok(brickfield_optics::automatic(volume));
        }
        if let Some(preset) = brickfield_optics::Preset::from_name(&self.transfer) {
            return Ok(preset.for_volume(volume)?);
        }
        let path = PathBuf::from(&self.transfer);
        if path.exists() {
            return Ok(brickfield_optics::read_transfer(&path)?);
        }
        let presets = brickfield_optics::Preset::ALL.map(|p| p.name()).join(", ");
        Err(OptionError::NoSuchTransfer { name: self.transfer.clone(), presets })
    }

    /// The scene of a volume.
    ///
    /// # Errors
    /// What the camera refuses.
    pub fn scene(&self, subject: &Subject, sampling: &SamplingOptions) -> Result<Scene, OptionError> {
        let camera = self.camera.camera(subject.tree.grid(), subject.frame, self.size)?;
        Ok(Scene {
            step_voxels: sampling.step,
            rule: sampling.rule,
            mode: sampling.mode,
            detail: self.lod,
            clip: self.clip,
            skipping: if sampling.no_skip { Skipping::Off } else { Skipping::On },
            ..Scene::new(camera, self.size, subject.transfer.clone())
        })
    }
}

/// A progress bar that shows after the first moments; hidden where there is no terminal.
pub fn progress_bar(what: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg} [{bar:40}] {percent}% {eta}").expect("a valid template");
    ProgressBar::new(0).with_style(style.progress_chars("=> ")).with_message(what)
}

fn spinner(what: String) -> ProgressBar {
    let bar = ProgressBar::new_spinner().with_message(what);
    bar.enable_steady_tick(std::time::Duration::from_millis(200));
    bar
}

fn numbers<const N: usize>(text: &str, separator: char) -> Option<[f64; N]> {
    let parsed: Result<Vec<f64>, _> = text.split(separator).map(|n| n.trim().parse::<f64>()).collect();
    parsed.ok()?.try_into().ok().filter(|n: &[f64; N]| n.iter().all(|x| x.is_finite()))
}

fn size(text: &str) -> Result<UVec2, String> {
    let sides: Option<Vec<u32>> = text.split(['x', 'X']).map(|n| n.parse().ok()).collect();
    match sides.as_deref() {
        Some([w, h]) if *w > 0 && *h > 0 => Ok(UVec2::new(*w, *h)),
        _ => Err("a size is WIDTHxHEIGHT in pixels, for example 512x512".to_owned()),
    }
}

fn brick_side(text: &str) -> Result<BrickSide, String> {
    let n = text.parse().map_err(|_| "a number: 16, 32 or 64".to_owned())?;
    BrickSide::new(n).map_err(|e| e.to_string())
}

fn downsampling(text: &str) -> Result<Downsampling, String> {
    match text {
        "subsample" => Ok(Downsampling::Subsample),
        "average" => Ok(Downsampling::Average),
        _ => Err("subsample or average".to_owned()),
    }
}

fn detail(text: &str) -> Result<Criterion, String> {
    match text {
        "full" => return Ok(Criterion::FullResolution),
        "distance" => return Ok(Criterion::Distance { factor: 1.0 }),
        _ => {}
    }
    if let Some(factor) = text.strip_prefix("distance=") {
        let factor = factor.parse::<f64>().ok().filter(|f| *f > 0.0);
        return factor.map(|factor| Criterion::Distance { factor }).ok_or_else(|| "a factor above 0".to_owned());
    }
    let level = text.parse::<u8>().ok().filter(|l| *l < 32);
    level.map(|l| Criterion::Uniform(Level(l))).ok_or_else(|| "full, a level 0 to 31, or distance[=FACTOR]".to_owned())
}

fn clip(text: &str) -> Result<Aabb, String> {
    let message = || "a clip box is X0:X1,Y0:Y1,Z0:Z1 in voxels, each lower bound below the upper".to_owned();
    let spans: Option<Vec<[f64; 2]>> = text.split(',').map(|axis| numbers(axis, ':')).collect();
    let Some([x, y, z]) = spans.as_deref() else { return Err(message()) };
    let clip = Aabb { min: DVec3::new(x[0], y[0], z[0]), max: DVec3::new(x[1], y[1], z[1]) };
    if clip.is_empty() { Err(message()) } else { Ok(clip) }
}

fn background(text: &str) -> Result<Background, String> {
    let grey = numbers::<1>(text, ',').map(|[g]| [g; 3]);
    let rgb = grey.or_else(|| numbers::<3>(text, ',')).filter(|c| c.iter().all(|x| (0.0..=1.0).contains(x)));
    rgb.map(Background).ok_or_else(|| "R,G,B or one number, each 0 to 1".to_owned())
}

fn mode(text: &str) -> Result<Mode, String> {
    match text {
        "exact" => Ok(Mode::Exact),
        "fast" => Ok(Mode::FAST),
        _ => Err("exact or fast".to_owned()),
    }
}

fn rule(text: &str) -> Result<QuadratureRule, String> {
    let names = || QuadratureRule::ALL.map(|r| r.name()).join(", ");
    QuadratureRule::from_name(text).ok_or_else(|| format!("one of {}", names()))
}

fn raw_spec(text: &str) -> Result<RawSpec, String> {
    let mut fields = text.split(',');
    let dims = fields.next().and_then(|d| {
        let n: Option<Vec<u32>> = d.split('x').map(|n| n.parse().ok().filter(|n| *n > 0)).collect();
        <[u32; 3]>::try_from(n?).ok()
    });
    let scalar = fields.next().and_then(|name| ScalarType::ALL.into_iter().find(|t| t.name() == name));
    let (Some(dims), Some(scalar)) = (dims, scalar) else {
        return Err(
            "NXxNYxNZ,TYPE with TYPE one of u8 i8 u16 i16 u32 i32 f32 f64, for example 256x256x128,u8".to_owned()
        );
    };
    let mut raw = RawSpec::new(dims.into(), scalar);
    for field in fields {
        raw_field(&mut raw, field)?;
    }
    Ok(raw)
}

fn raw_field(raw: &mut RawSpec, field: &str) -> Result<(), String> {
    match field.split_once('=') {
        None if field == "big" => raw.order = ByteOrder::Big,
        None if field == "little" => raw.order = ByteOrder::Little,
        Some(("skip", n)) => raw.skip_bytes = n.parse().map_err(|_| format!("skip={n:?} is not a number of bytes"))?,
        Some(("spacing", s)) => {
            let spacing = numbers::<3>(s, ':').ok_or_else(|| format!("spacing={s:?} is not SX:SY:SZ"))?;
            raw.spacing = DVec3::from(spacing);
        }
        _ => return Err(format!("{field:?} is not big, little, skip=BYTES or spacing=SX:SY:SZ")),
    }
    Ok(())
}
