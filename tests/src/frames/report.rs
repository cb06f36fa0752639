//! The measurement as JSON and as a table.

use std::time::Instant;

use comfy_table::{CellAlignment, Table, presets::NOTHING};
use serde::Serialize;

use crate::memory::cpu_seconds;
use crate::report::{BackendInfo, Machine};
use crate::turns::Spread;

/// Steady frames of a file on some backends.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs)]
pub struct FramesReport {
    pub file: String,
    pub machine: Machine,
    pub commit: String,
    /// Voxels along x, y and z, their type, and the voxels along a brick's side.
    pub dims: [u32; 3],
    pub scalar: String,
    pub brick: u32,
    pub pixels: [u32; 2],
    pub step_voxels: f64,
    pub rule: String,
    pub turn_degrees: f64,
    /// Reading the file, building the octree, opening all backends.
    pub read: Phase,
    pub build: Phase,
    pub devices: Phase,
    pub series: Vec<Series>,
    /// The backends that were asked for.
    pub backends: Vec<BackendInfo>,
}

/// Something that is done once.
#[derive(Clone, Copy, Debug, Serialize)]
#[allow(missing_docs)]
pub struct Phase {
    pub wall_ms: f64,
    /// Of all threads, where the system tells.
    pub cpu_ms: Option<f64>,
}

/// A mode on a backend.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs)]
pub struct Series {
    pub backend: String,
    pub mode: String,
    pub prepare_ms: Spread,
    pub upload_ms: Spread,
    /// As the caller waits for it, and as the device's clock says.
    pub render_ms: Spread,
    pub device_ms: Option<Spread>,
    pub read_back_ms: Spread,
    pub whole_ms: Spread,
    /// Of all threads, a frame: the mean.
    pub cpu_ms: Option<f64>,
    /// The most that the process held while it drew these frames; other backends' bricks are among it.
    pub peak_bytes: Option<u64>,
    /// The first frame, which brings bricks and builds shaders; then the timed ones.
    pub first: FrameTimes,
    pub frames: Vec<FrameTimes>,
}

/// A frame, in milliseconds.
#[derive(Clone, Copy, Debug, Serialize)]
#[allow(missing_docs)]
pub struct FrameTimes {
    pub prepare_ms: f64,
    pub upload_ms: f64,
    pub render_ms: f64,
    pub device_ms: Option<f64>,
    pub read_back_ms: f64,
    pub whole_ms: f64,
    pub uploaded_bytes: u64,
    pub n_bricks: usize,
}

impl Phase {
    /// Does it.
    pub(crate) fn of<T>(work: impl FnOnce() -> T) -> (Phase, T) {
        let (begin, cpu) = (Instant::now(), cpu_seconds());
        let done = work();
        let wall_ms = begin.elapsed().as_secs_f64() * 1e3;
        (Phase { wall_ms, cpu_ms: cpu_seconds().zip(cpu).map(|(after, before)| 1e3 * (after - before)) }, done)
    }
}

/// The report for people: what is done once, then a line for each mode of a backend (medians; in brackets least and greatest).
pub fn table(report: &FramesReport) -> String {
    let [x, y, z] = report.dims;
    let phase = |p: &Phase| match p.cpu_ms {
        Some(cpu) => format!("{:.0} ms ({cpu:.0} ms of CPU)", p.wall_ms),
        None => format!("{:.0} ms", p.wall_ms),
    };
    let mut lines = Table::new();
    lines.load_preset(NOTHING).set_header([
        "backend",
        "mode",
        "first",
        "prepare",
        "upload",
        "render",
        "read-back",
        "whole",
        "",
        "CPU",
        "peak MiB",
    ]);
    let ms = |s: &Spread| format!("{:.1}", s.median);
    let row = |s: &Series| {
        [
            s.backend.clone(),
            s.mode.clone(),
            format!("{:.1}", s.first.whole_ms),
            ms(&s.prepare_ms),
            ms(&s.upload_ms),
            ms(&s.render_ms),
            ms(&s.read_back_ms),
            ms(&s.whole_ms),
            format!("({:.1} to {:.1})", s.whole_ms.min, s.whole_ms.max),
            s.cpu_ms.map_or_else(|| "unknown".to_owned(), |ms| format!("{ms:.1}")),
            s.peak_bytes.map_or_else(|| "unknown".to_owned(), |bytes| (bytes >> 20).to_string()),
        ]
    };
    lines.add_rows(report.series.iter().map(row));
    lines.column_iter_mut().skip(2).for_each(|column| column.set_cell_alignment(CellAlignment::Right));
    format!(
        "{}: {x} x {y} x {z} {}; {} x {} pixels, {}, {} voxels a step, bricks of {}\n\
         read {}; octree {}; devices {}\n\
         milliseconds of {} frames, {} degrees apart:\n{lines}\n",
        report.file,
        report.scalar,
        report.pixels[0],
        report.pixels[1],
        report.rule,
        report.step_voxels,
        report.brick,
        phase(&report.read),
        phase(&report.build),
        phase(&report.devices),
        report.series.first().map_or(0, |s| s.frames.len()),
        report.turn_degrees,
    )
}
