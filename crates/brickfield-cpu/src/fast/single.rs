//! Segments one by one, wherever their nodes lie: for plans whose slots differ, and for light.

use std::ops::Range;

use brickfield_core::Level;
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_frame::{Division, PlanRay};

use super::Renderer;
use super::light::Lamp;
use super::march::{self, Path, clip};
use super::segment::{Ray32, Segment32, lit_segment};
use crate::blocks::Blocks;

/// The pixel of a ray, of which some runs of segments may see something, front to back.
pub(super) fn pixel(renderer: &impl Renderer, ray: &PlanRay, runs: &[Range<i64>]) -> [f32; 4] {
    let (plan, center) = (renderer.plan(), renderer.plan().rays().center);
    let domain = (plan.domain().min - center, plan.domain().max - center);
    let Some(span) = clip(ray, domain, ray.t_eye) else { return [0.0; 4] };
    let (mut state, lamp) = (Ray32::default(), Lamp::of(renderer));
    let floor = plan.sampling().transmittance_floor();
    let has_ended = |state: &Ray32| state.transmittance < floor || state.transmittance == 0.0;
    match plan.sampling().division() {
        Division::Ray => {
            let path = Path::new(plan.sampling(), ray, span, Level(0));
            for k in runs.iter().flat_map(|run| path.first.max(run.start)..path.end.min(run.end)) {
                state.push(one(renderer, lamp.as_ref(), &path, k, |q| plan.field().cell_at(q)));
                if has_ended(&state) {
                    break;
                }
            }
        }
        Division::Brick => {
            for crossing in Blocks::new(plan, ray, span).filter(|c| c.entry.slot().is_some()) {
                let level = plan.field().level_at(crossing.cell);
                let path = Path::new(plan.sampling(), ray, crossing.span, level);
                for k in path.first..path.end {
                    state.push(one(renderer, lamp.as_ref(), &path, k, |_| crossing.cell));
                }
                if has_ended(&state) {
                    break;
                }
            }
        }
    }
    state.rgba(lamp.map_or(1.0, |lamp| lamp.brightest()))
}

/// One segment; its nodes lie in the blocks around these index cells.
fn one(renderer: &impl Renderer, lamp: Option<&Lamp>, path: &Path, k: i64, cell: impl Fn(DVec3) -> UVec3) -> Segment32 {
    let (plan, transfer) = (renderer.plan(), renderer.transfer());
    let value = |q: DVec3| renderer.value_in(cell(q), q);
    let unlit = march::one((plan, transfer), path, k, value);
    let Some(lamp) = lamp.filter(|_| unlit.depth > 0.0) else { return unlit };
    let (start, length, weight) = path.segment(k);
    let node = |x: &f64| {
        let q = plan.rays().center + path.ray.at(start + length * x);
        Some((value(q)?, lamp.shade(renderer, cell(q), q, path.ray)))
    };
    let rule = plan.sampling().rule();
    let nodes = rule.nodes();
    lit_segment(rule, transfer, [node(&nodes[0]), nodes.get(1).and_then(node)], weight)
}
