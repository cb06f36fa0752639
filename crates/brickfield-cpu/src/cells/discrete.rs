//! The discrete f64 answer of cells: the very sum that a plan asks for, cell by cell and node by node.
//!
//! Written from the rules of ARCHITECTURE.md ("Cells"). Cells along a ray come from `brickfield-curvilinear`, whose walker decides by
//! integers: the f32 renderer shares no line with it.

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Image, Ray};
use brickfield_curvilinear::{CellSegment, CellWalker, CurvilinearVolume};
use brickfield_frame::{CellsPlan, ViewRay};
use brickfield_optics::RayState;
use rayon::prelude::*;

/// The sum of a plan of cells, and how much it depends on roundings.
#[derive(Clone, Debug, PartialEq)]
pub struct DiscreteCells {
    /// Linear, premultiplied RGBA.
    pub image: Image<f64>,
    /// For each pixel, rows from the top: the most by which a channel changes when the ray is moved by [`SHIFT`](Self::SHIFT) of the cells'
    /// radius, to eight sides and along itself: each backend has its own way past edges. Rays that graze faces, edges or the outline of the cells have it large.
    pub ambiguity: Vec<f64>,
    /// Nodes of all segments.
    pub n_samples: u64,
    /// Cells along all rays.
    pub n_cells: u64,
}

impl DiscreteCells {
    /// By how much f32 may move a ray, in the cells' radius.
    pub const SHIFT: f64 = 1.0 / (1 << 20) as f64;
}

/// The sum that a plan of cells asks for, in f64.
///
/// No ray ends early, and no cell is jumped over. Accuracy: that of f64; positions of nodes are the plan's, rounded to f32. Cost: about 1 us a
/// cell and core, nine rays for each pixel.
pub fn discrete_cells(plan: &CellsPlan) -> DiscreteCells {
    let (size, reference) = (plan.size(), Reference::new(plan));
    let row = |y: u32| (0..size.x).map(|x| reference.pixel(x, y)).collect::<Vec<_>>();
    let rows: Vec<Vec<Pixel>> = (0..size.y).into_par_iter().map(row).collect();
    let pixels = || rows.iter().flatten();
    let mut image = Image::transparent(size);
    image.pixels_mut().iter_mut().zip(pixels()).for_each(|(to, from)| *to = from.rgba);
    DiscreteCells {
        image,
        ambiguity: pixels().map(|p| p.ambiguity).collect(),
        n_samples: pixels().map(|p| p.n_samples).sum(),
        n_cells: pixels().map(|p| p.n_cells).sum(),
    }
}

struct Reference<'a> {
    plan: &'a CellsPlan,
    /// `None` if rounding leaves the cells no volume: there is nothing to see.
    walker: Option<CellWalker>,
}

#[derive(Default)]
struct Pixel {
    rgba: [f64; 4],
    ambiguity: f64,
    n_samples: u64,
    n_cells: u64,
}

impl<'a> Reference<'a> {
    fn new(plan: &'a CellsPlan) -> Reference<'a> {
        let cells = plan.cells();
        let positions = (0..cells.nodes().len()).map(|i| cells.position(i)).collect();
        let volume = CurvilinearVolume::new(cells.n_cells(), positions).ok();
        let [nx, ny, _] = cells.n_cells().to_array().map(|n| n as usize);
        let is_void = |c: UVec3| cells.is_void(c.x as usize + nx * (c.y as usize + ny * c.z as usize));
        Reference { plan, walker: volume.and_then(|volume| CellWalker::with_voids(volume, is_void).ok()) }
    }

    fn pixel(&self, x: u32, y: u32) -> Pixel {
        let (ray, end) = (self.plan.rays().ray(x, y), self.plan.end(x, y));
        let mut pixel = self.along(&ray, end);
        let shift = DiscreteCells::SHIFT * self.plan.cells().radius();
        let right = ray.direction.any_orthonormal_vector();
        let up = ray.direction.cross(right);
        let sides = [(right, 1.0), (-right, -1.0), (up, -1.0), (-up, 1.0)];
        let corners = [right + up, right - up, -right + up, -right - up].map(|corner| (corner, 0.0));
        for (side, along) in sides.into_iter().chain(corners) {
            let moved = ViewRay { anchor: ray.anchor + (side + ray.direction * along) * shift, ..ray };
            let other = self.along(&moved, end);
            let difference = pixel.rgba.iter().zip(other.rgba).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            pixel.ambiguity = pixel.ambiguity.max(difference);
        }
        pixel
    }

    /// The sum along a ray, up to the surface that it ends at.
    fn along(&self, ray: &ViewRay, end: Option<([f32; 3], f32)>) -> Pixel {
        let (mut pixel, mut state) = (Pixel::default(), RayState::default());
        let t_end = end.map_or(f64::INFINITY, |(_, t)| f64::from(t));
        // From the eye, or from a place before all cells: t counts from the eye, but digits are not lost on the way.
        let t_start = (ray.t_anchor - ray.anchor.length() - 2.0 * self.plan.cells().radius()).max(0.0);
        let origin = ray.anchor + ray.direction * (t_start - ray.t_anchor);
        let walk =
            self.walker.as_ref().and_then(|w| Some((w, w.walk(&Ray { origin, direction: ray.direction }).ok()?)));
        let Some((walker, walk)) = walk else {
            pixel.rgba = over(&state, end.map(|(color, _)| color));
            return pixel;
        };
        let shifted = walk.map(|s| CellSegment { t_in: s.t_in + t_start, t_out: s.t_out + t_start, ..s });
        let cells: Vec<CellSegment> = shifted.collect();
        for run in cells.chunk_by(|a, b| a.run == b.run) {
            pixel.n_samples += self.add_run(walker, ray, run, t_end, &mut state);
        }
        pixel.n_cells = cells.len() as u64;
        pixel.rgba = over(&state, end.map(|(color, _)| color));
        pixel
    }

    /// Adds the segments of a row of cells; the number of its nodes.
    fn add_run(
        &self,
        walker: &CellWalker,
        ray: &ViewRay,
        run: &[CellSegment],
        t_end: f64,
        state: &mut RayState,
    ) -> u64 {
        let (step, rule) = (self.plan.sampling().step_world(), self.plan.sampling().rule());
        let (start, end) = (run[0].t_in, run[run.len() - 1].t_out.min(t_end));
        let mut n_samples = 0;
        let mut k = (start / step).floor();
        while k * step < end {
            let (from, to) = (start.max(k * step), end.min((k + 1.0) * step));
            k += 1.0;
            if from >= to {
                continue;
            }
            let node = |x: &f64| self.value(walker, ray, run, from + x * (to - from));
            let values: Vec<f64> = rule.nodes().iter().map(node).collect();
            state.push(rule.segment(self.plan.transfer(), &values, to - from));
            n_samples += values.len() as u64;
        }
        n_samples
    }

    /// The value at distance t: in the cell that the ray is in, by its local coordinates.
    fn value(&self, walker: &CellWalker, ray: &ViewRay, run: &[CellSegment], t: f64) -> f64 {
        let i = run.partition_point(|s| s.t_out <= t).min(run.len() - 1);
        let cell = run[i].cell;
        let position = ray.anchor + ray.direction * (t - ray.t_anchor);
        let local = walker.volume().local_inside(cell, position);
        let [nx, ny, _] = walker.volume().n_cells().to_array().map(|n| n as usize + 1);
        let corner = |i: usize| {
            let at = (cell.x as usize + (i & 1), cell.y as usize + (i >> 1 & 1), cell.z as usize + (i >> 2));
            f64::from(self.plan.cells().nodes()[at.0 + nx * (at.1 + ny * at.2)].value)
        };
        trilinear(std::array::from_fn(corner), local)
    }
}

fn trilinear(corners: [f64; 8], local: DVec3) -> f64 {
    let mix = |a: f64, b: f64, x: f64| a * (1.0 - x) + b * x;
    let [a, b, c, d] = std::array::from_fn(|i| mix(corners[2 * i], corners[2 * i + 1], local.x));
    mix(mix(a, b, local.y), mix(c, d, local.y), local.z)
}

/// What a ray has gathered, before the surface that it ends at.
fn over(state: &RayState, surface: Option<[f32; 3]>) -> [f64; 4] {
    let [r, g, b, a] = state.rgba();
    match surface {
        None => [r, g, b, a],
        Some(color) => {
            let behind = color.map(|c| f64::from(c) * (1.0 - a));
            [r + behind[0], g + behind[1], b + behind[2], 1.0]
        }
    }
}
