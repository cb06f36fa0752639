//! Contestants take turns at each step of a scene; their pictures are held to the answers of their domains.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use brickfield::BackendKind;
use brickfield::core::glam::{DVec3, UVec2};
use brickfield::core::{Aabb, Image};
use brickfield::cpu::{ContinuousOptions, continuous};
use serde::Serialize;

use super::lineup::{Build, Exhibit, Lineup, Who};
use super::page::Page;
use super::process::Contestant;
use super::protocol::{Domain, Drawn, Part};
use super::scenes::Subject;
use super::standing::{TimeRatio, TimeToError, ratios, times_to_errors};
use super::{PeersArgs, PeersError, table};
use crate::compare::rivals::Rivals;
use crate::metrics::opaque;
use crate::report::BackendInfo;
use crate::turns::{Spread, take_turns};

/// How far the answer is driven: its error is a thousandth of the least that is asked of a contestant.
pub(super) const ACCURACY: ContinuousOptions = ContinuousOptions { tolerance: 1e-7, transmittance_floor: 1e-8 };
/// Frames of a contestant at each step that warm up, after the one whose picture is kept.
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
    pub times_to_errors: Vec<TimeToError>,
}

/// A contestant in a scene, and whether it took part.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs)]
pub struct ContestantInfo {
    #[serde(skip)]
    pub(super) who: Who,
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

/// A contestant's frames at a step.
pub(super) struct Frames {
    picture: PathBuf,
    pub(super) first: Drawn,
    timed: Vec<Drawn>,
}

/// The answers of domains and fields of view, over black.
struct Answers<'a> {
    subject: &'a Subject,
    size: UVec2,
    known: HashMap<(Domain, u64), Image<f64>>,
}

impl Answers<'_> {
    fn of(&mut self, domain: Domain, view: f64) -> &Image<f64> {
        let Answers { subject, size, known } = self;
        known.entry((domain, view.to_bits())).or_insert_with(|| {
            let (volume, camera) = (&subject.volume, subject.camera(view));
            let clip = match domain {
                Domain::Voxels => Aabb { min: DVec3::NEG_INFINITY, max: DVec3::INFINITY },
                Domain::Centres => Aabb { min: DVec3::ZERO, max: volume.grid().dims().as_dvec3() - 1.0 },
            };
            opaque(&continuous(volume, &subject.transfer, &camera, *size, &clip, &ACCURACY).image)
        })
    }
}

/// Measures a scene, and writes its page.
pub(super) fn scene(
    args: &PeersArgs,
    lineup: &Lineup,
    subject: Subject,
    say: &mut dyn FnMut(&str),
) -> Result<SceneReport, PeersError> {
    let exhibit = Exhibit::new(args, subject)?;
    let subject = &exhibit.subject;
    let (mut present, contestants) = contestants(args, lineup, &exhibit)?;
    let mut report = SceneReport {
        name: subject.name.clone(),
        dims: subject.volume.grid().dims().to_array(),
        scalar: subject.volume.scalar_type().to_string(),
        contestants,
        steps: Vec::new(),
        times_to_errors: Vec::new(),
    };
    say(&table::heading(&report));
    let mut answers = Answers { subject, size: args.view.size, known: HashMap::new() };
    let (begin, answer) = (Instant::now(), answers.of(Domain::Voxels, 1.0));
    let mut page = Page::new(args, subject, answer, begin.elapsed().as_secs_f64())?;
    for step in &args.steps {
        let frames = frames(args, &exhibit, &mut present, *step, &mut report.contestants)?;
        let mut rows = Vec::new();
        for (contestant, frames) in present.iter().zip(frames) {
            let Some(frames) = frames else { continue };
            let answer = answers.of(contestant.opened.domain, contestant.opened.view);
            let image = read_picture(&frames.picture, answer.size())?;
            match page.add(contestant, *step, &frames, &image, answer)? {
                Ok(row) => rows.push(row),
                Err(reason) => fail(&mut report.contestants, contestant.who, reason),
            }
        }
        let who: Vec<Who> = present.iter().map(|c| c.who).collect();
        let step = StepReport { step_voxels: *step, ratios: ratios(&who, &rows), rows };
        say(&table::step(&report, &step));
        report.steps.push(step);
    }
    report.times_to_errors = times_to_errors(&report.steps);
    say(&table::times_to_errors(&report));
    page.publish(&report)?;
    Ok(report)
}

/// The contestants that can be had, and a line for each that was asked for.
pub(super) fn contestants(
    args: &PeersArgs,
    lineup: &Lineup,
    exhibit: &Exhibit,
) -> Result<(Vec<Contestant>, Vec<ContestantInfo>), PeersError> {
    let (mut present, mut infos) = (Vec::new(), Vec::new());
    for who in &lineup.who {
        let opened = exhibit.open(lineup, *who)?;
        infos.push(info(*who, &opened));
        present.extend(opened);
    }
    let own = |backend: &BackendKind| {
        let is_own =
            |i: &&ContestantInfo| matches!(i.who, Who::Own { build: Build::This, backend: b, .. } if b == *backend);
        infos.iter().find(is_own).map(ContestantInfo::backend)
    };
    let backends = args.rivals.backends.iter().filter_map(own).collect();
    Rivals { present: Vec::new(), infos: backends }.check_required(&args.rivals.require)?;
    Ok((present, infos))
}

fn info(who: Who, opened: &Result<Contestant, String>) -> ContestantInfo {
    let absent = ContestantInfo {
        who,
        name: who.to_string(),
        version: String::new(),
        device: String::new(),
        domain: None,
        phases: Vec::new(),
        absent: opened.as_ref().err().cloned(),
    };
    let Ok(Contestant { opened, .. }) = opened else { return absent };
    ContestantInfo {
        version: opened.version.clone(),
        device: opened.device.clone(),
        domain: Some(opened.domain),
        phases: opened.phases.clone(),
        ..absent
    }
}

impl ContestantInfo {
    /// Its line among backends, on the page.
    pub(super) fn backend(&self) -> BackendInfo {
        let took_part = self.domain.is_some();
        BackendInfo {
            backend: self.who.backend().to_owned(),
            adapter: took_part.then(|| self.version.clone()),
            driver: took_part.then(|| self.device.clone()),
            absent: self.absent.clone().filter(|_| !took_part),
        }
    }
}

/// A contestant that takes part no longer.
fn fail(infos: &mut [ContestantInfo], who: Who, reason: String) {
    infos.iter_mut().filter(|i| i.who == who).for_each(|i| i.absent = Some(reason.clone()));
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
    let failed = |infos: &[ContestantInfo], who: Who| infos.iter().any(|i| i.who == who && i.absent.is_some());
    take_turns::<PeersError>(present.len(), WARM_UP + args.frames, |turn| {
        let contestant = &mut present[turn.contestant];
        if failed(infos, contestant.who) {
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
        match drawn {
            Ok(drawn) => {
                let ms = drawn.wall_ms;
                own.iter_mut().filter(|_| turn.round > WARM_UP).for_each(|own| own.timed.push(drawn.clone()));
                Ok(ms)
            }
            Err(reason) => {
                *own = None;
                fail(infos, contestant.who, reason);
                Ok(f64::NAN)
            }
        }
    })?;
    Ok(found)
}

impl Frames {
    /// The times of the timed frames, with the errors of the picture.
    pub(super) fn measured(&self, who: Who, step_voxels: f64, rmse: f64, max_abs: f64) -> Measured {
        let wall_ms: Vec<f64> = self.timed.iter().map(|d| d.wall_ms).collect();
        let cpu_ms: Vec<f64> = self.timed.iter().map(|d| d.cpu_ms).collect();
        let (wall, cpu) = (Spread::of(&wall_ms), Spread::of(&cpu_ms));
        Measured { contestant: who.to_string(), step_voxels, wall, cpu, wall_ms, cpu_ms, rmse, max_abs }
    }
}

/// A raw picture of a contestant.
fn read_picture(path: &Path, size: UVec2) -> Result<Image<f32>, PeersError> {
    let out = |source| PeersError::Out { path: path.to_owned(), source };
    let bytes = std::fs::read(path).map_err(out)?;
    let channel = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    let pixels = bytes.chunks_exact(16).map(|p| std::array::from_fn(|c| channel(&p[4 * c..]))).collect();
    Image::new(size, pixels).map_err(|e| out(std::io::Error::other(e)))
}
