//! The run as tables.

use std::fmt::Write;

use comfy_table::{CellAlignment, Table, presets::NOTHING};

use super::descent::LEAST_STEP;
use super::first::FirstReport;
use super::measure::{ContestantInfo, Measured, Probe, SceneReport, StepReport};
use super::protocol::Domain;
use super::standing::{BOUNDS, Reached, TimeRatio};
use crate::report::step_label;
use crate::turns::Spread;

/// Errors above this are not of steps, filters and eight bits.
const ANOTHER_SCENE: f64 = 0.03;
/// A shift of a picture, in pixels and in its share of the squared error, at steps of up to half a voxel. Pictures that are blurred,
/// or of another filter, are shifted by up to 0.1; where a volume is visible at its faces, larger shifts explain up to 0.36.
const BESIDE: (f64, f64) = (0.25, 0.4);
const BESIDE_STEP: f64 = 0.5;
/// Devices that are the processor, by a part of their names.
const ON_PROCESSOR: [&str; 5] = [" threads", "llvmpipe", "lavapipe", "SwiftShader", "Basic Render"];

/// The scene, who takes part, and who does not.
pub(super) fn heading(scene: &SceneReport) -> String {
    let [x, y, z] = scene.dims;
    let (who, notes) = (who(&scene.contestants), checked(&scene.contestants));
    format!("\n{}: {x} x {y} x {z} {}\n{who}\n{notes}", scene.name, scene.scalar)
}

/// A line if a build has debug assertions: `cargo test` puts such a program where `cargo build` puts the optimized one.
fn checked(contestants: &[ContestantInfo]) -> String {
    let checked = contestants.iter().filter(|c| c.version.contains("checked build"));
    let names: Vec<&str> = checked.map(|c| c.name.as_str()).collect();
    if names.is_empty() {
        return String::new();
    }
    format!("note: {}: of a checked build, whose times say little; build it anew, without tests\n", names.join(", "))
}

fn who(contestants: &[ContestantInfo]) -> Table {
    let mut lines = Table::new();
    lines.load_preset(NOTHING);
    for c in contestants {
        let held = match c.domain {
            Some(Domain::Voxels) => "whole voxels",
            Some(Domain::Centres) => "between sample centres",
            None => "absent",
        };
        let what = c.absent.clone().unwrap_or_else(|| format!("{}; {}", c.version, c.device));
        lines.add_row([c.name.as_str(), held, what.as_str()]);
    }
    lines
}

/// The cheapest step of each contestant that reaches an error.
pub(super) fn times_to_errors(scene: &SceneReport) -> String {
    let mut lines = Table::new();
    let header = BOUNDS.map(|bound| format!("RMSE {bound:e}"));
    lines.load_preset(NOTHING).set_header(std::iter::once("contestant".to_owned()).chain(header));
    for times in scene.times_to_errors.chunks(BOUNDS.len()) {
        let reached = times.iter().map(|time| time.reached.to_string());
        lines.add_row(std::iter::once(times[0].contestant.clone()).chain(reached));
    }
    let is_open = scene.times_to_errors.iter().any(|t| is_open(&t.reached));
    let hint = if is_open { "note: --to-error goes on to smaller steps where the error may fall\n" } else { "" };
    format!("{}: the cheapest step that reaches an error\n{lines}\n{hint}", scene.name)
}

/// Whether smaller steps may reach an error.
fn is_open(reached: &Reached) -> bool {
    matches!(reached, Reached::NotYet { step_voxels, .. } if 0.5 * step_voxels >= LEAST_STEP)
}

/// The errors of pictures that were drawn once.
pub(super) fn probes<'a>(scene: &str, step_voxels: f64, probes: impl Iterator<Item = &'a Probe>) -> String {
    let found: Vec<String> = probes.map(|p| format!("{} {:.3}", p.contestant, 1e3 * p.rmse)).collect();
    format!("{scene}, step {}: RMSE x 1e3 of one picture: {}\n", step_label(step_voxels), found.join(", "))
}

/// From a file to the first picture.
pub(super) fn first(report: &FirstReport) -> String {
    let [x, y, z] = report.dims;
    let mut lines = Table::new();
    lines.load_preset(NOTHING).set_header([
        "contestant",
        "file to picture",
        "",
        "CPU",
        "process",
        "RMSE x 1e3",
        "its parts",
    ]);
    for p in &report.pictures {
        let parts: Vec<String> = p.parts.iter().map(|(name, ms)| format!("{name} {:.0}", ms.median)).collect();
        let (range, process) = (range(&p.wall), format!("{:.0}", p.process.median));
        let times = [
            format!("{:.0}", p.wall.median),
            range,
            format!("{:.0}", p.cpu.median),
            process,
            format!("{:.3}", 1e3 * p.rmse),
        ];
        lines.add_row(std::iter::once(p.contestant.clone()).chain(times).chain([parts.join(", ")]));
    }
    lines.column_iter_mut().skip(1).take(5).for_each(|column| column.set_cell_alignment(CellAlignment::Right));
    let n = report.pictures.first().map_or(0, |p| p.n_processes);
    let absent = who(&report.absent);
    let absent = if report.absent.is_empty() { String::new() } else { format!("{absent}\n") };
    let label = step_label(report.step_voxels);
    let odd = notes_of_another_scene(report.pictures.iter().map(|p| (p.contestant.as_str(), p.rmse)));
    format!(
        "\n{}: {x} x {y} x {z} {}, step {label}: ms from the file to the first picture, medians of {n} processes\n{lines}\n{odd}{absent}",
        report.name, report.scalar
    )
}

/// A step: a line for each contestant, then the ratios of CPU time.
pub(super) fn step(scene: &SceneReport, step: &StepReport) -> String {
    let mut lines = Table::new();
    lines.load_preset(NOTHING).set_header(["contestant", "wall", "", "CPU", "", "RMSE x 1e3", "max"]);
    lines.add_rows(step.rows.iter().map(row));
    lines.column_iter_mut().skip(1).for_each(|column| column.set_cell_alignment(CellAlignment::Right));
    let n_frames = step.rows.first().map_or(0, |r| r.wall_ms.len());
    let label = step_label(step.step_voxels);
    let mut text = format!("{}, step {label}: ms a frame, medians of {n_frames}\n{lines}\n", scene.name);
    for c in scene.contestants.iter().filter(|c| c.domain.is_some()) {
        if let Some(reason) = &c.absent {
            let _ = writeln!(text, "failed: {}: {reason}", c.name);
        }
    }
    text += &notes_of_another_scene(step.rows.iter().map(|row| (row.contestant.as_str(), row.rmse)));
    for row in step.rows.iter().filter(|row| lies_beside(row)) {
        let (name, pixels) = (&row.contestant, row.beside.length());
        let _ = writeln!(text, "note: {name}: its picture lies {pixels:.2} pixels beside the answer");
    }
    for row in step.rows.iter().filter(|row| hardly_computes(row, &scene.contestants)) {
        let (name, cpu, wall) = (&row.contestant, row.cpu.median, row.wall.median);
        let _ = writeln!(
            text,
            "note: {name}: {cpu:.1} ms of CPU time in {wall:.1} ms, on a processor: some is not counted"
        );
    }
    if !step.ratios.is_empty() {
        let mut lines = Table::new();
        lines.load_preset(NOTHING).set_header(["CPU time as a ratio", "", "wall time"]);
        let ratio = |r: &TimeRatio| [format!("{} / {}", r.of, r.to), r.cpu.to_string(), r.wall.to_string()];
        lines.add_rows(step.ratios.iter().map(ratio));
        let _ = writeln!(text, "{lines}");
    }
    text
}

/// A line for each contestant whose picture has little to do with the scene. Too large a step has large errors, too, but of
/// all contestants.
fn notes_of_another_scene<'a>(errors: impl Iterator<Item = (&'a str, f64)> + Clone) -> String {
    let least = errors.clone().map(|(_, rmse)| rmse).fold(f64::INFINITY, f64::min);
    let odd = errors.filter(|(_, rmse)| *rmse > ANOTHER_SCENE.max(4.0 * least));
    let note = |(name, rmse)| {
        format!("note: {name}: an RMSE of {rmse:.3} is that of another scene; its times say nothing of this one\n")
    };
    odd.map(note).collect()
}

fn lies_beside(row: &Measured) -> bool {
    row.step_voxels <= BESIDE_STEP && row.beside.length() > BESIDE.0 && row.beside.share > BESIDE.1
}

/// Whether a contestant draws with the processor, and has hardly used it.
fn hardly_computes(row: &Measured, contestants: &[ContestantInfo]) -> bool {
    let on_processor = |c: &ContestantInfo| ON_PROCESSOR.iter().any(|part| c.device.contains(part));
    row.cpu.median < 0.1 * row.wall.median && contestants.iter().any(|c| c.name == row.contestant && on_processor(c))
}

fn row(r: &Measured) -> [String; 7] {
    [
        r.contestant.clone(),
        format!("{:.1}", r.wall.median),
        range(&r.wall),
        format!("{:.1}", r.cpu.median),
        range(&r.cpu),
        format!("{:.3}", 1e3 * r.rmse),
        format!("{:.4}", r.max_abs),
    ]
}

fn range(spread: &Spread) -> String {
    format!("({:.1} to {:.1})", spread.min, spread.max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::peers::beside::Beside;
    use crate::peers::standing::tests::{row as measured, scene};
    use crate::peers::standing::times_to_errors as of_scene;

    #[test]
    fn peers_tables_have_a_line_for_each_contestant() {
        let rows = vec![measured("cpu fast", 0.5, 20.0, 1.84e-4), measured("pygfx", 0.5, 40.0, 1.646e-3)];
        let mut scene = scene(&["cpu fast", "pygfx"], vec![rows]);
        scene.times_to_errors = of_scene(&scene);
        let report = scene.steps[0].clone();
        let text = step(&scene, &report);
        let words = |line: &str| line.split_whitespace().collect::<Vec<_>>().join(" ");
        let lines: Vec<String> = text.lines().map(words).collect();
        assert_eq!(lines[0], "blobs-256, step 1/2: ms a frame, medians of 3");
        assert_eq!(lines[2], "cpu fast 10.0 (9.0 to 11.0) 20.0 (18.0 to 22.0) 0.184 0.0018");
        assert!(lines[3].starts_with("pygfx 20.0") && lines[3].ends_with("1.646 0.0165"), "{text}");
        assert!(!text.contains("note:"), "{text}");
        let mut beside = report.clone();
        beside.rows[1].beside = Beside { pixels: [0.9, 0.0], share: 0.5 };
        beside.rows[1].cpu = Spread::of(&[1.0]);
        assert!(step(&scene, &beside).contains("note: pygfx: its picture lies 0.90 pixels beside the answer\n"));
        // A card computes without the processor; a driver that is software does not.
        assert!(!step(&scene, &beside).contains("CPU time in"));
        scene.contestants[1].device = "llvmpipe (LLVM 15)".to_owned();
        assert!(step(&scene, &beside).contains("note: pygfx: 1.0 ms of CPU time in 20.0 ms, on a processor"));
        let black =
            StepReport { rows: vec![measured("vtk-gpu", 0.5, 1.0, 0.155), report.rows[0].clone()], ..report.clone() };
        assert!(step(&scene, &black).contains("note: vtk-gpu: an RMSE of 0.155 is that of another scene; "));
        let coarse =
            StepReport { rows: black.rows.iter().map(|r| Measured { rmse: 0.155, ..r.clone() }).collect(), ..black };
        assert!(!step(&scene, &coarse).contains("note:"));
        let text = times_to_errors(&scene);
        let lines: Vec<String> = text.lines().map(words).collect();
        assert_eq!(lines[2], "cpu fast step 1/2: 10.0 ms, CPU 20.0 ms not by step 1/2: 1.84e-4");
        assert_eq!(lines[3], "pygfx not by step 1/2: 1.65e-3 not by step 1/2: 1.65e-3");
        assert!(lines[4].starts_with("note: --to-error"));
        let probe = |name: &str| Probe { contestant: name.to_owned(), step_voxels: 0.125, rmse: 7e-5 };
        let text = probes("ml-64", 0.125, [probe("cpu fast"), probe("ash exact")].iter());
        assert_eq!(text, "ml-64, step 1/8: RMSE x 1e3 of one picture: cpu fast 0.070, ash exact 0.070\n");
    }
}
