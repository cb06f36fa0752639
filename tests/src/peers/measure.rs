//! Contestants take turns at each step of a scene; their pictures are held to the answers of their domains.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use brickfield::BackendKind;
use brickfield::core::glam::{DVec3, UVec2};
use brickfield::core::{Aabb, Image};
use brickfield::cpu::{ContinuousOptions, continuous};
use brickfield::io::{SaveOptions, save};
use serde::Serialize;

use super::process::Contestant;
use super::protocol::{Domain, Drawing, Drawn, Opening, Part, SceneFile, View, numpy_name};
use super::python::Python;
use super::scenes::Subject;
use super::{Build, Peer, PeersArgs, PeersError, Who, table};
use crate::compare::rivals::Rivals;
use crate::frames::turned;
use crate::metrics::color_errors;
use crate::report::BackendInfo;
use crate::turns::{Ratio, Spread, take_turns};

/// How far the answer is driven: its error is a thousandth of the least that is asked of a contestant.
const ACCURACY: ContinuousOptions = ContinuousOptions { tolerance: 1e-7, transmittance_floor: 1e-8 };
/// Frames of a contestant before the timed ones, at each step: the one whose picture is kept, and one that warms up.
const WARM_UP: u32 = 1;

/// A scene, all contestants and steps.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs)]
pub struct SceneReport {
    pub name: String,
    pub dims: [u32; 3],
    pub scalar: String,
    pub contestants: Vec<ContestantInfo>,
    pub steps: Vec<StepReport>,
}

/// A contestant in a scene, and whether it took part.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs)]
pub struct ContestantInfo {
    pub name: String,
    pub version: String,
    pub device: String,
    pub domain: Option<Domain>,
    /// What it did once, before its first frame.
    pub phases: Vec<Part>,
    /// Why it did not take part, or from some frame on no longer, in a line.
    pub absent: Option<String>,
}

/// All contestants at a step.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs)]
pub struct StepReport {
    pub step_voxels: f64,
    pub rows: Vec<Measured>,
    pub ratios: Vec<TimeRatio>,
}

/// A contestant at a step.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs)]
pub struct Measured {
    pub contestant: String,
    pub step_voxels: f64,
    /// Milliseconds a frame.
    pub wall: Spread,
    pub cpu: Spread,
    pub wall_ms: Vec<f64>,
    pub cpu_ms: Vec<f64>,
    /// Over all pixels and three colour channels, against the answer of its domain.
    pub rmse: f64,
    pub max_abs: f64,
}

/// How many times as long one contestant takes as another at a step.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs)]
pub struct TimeRatio {
    pub of: String,
    pub to: String,
    pub cpu: Ratio,
    pub wall: Ratio,
}

/// Who is asked to take part.
pub(super) struct Lineup {
    pub(super) who: Vec<Who>,
    python: Python,
    this: PathBuf,
    other: Option<PathBuf>,
}

impl Lineup {
    pub(super) fn new(args: &PeersArgs) -> Result<Lineup, PeersError> {
        let mut backends = args.rivals.backends.clone();
        backends.sort();
        backends.dedup();
        let builds = if args.other.is_some() { &[Build::This, Build::Other][..] } else { &[Build::This] };
        let mut who = Vec::new();
        for backend in backends {
            for mode in &args.modes {
                who.extend(builds.iter().map(|build| Who::Own { build: *build, backend, mode: *mode }));
            }
        }
        let mut peers: Vec<Peer> = args.peers.iter().copied().flatten().collect();
        peers.dedup();
        who.extend(peers.into_iter().map(Who::Peer));
        let this = std::env::current_exe().map_err(PeersError::Temporary)?;
        Ok(Lineup { who, python: Python::new(args.python.as_deref())?, this, other: args.other.clone() })
    }

    /// The command of a process that serves a contestant.
    pub(super) fn command(&self, who: Who) -> Command {
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

/// A scene's file, and what contestants are told of it.
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
        // What the file holds: the values of a volume that has a rescale, say.
        let volume =
            brickfield::io::open(&path, &Default::default()).map_err(brickfield::options::OptionError::from)?.volume;
        let n_bytes = volume.grid().n_voxels() as u64 * volume.scalar_type().n_bytes() as u64;
        let length = std::fs::metadata(&path).map_err(PeersError::Temporary)?.len();
        let grid = volume.grid();
        let file = SceneFile {
            offset: length - n_bytes,
            path,
            dims: grid.dims().to_array(),
            spacing: grid.spacing().to_array(),
            dtype: numpy_name(volume.scalar_type()).to_owned(),
            size: args.view.size.x,
            fov_degrees: subject.fov_degrees,
            knots: subject.transfer.knots().to_vec(),
        };
        let (brick, adapter) = (args.tree.brick.n_samples(), args.rivals.adapter.clone());
        Ok(Exhibit { subject: Subject { volume, ..subject }, folder, file, brick, adapter })
    }

    pub(super) fn open(&self, lineup: &Lineup, who: Who) -> Result<Result<Contestant, String>, PeersError> {
        let adapter = self.adapter.clone().filter(|_| !matches!(who, Who::Own { backend: BackendKind::Cpu, .. }));
        let opening = Opening { contestant: who.served_name(), scene: self.file.clone(), brick: self.brick, adapter };
        Contestant::open(who, lineup.command(who), opening)
    }

    /// The frame of a camera that has turned.
    pub(super) fn drawing(&self, step_voxels: f64, degrees: f64) -> Drawing {
        let subject = &self.subject;
        let axis = DVec3::from(subject.view.up);
        let camera = turned(&subject.camera(1.0), subject.middle(), axis, degrees);
        let distance = (subject.middle() - camera.eye()).dot(camera.forward());
        let target = camera.eye() + camera.forward() * distance;
        let view = View { eye: camera.eye().to_array(), target: target.to_array(), up: subject.view.up };
        Drawing { step_voxels, camera: view }
    }
}

/// The answers of domains and fields of view.
struct Answers<'a> {
    subject: &'a Subject,
    size: u32,
    known: HashMap<(Domain, u64), Image<f64>>,
}

impl Answers<'_> {
    fn of(&mut self, domain: Domain, view: f64) -> &Image<f64> {
        let Answers { subject, size, known } = self;
        known.entry((domain, view.to_bits())).or_insert_with(|| {
            let (volume, camera) = (&subject.volume, subject.camera(view));
            let last = volume.grid().dims().as_dvec3() - 1.0;
            let clip = match domain {
                Domain::Voxels => Aabb { min: DVec3::NEG_INFINITY, max: DVec3::INFINITY },
                Domain::Centres => Aabb { min: DVec3::ZERO, max: last },
            };
            continuous(volume, &subject.transfer, &camera, UVec2::splat(*size), &clip, &ACCURACY).image
        })
    }
}

/// Measures a scene.
pub(super) fn scene(
    args: &PeersArgs,
    lineup: &Lineup,
    subject: Subject,
    say: &mut dyn FnMut(&str),
) -> Result<SceneReport, PeersError> {
    let exhibit = Exhibit::new(args, subject)?;
    let (mut present, mut infos) = (Vec::new(), Vec::new());
    for who in &lineup.who {
        let opened = exhibit.open(lineup, *who)?;
        infos.push(info(*who, &opened));
        present.extend(opened);
    }
    check_backends(args, &infos)?;
    let subject = &exhibit.subject;
    let mut answers = Answers { subject, size: args.view.size.x, known: HashMap::new() };
    let mut report = SceneReport {
        name: subject.name.clone(),
        dims: subject.volume.grid().dims().to_array(),
        scalar: subject.volume.scalar_type().to_string(),
        contestants: infos,
        steps: Vec::new(),
    };
    say(&table::heading(&report));
    for step in &args.steps {
        let frames = frames(args, &exhibit, &mut present, *step, &mut report.contestants)?;
        let mut rows = Vec::new();
        for (contestant, frames) in present.iter().zip(frames) {
            let Some(frames) = frames else { continue };
            let answer = answers.of(contestant.opened.domain, contestant.opened.view);
            rows.push(measured(contestant, *step, frames, answer)?);
        }
        let whos: Vec<Who> = present.iter().map(|c| c.who).collect();
        let ratios = ratios(&whos, &rows);
        let step = StepReport { step_voxels: *step, rows, ratios };
        say(&table::step(&report, &step));
        report.steps.push(step);
    }
    Ok(report)
}

fn info(who: Who, opened: &Result<Contestant, String>) -> ContestantInfo {
    let name = who.to_string();
    match opened {
        Ok(Contestant { opened, .. }) => ContestantInfo {
            name,
            version: opened.version.clone(),
            device: opened.device.clone(),
            domain: Some(opened.domain),
            phases: opened.phases.clone(),
            absent: None,
        },
        Err(reason) => ContestantInfo {
            name,
            version: String::new(),
            device: String::new(),
            domain: None,
            phases: Vec::new(),
            absent: Some(reason.clone()),
        },
    }
}

/// Required backends must be there.
fn check_backends(args: &PeersArgs, infos: &[ContestantInfo]) -> Result<(), PeersError> {
    let info = |backend: &BackendKind| {
        let own = infos.iter().find(|i| i.name.split(' ').next() == Some(backend.name()))?;
        let (adapter, driver) = (Some(own.device.clone()), None);
        Some(BackendInfo { backend: backend.name().to_owned(), adapter, driver, absent: own.absent.clone() })
    };
    let infos = args.rivals.backends.iter().filter_map(info).collect();
    Ok(Rivals { present: Vec::new(), infos }.check_required(&args.rivals.require)?)
}

/// A contestant's frames at a step.
struct Frames {
    picture: PathBuf,
    first: Drawn,
    timed: Vec<Drawn>,
}

/// Gives each contestant its turns. `None` for one that failed, now or at an earlier step.
fn frames(
    args: &PeersArgs,
    exhibit: &Exhibit,
    present: &mut [Contestant],
    step: f64,
    infos: &mut [ContestantInfo],
) -> Result<Vec<Option<Frames>>, PeersError> {
    let mut found: Vec<Option<Frames>> = present.iter().map(|_| None).collect();
    take_turns::<PeersError>(present.len(), WARM_UP + args.frames, |turn| {
        let contestant = &mut present[turn.contestant];
        let name = contestant.who.to_string();
        let info = infos.iter_mut().find(|i| i.name == name).expect("every contestant has its line");
        if info.absent.is_some() {
            return Ok(f64::NAN);
        }
        let drawing = exhibit.drawing(step, args.turn * f64::from(turn.round));
        let own = &mut found[turn.contestant];
        let drawn = if turn.warms_up() {
            let picture = exhibit.folder.path().join(format!("{}.f32", turn.contestant));
            let drawn = contestant.picture(drawing, &picture);
            *own = drawn.clone().ok().map(|first| Frames { picture, first, timed: Vec::new() });
            drawn
        } else {
            contestant.frame(drawing)
        };
        match (drawn, own.as_mut()) {
            (Ok(drawn), Some(frames)) => {
                if turn.round > WARM_UP {
                    frames.timed.push(drawn.clone());
                }
                Ok(drawn.wall_ms)
            }
            (drawn, _) => {
                info.absent = Some(drawn.err().unwrap_or_default());
                *own = None;
                Ok(f64::NAN)
            }
        }
    })?;
    Ok(found)
}

fn measured(contestant: &Contestant, step: f64, frames: Frames, answer: &Image<f64>) -> Result<Measured, PeersError> {
    let image = read_picture(&frames.picture, answer.size())?;
    let errors = color_errors(&image, answer)
        .map_err(|e| PeersError::Picture { contestant: contestant.who.to_string(), reason: e.to_string() })?;
    let wall_ms: Vec<f64> = frames.timed.iter().map(|d| d.wall_ms).collect();
    let cpu_ms: Vec<f64> = frames.timed.iter().map(|d| d.cpu_ms).collect();
    Ok(Measured {
        contestant: contestant.who.to_string(),
        step_voxels: step,
        wall: Spread::of(&wall_ms),
        cpu: Spread::of(&cpu_ms),
        wall_ms,
        cpu_ms,
        rmse: errors.rmse,
        max_abs: errors.worst.difference,
    })
}

/// A raw picture of a contestant.
fn read_picture(path: &Path, size: UVec2) -> Result<Image<f32>, PeersError> {
    let out = |source| PeersError::Out { path: path.to_owned(), source };
    let bytes = std::fs::read(path).map_err(out)?;
    let channel = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    let pixels = bytes.chunks_exact(16).map(|p| std::array::from_fn(|c| channel(&p[4 * c..]))).collect();
    Image::new(size, pixels).map_err(|e| out(std::io::Error::other(e)))
}

/// Whose times are stated as a part of whose.
fn ratios(present: &[Who], rows: &[Measured]) -> Vec<TimeRatio> {
    let row = |who: &Who| rows.iter().find(|r| r.contestant == who.to_string());
    let mut ratios = Vec::new();
    for of in present {
        for to in present.iter().filter(|to| is_held_against(of, to)) {
            if let (Some(a), Some(b)) = (row(of), row(to)) {
                let (cpu, wall) = (Ratio::of(&a.cpu_ms, &b.cpu_ms), Ratio::of(&a.wall_ms, &b.wall_ms));
                ratios.push(TimeRatio { of: of.to_string(), to: to.to_string(), cpu, wall });
            }
        }
    }
    ratios
}

/// GPU paths are held against pygfx, the CPU path against VTK's fixed-point mapper, exact mode against fast mode, this build
/// against the other.
fn is_held_against(of: &Who, to: &Who) -> bool {
    let Who::Own { build, backend, mode } = *of else { return false };
    match *to {
        Who::Peer(Peer::VtkFixed) => backend == BackendKind::Cpu,
        Who::Peer(Peer::Pygfx) => backend != BackendKind::Cpu,
        Who::Peer(_) => false,
        Who::Own { build: b, backend: kind, mode: m } if kind == backend => {
            (b == build && m != mode && mode.name() == "exact") || (b != build && m == mode && build == Build::This)
        }
        Who::Own { .. } => false,
    }
}
