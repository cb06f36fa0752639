//! Who takes part: names, and how the process of each is started and told of a scene.

use std::fmt;
use std::path::PathBuf;
use std::process::Command;
use std::str::FromStr;
use std::time::Duration;

use brickfield::BackendKind;
use brickfield::core::glam::DVec3;
use brickfield::frame::Mode;
use brickfield::io::{SaveOptions, save};
use brickfield::options::OptionError;

use super::process::Contestant;
use super::protocol::{Drawing, Opening, SceneFile, View, numpy_name};
use super::python::Python;
use super::scenes::Subject;
use super::{PeersArgs, PeersError};
use crate::compare::each_once;
use crate::frames::turned;

/// Another renderer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Peer {
    VtkFixed,
    VtkGpu,
    Pygfx,
    Vispy,
}

/// Which build a contestant is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Build {
    This,
    Other,
}

/// A contestant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Who {
    Own { build: Build, backend: BackendKind, mode: Mode },
    Peer(Peer),
}

impl Peer {
    const ALL: [Peer; 4] = [Peer::VtkFixed, Peer::VtkGpu, Peer::Pygfx, Peer::Vispy];

    /// The name on the command line and in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Peer::VtkFixed => "vtk-fixed",
            Peer::VtkGpu => "vtk-gpu",
            Peer::Pygfx => "pygfx",
            Peer::Vispy => "vispy",
        }
    }
}

impl FromStr for Peer {
    type Err = String;

    fn from_str(text: &str) -> Result<Peer, String> {
        let names = || Peer::ALL.map(Peer::name).join(", ");
        Peer::ALL.into_iter().find(|p| p.name() == text).ok_or_else(|| format!("{}, or none", names()))
    }
}

impl Who {
    /// The backend's or the peer's name.
    pub(super) const fn backend(self) -> &'static str {
        match self {
            Who::Own { backend, .. } => backend.name(),
            Who::Peer(peer) => peer.name(),
        }
    }

    /// The name that its process knows.
    fn served_name(self) -> String {
        match self {
            Who::Own { backend, mode, .. } => format!("{backend} {}", mode.name()),
            Who::Peer(peer) => peer.name().to_owned(),
        }
    }
}

impl fmt::Display for Who {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let other = if matches!(self, Who::Own { build: Build::Other, .. }) { "other " } else { "" };
        write!(f, "{other}{}", self.served_name())
    }
}

/// Who is asked to take part.
pub(super) struct Lineup {
    pub(super) who: Vec<Who>,
    python: Python,
    this: PathBuf,
    other: Option<PathBuf>,
    /// How long a contestant's answer may take.
    patience: Duration,
}

impl Lineup {
    pub(super) fn new(args: &PeersArgs) -> Result<Lineup, PeersError> {
        let builds = if args.other.is_some() { &[Build::This, Build::Other][..] } else { &[Build::This] };
        let mut who = Vec::new();
        for backend in each_once(&args.rivals.backends) {
            for mode in &args.modes {
                who.extend(builds.iter().map(|build| Who::Own { build: *build, backend, mode: *mode }));
            }
        }
        who.extend(each_once(&args.peers).into_iter().flatten().map(Who::Peer));
        let this = std::env::current_exe().map_err(PeersError::Temporary)?;
        let (python, patience) = (Python::new(args.python.as_deref())?, Duration::from_secs(args.patience));
        Ok(Lineup { who, python, this, other: args.other.clone(), patience })
    }

    /// The command of a process that serves a contestant.
    fn command(&self, who: Who) -> Command {
        let build = match who {
            Who::Peer(_) => return self.python.serve(),
            Who::Own { build: Build::This, .. } => &self.this,
            Who::Own { build: Build::Other, .. } => self.other.as_ref().expect("another build is in the line-up"),
        };
        let mut command = Command::new(build);
        command.arg("--serve");
        command
    }
}

/// A scene in a file, and what contestants are told of it.
pub(super) struct Exhibit {
    pub(super) subject: Subject,
    pub(super) folder: tempfile::TempDir,
    file: SceneFile,
    brick: u32,
    adapter: Option<String>,
}

impl Exhibit {
    pub(super) fn new(args: &PeersArgs, subject: Subject) -> Result<Exhibit, PeersError> {
        let folder = tempfile::tempdir().map_err(PeersError::Temporary)?;
        let path = folder.path().join("volume.nrrd");
        save(&path, &subject.volume, &SaveOptions::default())?;
        // What the file holds: of a volume that has a rescale, its values.
        let volume = brickfield::io::open(&path, &Default::default()).map_err(OptionError::from)?.volume;
        let n_bytes = (volume.grid().n_voxels() * volume.scalar_type().n_bytes()) as u64;
        let length = std::fs::metadata(&path).map_err(PeersError::Temporary)?.len();
        let file = SceneFile {
            path,
            offset: length - n_bytes,
            dims: volume.grid().dims().to_array(),
            spacing: volume.grid().spacing().to_array(),
            dtype: numpy_name(volume.scalar_type()).to_owned(),
            size: args.view.size.x,
            fov_degrees: subject.fov_degrees,
            knots: subject.transfer.knots().to_vec(),
        };
        let (brick, adapter) = (args.tree.brick.n_samples(), args.rivals.adapter.clone());
        Ok(Exhibit { subject: Subject { volume, ..subject }, folder, file, brick, adapter })
    }

    /// A contestant that has read the file. The inner error says why it is absent.
    pub(super) fn open(&self, lineup: &Lineup, who: Who) -> Result<Result<Contestant, String>, PeersError> {
        if let (Who::Peer(_), Some(reason)) = (who, lineup.python.missing()) {
            return Ok(Err(reason));
        }
        let adapter = self.adapter.clone().filter(|_| who.backend() != BackendKind::Cpu.name());
        let (contestant, scene) = (who.served_name(), self.file.clone());
        let opening = Opening { contestant, scene, brick: self.brick, adapter };
        Contestant::open(who, lineup.command(who), opening, lineup.patience)
    }

    /// The frame of a camera that has turned.
    pub(super) fn drawing(&self, step_voxels: f64, degrees: f64) -> Drawing {
        let (subject, up) = (&self.subject, self.subject.view.up);
        let camera = turned(&subject.camera(1.0), subject.middle(), DVec3::from(up), degrees);
        let distance = (subject.middle() - camera.eye()).dot(camera.forward());
        let target = camera.eye() + camera.forward() * distance;
        Drawing { step_voxels, camera: View { eye: camera.eye().to_array(), target: target.to_array(), up } }
    }
}
