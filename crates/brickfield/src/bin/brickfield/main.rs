//! The `brickfield` command: look at a volume file, render it, save it in another format, list the backends.

mod backend;
mod cells;
mod convert;
#[cfg(feature = "fetch")]
mod fetched;
mod grid_input;
mod info;
#[cfg(feature = "formats")]
mod pack;
mod render;
#[cfg(feature = "serve")]
mod serve;
mod surface;

use std::io::{ErrorKind, Write};
use std::path::PathBuf;
use std::process::ExitCode;

#[cfg(feature = "formats")]
use brickfield::Codec;
#[cfg(feature = "fetch")]
use brickfield::core::Aabb;
use brickfield::core::glam::UVec2;
use brickfield::curvilinear::IndexPlane;
use brickfield::frame::{Mode, QuadratureRule};
use brickfield::io::SAVED_EXTENSIONS;
use brickfield::options::{
    Background, BlockArgs, Boxes, InputOptions, LightOptions, LightSourceOptions, OptionError, SamplingOptions,
    TreeOptions, ViewOptions, values,
};
use brickfield::overlay::LEVEL_COLORS;
use brickfield::{AdapterInfo, BackendError, BackendStatus, SurfaceNormals, Trimming, Viewpoint, backends};

use backend::BackendOptions;
use clap::builder::PossibleValuesParser;
use clap::{Args, Parser, Subcommand};
use grid_input::GridInput;

/// Renders scalar volumes by multiresolution bricks, on the CPU, through wgpu and through raw Vulkan.
///
/// Exit status: 0 done, 1 failed (one line on standard error says why), 2 unusable arguments, 3 backend or adapter not
/// available.
#[derive(Parser)]
#[command(
    version,
    after_help = "Examples:
  brickfield info head.nrrd
  brickfield info scan.ome.tif --json
  brickfield convert dicom-folder/ -o head.nii.gz --series 1
  brickfield pack large.nrrd -o large.zarr
  brickfield serve large.zarr --mbit 30 --latency-ms 10
  brickfield render head.nrrd -o head.png
  brickfield render dicom-folder/ -o head.exr --transfer ct-bone --camera \"front zoom=1.2\"
  brickfield render engine.vti -o inside.png --camera \"eye=80,100,60 target=200,128,60 up=0,0,1 fov=60\" --mode fast
  brickfield render head.nrrd -o bricks.png --lod error=2 --show-bricks
  brickfield render head.nrrd -o planes.exr --polygons rgba16float --placement object-planes
  brickfield surface N00E010.hgt -o terrain.png --zones 20000 --light 1,-1,2 --color-bar
  brickfield surface combxyz.bin --solution combq.bin -o slice.png --plane k=12 --lines 1
  brickfield cells combxyz.bin --solution combq.bin -o comb.png --plane k=12"
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

const FILES_HELP: &str =
    "Volume file or folder (NRRD, MetaImage, NIfTI, VTK, MGH, DICOM series, OME-Zarr, TIFF stack, folder of pictures)";

#[derive(Subcommand)]
enum Command {
    /// Says what a volume file holds: dimensions, type, spacing, values, and what its bricks take
    Info(InfoArgs),
    /// Renders a picture of a volume file
    Render(Box<RenderArgs>),
    /// Draws a surface of a structured grid, coloured by its values: terrain (HGT, USGS DEM, GeoTIFF), or a plane of a PLOT3D or VTK grid
    Surface(Box<SurfaceArgs>),
    /// Renders the cells of a curvilinear grid as a volume (PLOT3D, VTK), with planes of the grid amid them if asked for
    Cells(Box<CellsArgs>),
    /// Saves a volume in another format: values, spacing and direction survive; what the format cannot state is noted
    Convert(ConvertArgs),
    /// Packs a volume of any size as OME-Zarr 0.5 with all coarser levels, in bounded memory
    #[cfg(feature = "formats")]
    Pack(PackArgs),
    /// Serves the files of a store to programs on this machine, for trying out: any web server, or S3, can do it
    #[cfg(feature = "serve")]
    Serve(ServeArgs),
    /// Lists the backends and their adapters, or why there are none
    Backends,
}

#[derive(Args)]
struct InfoArgs {
    #[arg(help = FILES_HELP)]
    file: PathBuf,
    #[command(flatten)]
    input: InputOptions,
    #[command(flatten)]
    tree: TreeOptions,
    /// Print JSON, for scripts
    #[arg(long)]
    json: bool,
}

#[derive(Args)]
struct ConvertArgs {
    #[arg(help = FILES_HELP)]
    file: PathBuf,
    #[arg(short, long, value_name = "VOLUME", help = convert_help())]
    out: PathBuf,
    /// Save samples as they are; otherwise they are compressed without loss
    #[arg(long)]
    unpacked: bool,
    #[command(flatten)]
    input: InputOptions,
}

#[cfg(feature = "formats")]
#[derive(Args)]
struct PackArgs {
    #[arg(help = FILES_HELP)]
    file: PathBuf,
    /// OME-Zarr to write: a folder that is not there yet; until it is complete it has another name, so that an interrupted run leaves
    /// no store
    #[arg(short, long, value_name = "STORE")]
    out: PathBuf,
    /// How samples are coded, without loss: zstd (every program opens all levels), haar (least bytes; integers only; level 0 as details of
    /// level 1, so that other programs open levels 1 and coarser) or none
    #[arg(long, value_name = "CODEC", default_value = "zstd", value_parser = values::codec)]
    codec: Codec,
    #[command(flatten)]
    input: InputOptions,
}

#[cfg(feature = "serve")]
#[derive(Args)]
struct ServeArgs {
    /// Folder whose files are served, and nothing outside of it
    store: PathBuf,
    /// Where to listen; port 0 takes a free one. Other machines can read what is served at another address than this machine's own
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:8080")]
    address: std::net::SocketAddr,
    /// Send as over a link of N Mbit/s, which all clients share
    #[arg(long, value_name = "N", value_parser = values::positive, allow_hyphen_values = true)]
    mbit: Option<f64>,
    /// Let each request wait N ms for its answer
    #[arg(long, value_name = "N", value_parser = values::positive, allow_hyphen_values = true)]
    latency_ms: Option<f64>,
}

fn convert_help() -> String {
    format!(
        "Volume to write; the end of its name is the format: one of {SAVED_EXTENSIONS}. .nii is NIfTI-1 unless \
         its 32-bit numbers would be seen, then NIfTI-2; .zarr must not be there yet, and cannot state axes that are flipped \
         or rotated against the world's; .raw has samples alone"
    )
}

#[derive(Args)]
struct RenderArgs {
    #[arg(help = FILES_HELP)]
    file: PathBuf,
    /// Picture to write: .exr (linear, for measuring) or .png (sRGB, for looking)
    #[arg(short, long, value_name = "PICTURE")]
    out: PathBuf,
    #[command(flatten)]
    backend: BackendOptions,
    #[command(flatten)]
    input: InputOptions,
    #[command(flatten)]
    tree: TreeOptions,
    #[command(flatten)]
    view: ViewOptions,
    #[command(flatten)]
    sampling: SamplingOptions,
    #[command(flatten)]
    light: LightOptions,
    #[command(flatten)]
    flat: BlockArgs,
    /// Draw bricks of the finest level as far as they may be seen (Tong, Wang, Tsang and Tang 1999): alone, merged or packed (their
    /// samples trimmed along one axis, merged into texture chunks, or trimmed along all axes), visible or envelope (whole
    /// bricks), or conventional (everything); the same picture (--blocks, --downsampling and --lod are not for them)
    #[arg(long, value_name = "HOW", conflicts_with = "show_bricks",
          value_parser = PossibleValuesParser::new(Trimming::NAMES), hide_possible_values = true)]
    trim: Option<String>,
    /// Bytes that the trimmed bricks' texture may take on the device, in MiB: what does not fit is drawn in batches, with the same picture
    #[arg(long, value_name = "MIB", requires = "trim", value_parser = values::positive, allow_hyphen_values = true)]
    cache_mib: Option<f64>,
    /// Draw what so many KiB of a store give: the whole volume coarse, then what the view shows, where that gains most (of a store of
    /// `brickfield pack`: a folder, or the URL under which it is served; flat blocks of 32 voxels)
    #[cfg(feature = "fetch")]
    #[arg(long, value_name = "KIB", conflicts_with_all = ["show_bricks", "trim", "budget_mib", "ratio", "block_level"],
          value_parser = values::positive, allow_hyphen_values = true)]
    fetch_kib: Option<f64>,
    /// A part of the volume that is fetched before the others, as a box of --clip
    #[cfg(feature = "fetch")]
    #[arg(long, value_name = "BOX", requires = "fetch_kib", value_parser = values::clip, allow_hyphen_values = true)]
    region: Option<Aabb>,
    #[arg(long, value_name = "WHICH", num_args = 0..=1, require_equals = true, default_missing_value = "drawn",
          conflicts_with = "blocks", value_parser = values::boxes, help = show_bricks_help())]
    show_bricks: Option<Boxes>,
}

fn show_bricks_help() -> String {
    let colors: Vec<_> = LEVEL_COLORS.iter().map(|c| c.name).collect();
    format!(
        "Draw the boxes of bricks over the picture, coloured by level, from the finest: {}, and again. drawn: those that \
         the frame draws; all: and, fainter, those that are selected but show nothing",
        colors.join(", ")
    )
}

#[derive(Args)]
struct CellsArgs {
    #[command(flatten)]
    input: GridInput,
    /// Picture to write: .exr (linear, for measuring) or .png (sRGB, for looking)
    #[arg(short, long, value_name = "PICTURE")]
    out: PathBuf,
    #[command(flatten)]
    backend: BackendOptions,
    /// Size of the picture in pixels
    #[arg(long, value_name = "WxH", default_value = "512x512", value_parser = values::size)]
    size: UVec2,
    /// Where the picture is taken from, as of `brickfield render`
    #[arg(long, value_name = "VIEW", default_value = "oblique")]
    camera: Viewpoint,
    /// Background behind the picture in PNG files, linear: R,G,B or one number for grey
    #[arg(long, value_name = "RGB", default_value = "0", value_parser = values::background)]
    background: Background,
    /// Transfer function: a preset, or a JSON or TOML file of knots, as of `brickfield render` (auto is of volumes alone)
    #[arg(long, value_name = "TF", default_value = "linear")]
    transfer: String,
    /// Steps along the diagonal of the box around all cells
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    steps: u32,
    /// exact (held to the reference) or fast (rays end where nothing shows any more)
    #[arg(long, default_value = "exact", value_parser = values::mode)]
    mode: Mode,
    /// Quadrature rule: left-riemann, left-exponential, midpoint, pre-integrated or gauss2
    #[arg(long, default_value = "midpoint", value_parser = values::rule)]
    rule: QuadratureRule,
    /// Planes of the grid that are drawn amid the cells, opaque and coloured by their values: i=N, j=N or k=N, from 0; may be repeated
    #[arg(long, value_name = "PLANE", value_delimiter = ',', value_parser = values::plane)]
    plane: Vec<IndexPlane>,
    /// Light on the planes
    #[command(flatten)]
    light: LightSourceOptions,
    /// Draw the outlines of the planes' zones, so many pixels wide, at most 64
    #[arg(long, value_name = "PIXELS", requires = "plane", value_parser = values::line_width, allow_hyphen_values = true)]
    lines: Option<f64>,
}

#[derive(Args)]
struct SurfaceArgs {
    #[command(flatten)]
    input: GridInput,
    /// Picture to write: .exr (linear, for measuring) or .png (sRGB, for looking)
    #[arg(short, long, value_name = "PICTURE")]
    out: PathBuf,
    #[command(flatten)]
    backend: BackendOptions,
    /// Plane of the grid: i=N, j=N or k=N, from 0; k=0 unless stated, which of terrain is a height field
    #[arg(long, value_name = "PLANE", value_parser = values::plane)]
    plane: Option<IndexPlane>,
    /// By how much heights of terrain are exaggerated, 1 unless stated; 0: flat
    #[arg(long, value_name = "FACTOR", value_parser = values::exaggeration, allow_hyphen_values = true)]
    exaggeration: Option<f64>,
    /// Size of the picture in pixels
    #[arg(long, value_name = "WxH", default_value = "512x512", value_parser = values::size)]
    size: UVec2,
    /// Where the picture is taken from, as of `brickfield render`; oblique if fields are stated and no view is
    #[arg(long, value_name = "VIEW", default_value = "top")]
    camera: Viewpoint,
    /// Background behind the picture in PNG files, linear: R,G,B or one number for grey
    #[arg(long, value_name = "RGB", default_value = "0", value_parser = values::background)]
    background: Background,
    /// Colours of values: a JSON or TOML file of knots, as of `brickfield render --transfer`; blue, green and red over the values' range unless
    /// stated
    #[arg(long, value_name = "FILE")]
    colors: Option<PathBuf>,
    /// Interpolate colours between corners, and not values
    #[arg(long)]
    gouraud: bool,
    #[command(flatten)]
    light: LightSourceOptions,
    /// Normals of the surface: grid (of its finest zones, whatever is drawn) or triangles (each is a plane)
    #[arg(long, value_name = "WHICH", default_value = "grid", value_parser = values::surface_normals)]
    normals: SurfaceNormals,
    /// Draw the outlines of zones, so many pixels wide, at most 64
    #[arg(long, value_name = "PIXELS", value_parser = values::line_width, allow_hyphen_values = true)]
    lines: Option<f64>,
    /// Draw so many zones, those with the greatest errors divided first; all zones unless stated. Zones around holes, and those that cannot be
    /// coarse, are drawn in any case
    #[arg(long, value_name = "N", conflicts_with = "granularity", value_parser = clap::value_parser!(u32).range(1..))]
    zones: Option<u32>,
    /// Draw zones as coarse as they may be with their shorter diagonal below so many pixels, seen face on
    #[arg(long, value_name = "PIXELS", value_parser = values::positive, allow_hyphen_values = true)]
    granularity: Option<f64>,
    /// Draw a bar of the colours with their values
    #[arg(long)]
    color_bar: bool,
}

/// Why the command failed, by exit status.
enum Failure {
    /// Status 2.
    Usage(Box<dyn std::error::Error>),
    /// Status 3.
    Backend(BackendError),
    /// Status 1: the picture was written, but the validation layer had something to say.
    Validation { n_messages: usize },
    /// Status 1.
    Other(Box<dyn std::error::Error>),
}

impl Failure {
    fn usage(e: impl std::error::Error + 'static) -> Failure {
        Failure::Usage(Box::new(e))
    }

    /// The line for standard error, and the exit status.
    fn told(&self) -> (String, u8) {
        match self {
            Failure::Usage(e) => (e.to_string(), 2),
            Failure::Backend(e) => (e.to_string(), 3),
            Failure::Validation { n_messages } => (format!("messages from the validation layer: {n_messages}"), 1),
            Failure::Other(e) => (e.to_string(), 1),
        }
    }
}

impl<E: std::error::Error + 'static> From<E> for Failure {
    fn from(e: E) -> Failure {
        let e: Box<dyn std::error::Error> = Box::new(e);
        match e.downcast_ref::<OptionError>().is_some_and(OptionError::is_usage) {
            true => Failure::Usage(e),
            false => Failure::Other(e),
        }
    }
}

fn main() -> ExitCode {
    let result = match Cli::parse().command {
        Command::Info(args) => info::run(&args),
        Command::Convert(args) => convert::run(&args),
        #[cfg(feature = "formats")]
        Command::Pack(args) => pack::run(&args),
        Command::Render(args) => render::run(&args),
        Command::Surface(args) => surface::run(&args),
        Command::Cells(args) => cells::run(&args),
        #[cfg(feature = "serve")]
        Command::Serve(args) => serve::run(&args),
        Command::Backends => print(&listed_backends()),
    };
    let Err(failure) = result else { return ExitCode::SUCCESS };
    let (message, status) = failure.told();
    eprintln!("brickfield: {}", message.split_whitespace().collect::<Vec<_>>().join(" "));
    ExitCode::from(status)
}

/// Prints to a reader who may have had enough.
fn print(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(()),
        other => Ok(other?),
    }
}

fn listed_backends() -> String {
    let of_status = |status: BackendStatus| match status.adapters {
        Ok(adapters) => {
            let line = |a: &AdapterInfo| format!("{:5} {}: {} ({})\n", status.kind.name(), a.index, a.name, a.driver);
            adapters.iter().map(line).collect()
        }
        Err(reason) => format!("{:5} absent: {reason}\n", status.kind.name()),
    };
    backends().into_iter().map(of_status).collect()
}

fn mib(bytes: u64) -> f64 {
    bytes as f64 / f64::from(1 << 20)
}
