//! The report as a table on the terminal.

use std::fmt::Write;

use comfy_table::{Cell, CellAlignment, ContentArrangement, Table, TableComponent, presets::NOTHING};

use super::{BackendInfo, Report, Row, SETUP_COMMAND, step_label};

const HEADER: [&str; 11] =
    ["", "backend", "mode", "rule", "step", "samples", "ms (min-max)", "RMSE", "max", "dE mean", "dE 95 %"];

/// All rows, curve after curve; `*` marks the Pareto front.
pub fn table(report: &Report) -> String {
    let mut table = Table::new();
    table.load_preset(NOTHING).set_content_arrangement(ContentArrangement::Disabled).set_header(HEADER);
    table.set_style(TableComponent::HeaderLines, '-').set_style(TableComponent::MiddleHeaderIntersections, '-');
    for row in report.curves().into_iter().flat_map(|(_, rows)| rows) {
        table.add_row(cells(row));
    }
    for column in table.column_iter_mut().skip(4) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table.to_string()
}

/// A line for each backend that did not take part, and the command that helps; empty if all did.
pub fn absences(backends: &[BackendInfo]) -> String {
    let mut text = String::new();
    for b in backends {
        if let Some(reason) = &b.absent {
            let _ = writeln!(text, "absent: {}: {reason}", b.backend);
        }
    }
    if !text.is_empty() {
        let _ = writeln!(text, "a software Vulkan driver comes by: {SETUP_COMMAND}");
    }
    text
}

fn cells(row: &Row) -> Vec<Cell> {
    let front = if row.on_front { "*" } else { "" };
    let times = format!("{:.1} ({:.1}-{:.1})", row.median_ms, row.min_ms, row.max_ms);
    let numbers = [row.rmse, row.max_abs, row.delta_e_mean, row.delta_e_p95].map(|x| format!("{x:.2e}"));
    let words = [front.to_owned(), row.backend.clone(), row.mode.clone(), row.rule.clone()];
    let middle = [step_label(row.step_voxels), millions(row.samples), times];
    words.into_iter().chain(middle).chain(numbers).map(Cell::new).collect()
}

fn millions(n: u64) -> String {
    format!("{:.2} M", n as f64 * 1e-6)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::tests::report;

    #[test]
    fn every_row_is_in_the_table_and_the_front_is_marked() {
        let report = report();
        let text = table(&report);
        let lines = text.lines().filter(|l| l.contains(" exact ") || l.contains(" fast ")).count();
        assert_eq!(lines, report.rows.len());
        let marked = text.lines().filter(|l| l.trim_start().starts_with('*')).count();
        assert_eq!(marked, report.rows.iter().filter(|r| r.on_front).count());
        assert!(marked > 0);
    }

    #[test]
    fn absent_backends_are_named_with_the_command_that_helps() {
        let mut report = report();
        let text = absences(&report.backends);
        assert!(text.contains("absent: ash: no Vulkan") && text.contains(SETUP_COMMAND));
        report.backends.iter_mut().for_each(|b| b.absent = None);
        assert_eq!(absences(&report.backends), "");
    }
}
