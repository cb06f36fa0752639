//! The options that the `brickfield` command shares with the conformance runs.

mod blocks;
mod light;
mod sampling;
pub mod values;

use std::path::Path;

#[cfg(feature = "formats")]
use brickfield_bricks::BlockSource;
use brickfield_bricks::{BrickTree, BuildOptions, Downsampling, build_tree_observed};
use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{Aabb, BlockSide, BrickSide, Grid, Level, LinearRgb, TransferFunction, Volume};
use brickfield_io::{ChoiceKind, Limits, OpenError, OpenOptions, Opened, RawSpec, SliceSource, WorldFrame};
use brickfield_lod::Criterion;
use brickfield_optics::Preset;
#[cfg(feature = "formats")]
use brickfield_optics::diagonal_world;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};

pub use blocks::{BlockArgs, BlockSubject, Blocks};
pub use light::{LightOptions, LightSourceOptions};
pub use sampling::{FinestVoxels, SamplingOptions};

#[cfg(feature = "formats")]
use crate::StoreBlocks;
use crate::{Scene, Viewpoint};

/// How a file is read.
#[derive(Args, Clone, Debug)]
pub struct InputOptions {
    /// Most bytes that the voxels may take, in MiB
    #[arg(long, value_name = "MIB", default_value_t = Limits::default().max_bytes >> 20,
          value_parser = clap::value_parser!(u64).range(1..1 << 43))]
    pub max_mib: u64,
    /// Read FILE as raw voxels: `NXxNYxNZ,TYPE` with TYPE u8 to f64; then, each if needed, `,big` `,skip=BYTES`
    /// `,spacing=SX:SY:SZ`
    #[arg(long, value_name = "SPEC", value_parser = values::raw_spec)]
    pub raw: Option<RawSpec>,
    /// World units between samples, instead of what the file states: `SX:SY:SZ`
    #[arg(long, value_name = "SX:SY:SZ", value_parser = values::spacing)]
    pub spacing: Option<DVec3>,
    /// The entries that are read where the file has several.
    #[command(flatten)]
    pub entries: EntryOptions,
}

/// Which entry is read where a file has several: its number, from 0, or its name, as `brickfield info` lists them.
#[derive(Args, Clone, Debug, Default)]
#[allow(missing_docs)]
pub struct EntryOptions {
    /// DICOM series: its number, from 0, or its UID; as all of these, `info` lists them, and the first one is the default
    #[arg(long, value_name = "WHICH")]
    pub series: Option<String>,
    /// Image of a file that has several: its number or name
    #[arg(long, value_name = "WHICH")]
    pub image: Option<String>,
    /// Array of a file that has several: its number or name
    #[arg(long, value_name = "WHICH")]
    pub array: Option<String>,
    /// Resolution: 0 is the finest
    #[arg(long, value_name = "WHICH")]
    pub level: Option<String>,
    /// Channel, component or colour: its number or name; of colours the luminance is the default
    #[arg(long, value_name = "WHICH")]
    pub channel: Option<String>,
    /// Point in time
    #[arg(long, value_name = "WHICH")]
    pub time: Option<String>,
}

/// How the octree is built.
#[derive(Args, Clone, Debug)]
pub struct TreeOptions {
    /// Samples along a brick's side: 16, 32 or 64
    #[arg(long, value_name = "N", default_value = "32", value_parser = values::brick_side)]
    pub brick: BrickSide,
    /// How coarser levels come about: subsample (sharper) or average (no aliasing)
    #[arg(long, value_name = "HOW", default_value = "subsample", value_parser = values::downsampling)]
    pub downsampling: Downsampling,
}

/// The part of a volume that is shown, and how.
#[derive(Args, Clone, Debug)]
pub struct ViewOptions {
    /// Size of the picture in pixels
    #[arg(long, value_name = "WxH", default_value = "512x512", value_parser = values::size)]
    pub size: UVec2,
    /// Where the picture is taken from: oblique, front, back, left, right, top, bottom, and/or fields:
    /// from=X,Y,Z eye=X,Y,Z target=X,Y,Z up=X,Y,Z (world units), fov=DEGREES or height=UNITS (orthographic), zoom=FACTOR
    #[arg(long, value_name = "VIEW", default_value = "oblique")]
    pub camera: Viewpoint,
    #[arg(long, value_name = "TF", default_value = "auto", help = transfer_help())]
    #[allow(missing_docs)]
    pub transfer: String,
    /// Which resolution; of several, separated by commas or each with its own --lod, all must be satisfied:
    /// full, a level (0 is the finest), distance[=FACTOR] (from the eye to a part's centre more than FACTOR of
    /// its own diagonals, 1), poi=X:Y:Z or poi=X:Y:Z:FACTOR (the same from a point of the world), fov[=FRACTION] (its angle below FRACTION of
    /// the field of view, 0.5), error=PIXELS (its voxels at most so large in the picture)
    #[arg(long, value_name = "LOD", default_value = "full", value_delimiter = ',', value_parser = values::criterion,
          allow_hyphen_values = true)]
    pub lod: Vec<Criterion>,
    /// Show only a part, in voxels: X0:X1,Y0:Y1,Z0:Z1
    #[arg(long, value_name = "BOX", value_parser = values::clip, allow_hyphen_values = true)]
    pub clip: Option<Aabb>,
    /// Background behind the picture in PNG files, linear: R,G,B or one number for grey
    #[arg(long, value_name = "RGB", default_value = "0", value_parser = values::background)]
    pub background: Background,
}

fn transfer_help() -> String {
    format!(
        "Transfer function: auto (from the histogram), a preset ({}), or a JSON or TOML file of knots: \
         {{\"knots\": [{{\"value\": 100, \"extinction\": 0, \"srgb\": \"#ffffff\"}}, ...]}}",
        presets()
    )
}

/// The names of all presets, as messages list them.
pub fn presets() -> String {
    Preset::ALL.map(|p| p.name()).join(", ")
}

/// A linear background colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Background(pub LinearRgb);

/// A transfer function as far as it is known before the values are.
#[derive(Clone, Debug)]
pub enum NamedTransfer {
    /// `auto`: from a volume's histogram.
    Automatic,
    /// A preset, by its name.
    Preset(Preset),
    /// That of a file.
    OfFile(TransferFunction),
}

impl NamedTransfer {
    /// What an option names; `None` if it is neither `auto`, nor a preset, nor a file.
    ///
    /// # Errors
    /// What is wrong in the file.
    pub fn of(name: &str) -> Result<Option<NamedTransfer>, OptionError> {
        if name == "auto" {
            return Ok(Some(NamedTransfer::Automatic));
        }
        if let Some(preset) = Preset::from_name(name) {
            return Ok(Some(NamedTransfer::Preset(preset)));
        }
        let path = Path::new(name);
        let of_file = || Ok(NamedTransfer::OfFile(brickfield_optics::read_transfer(path)?));
        path.exists().then(of_file).transpose()
    }
}

/// Which bricks are shown as boxes over a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Boxes {
    /// The bricks that the frame draws.
    Drawn,
    /// The bricks that the frame draws, and fainter the selected ones in which nothing is visible.
    All,
}

/// A volume that is ready to be rendered.
#[derive(Debug)]
pub struct Subject {
    /// The volume.
    pub volume: Volume,
    /// The names of the world's axes, where they are known.
    pub frame: WorldFrame,
    /// Its bricks at all resolutions.
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
    #[error(transparent)]
    Blocks(#[from] brickfield_bricks::BlockBuildError),
    #[error(transparent)]
    BlockErrors(#[from] brickfield_lod::EstimateError),
    #[error(transparent)]
    Fetch(#[from] brickfield_bricks::FetchError),
    #[error("the blocks' budget: {0}")]
    Budget(#[from] brickfield_lod::BudgetError),
    #[error("--block-level {level}: blocks of {side} voxels have levels 0 to {most}")]
    BlockLevel { level: u8, side: BlockSide, most: u8 },
    #[error("all blocks at level {level} take {} MiB; --max-mib allows {}: state --budget-mib, --ratio or a coarser --block-level", n_bytes.div_ceil(1 << 20), max_bytes >> 20)]
    BlocksTooLarge { level: u8, n_bytes: u64, max_bytes: u64 },
    #[error("--transfer: {0}")]
    Preset(#[from] brickfield_core::TransferError),
    #[error("--transfer: {0}")]
    Transfer(#[from] brickfield_optics::ReadTransferError),
    #[error("--transfer: {name:?} is neither auto, nor a file, nor a preset; the presets are {presets}")]
    NoSuchTransfer { name: String, presets: String },
    #[error("--camera: {0}")]
    Camera(#[from] brickfield_core::CameraError),
    #[error("--light: {0}")]
    Light(#[from] brickfield_optics::LightError),
    #[error("--clip: the box from {} to {} lies outside of the volume's {} x {} x {} voxels", clip.min, clip.max, dims.x, dims.y, dims.z)]
    ClipOutside { clip: Aabb, dims: UVec3 },
    #[error("{first} and {second} exclude each other: {reason}")]
    Exclude { first: String, second: String, reason: &'static str },
}

impl OptionError {
    /// Whether the command line is to blame, and not a file or the machine.
    pub fn is_usage(&self) -> bool {
        match self {
            OptionError::Open(_) | OptionError::Build(_) | OptionError::Preset(_) | OptionError::Transfer(_) => false,
            OptionError::Blocks(_) | OptionError::BlockErrors(_) | OptionError::Fetch(_) => false,
            OptionError::Budget(_)
            | OptionError::BlockLevel { .. }
            | OptionError::BlocksTooLarge { .. }
            | OptionError::NoSuchTransfer { .. }
            | OptionError::Camera(_)
            | OptionError::Light(_)
            | OptionError::ClipOutside { .. }
            | OptionError::Exclude { .. } => true,
        }
    }
}

impl InputOptions {
    /// Opens a volume as it lies in its file, with a progress display on the terminal.
    ///
    /// # Errors
    /// What the reader says.
    pub fn open(&self, path: &Path) -> Result<Opened, OptionError> {
        let bar = spinner(format!("reading {}", path.display()));
        let opened = match &self.raw {
            Some(raw) => brickfield_io::open_raw(path, raw, &self.open_options()),
            None => brickfield_io::open(path, &self.open_options()),
        };
        bar.finish_and_clear();
        Ok(opened?)
    }

    /// Opens a volume for pictures, with the transfer function that is asked for; what the reader noticed is printed. Uneven slices are
    /// made even.
    ///
    /// # Errors
    /// What the reader or the transfer function says.
    pub fn open_to_render(
        &self,
        path: &Path,
        view: &ViewOptions,
    ) -> Result<(Volume, WorldFrame, TransferFunction), OptionError> {
        let Opened { volume, frame, notes, .. } = self.open(path)?.evenly_spaced(&self.limits());
        notes.iter().for_each(|text| note(text));
        let transfer = view.transfer(&volume)?;
        Ok((volume, frame, transfer))
    }

    /// Opens the slices of a volume in order, so that it is never whole in memory if its format allows.
    ///
    /// # Errors
    /// What the reader says.
    pub fn open_slices(&self, path: &Path) -> Result<Box<dyn SliceSource>, OpenError> {
        match &self.raw {
            Some(raw) => brickfield_io::open_raw_slices(path, raw, &self.open_options()),
            None => brickfield_io::open_slices(path, &self.open_options()),
        }
    }

    /// What is wanted of the file.
    pub fn open_options(&self) -> OpenOptions {
        let mut options = OpenOptions::from(self.limits());
        options.spacing = self.spacing;
        let EntryOptions { series, image, array, level, channel, time } = &self.entries;
        let wanted = [
            (ChoiceKind::Series, series),
            (ChoiceKind::Image, image),
            (ChoiceKind::Array, array),
            (ChoiceKind::Level, level),
            (ChoiceKind::Channel, channel),
            (ChoiceKind::Time, time),
        ];
        for (kind, entry) in wanted {
            if let Some(entry) = entry {
                options.wanted.want(kind, entry);
            }
        }
        options
    }

    /// What a reader may allocate.
    pub fn limits(&self) -> Limits {
        Limits { max_bytes: self.max_mib.saturating_mul(1 << 20) }
    }
}

impl Subject {
    /// Opens a file and builds its bricks; what the reader noticed is printed. Uneven slices are made even.
    ///
    /// # Errors
    /// What the reader, the transfer function or the builder says.
    pub fn open(
        path: &Path,
        input: &InputOptions,
        tree: &TreeOptions,
        view: &ViewOptions,
    ) -> Result<Subject, OptionError> {
        let (volume, frame, transfer) = input.open_to_render(path, view)?;
        Ok(Subject { frame, tree: tree.build(&volume)?, transfer, volume })
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
    /// Refuses what is wrong for any volume.
    ///
    /// # Errors
    /// A transfer function that cannot be had, or a camera that looks nowhere.
    pub fn check(&self) -> Result<(), OptionError> {
        self.named_transfer()?;
        Ok(self.camera.check()?)
    }

    /// The transfer function that is asked for.
    ///
    /// # Errors
    /// An unknown name, or what is wrong in the file.
    pub fn transfer(&self, volume: &Volume) -> Result<TransferFunction, OptionError> {
        Ok(match self.named_transfer()? {
            NamedTransfer::Automatic => brickfield_optics::automatic(volume),
            NamedTransfer::Preset(preset) => preset.for_volume(volume)?,
            NamedTransfer::OfFile(transfer) => transfer,
        })
    }

    /// The transfer function that is asked for, for a volume that stays on disk.
    ///
    /// # Errors
    /// As [`transfer`](Self::transfer); a store that has no level to choose one from.
    #[cfg(feature = "formats")]
    fn transfer_of_store(&self, store: &StoreBlocks) -> Result<TransferFunction, OptionError> {
        Ok(match self.named_transfer()? {
            NamedTransfer::Automatic => {
                let overview = store.overview(StoreBlocks::OVERVIEW_BYTES)?;
                if overview.grid().dims() != store.grid().dims() {
                    note(
                        &"--transfer auto is chosen from a coarse level of the store: the volume in memory may get another one",
                    );
                }
                brickfield_optics::automatic(&overview)
            }
            NamedTransfer::Preset(preset) => preset.transfer(store.range(), diagonal_world(store.grid()))?,
            NamedTransfer::OfFile(transfer) => transfer,
        })
    }

    fn named_transfer(&self) -> Result<NamedTransfer, OptionError> {
        let no_such = || OptionError::NoSuchTransfer { name: self.transfer.clone(), presets: presets() };
        NamedTransfer::of(&self.transfer)?.ok_or_else(no_such)
    }

    /// The scene of a volume, sampled as by default; what of the options the volume does not have is printed.
    ///
    /// # Errors
    /// What the camera refuses, or a clip box outside of the volume.
    pub fn scene(&self, subject: &Subject) -> Result<Scene, OptionError> {
        note_missing_levels(&self.lod, subject.tree.layout().root().level);
        self.scene_of(subject.tree.grid(), subject.frame, &subject.transfer)
    }

    /// The scene of whatever lies on a grid, sampled as by default.
    ///
    /// # Errors
    /// As [`scene`](Self::scene).
    pub fn scene_of(&self, grid: &Grid, frame: WorldFrame, transfer: &TransferFunction) -> Result<Scene, OptionError> {
        let camera = self.camera.camera(grid, frame, self.size)?;
        if let Some(clip) = self.clip {
            check_clip(clip, grid)?;
        }
        let scene = Scene::new(camera, self.size, transfer.clone());
        Ok(Scene { detail: self.lod.clone(), clip: self.clip, ..scene })
    }
}

/// Says which levels the volume does not have.
fn note_missing_levels(criteria: &[Criterion], Level(root): Level) {
    for criterion in criteria {
        if let Criterion::Uniform(Level(level)) = criterion
            && *level > root
        {
            note(&format!("--lod {level}: the volume has levels 0 to {root}; level {root} is shown"));
        }
    }
}

/// Refuses a clip box outside of the volume, and says if a part of it is.
fn check_clip(clip: Aabb, grid: &Grid) -> Result<(), OptionError> {
    let (volume, dims) = (grid.index_box(), grid.dims());
    let inside = clip.intersection(&volume);
    if inside.is_empty() {
        return Err(OptionError::ClipOutside { clip, dims });
    }
    if inside != clip {
        note(&format!("--clip: the box is cut to the volume's {} x {} x {} voxels", dims.x, dims.y, dims.z));
    }
    Ok(())
}

/// Says what the user ought to know.
fn note(text: &dyn std::fmt::Display) {
    eprintln!("note: {text}");
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
