//! Curvilinear cells: the f64 answer, and a fast f32 renderer.

mod crossing;
mod discrete;
mod entry;
mod lanes;
mod line;
mod map;
mod march;
mod scene;
mod walk;

use std::time::Instant;

use brickfield_core::Image;
use brickfield_core::glam::UVec2;
use brickfield_frame::{CellsBackend, CellsPlan, Cost, Frame, RenderError, check_memory};
use rayon::prelude::*;

pub use discrete::{DiscreteCells, discrete_cells};

use crate::CpuBackend;
use crate::fast::segment::Ray32;
use crate::fast::{check, milliseconds};
use lanes::{Lanes, Plain};
use march::March;
use scene::Scene;

impl CellsBackend for CpuBackend {
    fn render_cells(&mut self, plan: &CellsPlan) -> Result<Frame, RenderError> {
        check(plan.size())?;
        check_memory(plan.size())?;
        let begin = Instant::now();
        let scene = Scene::new(plan);
        let mut image = Image::transparent(plan.size());
        let width = plan.size().x as usize;
        let simd = pulp::Arch::new();
        let bands = image.pixels_mut().par_chunks_mut(width * TILE).enumerate();
        bands.for_each(|(band, pixels)| {
            render(simd, &scene, UVec2::new(width as u32, (band * TILE) as u32), pixels);
        });
        Ok(Frame::new(image, Cost::of_rendering(milliseconds(begin))))
    }
}

/// Pixels along a tile's side: neighbouring rays pass the same cells while these are in the cache.
const TILE: usize = 8;

/// Renders rows by the processor's instructions: the width of the picture, and the first row.
fn render(simd: pulp::Arch, scene: &Scene, place: UVec2, pixels: &mut [[f32; 4]]) {
    let [width, first_row] = place.to_array().map(|x| x as usize);
    #[cfg(target_arch = "x86_64")]
    if let pulp::Arch::V3(lanes) = simd {
        return pulp::Simd::vectorize(lanes, Band { lanes, scene, first_row, width, pixels });
    }
    simd.dispatch(Band { lanes: Plain, scene, first_row, width, pixels });
}

/// [`TILE`] rows of the picture: all that is inlined below it is compiled once for each instruction set.
struct Band<'a, L> {
    lanes: L,
    scene: &'a Scene<'a>,
    first_row: usize,
    width: usize,
    pixels: &'a mut [[f32; 4]],
}

impl<L: Lanes> pulp::WithSimd for Band<'_, L> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let n_rows = self.pixels.len() / self.width;
        let mut march = March::new(self.lanes, self.scene);
        for tile in (0..self.width).step_by(TILE) {
            march.enter_tile(UVec2::new(tile as u32, self.first_row as u32), TILE as u32);
            for y in 0..n_rows {
                for x in tile..(tile + TILE).min(self.width) {
                    let pixel = UVec2::new(x as u32, (self.first_row + y) as u32);
                    self.pixels[y * self.width + x] = march.pixel(pixel);
                }
            }
        }
    }
}

/// The pixel of a ray that ends at a surface of this colour, if at any.
fn over(ray: &Ray32, surface: Option<[f32; 3]>) -> [f32; 4] {
    let [r, g, b, a] = ray.rgba(1.0);
    match surface {
        None => [r, g, b, a],
        Some(color) => {
            let t = ray.transmittance as f32;
            [r + t * color[0], g + t * color[1], b + t * color[2], 1.0]
        }
    }
}
