//! The page of a scene: that of `compare`, with the peers as further curves.

use std::time::Instant;

use brickfield::core::Image;
use brickfield::core::glam::UVec2;

use super::answers::ACCURACY;
use super::beside::beside;
use super::lineup::{Build, Who};
use super::measure::{ContestantInfo, Frames, Judged, Measured, SceneReport, StepReport};
use super::process::Contestant;
use super::protocol::Domain;
use super::scenes::Subject;
use super::{PeersArgs, PeersError};
use crate::compare::output::{Caption, Effort, OutputError, OutputFolder, Pictures};
use crate::compare::{CompareError, drivers, subject::projection_text};
use crate::report::{
    BackendInfo, Channels, LeftOut, Machine, REPORT_FORMAT, ReferenceInfo, Report, Row, SceneInfo, commit, mark_front,
    page,
};

/// Pictures over black.
const BACKGROUND: [f64; 3] = [0.0; 3];

/// A page that is being made.
pub(super) struct Page<'a> {
    args: &'a PeersArgs,
    subject: &'a Subject,
    output: OutputFolder,
    reference: ReferenceInfo,
    rows: Vec<Row>,
    begin: Instant,
}

/// What the reference is.
const ANSWER: &str = "the continuous integral in f64 of whole voxels, over black. Pictures of VTK are held to the one between \
                      the outer sample centres, and those of its fixed-point mapper to that one on the mapper's own grid of pixels";

impl<'a> Page<'a> {
    /// The answer took some seconds.
    pub(super) fn new(
        args: &'a PeersArgs,
        subject: &'a Subject,
        answer: &Image<f64>,
        seconds: f64,
    ) -> Result<Page<'a>, PeersError> {
        let output = OutputFolder::new(&args.out.join(&subject.name))?;
        let files = output.picture("reference", &answer.map(|v| v as f32), BACKGROUND, &[])?;
        let begin = Instant::now();
        let reference = ReferenceInfo {
            what: ANSWER.to_owned(),
            tolerance: ACCURACY.tolerance,
            seconds,
            png: files.png,
            exr: files.exr,
        };
        Ok(Page { args, subject, output, reference, rows: Vec::new(), begin })
    }

    /// Judges a picture, and keeps it. The inner error says why it has no errors.
    pub(super) fn add(
        &mut self,
        contestant: &Contestant,
        step_voxels: f64,
        frames: &Frames,
        image: &Image<f32>,
        answer: &Image<f64>,
    ) -> Result<Result<Measured, String>, PeersError> {
        let who = contestant.who;
        let (mode, rule) = curve(who);
        let adapter = contestant.opened.device.clone();
        let caption = Caption { backend: who.backend(), adapter, mode, rule, step_voxels };
        let pictures = Pictures { output: &self.output, answer, background: BACKGROUND, channels: Channels::Colors };
        let shown = match pictures.judge(&caption, image)? {
            Ok(shown) => shown,
            Err(reason) => return Ok(Err(reason)),
        };
        let judged =
            Judged { rmse: shown.errors.rmse, max_abs: shown.errors.worst.difference, beside: beside(image, answer) };
        let measured = frames.measured(who, step_voxels, judged);
        let samples = self.n_samples(contestant.opened.domain, step_voxels);
        let upload = frames.first.parts.iter().find(|part| part.name == "upload");
        let upload_ms = upload.map_or(0.0, |part| part.wall_ms);
        let (wall, n_frames) = (measured.wall, measured.wall_ms.len());
        self.rows.push(shown.row(caption, Effort { samples, wall, n_frames, device_ms: None, upload_ms }));
        Ok(Ok(measured))
    }

    /// Writes the page and its report.
    pub(super) fn publish(mut self, scene: &SceneReport) -> Result<(), PeersError> {
        let absent = scene.contestants.iter().find_map(|c| c.absent.clone());
        if let (true, Some(reason)) = (self.rows.is_empty(), absent) {
            return Err(CompareError::Nothing { reason }.into());
        }
        mark_front(&mut self.rows);
        let backends = backends(&scene.contestants);
        let report = Report {
            format: REPORT_FORMAT,
            scene: self.scene(scene),
            commit: commit(),
            machine: Machine::here(),
            driver: drivers(
                &backends.iter().filter(|b| ["wgpu", "ash"].contains(&&*b.backend)).cloned().collect::<Vec<_>>(),
            ),
            backends,
            reference: self.reference,
            channels: Channels::Colors,
            rows: self.rows,
            left_out: left_out(scene),
            total_seconds: self.begin.elapsed().as_secs_f64(),
        };
        let html = page(&report, self.output.folder()).map_err(OutputError::Page)?;
        Ok(self.output.publish(&report, &html)?)
    }

    fn scene(&self, scene: &SceneReport) -> SceneInfo {
        let camera = self.subject.camera(1.0);
        SceneInfo {
            name: scene.name.clone(),
            dims: scene.dims,
            spacing: self.subject.volume.grid().spacing().to_array(),
            scalar: scene.scalar.clone(),
            size: self.args.view.size.to_array(),
            eye: camera.eye().to_array(),
            forward: camera.forward().to_array(),
            up: camera.up().to_array(),
            projection: projection_text(&camera),
            transfer: self.subject.transfer.clone(),
            background: BACKGROUND,
            command: self.args.command.clone(),
        }
    }

    /// Steps of all rays in a domain.
    fn n_samples(&self, domain: Domain, step_voxels: f64) -> u64 {
        let (grid, size) = (self.subject.volume.grid(), self.args.view.size);
        let mut bounds = grid.world_box();
        if domain == Domain::Centres {
            bounds.min += 0.5 * grid.spacing();
            bounds.max -= 0.5 * grid.spacing();
        }
        let (rays, step) = (self.subject.camera(1.0).pixel_rays(size), step_voxels * grid.spacing().min_element());
        let steps =
            |UVec2 { x, y }| rays.pixel_ray(x, y).clip(&bounds).map_or(0, |s| ((s.end - s.start) / step).ceil() as u64);
        (0..size.y).flat_map(|y| (0..size.x).map(move |x| UVec2::new(x, y))).map(steps).sum()
    }
}

const OTHER_BUILD: &str = "other-build";

/// Mode and rule, as the page names them.
const fn curve(who: Who) -> (&'static str, &'static str) {
    match who {
        Who::Own { build: Build::This, mode, .. } => (mode.name(), "midpoint"),
        Who::Own { build: Build::Other, mode, .. } => (mode.name(), OTHER_BUILD),
        Who::Peer(_) => ("fast", "peer"),
    }
}

/// One line for each backend of this build, and for each peer.
fn backends(contestants: &[ContestantInfo]) -> Vec<BackendInfo> {
    let mut infos: Vec<BackendInfo> = Vec::new();
    for info in contestants.iter().filter(|c| curve(c.who).1 != OTHER_BUILD).map(ContestantInfo::backend) {
        if infos.iter().all(|known| known.backend != info.backend) {
            infos.push(info);
        }
    }
    infos
}

/// The steps of contestants that failed.
fn left_out(scene: &SceneReport) -> Vec<LeftOut> {
    let failed = scene.contestants.iter().filter(|c| c.domain.is_some() && c.absent.is_some());
    let of = |c: &ContestantInfo| {
        let (mode, rule) = curve(c.who);
        let reason = c.absent.clone().unwrap_or_default();
        let missing = scene.steps.iter().filter(|step| step.rows.iter().all(|row| row.contestant != c.name));
        let left_out = |step: &StepReport| LeftOut {
            backend: c.who.backend().to_owned(),
            mode: mode.to_owned(),
            rule: rule.to_owned(),
            step_voxels: step.step_voxels,
            reason: reason.clone(),
        };
        missing.map(left_out).collect::<Vec<_>>()
    };
    failed.flat_map(of).collect()
}
