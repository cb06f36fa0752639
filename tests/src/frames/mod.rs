//! Steady frames of a turning camera: what a viewer waits for after the first picture.
//!
//! ```text
//!  file --read--> volume --tree--> bricks        once
//!                                    |
//!  round k: the camera turned by k steps, each backend and mode a frame:
//!           prepare | upload | render | read-back     wall time, CPU time, peak memory
//! ```
//!
//! Backends and modes take turns ([`crate::turns`]). Modes of a backend share its resident bricks, so that steady frames upload
//! only bricks that come into sight.

mod report;

use std::path::PathBuf;

use brickfield::core::Camera;
use brickfield::core::glam::{DQuat, DVec3};
use brickfield::frame::{Backend, Mode};
use brickfield::io::Opened;
use brickfield::optics::QuadratureRule;
use brickfield::options::{InputOptions, OptionError, Subject, TreeOptions, ViewOptions, values};
use brickfield::{Residency, Scene, Skipping};
use clap::Parser;

use crate::compare::rivals::Rivals;
use crate::compare::{CompareError, RivalArgs, each_once};
use crate::memory::{cpu_seconds, peak, restart_peak};
use crate::report::{Machine, commit};
use crate::turns::{FrameError, Spread, take_turns, tree_frame};

pub use report::{FrameTimes, FramesReport, Phase, Series, table};

/// Renders steady frames of a slowly turning camera, and reports how long each part takes
///
/// Backends and modes take turns, frame by frame. Exit status: 0 done, 1 failed (one line on standard error says why), 2
/// unusable arguments, 3 a required backend is absent.
#[derive(Parser, Clone, Debug)]
#[command(
    name = "frames",
    after_help = "Examples:
  frames engine.vti --transfer ct-bone
  frames engine.vti --backends cpu --modes fast --step 1/4 --frames 30 --brick 64"
)]
pub struct FramesArgs {
    /// Volume file or folder
    pub file: PathBuf,
    /// File that receives the measurement as JSON
    #[arg(long, value_name = "FILE", default_value = "target/frames.json")]
    pub out: PathBuf,
    /// Modes
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::mode, default_value = "exact,fast")]
    pub modes: Vec<Mode>,
    /// Distance between samples, in units of the least voxel spacing, as a decimal or a fraction
    #[arg(long, value_name = "VOXELS", default_value_t = 0.5, value_parser = values::step)]
    pub step: f64,
    /// Quadrature rule
    #[arg(long, value_parser = values::rule, default_value = "midpoint")]
    pub rule: QuadratureRule,
    /// Draw bricks in which nothing is visible, too
    #[arg(long)]
    pub no_skipping: bool,
    /// Timed frames, after the first one and two that warm up
    #[arg(long, default_value_t = 12, value_parser = clap::value_parser!(u32).range(1..))]
    pub frames: u32,
    /// Degrees that the camera turns around the volume's centre from frame to frame
    #[arg(long, value_name = "DEGREES", default_value_t = 0.5, value_parser = degrees, allow_hyphen_values = true)]
    pub turn: f64,
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
}

/// Why there is no measurement.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum FramesError {
    #[error(transparent)]
    Compare(Box<CompareError>),
    #[error(transparent)]
    Frame(#[from] FrameError),
}

impl From<OptionError> for FramesError {
    fn from(e: OptionError) -> FramesError {
        CompareError::Options(e).into()
    }
}

impl From<CompareError> for FramesError {
    fn from(e: CompareError) -> FramesError {
        FramesError::Compare(Box::new(e))
    }
}

impl FramesError {
    /// The exit status that scripts see: 1 failed, 2 unusable arguments, 3 a required backend is absent.
    pub fn status(&self) -> u8 {
        match self {
            FramesError::Compare(e) => e.status(),
            FramesError::Frame(FrameError::Prepare(_)) => 2,
            FramesError::Frame(_) => 1,
        }
    }
}

/// A mode on a backend, and its frames so far.
struct Contestant {
    backend: usize,
    scene: Scene,
    first: Option<FrameTimes>,
    timed: Vec<FrameTimes>,
    /// Of all timed frames.
    cpu_seconds: Option<f64>,
    peak_bytes: Option<u64>,
}

/// Frames that warm up, after the first.
const WARM_UP: u32 = 2;

/// Opens the file and measures.
///
/// # Errors
/// A file, scene or backend that cannot be had.
pub fn frames(args: &FramesArgs) -> Result<FramesReport, FramesError> {
    let (read, opened) = Phase::of(|| args.input.open(&args.file));
    let Opened { volume, frame, notes, .. } = opened?.evenly_spaced(&args.input.limits());
    notes.iter().for_each(|note| eprintln!("note: {note}"));
    let (build, tree) = Phase::of(|| args.tree.build(&volume));
    let transfer = args.view.transfer(&volume)?;
    let subject = Subject { volume, frame, tree: tree?, transfer };
    let (devices, rivals) = Phase::of(|| args.rivals.open());
    let Rivals { mut present, infos } = rivals?;
    let scene = scene(args, &subject)?;
    let mut contestants = contestants(args, &scene, present.len());
    let mut residencies: Vec<Residency> = present.iter().map(|_| Residency::default()).collect();
    let middle = subject.volume.grid().world_box().center();
    take_turns(contestants.len(), WARM_UP + args.frames, |turn| {
        let contestant = &mut contestants[turn.contestant];
        let camera = turned(&scene.camera, middle, scene.camera.up(), args.turn * f64::from(turn.round));
        let backend = present[contestant.backend].as_mut();
        contestant.frame(&subject, camera, backend, &mut residencies[contestant.backend], turn.round)
    })?;
    Ok(FramesReport {
        file: args.file.display().to_string(),
        machine: Machine::here(),
        commit: commit(),
        dims: subject.volume.grid().dims().to_array(),
        scalar: subject.volume.scalar_type().to_string(),
        brick: args.tree.brick.n_samples(),
        pixels: args.view.size.to_array(),
        step_voxels: args.step,
        rule: args.rule.name().to_owned(),
        turn_degrees: args.turn,
        read,
        build,
        devices,
        series: contestants.into_iter().map(|c| c.series(&present)).collect(),
        backends: infos,
    })
}

fn scene(args: &FramesArgs, subject: &Subject) -> Result<Scene, FramesError> {
    let skipping = if args.no_skipping { Skipping::Off } else { Skipping::On };
    Ok(Scene { step_voxels: args.step, rule: args.rule, skipping, ..args.view.scene(subject)? })
}

fn contestants(args: &FramesArgs, scene: &Scene, n_backends: usize) -> Vec<Contestant> {
    let modes = each_once(&args.modes);
    let of = |(backend, mode)| Contestant {
        backend,
        scene: Scene { mode, ..scene.clone() },
        first: None,
        timed: Vec::new(),
        cpu_seconds: Some(0.0),
        peak_bytes: None,
    };
    (0..n_backends).flat_map(|backend| modes.iter().map(move |mode| (backend, *mode))).map(of).collect()
}

impl Contestant {
    /// A frame's milliseconds.
    fn frame(
        &mut self,
        subject: &Subject,
        camera: Camera,
        backend: &mut dyn Backend,
        residency: &mut Residency,
        round: u32,
    ) -> Result<f64, FramesError> {
        self.scene.camera = camera;
        restart_peak();
        let cpu = cpu_seconds();
        let frame = tree_frame(&subject.tree, &self.scene, residency, backend)?;
        let times = FrameTimes {
            prepare_ms: frame.prepare_ms,
            upload_ms: frame.timing.upload_ms,
            render_ms: frame.timing.wall_ms,
            device_ms: frame.timing.device_ms,
            read_back_ms: frame.timing.read_back_ms,
            whole_ms: frame.ms,
            uploaded_bytes: frame.uploaded_bytes,
            n_bricks: frame.plan.field().slots().n_filled(),
        };
        let taken = cpu_seconds().zip(cpu).map(|(after, before)| after - before);
        self.peak_bytes = self.peak_bytes.max(peak());
        match round {
            0 => self.first = Some(times),
            _ if round > WARM_UP => {
                self.timed.push(times);
                self.cpu_seconds = self.cpu_seconds.zip(taken).map(|(sum, own)| sum + own);
            }
            _ => {}
        }
        Ok(times.whole_ms)
    }

    fn series(self, backends: &[Box<dyn Backend>]) -> Series {
        let of = |ms: fn(&FrameTimes) -> f64| Spread::of(&self.timed.iter().map(ms).collect::<Vec<_>>());
        let device: Option<Vec<f64>> = self.timed.iter().map(|t| t.device_ms).collect();
        Series {
            backend: backends[self.backend].describe().backend.to_owned(),
            mode: self.scene.mode.name().to_owned(),
            prepare_ms: of(|t| t.prepare_ms),
            upload_ms: of(|t| t.upload_ms),
            render_ms: of(|t| t.render_ms),
            device_ms: device.map(|ms| Spread::of(&ms)),
            read_back_ms: of(|t| t.read_back_ms),
            whole_ms: of(|t| t.whole_ms),
            cpu_ms: self.cpu_seconds.map(|sum| sum * 1e3 / self.timed.len() as f64),
            peak_bytes: self.peak_bytes,
            first: self.first.expect("round 0 is drawn"),
            frames: self.timed,
        }
    }
}

/// A camera that has gone around a point, about an axis of unit length.
pub(crate) fn turned(camera: &Camera, around: DVec3, axis: DVec3, degrees: f64) -> Camera {
    let turn = DQuat::from_axis_angle(axis, degrees.to_radians());
    let eye = around + turn * (camera.eye() - around);
    Camera::look_at(eye, eye + turn * camera.forward(), turn * camera.up(), camera.projection())
        .expect("a camera that has been turned is one")
}

/// Degrees from -360 to 360, as the command line states them.
pub(crate) fn degrees(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(degrees) if degrees.abs() <= 360.0 => Ok(degrees),
        _ => Err("degrees are a number from -360 to 360".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use brickfield::core::Projection;

    use super::*;

    #[test]
    fn a_turned_camera_keeps_its_distance_and_its_aim() {
        let around = DVec3::new(1.0, 2.0, 3.0);
        let projection = Projection::Perspective { fov_y: 0.5 };
        let camera = Camera::look_at(DVec3::new(9.0, 5.0, 4.0), around, DVec3::Z, projection).unwrap();
        let turned = |camera: &Camera, degrees| turned(camera, around, camera.up(), degrees);
        let there = turned(&camera, 90.0);
        assert!((there.eye().distance(around) - camera.eye().distance(around)).abs() < 1e-12);
        assert!(there.forward().dot((around - there.eye()).normalize()) > 1.0 - 1e-12);
        assert!((there.up() - camera.up()).length() < 1e-12);
        let back = turned(&turned(&camera, 33.0), -33.0);
        assert!((back.eye() - camera.eye()).length() < 1e-12);
    }

    #[test]
    fn every_mode_of_a_backend_has_its_frames() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("steps.nrrd");
        let head = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 24 20 16\nspacings: 1 1 1\nencoding: raw\n\n";
        let values = (0..24 * 20 * 16).map(|i| (i % 251) as u8);
        std::fs::write(&path, head.bytes().chain(values).collect::<Vec<u8>>()).unwrap();
        let words = ["frames", path.to_str().unwrap(), "--backends", "cpu", "--frames", "3", "--size", "24x24"];
        let report = frames(&FramesArgs::try_parse_from(words).unwrap()).unwrap();
        let modes: Vec<&str> = report.series.iter().map(|s| s.mode.as_str()).collect();
        assert_eq!((report.dims, modes), ([24, 20, 16], vec!["exact", "fast"]));
        for series in &report.series {
            assert_eq!(series.frames.len(), 3);
            assert!(series.first.n_bricks > 0 && series.whole_ms.min >= series.prepare_ms.min);
        }
        let text = table(&report);
        assert!(text.contains("24 x 20 x 16") && text.lines().filter(|l| l.contains("cpu")).count() == 2, "{text}");
    }

    #[test]
    fn arguments_that_cannot_be_used_are_refused() {
        for bad in ["--turn 400", "--turn x", "--frames 0", "--step 0", "--modes slow"] {
            let words = ["frames", "x.vti"].into_iter().chain(bad.split_whitespace());
            assert_eq!(FramesArgs::try_parse_from(words).unwrap_err().exit_code(), 2, "{bad}");
        }
        assert_eq!(FramesArgs::try_parse_from(["frames"]).unwrap_err().exit_code(), 2);
    }
}
