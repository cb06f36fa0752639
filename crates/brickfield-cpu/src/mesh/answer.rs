//! The answer to a mesh's plan, and how far each pixel may be from it.

use brickfield_core::Image;
use brickfield_core::glam::{DVec2, UVec2};
use brickfield_frame::MeshPlan;
use rayon::prelude::*;

use super::bins::{BAND_ROWS, Bins};
use super::outline::{Corners, Outline};
use super::shade::{ShadedColor, Shader};
use super::{Hit, Rows};

/// A mesh's picture in f64.
///
/// Rasterisers round corners to fractions of a pixel, and keep depths in f32. So there are pixels at which another triangle may be
/// drawn, or none: at outlines, and where surfaces cross. The other answers of such a pixel say how far it may be off.
#[derive(Clone, Debug)]
pub struct MeshAnswer {
    /// Linear red, green and blue, and the distance from the eye in units of [`MeshPlan::reach`]; 0 where there is nothing.
    pub pixels: Image<f64>,
    /// How far each pixel may be from that, in every channel, by another triangle or by roundings of values.
    pub ambiguity: Vec<f64>,
}

/// Corners are rounded by less, in pixels: 8 bits below a pixel, and the rounding of f32.
const CORNER_ROUNDING: f64 = 1.0 / 128.0;
/// Depths of f32, and the roundings of their computation, relative.
const DEPTH_ROUNDING: f64 = 2e-6;
/// Weights of corners, as shaders work them out from a triangle's volumes.
const WEIGHT_ROUNDING: f64 = 2e-6;

/// The answer to a plan.
pub fn mesh_answer(plan: &MeshPlan) -> MeshAnswer {
    let size = plan.size();
    let (bins, shader) = (Bins::of(plan), Shader::new(plan));
    let n_bands = size.y.div_ceil(BAND_ROWS);
    let band = |band: u32| {
        let rows = Rows { first: band * BAND_ROWS, n: BAND_ROWS.min(size.y - band * BAND_ROWS) };
        let found = candidates(plan, &bins, band as usize, rows);
        let pixel =
            |(i, found): (usize, Vec<Candidate>)| settled(plan, &shader, rows.center(i, size.x as usize), &found);
        found.into_iter().enumerate().map(pixel).collect::<Vec<_>>()
    };
    let settled: Vec<Settled> = (0..n_bands).into_par_iter().flat_map_iter(band).collect();
    let mut pixels = Image::transparent(UVec2::new(size.x, size.y));
    pixels.pixels_mut().iter_mut().zip(&settled).for_each(|(pixel, settled)| *pixel = settled.pixel);
    MeshAnswer { pixels, ambiguity: settled.into_iter().map(|settled| settled.ambiguity).collect() }
}

/// A triangle that may be drawn at a pixel.
struct Candidate {
    hit: Hit,
    corners: Corners,
    /// Whether it is there whatever corners are rounded to.
    is_sure: bool,
    /// Whether it covers the pixel's centre.
    is_met: bool,
    /// How far the depth may be off, in world units.
    rounding: f64,
}

struct Settled {
    pixel: [f64; 4],
    ambiguity: f64,
}

fn candidates(plan: &MeshPlan, bins: &Bins, band: usize, rows: Rows) -> Vec<Vec<Candidate>> {
    let width = plan.size().x;
    let mut found: Vec<Vec<Candidate>> = (0..width * rows.n).map(|_| Vec::new()).collect();
    for triangle in bins.of_band(band) {
        let corners = Corners::of(plan, *triangle);
        let Some(outline) = Outline::of(plan, &corners) else { continue };
        for pixel in rows.within(&outline, width) {
            let at = rows.center(pixel, width as usize);
            found[pixel].extend(Candidate::of(plan, &outline, corners, at));
        }
    }
    found
}

impl Candidate {
    fn of(plan: &MeshPlan, outline: &Outline, corners: Corners, at: DVec2) -> Option<Candidate> {
        let inside = outline.pixels_inside(at);
        let hit = (inside > -CORNER_ROUNDING).then(|| outline.meet(plan, &corners, at))??;
        let depth = |at: DVec2| outline.depth_in_plane(plan, &corners, at);
        let moved = [DVec2::X, DVec2::Y].map(|axis| (depth(at + axis * CORNER_ROUNDING) - depth(at)).abs());
        // Seen from its edge, a plane is anywhere.
        let rounding = moved[0] + moved[1] + DEPTH_ROUNDING * plan.reach();
        let rounding = if rounding.is_finite() { rounding } else { f64::INFINITY };
        Some(Candidate { hit, corners, is_sure: inside > CORNER_ROUNDING, is_met: outline.covers(at), rounding })
    }
}

/// The nearest triangle, and the farthest that any other triangle that may be drawn is from it.
fn settled(plan: &MeshPlan, shader: &Shader<'_>, at: DVec2, found: &[Candidate]) -> Settled {
    let pixel = |c: &Candidate| {
        let ShadedColor { color: [r, g, b], rounding } = shader.shade(&c.corners, at, c.hit.weights);
        ([r, g, b, c.hit.distance / plan.reach()], rounding)
    };
    let nearest = found.iter().filter(|c| c.is_met).min_by(|a, b| a.hit.distance.total_cmp(&b.hit.distance));
    let (own, rounding) = nearest.map_or(([0.0; 4], 0.0), pixel);
    // Triangles behind one that is surely there are hidden.
    let behind = |c: &Candidate| c.hit.distance + c.rounding;
    let hidden_from = found.iter().filter(|c| c.is_sure).map(behind).fold(f64::INFINITY, f64::min);
    let shown = found.iter().filter(|c| c.hit.distance - c.rounding <= hidden_from).map(|c| pixel(c).0);
    let nothing = (hidden_from == f64::INFINITY).then_some([0.0; 4]);
    let differs = |other: [f64; 4]| (0..4).map(|i| (other[i] - own[i]).abs()).fold(0.0, f64::max);
    Settled { pixel: own, ambiguity: rounding + shown.chain(nothing).map(differs).fold(0.0, f64::max) }
}

/// By how much the value at a point of a triangle may be off, for the values of its corners.
pub(super) fn value_rounding(values: [f64; 3]) -> f64 {
    let (low, high) = (
        values.iter().copied().fold(f64::INFINITY, f64::min),
        values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    );
    WEIGHT_ROUNDING * (high - low) + low.abs().max(high.abs()) * 2f64.powi(-22)
}
