//! Log-log plots as SVG: axes by plotters, curves as groups that a page can label, dim and hide.

use std::fmt::Write;

use plotters::coord::CoordTranslate;
use plotters::coord::ranged1d::{KeyPointHint, Ranged};
use plotters::prelude::*;

use super::{CurveKey, Report, Row, observed_order, step_label};

/// The quantity that a plot shows error against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Against {
    /// Median time.
    Time,
    /// Step.
    Step,
}

/// Why a plot failed: there is nothing to show.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("no measurement with a finite, positive time and error to plot")]
pub(super) struct NothingToPlot;

const SIZE: (u32, u32) = (1000, 600);
/// The least error that is drawn; equal bits have none.
const LEAST_ERROR: f64 = 1e-9;

impl Against {
    fn of(self, row: &Row) -> f64 {
        match self {
            Against::Time => row.median_ms,
            Against::Step => row.step_voxels,
        }
    }

    fn title(self) -> &'static str {
        match self {
            Against::Time => "median time of a frame [ms]",
            Against::Step => "step [voxels]",
        }
    }

    fn tick(self, x: f64) -> String {
        match self {
            Against::Time => x.to_string(),
            Against::Step => step_label(x),
        }
    }

    fn axis(self, range: (f64, f64), report: &Report) -> LogAxis {
        match self {
            Against::Time => LogAxis::decimal(range),
            Against::Step => {
                let mut ticks: Vec<f64> = report.rows.iter().map(|r| r.step_voxels).collect();
                ticks.sort_by(f64::total_cmp);
                ticks.dedup();
                LogAxis { ticks, ..LogAxis::decimal(range) }
            }
        }
    }
}

/// Error (RMSE) of all rows against time or step.
pub(super) fn plot(report: &Report, against: Against) -> Result<String, NothingToPlot> {
    let point = |r: &Row| (against.of(r), r.rmse.max(LEAST_ERROR));
    let xs = around(report.rows.iter().map(|r| point(r).0)).ok_or(NothingToPlot)?;
    let ys = around(report.rows.iter().map(|r| point(r).1)).ok_or(NothingToPlot)?;
    let mut svg = String::new();
    let place = axes(&mut svg, against.axis(xs, report), LogAxis::decimal(ys), against);
    svg.truncate(svg.rfind("</svg>").unwrap_or(svg.len()));
    if against == Against::Time {
        svg.push_str(&front(report, &|r| place(point(r))));
    } else {
        svg.push_str(&guides(xs, ys, &place));
    }
    for (key, rows) in report.curves() {
        svg.push_str(&curve(&key, &rows, &|r| place(point(r))));
    }
    svg.push_str("</svg>\n");
    Ok(svg)
}

/// The range around positive numbers, with a margin; `None` if there is none.
fn around(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let usable = values.filter(|v| v.is_finite() && *v > 0.0);
    let (min, max) = usable.fold((f64::INFINITY, 0.0f64), |(a, b), v| (a.min(v), b.max(v)));
    (min <= max).then_some((min / 1.4, max * 1.4))
}

/// A logarithmic axis.
#[derive(Clone)]
struct LogAxis {
    min: f64,
    max: f64,
    ticks: Vec<f64>,
}

impl LogAxis {
    /// Ticks at 1, 2 and 5 times powers of ten; only at the powers if there are many.
    fn decimal((min, max): (f64, f64)) -> LogAxis {
        let steps: &[f64] = if (max / min).log10() > 3.5 { &[1.0] } else { &[1.0, 2.0, 5.0] };
        let decades = min.log10().floor() as i32..=max.log10().ceil() as i32;
        let ticks = decades.flat_map(|e| steps.iter().map(move |s| format!("{s}e{e}").parse().unwrap_or(f64::NAN)));
        LogAxis { min, max, ticks: ticks.filter(|v| (min..=max).contains(v)).collect() }
    }
}

impl Ranged for LogAxis {
    type FormatOption = plotters::coord::ranged1d::NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        let share = (value / self.min).ln() / (self.max / self.min).ln();
        limit.0 + (share * f64::from(limit.1 - limit.0)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.ticks.clone()
    }

    fn range(&self) -> std::ops::Range<f64> {
        self.min..self.max
    }
}

impl plotters::coord::ranged1d::ValueFormatter<f64> for LogAxis {
    fn format(value: &f64) -> String {
        value.to_string()
    }
}

/// Draws the axes; returns the map from numbers to picture positions.
fn axes(svg: &mut String, xs: LogAxis, ys: LogAxis, against: Against) -> impl Fn((f64, f64)) -> (i32, i32) + use<> {
    let root = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    let mut chart = ChartBuilder::on(&root)
        .margin(12)
        .x_label_area_size(52)
        .y_label_area_size(84)
        .build_cartesian_2d(xs, ys)
        .expect("a string takes any drawing");
    let text = RGBColor(90, 98, 110);
    chart
        .configure_mesh()
        .x_desc(against.title())
        .x_label_formatter(&|x| against.tick(*x))
        .y_label_formatter(&|y| format!("{y:e}"))
        .y_desc("error: RMSE")
        .axis_desc_style(("sans-serif", 17).into_font().color(&text))
        .label_style(("sans-serif", 15).into_font().color(&text))
        .axis_style(RGBColor(150, 158, 170))
        .bold_line_style(RGBColor(214, 219, 226))
        .light_line_style(TRANSPARENT)
        .draw()
        .expect("a string takes any drawing");
    root.present().expect("a string takes any drawing");
    let coordinates = chart.as_coord_spec().clone();
    move |point| coordinates.translate(&point)
}

fn curve(key: &CurveKey, rows: &[&Row], place: &dyn Fn(&Row) -> (i32, i32)) -> String {
    let color = rule_color(&key.rule);
    let line: String = rows.iter().map(|r| place(r)).map(|(x, y)| format!("{x},{y} ")).collect();
    let dash = if key.mode == "fast" { " stroke-dasharray=\"7 5\"" } else { "" };
    let order = observed_order(rows).map(|o| format!(", observed order {o:.2}")).unwrap_or_default();
    let mut svg = format!(
        "<g class=\"curve\" {} style=\"color:{color}\">\n<polyline points=\"{line}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"2\"{dash}><title>{} {} {}{order}</title></polyline>\n",
        attributes(key),
        key.backend,
        key.mode,
        key.rule
    );
    for row in rows {
        let fill = if key.mode == "fast" { "#fff" } else { color };
        let _ = writeln!(svg, "{}", marker(&key.backend, place(row), color, fill, &label(row)));
    }
    svg.push_str("</g>\n");
    svg
}

/// The attributes that the page filters by.
pub(super) fn attributes(key: &CurveKey) -> String {
    format!("data-backend=\"{}\" data-mode=\"{}\" data-rule=\"{}\"", key.backend, key.mode, key.rule)
}

fn label(row: &Row) -> String {
    let front = if row.on_front { ", on the front" } else { "" };
    format!(
        "{} {} {}, step {}: {:.1} ms, RMSE {:.2e}{front}",
        row.backend,
        row.mode,
        row.rule,
        step_label(row.step_voxels),
        row.median_ms,
        row.rmse
    )
}

/// A mark whose shape says the backend: cpu a disc, wgpu a square, ash a triangle; peers have corners of their own.
pub(super) fn marker(backend: &str, (x, y): (i32, i32), color: &str, fill: &str, title: &str) -> String {
    let style = format!("fill=\"{fill}\" stroke=\"{color}\" stroke-width=\"1.6\"");
    let title = format!("<title>{title}</title>");
    match backend {
        "cpu" => format!("<circle cx=\"{x}\" cy=\"{y}\" r=\"4.4\" {style}>{title}</circle>"),
        "wgpu" => {
            format!("<rect x=\"{}\" y=\"{}\" width=\"8\" height=\"8\" {style}>{title}</rect>", x - 4, y - 4)
        }
        _ => {
            let points = corners(backend).iter().map(|(right, down)| format!("{},{}", x + right, y + down));
            let points = points.collect::<Vec<_>>().join(" ");
            format!("<polygon points=\"{points}\" {style}>{title}</polygon>")
        }
    }
}

/// The corners of a mark, to the right and down from its middle.
fn corners(backend: &str) -> &'static [(i32, i32)] {
    match backend {
        "vtk-fixed" => &[(0, -6), (6, 0), (0, 6), (-6, 0)],
        "vtk-gpu" => &[(0, 6), (-5, -4), (5, -4)],
        "pygfx" => &[
            (-2, -6),
            (2, -6),
            (2, -2),
            (6, -2),
            (6, 2),
            (2, 2),
            (2, 6),
            (-2, 6),
            (-2, 2),
            (-6, 2),
            (-6, -2),
            (-2, -2),
        ],
        "vispy" => {
            &[(0, -3), (3, -6), (6, -3), (3, 0), (6, 3), (3, 6), (0, 3), (-3, 6), (-6, 3), (-3, 0), (-6, -3), (-3, -6)]
        }
        _ => &[(0, -6), (-5, 4), (5, 4)],
    }
}

/// The front as a broad band behind the curves, with a ring around each of its points.
fn front(report: &Report, place: &dyn Fn(&Row) -> (i32, i32)) -> String {
    let mut rows: Vec<&Row> = report.rows.iter().filter(|r| r.on_front).collect();
    rows.sort_by(|a, b| a.median_ms.total_cmp(&b.median_ms));
    let line: String = rows.iter().map(|r| place(r)).map(|(x, y)| format!("{x},{y} ")).collect();
    let mut svg = format!(
        "<g class=\"front\"><polyline points=\"{line}\" fill=\"none\" stroke=\"#ffd35c\" stroke-width=\"13\" stroke-linejoin=\"round\" stroke-linecap=\"round\" opacity=\"0.55\"><title>Pareto front</title></polyline>\n"
    );
    for (x, y) in rows.iter().map(|r| place(r)) {
        let _ = writeln!(
            svg,
            "<circle cx=\"{x}\" cy=\"{y}\" r=\"9\" fill=\"#fff3cc\" stroke=\"#c98a00\" stroke-width=\"1.5\"/>"
        );
    }
    svg.push_str("</g>\n");
    svg
}

/// Thin lines of slope 1, 2 and 4 through the upper right corner.
fn guides(xs: (f64, f64), ys: (f64, f64), place: &dyn Fn((f64, f64)) -> (i32, i32)) -> String {
    let mut svg = String::from("<g class=\"guides\">\n");
    for order in [1, 2, 4] {
        let at = |x: f64| ys.1 * (x / xs.1).powi(order);
        let low = xs.0.max(xs.1 * (ys.0 / ys.1).powf(1.0 / f64::from(order)));
        let ((x1, y1), (x2, y2)) = (place((low, at(low))), place((xs.1, ys.1)));
        let _ = writeln!(
            svg,
            "<line x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\" stroke=\"#9aa3af\" stroke-dasharray=\"2 5\"/><text x=\"{}\" y=\"{}\" font-size=\"13\" fill=\"#7b8494\" stroke=\"#fff\" stroke-width=\"4\" paint-order=\"stroke\">order {order}</text>",
            x1 + 8,
            y1 - 8
        );
    }
    svg.push_str("</g>\n");
    svg
}

/// A rule's colour, distinct for colour-blind readers too (Okabe and Ito 2008).
pub(super) fn rule_color(rule: &str) -> &'static str {
    match rule {
        "left-riemann" => "#8a8f98",
        "left-exponential" => "#d55e00",
        "midpoint" => "#0072b2",
        "pre-integrated" => "#009e73",
        "gauss2" => "#b5489a",
        "other-build" => "#e69f00",
        _ => "#333333",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::tests::report;

    #[test]
    fn one_curve_per_backend_rule_and_mode_and_the_front() {
        let report = report();
        let svg = plot(&report, Against::Time).unwrap();
        assert_eq!(svg.matches("<g class=\"curve\"").count(), report.curves().len());
        assert_eq!(svg.matches("<title>").count(), report.curves().len() + report.rows.len() + 1);
        assert_eq!(svg.matches("r=\"9\"").count(), report.rows.iter().filter(|r| r.on_front).count());
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
    }

    #[test]
    fn less_error_is_lower_and_more_time_further_right() {
        let mut svg = String::new();
        let (xs, ys) = (LogAxis::decimal((1.0, 100.0)), LogAxis::decimal((1e-6, 1e-1)));
        assert_eq!((&xs.ticks[..4], ys.ticks.len()), (&[1.0, 2.0, 5.0, 10.0][..], 6));
        let place = axes(&mut svg, xs, ys, Against::Time);
        let (a, b) = (place((2.0, 1e-2)), place((50.0, 1e-5)));
        assert!(a.0 < b.0 && a.1 < b.1);
    }

    #[test]
    fn no_rows_no_plot() {
        let mut report = report();
        report.rows.clear();
        assert_eq!(plot(&report, Against::Step), Err(NothingToPlot));
    }
}
