//! Frame after frame with resident bricks, and their device time against the rate at which textures are read.

use std::time::Instant;

use brickfield::bricks::{BrickTree, tree_memory};
use brickfield::frame::{Backend, Fetch, FramePlan, Mode, SampleFormat, Timing};
use brickfield::{Residency, Scene, Skipping, prepare};
use brickfield_core::glam::{UVec2, UVec3};
use brickfield_core::{BrickLayout, BrickSide, Camera, Level, Ray, ScalarType};

use super::budget::{Deadline, Unmeasured};
use super::devices::Devices;
use super::errors::{MODES, tree};
use super::phantoms::Phantoms;
use super::report::{Steady, TextureRate, VolumeInfo};
use super::texture::{Reading, texture_rate};
use super::{Form, PartResult};
use crate::memory::{available, gigabytes, peak};
use crate::turns::{Spread, TimedFrame, order, tree_frame};
use crate::volumes::{phantom_camera, phantom_transfer};

/// Least and most timed frames.
const FRAMES: [u32; 2] = [1, 60];

/// The results of steady frames.
#[derive(Default)]
pub(super) struct SteadyFrames {
    pub(super) volumes: Vec<VolumeInfo>,
    pub(super) frames: Vec<Steady>,
    pub(super) textures: Vec<TextureRate>,
}

/// Measures phantoms of growing size.
pub(super) fn steady(
    form: Form,
    devices: &mut Devices,
    phantoms: &mut Phantoms,
    deadline: Deadline,
    failures: &mut Vec<String>,
) -> PartResult<SteadyFrames> {
    let sizes = form.sizes().steady;
    let (mut found, mut left_out) = (SteadyFrames::default(), Vec::new());
    // Seconds for a volume and its tree, by the one before.
    let mut seconds = 0.0;
    for (i, voxels) in sizes.iter().enumerate() {
        // The larger ones take longer.
        let share = 1.0 / f64::from(1u32 << (sizes.len() - 1 - i));
        let what = format!("steady frames of {voxels}^3");
        let made = deadline
            .admit(&what, seconds)
            .and_then(|()| check_memory(*voxels, &what))
            .and_then(|()| volume(*voxels, phantoms).map_err(|e| Unmeasured::new(&what, e)));
        match made {
            Err(e) => left_out.push(e),
            Ok(mut made) => {
                seconds = 8.0 * (made.info.generate_s + made.info.build_s);
                let rounds = deadline.share(share);
                let (left_out, found) = (&mut left_out, &mut found);
                let mut measured = Measured { form, deadline, rounds, failures, left_out, found };
                measured.volume(&mut made, devices);
                found.volumes.push(made.info);
            }
        }
    }
    compare_with_textures(&mut found);
    let line = line(&found);
    PartResult { found, left_out, line }
}

/// A volume as a tree.
struct Made {
    tree: BrickTree,
    camera: Camera,
    info: VolumeInfo,
}

/// Bytes that a volume, its tree, its bricks as they are handed over, and a copy on a software device take.
fn needed_bytes(voxels: u32) -> u64 {
    let layout = BrickLayout::new(UVec3::splat(voxels), BrickSide::S32);
    let memory = tree_memory(&layout, ScalarType::U8);
    let finest = memory.levels[usize::from(Level(0).0)].stored_bytes;
    // Each of two software devices holds the bricks, and they are being built while the volume is there.
    u64::from(voxels).pow(3) + memory.total.bytes() + 3 * finest
}

fn check_memory(voxels: u32, what: &str) -> Result<(), Unmeasured> {
    let needed = needed_bytes(voxels);
    match available() {
        Some(available) if available < needed => {
            let (needed, available) = (gigabytes(needed), gigabytes(available));
            Err(Unmeasured::new(what, format!("it needs about {needed} of main memory, {available} are free")))
        }
        _ => Ok(()),
    }
}

fn volume(voxels: u32, phantoms: &mut Phantoms) -> Result<Made, String> {
    let begin = Instant::now();
    let volume = phantoms.of(voxels);
    let generate_s = begin.elapsed().as_secs_f64();
    let camera = phantom_camera(volume.grid()).map_err(|e| e.to_string())?;
    let begin = Instant::now();
    let tree = tree(&volume)?;
    let info = VolumeInfo {
        voxels,
        generate_s,
        build_s: begin.elapsed().as_secs_f64(),
        volume_bytes: volume.grid().n_voxels() as u64,
        tree_bytes: tree_memory(tree.layout(), ScalarType::U8).total.bytes(),
        visible_bricks: 0,
        visible_bytes: 0,
        all_bricks: None,
        all_bytes: None,
        peak_host_bytes: None,
    };
    Ok(Made { tree, camera, info })
}

/// The lists that measurements are added to.
struct Measured<'a> {
    form: Form,
    /// Until then first frames and texture reads may begin.
    deadline: Deadline,
    /// Until then there may be rounds.
    rounds: Deadline,
    failures: &'a mut Vec<String>,
    left_out: &'a mut Vec<Unmeasured>,
    found: &'a mut SteadyFrames,
}

impl Measured<'_> {
    fn volume(&mut self, made: &mut Made, devices: &mut Devices) {
        let (n_bricks, n_bytes) = self.frames(made, Skipping::On, self.rounds.share(0.4), devices);
        (made.info.visible_bricks, made.info.visible_bytes) = (n_bricks, n_bytes);
        self.textures(made.info.voxels, devices);
        let (n_bricks, n_bytes) = self.frames(made, Skipping::Off, self.rounds, devices);
        (made.info.all_bricks, made.info.all_bytes) = (Some(n_bricks), Some(n_bytes));
        made.info.peak_host_bytes = peak();
    }

    /// The frames of each mode by turns; backends hold the bricks for all modes. Returns the bricks and their bytes.
    fn frames(&mut self, made: &Made, skipping: Skipping, rounds: Deadline, devices: &mut Devices) -> (u32, u64) {
        let mut residency = Residency::default();
        let mut series = self.first_frames(made, skipping, devices, &mut residency);
        let round_seconds = series.iter().map(|s| s.seconds).sum();
        for round in 0..rounds.rounds(0.9, round_seconds, FRAMES) {
            for i in order(round, series.len()) {
                let s = &mut series[i];
                match frame(made, &s.scene, &mut *devices[s.device].1, &mut residency) {
                    Ok((times, _)) => s.timed.push(times),
                    Err(e) => self.left_out.push(Unmeasured::new(format!("a frame, {}", s.name), e)),
                }
            }
        }
        let of = |s: &Series<'_>| s.steady(made.info.voxels, skipping, devices[s.device].0.name());
        self.found.frames.extend(series.iter().filter(|s| !s.timed.is_empty()).map(of));
        resident(made, skipping, &mut residency)
    }

    /// A frame of each mode on each backend, as far as there is time: it brings the bricks and builds the shader.
    fn first_frames(
        &mut self,
        made: &Made,
        skipping: Skipping,
        devices: &mut Devices,
        residency: &mut Residency,
    ) -> Vec<Series<'static>> {
        let mut all: Vec<Series<'static>> = Vec::new();
        for (name, mode) in MODES.into_iter().filter(|(_, mode)| is_measured(*mode, skipping)) {
            for (device, (kind, probe)) in devices.iter_mut().enumerate() {
                let what = format!("{}^3, {name}, skipping {skipping:?}, {kind}", made.info.voxels);
                let scene = scene(self.form, made, mode, skipping);
                let drawn = self
                    .deadline
                    .admit(&what, 0.0)
                    .and_then(|()| frame(made, &scene, &mut **probe, residency).map_err(|e| Unmeasured::new(&what, e)));
                let (times, plan) = match drawn {
                    Ok(drawn) => drawn,
                    Err(e) => {
                        self.left_out.push(e);
                        continue;
                    }
                };
                let brings = all.iter().all(|s| s.device != device);
                all.push(Series {
                    name,
                    scene,
                    device,
                    first_upload_ms: brings.then_some(times.timing.upload_ms),
                    seconds: 1e-3 * (times.timing.wall_ms + times.timing.read_back_ms),
                    n_samples: (skipping == Skipping::Off).then(|| n_samples(&plan)),
                    timed: Vec::new(),
                });
            }
        }
        all
    }

    /// The texture rates of this size; rates of other formats only at the smallest.
    fn textures(&mut self, voxels: u32, devices: &mut Devices) {
        let sizes = self.form.sizes();
        let formats: &[SampleFormat] = match voxels == sizes.steady[0] {
            true => &[SampleFormat::Unorm8, SampleFormat::Unorm16, SampleFormat::Float32],
            false => &[SampleFormat::Unorm8],
        };
        for format in formats {
            for fetch in Fetch::ALL {
                for (_, probe) in devices.iter_mut() {
                    let reading =
                        Reading { format: *format, texels: voxels, fetch, rays: sizes.pixels, n_runs: sizes.runs };
                    match texture_rate(&mut **probe, &reading, self.deadline, self.failures) {
                        Ok(rate) => self.found.textures.push(rate),
                        Err(e) => self.left_out.push(e),
                    }
                }
            }
        }
    }
}

/// With skipping as frames are drawn; without, so that every sample is taken and counts.
fn is_measured(mode: Mode, skipping: Skipping) -> bool {
    match skipping {
        Skipping::On => mode == Mode::Exact || mode == Mode::FAST,
        Skipping::Off => mode != Mode::FAST,
    }
}

fn scene(form: Form, made: &Made, mode: Mode, skipping: Skipping) -> Scene {
    let size = UVec2::splat(form.sizes().pixels);
    Scene { mode, skipping, ..Scene::new(made.camera, size, phantom_transfer(ScalarType::U8)) }
}

/// Bricks of a scene's frame, and their bytes.
fn resident(made: &Made, skipping: Skipping, residency: &mut Residency) -> (u32, u64) {
    let plan = prepare(&made.tree, &scene(Form::Short, made, Mode::Exact, skipping), residency);
    plan.map_or((0, 0), |plan| (plan.field().slots().n_filled() as u32, plan.field().slots().n_bytes() as u64))
}

/// The times of a frame, in milliseconds.
#[derive(Clone, Copy)]
struct FrameTimes {
    prepare_ms: f64,
    whole_ms: f64,
    timing: Timing,
}

/// One scene on one backend.
struct Series<'a> {
    name: &'a str,
    scene: Scene,
    device: usize,
    /// Of the frame that brought the bricks, if none had brought them before.
    first_upload_ms: Option<f64>,
    /// Of the first frame, without the upload, which later ones have not.
    seconds: f64,
    n_samples: Option<u64>,
    timed: Vec<FrameTimes>,
}

fn frame(
    made: &Made,
    scene: &Scene,
    backend: &mut (impl Backend + ?Sized),
    residency: &mut Residency,
) -> Result<(FrameTimes, FramePlan), String> {
    let TimedFrame { plan, prepare_ms, ms, timing, .. } =
        tree_frame(&made.tree, scene, residency, backend).map_err(|e| e.to_string())?;
    Ok((FrameTimes { prepare_ms, whole_ms: ms, timing }, plan))
}

impl Series<'_> {
    fn steady(&self, voxels: u32, skipping: Skipping, backend: &str) -> Steady {
        let of = |ms: fn(&FrameTimes) -> f64| Spread::of(&self.timed.iter().map(ms).collect::<Vec<_>>());
        let device: Option<Vec<f64>> = self.timed.iter().map(|t| t.timing.device_ms).collect();
        let device_ms = device.map(|ms| Spread::of(&ms));
        let rate = |n: u64| Some(n as f64 * 1e-3 / device_ms?.median);
        Steady {
            voxels,
            pixels: self.scene.size.x,
            mode: self.name.to_owned(),
            skipping: skipping == Skipping::On,
            backend: backend.to_owned(),
            n_frames: self.timed.len() as u32,
            first_upload_ms: self.first_upload_ms,
            prepare_ms: of(|t| t.prepare_ms),
            upload_ms: of(|t| t.timing.upload_ms),
            device_ms,
            wall_ms: of(|t| t.timing.wall_ms),
            read_back_ms: of(|t| t.timing.read_back_ms),
            whole_ms: of(|t| t.whole_ms),
            n_samples: self.n_samples,
            msamples_per_s: self.n_samples.and_then(rate),
            of_texture_rate: None,
        }
    }
}

/// The values that a frame of whole rays samples if nothing is skipped and no ray ends early.
fn n_samples(plan: &FramePlan) -> u64 {
    let size = plan.size();
    let segments = |i: u32| {
        let ray = plan.rays().ray(i % size.x, i / size.x);
        let eye = plan.rays().center + ray.anchor - ray.direction * (ray.t_anchor - ray.t_eye);
        let from_eye = Ray { origin: eye, direction: ray.direction };
        let apart = plan.sampling().step_world() * ray.stretch;
        from_eye
            .clip(plan.domain())
            .map_or(0.0, |s| (s.end.max(0.0) / apart).ceil() - (s.start.max(0.0) / apart).floor())
    };
    let n: f64 = (0..size.x * size.y).map(segments).sum();
    n as u64 * plan.sampling().rule().nodes().len() as u64
}

fn compare_with_textures(found: &mut SteadyFrames) {
    for frame in &mut found.frames {
        let fetch = if frame.mode == "exact" { Fetch::Gathered } else { Fetch::Filtered };
        let rate = found.textures.iter().find(|t| {
            (t.texels, t.bytes_per_texel) == (frame.voxels, 1) && t.backend == frame.backend && t.fetch == fetch.name()
        });
        frame.of_texture_rate = frame.msamples_per_s.zip(rate).map(|(march, t)| march / t.msamples_per_s);
    }
}

fn line(found: &SteadyFrames) -> String {
    let fastest = found.frames.iter().filter(|f| f.skipping && f.mode == "fast");
    let frames: Vec<String> =
        fastest.map(|f| format!("{}^3 {} {:.2} ms", f.voxels, f.backend, f.whole_ms.median)).collect();
    format!("{} series; fast: {}", found.frames.len(), frames.join(", "))
}

#[cfg(test)]
mod tests {
    use brickfield::cpu::discrete;

    use super::*;

    #[test]
    fn samples_are_counted_as_the_reference_counts_them() {
        let made = volume(24, &mut Phantoms::default()).unwrap();
        let scene = Scene { size: UVec2::splat(24), ..scene(Form::Short, &made, Mode::Exact, Skipping::Off) };
        let plan = prepare(&made.tree, &scene, &mut Residency::default()).unwrap();
        let (counted, expected) = (n_samples(&plan), discrete(&plan).n_samples);
        assert!(expected > 0 && counted.abs_diff(expected) <= expected / 1000, "{counted}, expected {expected}");
    }

    #[test]
    fn memory_is_asked_for_before_it_is_taken() {
        assert!(needed_bytes(1024) > 5 << 30 && needed_bytes(1024) < 8 << 30);
        assert!(needed_bytes(256) < 1 << 28);
    }

    #[test]
    fn frames_are_compared_with_their_own_texture_rate() {
        let ms = Spread { median: 1.0, min: 1.0, max: 1.0 };
        let rate = |fetch: Fetch, texels, msamples_per_s| TextureRate {
            backend: "ash".into(),
            fetch: fetch.name().into(),
            bytes_per_texel: 1,
            texels,
            rays: 8,
            n_samples: 1,
            n_runs: 1,
            device_ms: Some(ms),
            wall_ms: ms,
            timed_by: "device".into(),
            msamples_per_s,
        };
        let frame = |mode: &str, msamples_per_s| Steady {
            voxels: 64,
            pixels: 8,
            mode: mode.into(),
            skipping: false,
            backend: "ash".into(),
            n_frames: 1,
            first_upload_ms: None,
            prepare_ms: ms,
            upload_ms: ms,
            device_ms: Some(ms),
            wall_ms: ms,
            read_back_ms: ms,
            whole_ms: ms,
            n_samples: Some(1),
            msamples_per_s,
            of_texture_rate: None,
        };
        let textures =
            vec![rate(Fetch::Filtered, 128, 7.0), rate(Fetch::Filtered, 64, 200.0), rate(Fetch::Gathered, 64, 50.0)];
        let frames = vec![frame("exact", Some(25.0)), frame("fast", Some(50.0)), frame("fast", None)];
        let mut found = SteadyFrames { volumes: vec![], frames, textures };
        compare_with_textures(&mut found);
        let ratios: Vec<Option<f64>> = found.frames.iter().map(|f| f.of_texture_rate).collect();
        assert_eq!(ratios, [Some(0.5), Some(0.25), None]);
    }
}
