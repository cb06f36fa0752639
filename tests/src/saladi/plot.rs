//! A plot of curves, both axes logarithmic.

use std::path::Path;

use plotters::prelude::*;

use crate::paper::PaperError;

/// A named curve.
pub(super) struct Curve {
    pub(super) name: String,
    pub(super) points: Vec<(f64, f64)>,
}

const SIZE: (u32, u32) = (900, 560);
/// The least error that is drawn; equal bits have none.
const LEAST: f64 = 1e-6;

/// Writes curves as SVG; numbers of 0 are drawn at 1e-6.
pub(super) fn plot(path: &Path, title: &str, axes: [&str; 2], curves: &[Curve]) -> Result<(), PaperError> {
    let drawn = |(x, y): (f64, f64)| (x.max(LEAST), y.max(LEAST));
    let points = || curves.iter().flat_map(|curve| curve.points.iter().copied()).map(drawn);
    let ends = |of: fn((f64, f64)) -> f64| {
        let (least, most) = points().map(of).fold((f64::INFINITY, LEAST), |(a, b), v| (a.min(v), b.max(v)));
        least.min(most) / 1.3..most * 1.3
    };
    let drawing = || -> Result<(), DrawingAreaErrorKind<<SVGBackend<'_> as DrawingBackend>::ErrorType>> {
        let root = SVGBackend::new(path, SIZE).into_drawing_area();
        root.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&root)
            .caption(title, ("sans-serif", 18))
            .margin(12)
            .x_label_area_size(48)
            .y_label_area_size(76)
            .build_cartesian_2d(ends(|p| p.0).log_scale(), ends(|p| p.1).log_scale())?;
        let label = |v: &f64| if (0.01..1e5).contains(v) { v.to_string() } else { format!("{v:e}") };
        chart
            .configure_mesh()
            .x_desc(axes[0])
            .y_desc(axes[1])
            .x_label_formatter(&label)
            .y_label_formatter(&label)
            .draw()?;
        for (i, curve) in curves.iter().enumerate() {
            let color = Palette99::pick(i).to_rgba();
            let points: Vec<_> = curve.points.iter().copied().map(drawn).collect();
            chart
                .draw_series(LineSeries::new(points.clone(), color.stroke_width(2)).point_size(3))?
                .label(&curve.name)
                .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 18, y)], color.stroke_width(2)));
        }
        chart.configure_series_labels().border_style(BLACK).background_style(WHITE.mix(0.8)).draw()?;
        root.present()
    };
    drawing().map_err(|e| PaperError::Out { path: path.to_owned(), source: std::io::Error::other(e.to_string()) })
}
