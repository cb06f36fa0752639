//! Figure 16: mesh lines over a perturbed Mandelbrot set, with and without a least size of zones.

use std::sync::Arc;

use brickfield::curvilinear::{CurvilinearGrid, Positions, Selection, SizeSelector, View};
use brickfield::frame::MeshLines;
use brickfield_core::Image;
use brickfield_core::glam::DVec3;

use super::WynnArgs;
use super::data::{Terrain, timed_frame};
use crate::compare::rivals::Rivals;
use crate::paper::{Missed, PaperError, print};

/// Zones along a side.
const N: u32 = 1024;
const MOST_ITERATIONS: u32 = 200;
/// The constraint of the figure, in pixels.
const GRANULARITY: f64 = 32.0;

pub(super) fn run(args: &WynnArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, PaperError> {
    let terrain = Terrain::new("perturbed Mandelbrot set".to_owned(), perturbed());
    let view = terrain.seen_from_above(args.common.size, 1.0)?;
    let lines = MeshLines { width: 1.0, color: [0.0; 3] };
    print(&format!("{N} x {N} zones; lines of 1 pixel"))?;
    for (name, granularity) in [("constrained", Some(GRANULARITY)), ("all", None)] {
        let selection = select(&terrain, &view, granularity);
        for backend in &mut rivals.present {
            let (plan, frame, seconds) =
                timed_frame(backend.as_mut(), || terrain.plan(&view, &selection, Some(lines)))?;
            let kind = backend.describe().backend;
            let image = frame.image();
            print(&format!(
                "  {name}: {} zones, {} triangles; {kind}: {:.0} ms, {:.1} % of the surface is dark with lines",
                selection.n_leaves(),
                plan.mesh().triangles().len(),
                seconds * 1e3,
                100.0 * dark_share(&image)
            ))?;
            let what = match granularity {
                Some(pixels) => format!("zones of at most {pixels} pixels, {kind}"),
                None => format!("all zones, {kind}"),
            };
            args.common.write_picture(&format!("wynn-mandelbrot-{name}-{kind}"), &image, &what)?;
        }
    }
    Ok(Vec::new())
}

fn select(terrain: &Terrain, view: &View, granularity: Option<f64>) -> Selection {
    let mut selector = SizeSelector::new(Arc::clone(&terrain.tree), granularity.unwrap_or(1e-6)).expect("above 0");
    selector.update(view);
    selector.selection().clone()
}

/// The share of opaque pixels that are nearly black: the spectrum has no such colour.
fn dark_share(image: &Image<f32>) -> f64 {
    let (mut n, mut n_dark) = (0u32, 0u32);
    for [r, g, b, a] in image.pixels() {
        n += u32::from(*a > 0.0);
        n_dark += u32::from(*a > 0.0 && r.max(*g).max(*b) < 0.5);
    }
    f64::from(n_dark) / f64::from(n.max(1))
}

/// Nodes beside an even grid, with the smooth number of iterations until a point leaves the set's neighbourhood.
fn perturbed() -> CurvilinearGrid {
    let at = |row: u32, column: u32| {
        let (u, v) = (f64::from(column) / f64::from(N), f64::from(row) / f64::from(N));
        let (wave_u, wave_v) = ((7.0 * v + 3.0 * u).sin(), (6.0 * u - 2.0 * v).cos());
        DVec3::new(-2.1 + 2.8 * (u + 0.02 * wave_u * wave_v), -1.4 + 2.8 * (v + 0.02 * wave_v), 0.0)
    };
    let nodes = || (0..=N).flat_map(|row| (0..=N).map(move |column| (row, column)));
    let positions: Vec<DVec3> = nodes().map(|(row, column)| at(row, column)).collect();
    let values = positions.iter().map(|p| n_iterations(p.x, p.y) as f32).collect();
    CurvilinearGrid::new(N, N, Positions::Curvilinear(positions), values).expect("finite nodes")
}

/// The logarithm of the number of iterations, without steps between whole ones.
fn n_iterations(x: f64, y: f64) -> f64 {
    let (mut u, mut v) = (0.0f64, 0.0f64);
    for i in 0..MOST_ITERATIONS {
        (u, v) = (u * u - v * v + x, 2.0 * u * v + y);
        let square = u * u + v * v;
        if square > 1e4 {
            return (f64::from(i) + 1.0 - (0.5 * square.ln()).log2().max(0.0) + 4.0).max(1.0).ln();
        }
    }
    f64::from(MOST_ITERATIONS).ln()
}
