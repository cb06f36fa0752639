//! Meshes in f64: the answer that other backends are held to, and the picture of the cpu backend.
//!
//! Of each pixel the ray through its centre is met with the triangles whose outline in the picture holds the centre. A ray that meets an edge or a corner
//! is taken for one a little further to the right, and still less further down: it meets exactly one of the triangles around a
//! point of a closed mesh, decided without a tolerance.

mod answer;
mod bins;
mod outline;
mod shade;

use brickfield_core::Image;
use brickfield_core::glam::DVec2;
use brickfield_frame::MeshPlan;
use rayon::prelude::*;

pub use answer::{MeshAnswer, mesh_answer};
use bins::{BAND_ROWS, Bins};
use outline::{Corners, Outline};
use shade::{ShadedColor, Shader};

/// The pixels of a mesh's picture as [`MeshFrame::pixels`](brickfield_frame::MeshFrame::pixels) has them, in f32 from f64.
///
/// # Panics
/// Never: plans are checked when they are made.
pub fn mesh_pixels(plan: &MeshPlan) -> Image<f32> {
    let mut image = Image::transparent(plan.size());
    let width = plan.size().x as usize;
    let (bins, shader) = (Bins::of(plan), Shader::new(plan));
    image.pixels_mut().par_chunks_mut(width * BAND_ROWS as usize).enumerate().for_each(|(band, pixels)| {
        let rows = Rows { first: band as u32 * BAND_ROWS, n: (pixels.len() / width) as u32 };
        let mut nearest = vec![Hit::NOTHING; pixels.len()];
        for triangle in bins.of_band(band) {
            let corners = Corners::of(plan, *triangle);
            draw(plan, &corners, rows, &mut |pixel, hit| {
                if hit.distance < nearest[pixel].distance {
                    nearest[pixel] = hit;
                }
            });
        }
        for (i, (pixel, hit)) in pixels.iter_mut().zip(nearest).enumerate().filter(|(_, (_, hit))| hit.is_something()) {
            let at = rows.center(i, width);
            let ShadedColor { color, .. } = shader.shade(&Corners::of(plan, hit.triangle), at, hit.weights);
            let [r, g, b] = color.map(|c| c as f32);
            *pixel = [r, g, b, hit.distance as f32];
        }
    });
    image
}

/// Some rows of the picture.
#[derive(Clone, Copy)]
struct Rows {
    first: u32,
    n: u32,
}

impl Rows {
    /// The numbers of these rows' pixels in the box around an outline.
    fn within(self, outline: &Outline, width: u32) -> impl Iterator<Item = usize> + use<> {
        let columns = outline.columns(0, width);
        let row = move |y: u32| columns.clone().map(move |x| (x + width * (y - self.first)) as usize);
        outline.rows(self.first, self.first + self.n).flat_map(row)
    }

    /// The centre of a pixel, by its number in these rows.
    fn center(self, i: usize, width: usize) -> DVec2 {
        DVec2::new((i % width) as f64 + 0.5, f64::from(self.first) + (i / width) as f64 + 0.5)
    }
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug)]
struct Hit {
    triangle: u32,
    /// Of the corners; together 1.
    weights: [f64; 3],
    /// From the eye.
    distance: f64,
}

impl Hit {
    const NOTHING: Hit = Hit { triangle: u32::MAX, weights: [0.0; 3], distance: f64::INFINITY };

    fn is_something(&self) -> bool {
        self.distance < f64::INFINITY
    }
}

/// The pixels of some rows that a triangle covers: their numbers, and where their rays meet it.
fn draw(plan: &MeshPlan, corners: &Corners, rows: Rows, hit: &mut dyn FnMut(usize, Hit)) {
    let Some(outline) = Outline::of(plan, corners) else { return };
    let width = plan.size().x;
    for pixel in rows.within(&outline, width) {
        let at = rows.center(pixel, width as usize);
        if outline.covers(at)
            && let Some(found) = outline.meet(plan, corners, at)
        {
            hit(pixel, found);
        }
    }
}
