//! How often the loops of a march go round: some drivers count.

use brickfield_core::glam::UVec2;
use brickfield_frame::{FramePlan, PlanRay, QuadratureRule};

use crate::{Entry, KnotSearch, Variant};

/// All loops of an invocation together end after so many rounds on Mesa's llvmpipe (`LP_MAX_TGSI_LOOP_ITERATIONS`; 22.3 has
/// it): longer rays are cut short, without a word.
pub const LLVMPIPE_LOOP_ROUNDS: u64 = 65_535;

/// About how often the loops of the march go round for the longest ray of a plan; seldom less.
pub fn loop_rounds(plan: &FramePlan) -> u64 {
    let n_segments = rays(plan).map(|ray| longest(plan, &ray)).fold(0.0, f64::max) / plan.sampling.step_world();
    let n_blocks = f64::from(plan.index.dims().element_sum());
    (n_segments * rounds_per_segment(plan) + 3.0 * n_blocks) as u64
}

/// Rays all over the picture.
fn rays(plan: &FramePlan) -> impl Iterator<Item = PlanRay> + '_ {
    const N: u32 = 8;
    let last = plan.size().max(UVec2::ONE) - 1;
    let at = move |i: u32, last: u32| (u64::from(last) * u64::from(i) / u64::from(N)) as u32;
    (0..=N).flat_map(move |j| (0..=N).map(move |i| plan.rays.ray(at(i, last.x), at(j, last.y))))
}

/// World units that a ray of this direction can run in the visible box.
fn longest(plan: &FramePlan, ray: &PlanRay) -> f64 {
    let extent = plan.visible.extent().to_array().into_iter();
    extent.zip(ray.direction.to_array()).map(|(e, d)| e / d.abs().max(1e-300)).fold(f64::MAX, f64::min)
}

fn rounds_per_segment(plan: &FramePlan) -> f64 {
    let rule = plan.sampling.rule();
    let pieces = if rule == QuadratureRule::PreIntegrated { 1.0 } else { 0.0 };
    let n_knots = plan.transfer.knots().len() as f64;
    let search = match Variant::of(plan, Entry::March).search {
        KnotSearch::Unrolled(_) => 0.0,
        KnotSearch::Loop => (n_knots.log2() + 1.0) * rule.nodes().len() as f64,
    };
    1.0 + pieces + search
}
