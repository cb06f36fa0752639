//! The measuring itself: contestants take turns, so that other load on the machine hits all of them alike.

use std::time::{Duration, Instant};

use brickfield::frame::{Frame, Timing};
use brickfield::options::progress_bar;
use indicatif::ProgressBar;

use super::CompareError;
use super::output::{Caption, Effort, JudgedPicture, OutputError, Pictures};
use super::rivals::Rivals;
use super::sweep::{Priority, REACHED, SweepPoint};
use crate::metrics::median;
use crate::report::{LeftOut, Row};
use crate::turns::{Spread, order};

/// How much is measured.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeasureLimits {
    /// When the last frame must have been started, and be expected to end.
    pub(super) end: Instant,
    /// Most timed frames of each contestant.
    pub(super) n_frames: u32,
}

pub(super) struct Contest<'a> {
    pub(super) points: &'a [SweepPoint],
    pub(super) rivals: &'a mut Rivals,
    pub(super) pictures: &'a Pictures<'a>,
    pub(super) limits: MeasureLimits,
}

/// One backend at one point: its first frame has been drawn and judged.
struct BackendAtPoint {
    point: usize,
    rival: usize,
    shown: JudgedPicture,
    warm_up: Timing,
    timed: Vec<Timing>,
    /// How long a frame takes altogether, upload and read-back included.
    whole: Duration,
}

impl Contest<'_> {
    /// A first frame of everybody, which warms up and gives the picture; then timed rounds, until frames or time run out.
    pub(super) fn run(mut self) -> Result<(Vec<Row>, Vec<LeftOut>), CompareError> {
        let bar = progress_bar("measuring");
        bar.set_length((self.points.len() * self.rivals.present.len()) as u64 * u64::from(1 + self.limits.n_frames));
        let (mut entries, mut left_out) = self.first_round(&bar)?;
        for round in 1..=self.limits.n_frames {
            self.round(round, &mut entries, &mut left_out, &bar);
        }
        bar.finish_and_clear();
        Ok((entries.into_iter().map(|e| self.row(e)).collect(), left_out))
    }

    fn first_round(&mut self, bar: &ProgressBar) -> Result<(Vec<BackendAtPoint>, Vec<LeftOut>), CompareError> {
        let (mut entries, mut left_out): (Vec<BackendAtPoint>, Vec<LeftOut>) = (Vec::new(), Vec::new());
        // Half the time is for first frames, so that the other half is for timed ones; the leading points may take more.
        let begin = Instant::now();
        let half = begin + self.limits.end.saturating_duration_since(begin) / 2;
        for point in 0..self.points.len() {
            for rival in 0..self.rivals.present.len() {
                bar.inc(1);
                if self.is_reached(&entries, point, rival) {
                    continue;
                }
                let end = if self.points[point].priority == Priority::Normal { half } else { self.limits.end };
                let expected = self.expected(&entries, point, rival);
                if Instant::now() + expected > end && point > 0 {
                    let reason = match expected {
                        Duration::ZERO => "no time was left for it: allow more --seconds".to_owned(),
                        _ => format!("it would take {:.1} s a frame: allow more --seconds", expected.as_secs_f64()),
                    };
                    left_out.push(self.left_out(point, rival, reason));
                    continue;
                }
                match self.first_frame(point, rival)? {
                    Ok(entry) => entries.push(entry),
                    Err(reason) => left_out.push(self.left_out(point, rival, reason)),
                }
            }
        }
        Ok((entries, left_out))
    }

    /// Whether a smaller step is not needed any more: the pursued curve's error is below [`REACHED`].
    fn is_reached(&self, entries: &[BackendAtPoint], point: usize, rival: usize) -> bool {
        let c = &self.points[point];
        let reached =
            |e: &BackendAtPoint| e.shown.errors.rmse < REACHED && like(&self.points[e.point], c) && e.rival == rival;
        c.priority == Priority::Pursuit && entries.iter().any(reached)
    }

    /// How long a first frame should take, by the same backend's last one of that rule and mode.
    fn expected(&self, entries: &[BackendAtPoint], point: usize, rival: usize) -> Duration {
        let c = &self.points[point];
        let last = entries.iter().rev().find(|e| e.rival == rival && like(&self.points[e.point], c));
        let Some(last) = last else { return Duration::ZERO };
        let more = c.n_samples as f64 / self.points[last.point].n_samples.max(1) as f64;
        Duration::from_secs_f64((last.warm_up.wall_ms * more.max(0.0)).min(1e9) * 1e-3)
    }

    /// The inner error says why this frame could not be had; the outer one ends the comparison.
    fn first_frame(&mut self, point: usize, rival: usize) -> Result<Result<BackendAtPoint, String>, OutputError> {
        let (begin, c) = (Instant::now(), &self.points[point]);
        let backend = &mut self.rivals.present[rival];
        let Frame { image, timing, .. } = match backend.render(&c.plan) {
            Ok(frame) => frame,
            Err(e) => return Ok(Err(e.to_string())),
        };
        let whole = begin.elapsed();
        let d = backend.describe();
        let caption = Caption {
            backend: d.backend,
            adapter: format!("{} ({})", d.adapter, d.driver),
            mode: c.mode.name(),
            rule: c.rule.name(),
            step_voxels: c.step_voxels,
        };
        let shown = self.pictures.judge(&caption, &image)?;
        Ok(shown.map(|shown| BackendAtPoint { point, rival, shown, warm_up: timing, timed: Vec::new(), whole }))
    }

    fn round(&mut self, round: u32, entries: &mut Vec<BackendAtPoint>, left_out: &mut Vec<LeftOut>, bar: &ProgressBar) {
        let mut failed = Vec::new();
        for i in order(round, entries.len()) {
            let entry = &mut entries[i];
            bar.inc(1);
            if Instant::now() + entry.whole > self.limits.end {
                continue;
            }
            let begin = Instant::now();
            match self.rivals.present[entry.rival].render(&self.points[entry.point].plan) {
                Ok(frame) => entry.timed.push(frame.timing),
                Err(e) => failed.push((i, e.to_string())),
            }
            entry.whole = begin.elapsed();
        }
        failed.sort();
        for (i, reason) in failed.into_iter().rev() {
            let entry = entries.remove(i);
            left_out.push(self.left_out(entry.point, entry.rival, format!("a later frame failed: {reason}")));
        }
    }

    fn left_out(&self, point: usize, rival: usize, reason: String) -> LeftOut {
        let c = &self.points[point];
        LeftOut {
            backend: self.rivals.present[rival].describe().backend.to_owned(),
            mode: c.mode.name().to_owned(),
            rule: c.rule.name().to_owned(),
            step_voxels: c.step_voxels,
            reason,
        }
    }

    fn row(&self, entry: BackendAtPoint) -> Row {
        let (c, d) = (&self.points[entry.point], self.rivals.present[entry.rival].describe());
        let timings = if entry.timed.is_empty() { vec![entry.warm_up] } else { entry.timed };
        let wall: Vec<f64> = timings.iter().map(|t| t.wall_ms).collect();
        let device: Option<Vec<f64>> = timings.iter().map(|t| t.device_ms).collect();
        let by = Caption {
            backend: d.backend,
            adapter: d.adapter.clone(),
            mode: c.mode.name(),
            rule: c.rule.name(),
            step_voxels: c.step_voxels,
        };
        let effort = Effort {
            samples: c.n_samples,
            wall: Spread::of(&wall),
            n_frames: wall.len(),
            device_ms: device.map(median),
            upload_ms: entry.warm_up.upload_ms,
        };
        entry.shown.row(by, effort)
    }
}

/// Whether two points lie on one curve.
fn like(a: &SweepPoint, b: &SweepPoint) -> bool {
    a.rule == b.rule && a.mode == b.mode
}
