//! Error against run time: one scene on every backend, over steps, rules and modes, against the continuous answer.

mod contest;
mod options;
pub(crate) mod output;
pub(crate) mod rivals;
pub(crate) mod subject;
mod sweep;

use std::time::{Duration, Instant};

use brickfield::Scene;
use brickfield::core::Image;
use brickfield::cpu::{ContinuousOptions, continuous};
use indicatif::ProgressBar;

use crate::report::{
    BackendInfo, Channels, LeftOut, Machine, REPORT_FORMAT, ReferenceInfo, Report, Row, SceneInfo, commit, mark_front,
    page,
};

pub use options::{CompareArgs, parse};
pub(crate) use options::{each_once, typed};
pub use output::{OutputError, say};
pub use rivals::RivalArgs;

use contest::{Contest, MeasureLimits};
use output::{OutputFolder, Pictures};
use subject::Exhibit;

/// Why a comparison could not be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum CompareError {
    #[error(transparent)]
    Options(#[from] brickfield::options::OptionError),
    #[error(transparent)]
    Prepare(#[from] brickfield::PrepareError),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error("{backend} is required and absent: {reason}")]
    Required { backend: String, reason: String },
    #[error("no backend to compare: {reasons}")]
    NoBackend { reasons: String },
    #[error("no measurement succeeded; the first reason: {reason}")]
    Nothing { reason: String },
}

impl CompareError {
    /// The exit status that scripts see: 1 failed, 2 unusable arguments, 3 a required backend is absent.
    pub fn status(&self) -> u8 {
        match self {
            CompareError::Options(e) if e.is_usage() => 2,
            CompareError::Prepare(_) => 2,
            CompareError::Required { .. } | CompareError::NoBackend { .. } => 3,
            CompareError::Options(_) | CompareError::Output(_) | CompareError::Nothing { .. } => 1,
        }
    }
}

/// Renders and measures all that `args` ask for, and writes it to the folder that they name.
///
/// # Errors
/// A volume, scene or folder that cannot be had, a required backend that is absent, or no measurement at all.
pub fn compare(args: &CompareArgs) -> Result<Report, CompareError> {
    let begin = Instant::now();
    let output = OutputFolder::new(&args.out)?;
    let mut rivals = args.rivals.open()?;
    let exhibit = subject::exhibit(args)?;
    let points = sweep::sweep_points(args, &exhibit)?;
    let (answer, reference) = answer(args, &exhibit, &output)?;
    let background = args.view.background.0;
    let pictures = Pictures { output: &output, answer: &answer, background, channels: Channels::All };
    let limits = MeasureLimits { end: begin + time_allowed(args), n_frames: args.frames };
    let (rows, left_out) = Contest { points: &points, rivals: &mut rivals, pictures: &pictures, limits }.run()?;
    if let (true, Some(first)) = (rows.is_empty(), left_out.first()) {
        return Err(CompareError::Nothing { reason: first.reason.clone() });
    }
    let found =
        CompareResult { rows, left_out, reference, backends: rivals.infos, seconds: begin.elapsed().as_secs_f64() };
    let report = report(args, &exhibit, found);
    let html = page(&report, output.folder()).map_err(OutputError::Page)?;
    output.publish(&report, &html)?;
    Ok(report)
}

/// The backends whose exact mode came nowhere below `bound` (RMSE).
pub fn short_of(report: &Report, bound: f64) -> Vec<String> {
    let present = report.backends.iter().filter(|b| b.absent.is_none()).map(|b| b.backend.clone());
    let reached = |name: &String| report.rows.iter().any(|r| r.backend == *name && r.mode == "exact" && r.rmse < bound);
    present.filter(|name| !reached(name)).collect()
}

fn time_allowed(args: &CompareArgs) -> Duration {
    let seconds = args.seconds.unwrap_or(if args.file.is_some() { 300.0 } else { 100.0 });
    Duration::from_secs_f64(seconds.min(1e6))
}

struct CompareResult {
    rows: Vec<Row>,
    left_out: Vec<LeftOut>,
    reference: ReferenceInfo,
    backends: Vec<BackendInfo>,
    seconds: f64,
}

/// The continuous answer, and its lines in the report.
fn answer(
    args: &CompareArgs,
    exhibit: &Exhibit,
    output: &OutputFolder,
) -> Result<(Image<f64>, ReferenceInfo), CompareError> {
    let (begin, scene) = (Instant::now(), &exhibit.scene);
    let spinner = ProgressBar::new_spinner().with_message("integrating the continuous answer");
    spinner.enable_steady_tick(Duration::from_millis(200));
    let options = ContinuousOptions { tolerance: 1e-9, transmittance_floor: 1e-12 };
    let clip = subject::clip_in_sample_space(exhibit);
    let answer = continuous(&exhibit.subject.volume, &scene.transfer, &scene.camera, scene.size, &clip, &options);
    spinner.finish_and_clear();
    let what = "the continuous integral in f64: rays split at cell faces and knots, error-controlled quadrature";
    let files = output.picture("reference", &answer.image.map(|v| v as f32), args.view.background.0, &[])?;
    let info = ReferenceInfo {
        what: what.to_owned(),
        tolerance: options.tolerance,
        seconds: begin.elapsed().as_secs_f64(),
        png: files.png,
        exr: files.exr,
    };
    Ok((answer.image, info))
}

fn report(args: &CompareArgs, exhibit: &Exhibit, found: CompareResult) -> Report {
    let mut rows = found.rows;
    mark_front(&mut rows);
    Report {
        format: REPORT_FORMAT,
        scene: scene_info(args, exhibit),
        commit: commit(),
        machine: Machine::here(),
        driver: drivers(&found.backends),
        backends: found.backends,
        reference: found.reference,
        channels: Channels::All,
        rows,
        left_out: found.left_out,
        total_seconds: found.seconds,
    }
}

/// The Vulkan drivers that took part, each once.
pub(crate) fn drivers(backends: &[BackendInfo]) -> String {
    let mut drivers: Vec<&str> =
        backends.iter().filter(|b| b.backend != "cpu").filter_map(|b| b.driver.as_deref()).collect();
    drivers.dedup();
    if drivers.is_empty() { "none".to_owned() } else { drivers.join("; ") }
}

fn scene_info(args: &CompareArgs, exhibit: &Exhibit) -> SceneInfo {
    let (scene, grid): (&Scene, _) = (&exhibit.scene, exhibit.subject.volume.grid());
    SceneInfo {
        name: exhibit.name.clone(),
        dims: grid.dims().to_array(),
        spacing: grid.spacing().to_array(),
        scalar: exhibit.subject.volume.scalar_type().name().to_owned(),
        size: scene.size.to_array(),
        eye: scene.camera.eye().to_array(),
        forward: scene.camera.forward().to_array(),
        up: scene.camera.up().to_array(),
        projection: subject::projection_text(&scene.camera),
        transfer: scene.transfer.clone(),
        background: args.view.background.0,
        command: args.command.clone(),
    }
}
