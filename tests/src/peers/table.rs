//! The run as tables.

use std::fmt::Write;

use comfy_table::{CellAlignment, Table, presets::NOTHING};

use super::measure::{Measured, SceneReport, StepReport};
use super::protocol::Domain;
use crate::report::step_label;

/// The scene, who takes part, and who does not.
pub(super) fn heading(scene: &SceneReport) -> String {
    let [x, y, z] = scene.dims;
    let mut text = format!("\n{}: {x} x {y} x {z} {}\n", scene.name, scene.scalar);
    let mut lines = Table::new();
    lines.load_preset(NOTHING);
    for c in &scene.contestants {
        let held = match c.domain {
            Some(Domain::Voxels) => "whole voxels",
            Some(Domain::Centres) => "between sample centres",
            None => "absent",
        };
        let what = c.absent.clone().unwrap_or_else(|| format!("{}; {}", c.version, c.device));
        lines.add_row([c.name.as_str(), held, what.as_str()]);
    }
    let _ = writeln!(text, "{lines}");
    text
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
    if !step.ratios.is_empty() {
        let mut lines = Table::new();
        lines.load_preset(NOTHING).set_header(["CPU time as a ratio", "", "wall time"]);
        let ratio =
            |r: &super::measure::TimeRatio| [format!("{} / {}", r.of, r.to), r.cpu.to_string(), r.wall.to_string()];
        lines.add_rows(step.ratios.iter().map(ratio));
        let _ = writeln!(text, "{lines}");
    }
    text
}

fn row(r: &Measured) -> [String; 7] {
    let range = |s: &crate::turns::Spread| format!("({:.1} to {:.1})", s.min, s.max);
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
