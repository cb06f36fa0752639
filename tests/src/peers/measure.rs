//! Contestants take turns at each step of a scene; their pictures are held to the answers of their domains.

use std::path::{Path, PathBuf};
use std::time::Instant;

use brickfield::BackendKind;
use serde::Serialize;

use super::answers::{Answers, read_picture};
use super::beside::Beside;
use super::lineup::{Build, Exhibit, Lineup, Who};
use super::page::Page;
use super::process::Contestant;
use super::protocol::{Domain, Drawing, Drawn, Part};
use super::scenes::Subject;
use super::standing::{TimeRatio, TimeToError, ratios, times_to_errors};
use super::{PeersArgs, PeersError, descent, table};
use crate::compare::rivals::Rivals;
use crate::report::BackendInfo;
use crate::turns::{Spread, take_turns};

/// Untimed rounds of a step: a frame by a camera elsewhere, then the picture. With a stuck camera a contestant shows the wrong picture.
const WARM_UP: u32 = 2;
/// How far the camera of the first round is turned.
const ELSEWHERE_DEGREES: f64 = 30.0;

/// A scene, all contestants and steps.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs)]
pub struct SceneReport {
    pub name: String,
    pub dims: [u32; 3],
    pub scalar: String,
    pub contestants: Vec<ContestantInfo>,
    pub steps: Vec<StepReport>,
    /// Pictures that were drawn once, for their errors alone.
    pub probes: Vec<Probe>,
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
    /// A shift of the picture from the answer.
    pub beside: Beside,
}

/// What is said of a picture.
pub(super) struct Judged {
    pub(super) rmse: f64,
    pub(super) max_abs: f64,
    pub(super) beside: Beside,
}

/// The error of a contestant at a step at which it was not timed.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[allow(missing_docs)]
pub struct Probe {
    pub contestant: String,
    pub step_voxels: f64,
    pub rmse: f64,
}

/// A contestant's frames at a step.
pub(super) struct Frames {
    picture: PathBuf,
    pub(super) first: Drawn,
    timed: Vec<Drawn>,
}

/// A scene that is being measured.
pub(super) struct Measuring<'a> {
    args: &'a PeersArgs,
    exhibit: &'a Exhibit,
    present: Vec<Contestant>,
    answers: Answers<'a>,
    page: Page<'a>,
    pub(super) report: SceneReport,
}

/// Measures a scene, and writes its page.
pub(super) fn scene(
    args: &PeersArgs,
    lineup: &Lineup,
    subject: Subject,
    say: &mut dyn FnMut(&str),
) -> Result<SceneReport, PeersError> {
    let exhibit = Exhibit::new(args, subject)?;
    let mut measuring = Measuring::new(args, lineup, &exhibit, say)?;
    for step in &args.steps {
        measuring.step(*step, &|_| true, say)?;
    }
    if args.to_error {
        descent::descend(&mut measuring, say)?;
    }
    let Measuring { mut report, page, .. } = measuring;
    report.times_to_errors = times_to_errors(&report);
    say(&table::times_to_errors(&report));
    page.publish(&report)?;
    Ok(report)
}

impl<'a> Measuring<'a> {
    fn new(
        args: &'a PeersArgs,
        lineup: &Lineup,
        exhibit: &'a Exhibit,
        say: &mut dyn FnMut(&str),
    ) -> Result<Measuring<'a>, PeersError> {
        let subject = &exhibit.subject;
        let (present, contestants) = contestants(args, lineup, exhibit)?;
        let report = SceneReport {
            name: subject.name.clone(),
            dims: subject.volume.grid().dims().to_array(),
            scalar: subject.volume.scalar_type().to_string(),
            contestants,
            steps: Vec::new(),
            probes: Vec::new(),
            times_to_errors: Vec::new(),
        };
        say(&table::heading(&report));
        let mut answers = Answers::new(subject, args.view.size);
        let (begin, answer) = (Instant::now(), answers.of(Domain::Voxels, 1.0));
        let page = Page::new(args, subject, answer, begin.elapsed().as_secs_f64())?;
        Ok(Measuring { args, exhibit, present, answers, page, report })
    }

    /// Times some contestants at a step.
    pub(super) fn step(
        &mut self,
        step_voxels: f64,
        is_timed: &dyn Fn(&str) -> bool,
        say: &mut dyn FnMut(&str),
    ) -> Result<(), PeersError> {
        let Measuring { args, exhibit, present, answers, page, report } = self;
        let mut present: Vec<&mut Contestant> =
            present.iter_mut().filter(|contestant| is_timed(&contestant.who.to_string())).collect();
        let frames = frames(args, exhibit, &mut present, step_voxels, &mut report.contestants)?;
        let mut rows = Vec::new();
        for (contestant, frames) in present.iter().zip(frames) {
            let Some(frames) = frames else { continue };
            let answer = answers.of(contestant.opened.domain, contestant.opened.view);
            let row = match read_picture(&frames.picture, answer.size()) {
                Ok(image) => page.add(contestant, step_voxels, &frames, &image, answer)?,
                Err(reason) => Err(reason),
            };
            match row {
                Ok(row) => rows.push(row),
                Err(reason) => fail(&mut report.contestants, contestant.who, reason),
            }
        }
        let who: Vec<Who> = present.iter().map(|c| c.who).collect();
        let step = StepReport { step_voxels, ratios: ratios(&who, &rows), rows };
        say(&table::step(report, &step));
        report.steps.push(step);
        Ok(())
    }

    /// Has a contestant draw one picture at a step, for its error.
    pub(super) fn probe(&mut self, contestant: &str, step_voxels: f64) {
        let Measuring { exhibit, present, answers, report, .. } = self;
        let of_that_name = present.iter_mut().find(|c| c.who.to_string() == contestant);
        let Some(present) = of_that_name else { return };
        let path = exhibit.folder.path().join("probe.f32");
        let drawn = present.picture(exhibit.drawing(step_voxels, 0.0), &path);
        match drawn.and_then(|_| answers.rmse(&path, &present.opened)) {
            Ok(rmse) => report.probes.push(Probe { contestant: contestant.to_owned(), step_voxels, rmse }),
            Err(reason) => fail(&mut report.contestants, present.who, reason),
        }
    }
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
    present: &mut [&mut Contestant],
    step: f64,
    infos: &mut [ContestantInfo],
) -> Result<Vec<Option<Frames>>, PeersError> {
    let mut found: Vec<Option<Frames>> = present.iter().map(|_| None).collect();
    let failed = |infos: &[ContestantInfo], who: Who| infos.iter().any(|i| i.who == who && i.absent.is_some());
    take_turns::<PeersError>(present.len(), WARM_UP - 1 + args.frames, |turn| {
        let contestant = &mut present[turn.contestant];
        if failed(infos, contestant.who) {
            return Ok(f64::NAN);
        }
        let own = &mut found[turn.contestant];
        let turned = if turn.round == 0 { ELSEWHERE_DEGREES } else { args.turn * f64::from(turn.round - 1) };
        let drawing = exhibit.drawing(step, turned);
        let path = exhibit.folder.path().join(format!("{}.f32", turn.contestant));
        let drawn = draw(contestant, drawing, turn.round, own, &path);
        Ok(drawn.unwrap_or_else(|reason| {
            *own = None;
            fail(infos, contestant.who, reason);
            f64::NAN
        }))
    })?;
    Ok(found)
}

/// A frame of a round, in milliseconds.
fn draw(
    contestant: &mut Contestant,
    drawing: Drawing,
    round: u32,
    own: &mut Option<Frames>,
    picture: &Path,
) -> Result<f64, String> {
    let is_picture = round == WARM_UP - 1;
    let drawn = if is_picture { contestant.picture(drawing, picture)? } else { contestant.frame(drawing)? };
    let ms = drawn.wall_ms;
    match own {
        None => *own = Some(Frames { picture: picture.to_owned(), first: drawn, timed: Vec::new() }),
        Some(frames) if round >= WARM_UP => frames.timed.push(drawn),
        Some(_) => {}
    }
    Ok(ms)
}

impl Frames {
    /// The times of the timed frames, with the errors of the picture.
    pub(super) fn measured(&self, who: Who, step_voxels: f64, judged: Judged) -> Measured {
        let wall_ms: Vec<f64> = self.timed.iter().map(|d| d.wall_ms).collect();
        let cpu_ms: Vec<f64> = self.timed.iter().map(|d| d.cpu_ms).collect();
        let (wall, cpu) = (Spread::of(&wall_ms), Spread::of(&cpu_ms));
        let Judged { rmse, max_abs, beside } = judged;
        Measured { contestant: who.to_string(), step_voxels, wall, cpu, wall_ms, cpu_ms, rmse, max_abs, beside }
    }
}
