//! How many samples a plan has to look at.

use brickfield::frame::{FramePlan, MACROCELL_SIDE, Occupancy};
use brickfield_core::glam::{DVec3, UVec3};
use rayon::prelude::*;

/// Segments whose middle lies in the domain and not where the plan knows that it is dark.
pub(super) fn n_samples(plan: &FramePlan) -> u64 {
    let (size, rays) = (plan.size(), plan.rays());
    let of_row = |y: u32| {
        let of_pixel = |x: u32| {
            let ray = rays.ray(x, y);
            let step = plan.sampling().step_world() * ray.stretch;
            let middles = (0..rays.n_segments as u64).map(|k| (k as f64 + 0.5) * step).filter(|t| *t > ray.t_eye);
            middles.filter(|t| is_looked_at(plan, rays.center + ray.at(*t))).count() as u64
        };
        (0..size.x).map(of_pixel).sum::<u64>()
    };
    (0..size.y).into_par_iter().map(of_row).sum()
}

fn is_looked_at(plan: &FramePlan, q: DVec3) -> bool {
    let field = plan.field();
    if !plan.domain().contains(q) {
        return false;
    }
    let cell = field.cell_at(q);
    let Some(slot) = field.index().at(cell).slot() else { return false };
    if let Some(kept) = plan.kept() {
        let kept = kept.boxes()[slot as usize];
        return q.cmpge(kept.min).all() && q.cmple(kept.max).all();
    }
    plan.occupancy().is_none_or(|occupancy| is_bright(occupancy, slot, field.place_at(cell).map(|p| p.local(q))))
}

/// Whether a brick's macrocell around a position in its samples may be seen.
fn is_bright(occupancy: &Occupancy, slot: u32, local: Option<DVec3>) -> bool {
    let n = Occupancy::n_macrocells(occupancy.side());
    let Some(local) = local else { return false };
    let at = (local.max(DVec3::ZERO) / f64::from(MACROCELL_SIDE)).as_uvec3().min(UVec3::splat(n - 1));
    occupancy.brick(slot)[(at.x + n * (at.y + n * at.z)) as usize] < 0
}
