//! Brickfield next to other renderers: the same scenes, the same steps, in one alternating run.
//!
//! ```text
//!  scene --> volume.nrrd --> a process of each contestant, kept alive         reads the file once
//!                                     |
//!  step: a frame from elsewhere
//!                                     |
//!  the picture --> error against the continuous answer
//!                                     |
//!  round k: the camera turned by k degrees, each contestant a frame:          wall and CPU time of its own process
//! ```
//!
//! A contestant is a mode of a backend of this build, the same of another build (`--other`), or a peer: VTK's fixed-point and
//! GPU mappers, pygfx and vispy, by Python scripts of `tests/peers`. All of them answer the same lines of JSON (`protocol`),
//! and [`crate::turns`] gives them their turns.
//!
//! Pictures are compared as they are seen over black, in three colour channels: not every peer hands out alpha. Each is held
//! to the answer of its own [`Domain`]: VTK ends a volume at the outer sample centres, all others at the outer voxels' faces.
//! A contestant that cannot be had, fails, or gives no answer in time is listed with its reason, and the others go on.
//!
//! `--first` measures something else: from a file to the first picture, by a new process each time.

mod answers;
mod beside;
mod descent;
mod first;
mod lineup;
mod measure;
mod page;
mod process;
mod protocol;
mod python;
mod scenes;
mod serve;
mod standing;
mod table;

use std::ffi::OsString;
use std::io;
use std::path::PathBuf;

use brickfield::frame::Mode;
use brickfield::options::{InputOptions, TreeOptions, ViewOptions, values};
use clap::{CommandFactory, FromArgMatches, Parser};
use serde::Serialize;

use crate::compare::{CompareError, RivalArgs, each_once};
use crate::frames::degrees;
use crate::report::{Machine, commit};

pub use beside::Beside;
pub use first::{FirstPicture, FirstReport};
pub use lineup::Peer;
pub use measure::{ContestantInfo, Measured, Probe, SceneReport, StepReport};
pub use protocol::{Domain, Part};
pub use scenes::Generated;
pub use standing::{Reached, TimeRatio, TimeToError};

use lineup::Lineup;
use python::Python;

/// Renders scenes with Brickfield and with other renderers, and reports time and error
///
/// Contestants take turns, frame by frame, each in a process of its own. VTK, pygfx and vispy are run by a Python that has
/// them; one that cannot be had is listed as absent. Exit status: 0 done, 1 failed (one line on standard error says why),
/// 2 unusable arguments, 3 a required backend is absent.
#[derive(Parser, Clone, Debug)]
#[command(
    name = "peers",
    after_help = "Examples:
  peers --install                                  once: makes target/peers with the peers in it
  peers --scene blobs --steps 1/2
  peers --scene sharp --to-error                   on to smaller steps, until each reaches 1e-4 or can be seen never to
  peers --first                                    from a file to the first picture, 256^3 and 512^3
  peers --other ../before/target/debug/peers       this build, another one and the peers in one run
  peers engine.vti --transfer ct-bone --peers vtk-gpu,pygfx"
)]
pub struct PeersArgs {
    /// Volume file or folder, instead of the generated scenes; its axes are the world's
    #[arg(conflicts_with_all = ["scene", "voxels"])]
    pub file: Option<PathBuf>,
    /// Generated scenes: blobs, ml, sharp
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        default_value = "blobs,ml,sharp",
        default_value_if("first", "true", "blobs")
    )]
    pub scene: Vec<Generated>,
    /// Voxels along the sides of the generated volumes
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "256",
          default_value_if("first", "true", "256,512"), value_parser = clap::value_parser!(u32).range(8..=1024))]
    pub voxels: Vec<u32>,
    /// Distances between samples, in units of the least voxel spacing, as decimals or fractions
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::step, default_value = "1/4,1/2,1,2",
          default_value_if("first", "true", "1/2"))]
    pub steps: Vec<f64>,
    /// Go on to smaller steps, halved down to 1/64: one picture of each contestant that has not reached an error of 1e-4 and
    /// whose error still falls; where it reaches 1e-3 or 1e-4, the step is measured
    #[arg(long, conflicts_with = "first")]
    pub to_error: bool,
    /// Modes of Brickfield
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::mode, default_value = "fast,exact")]
    pub modes: Vec<Mode>,
    /// Peers: vtk-fixed, vtk-gpu, pygfx, vispy, or none
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "vtk-fixed,vtk-gpu,pygfx,vispy",
          value_parser = wanted_peer)]
    pub peers: Vec<WantedPeer>,
    /// The `peers` program of another build: its Brickfield takes part, too, as `other`
    #[arg(long, value_name = "PROGRAM")]
    pub other: Option<PathBuf>,
    /// Timed frames of each contestant, after one that warms up and the one whose picture is kept; fewer than 6 give no
    /// interval of 95 %. With --first, its timed processes
    #[arg(long, default_value_t = 7, default_value_if("first", "true", "3"), value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub frames: u32,
    /// Degrees that the camera turns around the volume's centre from frame to frame
    #[arg(long, value_name = "DEGREES", default_value_t = 0.5, value_parser = degrees, allow_hyphen_values = true)]
    pub turn: f64,
    /// Measure the way from a file to the first picture instead, by a new process each time
    #[arg(long)]
    pub first: bool,
    /// How long the answer of a contestant may take, to read a volume or to draw a frame; one that takes longer is killed, and
    /// the others go on
    #[arg(long, value_name = "SECONDS", default_value_t = 300, value_parser = clap::value_parser!(u64).range(1..=86_400))]
    pub patience: u64,
    /// Folder that receives peers.json, and for each scene a page with its pictures
    #[arg(long, value_name = "DIR", default_value = "target/compare-peers")]
    pub out: PathBuf,
    /// A Python that has the peers; by default that of --install
    #[arg(long, value_name = "PROGRAM", env = "BRICKFIELD_PEERS_PYTHON")]
    pub python: Option<PathBuf>,
    /// Make target/peers, a Python environment, and install the peers in it
    #[arg(long)]
    pub install: bool,
    /// Measure nothing, but draw frames on request (lines of JSON), for another `peers`
    #[arg(long)]
    pub serve: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub rivals: RivalArgs,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub input: InputOptions,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub tree: TreeOptions,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub view: ViewOptions,
    /// The command line, for the report.
    #[arg(skip)]
    pub command: String,
}

/// A peer, or the word that wants none.
pub type WantedPeer = Option<Peer>;

/// A run.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs)]
pub struct PeersReport {
    pub machine: Machine,
    pub commit: String,
    pub command: String,
    pub size: u32,
    pub n_frames: u32,
    pub turn_degrees: f64,
    pub brick: u32,
    pub scenes: Vec<SceneReport>,
    pub first: Vec<FirstReport>,
}

/// Why there is no measurement.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum PeersError {
    #[error(transparent)]
    Compare(Box<CompareError>),
    #[error(transparent)]
    Save(#[from] brickfield::io::SaveError),
    #[error("a temporary file: {0}")]
    Temporary(io::Error),
    #[error("--camera: the peers have perspective cameras only, and the view is orthographic")]
    Orthographic,
    #[error("--size {width}x{height}: the picture must be square")]
    Size { width: u32, height: u32 },
    #[error("{option}: the peers draw whole volumes at full resolution")]
    Whole { option: &'static str },
    #[error("--install: {what}: {reason}")]
    Install { what: &'static str, reason: String },
    #[error("{}: {source}", path.display())]
    Out { path: PathBuf, source: io::Error },
    #[error("the streams of requests: {0}")]
    Serve(io::Error),
}

impl<E: Into<CompareError>> From<E> for PeersError {
    fn from(e: E) -> PeersError {
        PeersError::Compare(Box::new(e.into()))
    }
}

impl PeersError {
    /// The exit status that scripts see: 1 failed, 2 unusable arguments, 3 a required backend is absent.
    pub fn status(&self) -> u8 {
        match self {
            PeersError::Compare(e) => e.status(),
            PeersError::Orthographic | PeersError::Size { .. } | PeersError::Whole { .. } => 2,
            _ => 1,
        }
    }
}

fn wanted_peer(text: &str) -> Result<WantedPeer, String> {
    if text == "none" { Ok(None) } else { text.parse().map(Some) }
}

/// The options of a command line; the first argument is the command's name.
///
/// # Errors
/// clap's message, to be printed by its `exit`.
pub fn parse(arguments: Vec<OsString>) -> Result<PeersArgs, clap::Error> {
    let command = crate::compare::typed("cargo xtask peers", &arguments);
    // The generated scenes have their own.
    let mut clap = PeersArgs::command();
    for name in ["camera", "transfer"] {
        clap = clap.mut_arg(name, |a| a.requires("file"));
    }
    for name in ["lod", "clip"] {
        clap = clap.mut_arg(name, |a| a.hide(true));
    }
    let args = PeersArgs::from_arg_matches_mut(&mut clap.try_get_matches_from(arguments)?)?;
    let (modes, steps) = (each_once(&args.modes), each_once(&args.steps));
    Ok(PeersArgs { modes, steps, command, ..args })
}

/// Does what the arguments ask for; `say` is told each table as soon as it is there. `None` if nothing was to be measured.
///
/// # Errors
/// See [`PeersError`].
pub fn peers(args: &PeersArgs, say: &mut dyn FnMut(&str)) -> Result<Option<PeersReport>, PeersError> {
    if args.serve {
        serve::serve(io::stdin().lock(), io::stdout().lock()).map_err(PeersError::Serve)?;
        return Ok(None);
    }
    if args.install {
        Python::install()?;
        say(&format!("{} has the peers; `cargo xtask peers` finds it\n", python::ENVIRONMENT));
        return Ok(None);
    }
    check(args)?;
    let lineup = Lineup::new(args)?;
    let mut report = PeersReport {
        machine: Machine::here(),
        commit: commit(),
        command: args.command.clone(),
        size: args.view.size.x,
        n_frames: args.frames,
        turn_degrees: args.turn,
        brick: args.tree.brick.n_samples(),
        scenes: Vec::new(),
        first: Vec::new(),
    };
    for subject in subjects(args) {
        if args.first {
            report.first.push(first::first(args, &lineup, subject?, say)?);
        } else {
            report.scenes.push(measure::scene(args, &lineup, subject?, say)?);
        }
        let (path, text) = (args.out.join("peers.json"), serde_json::to_string_pretty(&report));
        let text = text.expect("a report is plain data") + "\n";
        std::fs::write(&path, text).map_err(|source| PeersError::Out { path, source })?;
    }
    Ok(Some(report))
}

fn check(args: &PeersArgs) -> Result<(), PeersError> {
    let size = args.view.size;
    if size.x != size.y {
        return Err(PeersError::Size { width: size.x, height: size.y });
    }
    if args.view.clip.is_some() {
        return Err(PeersError::Whole { option: "--clip" });
    }
    if args.view.lod.iter().any(|criterion| *criterion != brickfield::lod::Criterion::FullResolution) {
        return Err(PeersError::Whole { option: "--lod" });
    }
    let out = |source| PeersError::Out { path: args.out.clone(), source };
    std::fs::create_dir_all(&args.out).map_err(out)
}

/// The scenes, made one by one.
fn subjects(args: &PeersArgs) -> Box<dyn Iterator<Item = Result<scenes::Subject, PeersError>> + '_> {
    match &args.file {
        Some(path) => Box::new(std::iter::once_with(|| scenes::of_file(path, &args.input, &args.view))),
        None => {
            let of = |n: &'_ u32| {
                let n = *n;
                args.scene.iter().map(move |scene| Ok(scene.subject(n)))
            };
            Box::new(args.voxels.iter().flat_map(of))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn args(words: &str) -> Result<PeersArgs, clap::Error> {
        parse(std::iter::once("peers").chain(words.split_whitespace()).map(OsString::from).collect())
    }

    #[test]
    fn peers_measure_three_scenes_or_first_pictures_of_two_sizes() {
        let a = args("").unwrap();
        assert_eq!(
            (a.scene.len(), a.voxels.as_slice(), a.steps.as_slice()),
            (3, &[256][..], &[0.25, 0.5, 1.0, 2.0][..])
        );
        assert_eq!((a.peers.len(), a.modes.len(), a.frames, a.view.size.x), (4, 2, 7, 512));
        let a = args("--first").unwrap();
        assert_eq!((a.scene.as_slice(), a.voxels.as_slice()), (&[Generated::Blobs][..], &[256, 512][..]));
        assert_eq!((a.steps.as_slice(), a.frames), (&[0.5][..], 3));
        assert_eq!(args("--peers none --steps 1,1").unwrap().peers, [None]);
        assert_eq!(args("x.vti --transfer ct-bone --peers pygfx").unwrap().peers, [Some(Peer::Pygfx)]);
    }

    #[test]
    fn peers_refuse_what_they_cannot_draw() {
        let bad = [
            "--scene spheres",
            "--voxels 4",
            "--steps 0",
            "--peers paraview",
            "--frames 0",
            "--transfer ct-bone",
            "--camera front",
            "x.vti --scene ml",
            "x.vti --voxels 64",
            "--turn 400",
        ];
        for bad in bad {
            assert_eq!(args(bad).unwrap_err().exit_code(), 2, "{bad}");
        }
        for (bad, text) in [("--size 8x9", "square"), ("--clip 0:1,0:1,0:1", "--clip"), ("--lod 1", "--lod")] {
            let e = peers(&args(bad).unwrap(), &mut |_| ()).unwrap_err();
            assert!(e.status() == 2 && e.to_string().contains(text), "{e}");
        }
    }
}
