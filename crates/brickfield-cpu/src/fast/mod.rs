//! The fast f32 renderer: a backend that needs no driver.

mod batch;
mod brick;
pub(crate) mod classify;
mod detail;
mod eight;
mod f32_plan;
mod light;
mod march;
mod placed;
mod prefiltered;
mod scalar;
pub(crate) mod segment;
mod single;
mod waiting;
mod walk;

use std::ops::Range;
use std::time::Instant;

use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{BrickSide, Image};
use brickfield_frame::{
    Backend, Capabilities, Cost, Description, Evaluate, Frame, FramePlan, Join, MeshBackend, MeshFrame, MeshPlan,
    Places, PlanRay, RenderError, SampleFormat, ShaderFunction, Timing, check_memory, draw_batches,
};
use brickfield_interp::Neighbourhood;
use rayon::prelude::*;

use crate::mesh::mesh_pixels;
use brick::{Float32, Stored, Unorm8, Unorm16};
use classify::{Classifier, Optics32};
use eight::{Eight, Vectorized, vectorized};
use f32_plan::F32Plan;
use light::Lamp;
use placed::PlacedPlan;
use prefiltered::{Values32, expected};
use segment::Ray32;

/// Most pixels along a side of a picture.
const MAX_IMAGE: u32 = 1 << 16;

/// Replays plans on the CPU, in f32, over all threads of the current rayon pool.
///
/// Sample positions are found in f64 block by block and followed in f32 inside a block, values and optics are f32, a ray's
/// sums f64: exact mode stays within 1e-5 of [`discrete`](crate::discrete()). Fast mode differs by early termination only.
#[derive(Clone, Debug)]
pub struct CpuBackend {
    description: Description,
}

impl CpuBackend {
    /// The backend for this machine.
    pub fn new() -> CpuBackend {
        let mut capabilities = Capabilities::UNLIMITED;
        capabilities.max_image = MAX_IMAGE;
        CpuBackend {
            description: Description::new(
                "cpu",
                cpu_model(),
                format!("{} threads, {}", rayon::current_num_threads(), instruction_set()),
                capabilities,
            ),
        }
    }
}

/// The vector instructions that are used: `V3` is AVX2 with FMA, `Scalar` what every processor has.
fn instruction_set() -> String {
    let debug = format!("{:?}", pulp::Arch::new());
    debug.split('(').next().unwrap_or_default().to_owned()
}

impl Default for CpuBackend {
    fn default() -> Self {
        CpuBackend::new()
    }
}

impl Backend for CpuBackend {
    fn describe(&self) -> &Description {
        &self.description
    }

    fn render_batches(
        &mut self,
        size: UVec2,
        batches: &mut dyn Iterator<Item = FramePlan>,
    ) -> Result<Frame, RenderError> {
        check(size)?;
        check_memory(size)?;
        let (mut rays, mut brightest) = (Vec::new(), 1.0);
        let cost = draw_batches(size, batches, |plan, _| {
            let begin = Instant::now();
            rays.resize(size.x as usize * size.y as usize, Ray32::default());
            brightest = dispatch(plan, Rendering { rays: &mut rays });
            Ok(Cost::of_rendering(milliseconds(begin)))
        })?;
        let mut image = Image::transparent(size);
        for (pixel, ray) in image.pixels_mut().iter_mut().zip(&rays) {
            *pixel = ray.rgba(brightest);
        }
        Ok(Frame::new(image, cost.unwrap_or_default()))
    }

    fn as_evaluate(&mut self) -> Option<&mut dyn Evaluate> {
        Some(self)
    }
}

impl MeshBackend for CpuBackend {
    /// In f64: it is the reference itself.
    fn render_mesh(&mut self, plan: &MeshPlan) -> Result<MeshFrame, RenderError> {
        check(plan.size())?;
        check_memory(plan.size())?;
        let begin = Instant::now();
        let pixels = mesh_pixels(plan);
        let timing = Timing { wall_ms: milliseconds(begin), ..Timing::default() };
        Ok(MeshFrame { pixels, timing, uploaded_bytes: 0 })
    }
}

impl Evaluate for CpuBackend {
    fn evaluate(
        &mut self,
        plan: &FramePlan,
        function: ShaderFunction,
        inputs: &[[f32; 4]],
    ) -> Result<Vec<[f32; 4]>, RenderError> {
        check(plan.size())?;
        Ok(dispatch(plan, Evaluation { function, inputs }))
    }
}

/// A plan in f32, whatever the size and format of its slots.
trait Renderer: Sync {
    fn plan(&self) -> &FramePlan;

    fn transfer(&self) -> &Classifier;

    /// The value that the block around an index cell has at a sample position, as a number of the value scale; `None` if it is empty.
    fn value_in(&self, cell: UVec3, q: DVec3) -> Option<f32>;

    /// Whether nodes have the optics that are [expected](Self::expected_in) of the values around them.
    fn is_prefiltered(&self) -> bool {
        false
    }

    /// The optics that are expected of the values around a sample position of the block around an index cell; `None` if it is empty, or
    /// nothing is known of these values.
    fn expected_in(&self, _cell: UVec3, _q: DVec3) -> Option<Optics32> {
        None
    }

    /// The value that the block around an index cell has, as gradients ask for it: of some fields, empty blocks have values, too.
    fn value_beside(&self, cell: UVec3, q: DVec3) -> Option<f32> {
        self.value_in(cell, q)
    }

    /// The stored gradient of the block around an index cell at a sample position: its four numbers, 0 to 1. 0 where a plan has none.
    fn codes(&self, _cell: UVec3, _q: DVec3) -> [f32; 4] {
        [0.0; 4]
    }

    /// A ray, of which some runs of segments may see something, front to back, behind what it has seen.
    fn march(&self, eight: impl Eight, ray: &PlanRay, runs: &[Range<i64>], state: &mut Ray32);
}

impl<const N: usize, S: Stored> Renderer for F32Plan<'_, N, S> {
    fn plan(&self) -> &FramePlan {
        self.plan
    }

    fn transfer(&self) -> &Classifier {
        &self.transfer
    }

    fn value_in(&self, cell: UVec3, q: DVec3) -> Option<f32> {
        F32Plan::value_in(self, &self.block_of(cell), q)
    }

    #[inline(always)]
    fn march(&self, eight: impl Eight, ray: &PlanRay, runs: &[Range<i64>], state: &mut Ray32) {
        match self.plan.lighting() {
            None => march::march(self, eight, ray, runs, state),
            Some(_) => single::march_singly(self, ray, runs, state),
        }
    }
}

/// Work on a plan of any kind.
trait Work {
    type Output;
    fn run(self, renderer: &impl Renderer) -> Self::Output;
}

fn dispatch<W: Work>(plan: &FramePlan, work: W) -> W::Output {
    match plan.field().slots().format() {
        SampleFormat::Unorm8 => dispatch_side::<Unorm8, W>(plan, work),
        SampleFormat::Unorm16 => dispatch_side::<Unorm16, W>(plan, work),
        SampleFormat::Float32 => dispatch_side::<Float32, W>(plan, work),
        SampleFormat::Unorm8x4 => unreachable!("values are single numbers"),
    }
}

fn dispatch_side<S: Stored, W: Work>(plan: &FramePlan, work: W) -> W::Output {
    match plan.field().slots().places() {
        Places::Even(BrickSide::S16) => work.run(&F32Plan::<16, S>::new(plan)),
        Places::Even(BrickSide::S32) => work.run(&F32Plan::<32, S>::new(plan)),
        Places::Even(BrickSide::S64) => work.run(&F32Plan::<64, S>::new(plan)),
        Places::Table { .. } | Places::Blocks(_) => work.run(&PlacedPlan::<S>::new(plan)),
    }
}

/// The rays of all pixels go on; the result is the brightest colour that they may show.
struct Rendering<'a> {
    rays: &'a mut [Ray32],
}

impl Work for Rendering<'_> {
    type Output = f32;
    fn run(self, renderer: &impl Renderer) -> f32 {
        let width = renderer.plan().size().x.max(1) as usize;
        let bands = self.rays.par_chunks_mut(width * TILE).enumerate();
        bands.for_each(|(band, rays)| vectorized(Band { renderer, first_row: band * TILE, width, rays }));
        Lamp::of(renderer).map_or(1.0, |lamp| lamp.brightest())
    }
}

/// Pixels along a tile's side: neighbouring rays read the same samples while they are in the cache. Beams have no smaller ones.
const TILE: usize = 8;
/// All segments of a ray.
const ALL: Range<i64> = i64::MIN..i64::MAX;

/// [`TILE`] rows of the picture: all that is inlined below it is compiled once for each instruction set.
struct Band<'a, R> {
    renderer: &'a R,
    first_row: usize,
    width: usize,
    rays: &'a mut [Ray32],
}

impl<R: Renderer> Vectorized for Band<'_, R> {
    #[inline(always)]
    fn run(self, eight: impl Eight) {
        let n_rows = self.rays.len() / self.width;
        let plan = self.renderer.plan();
        for tile in (0..self.width).step_by(TILE) {
            let columns = tile..(tile + TILE).min(self.width);
            let corner = UVec2::new(tile as u32, self.first_row as u32);
            let runs = plan.beams().map_or(std::slice::from_ref(&ALL), |beams| beams.runs(corner));
            if runs.is_empty() {
                continue;
            }
            for (y, x) in (0..n_rows).flat_map(|y| columns.clone().map(move |x| (y, x))) {
                let ray = plan.rays().ray(x as u32, (self.first_row + y) as u32);
                let state = &mut self.rays[y * self.width + x];
                match plan.proxy() {
                    None => self.renderer.march(eight, &ray, runs, state),
                    // Batches of polygons come from back to front.
                    Some(_) => {
                        let mut front = Ray32::default();
                        self.renderer.march(eight, &ray, runs, &mut front);
                        *state = front.before(state);
                    }
                }
            }
        }
    }
}

struct Evaluation<'a> {
    function: ShaderFunction,
    inputs: &'a [[f32; 4]],
}

impl Work for Evaluation<'_> {
    type Output = Vec<[f32; 4]>;
    fn run(self, renderer: &impl Renderer) -> Vec<[f32; 4]> {
        self.inputs.iter().map(|input| evaluate(renderer, self.function, *input)).collect()
    }
}

fn evaluate(renderer: &impl Renderer, function: ShaderFunction, [x, y, z, w]: [f32; 4]) -> [f32; 4] {
    let (plan, transfer) = (renderer.plan(), renderer.transfer());
    let values = transfer.values;
    let relative = |v: f32| values.number(v.into()) as f32;
    match function {
        ShaderFunction::Alpha => [scalar::alpha(x), 0.0, 0.0, 0.0],
        ShaderFunction::Depth => [scalar::depth(x), 0.0, 0.0, 0.0],
        ShaderFunction::Classify => {
            let o = match plan.spreads() {
                Some(_) => {
                    let deviation = (f64::from(y) / values.unit()) as f32;
                    expected(transfer, &Values32 { mean: relative(x), deviation, range: [relative(z), relative(w)] })
                }
                None => transfer.at(relative(x)),
            };
            [o.color[0], o.color[1], o.color[2], o.extinction]
        }
        ShaderFunction::Segment => {
            let rule = plan.sampling().rule();
            let s = segment::segment(rule, transfer, [Some(relative(x)), Some(relative(y))], z);
            [s.emission[0], s.emission[1], s.emission[2], s.depth]
        }
        ShaderFunction::Sample => {
            let q = DVec3::new(x.into(), y.into(), z.into());
            let value = renderer.value_in(plan.field().cell_at(q), q);
            value.map_or([0.0; 4], |v| [values.value(v.into()) as f32, 1.0, 0.0, 0.0])
        }
        ShaderFunction::RayAnchor => {
            let ray = plan.rays().ray(x as u32, y as u32);
            let a = ray.anchor.as_vec3();
            [a.x, a.y, a.z, ray.t_anchor as f32]
        }
        ShaderFunction::RayDirection => {
            let d = plan.rays().ray(x as u32, y as u32).direction.as_vec3();
            [d.x, d.y, d.z, 0.0]
        }
        ShaderFunction::WeightsLow => weights(plan, [x, y, z]).map_or([0.0; 4], |[low, _]| low),
        ShaderFunction::WeightsHigh => weights(plan, [x, y, z]).map_or([0.0; 4], |[_, high]| high),
    }
}

/// The weights of the eight flat blocks around a position; `None` if no blocks are blended.
fn weights(plan: &FramePlan, position: [f32; 3]) -> Option<[[f32; 4]; 2]> {
    let (Join::Blend(scheme), Places::Blocks(places)) = (plan.field().join(), plan.field().slots().places()) else {
        return None;
    };
    let around = Neighbourhood::around(places.layout(), position);
    let [a, b, c, d, e, f, g, h] = around.weights(places.layout(), scheme, |block| places.row(block).level);
    Some([[a, b, c, d], [e, f, g, h]])
}

/// Refuses pictures that are too large.
pub(crate) fn check(size: UVec2) -> Result<(), RenderError> {
    if size.max_element() > MAX_IMAGE {
        return Err(RenderError::ImageTooLarge { size, limit: MAX_IMAGE });
    }
    Ok(())
}

pub(crate) fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

/// The processor's name, as the operating system states it.
fn cpu_model() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = info.lines().find(|l| l.starts_with("model name")).and_then(|l| l.split(':').nth(1));
    name.map_or(std::env::consts::ARCH, str::trim).to_owned()
}
