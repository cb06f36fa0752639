//! A plan whose slots are of several sizes, or flat blocks: each segment by itself.

use std::marker::PhantomData;
use std::ops::Range;
use std::sync::Arc;

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Level, Place};
use brickfield_frame::{BlockRanges, Division, FramePlan, Join, Places, PlanRay, Slots};
use brickfield_interp::interpolate;

use super::Renderer;
use super::brick::{Stored, Unorm8};
use super::classify::{Classifier, Optics32};
use super::f32_plan::Numbers;
use super::march::{Path, clip, nodes_of, one};
use super::prefiltered::{Values32, expected};
use super::segment::{Ray32, Segment32, segment_of};
use crate::blocks::Blocks;

/// A plan whose places differ, and whose samples are stored as `S`.
pub(super) struct PlacedPlan<'a, S> {
    plan: &'a FramePlan,
    transfer: Classifier,
    numbers: Numbers,
    spreads: Option<Spreads<'a>>,
    stored: PhantomData<S>,
}

/// The spreads of flat blocks' samples.
#[derive(Clone, Copy)]
struct Spreads<'a> {
    slots: &'a Slots,
    /// From a byte to a deviation in units of the value scale.
    scale: f32,
    ranges: &'a BlockRanges,
}

impl<'a, S: Stored> PlacedPlan<'a, S> {
    pub(super) fn new(plan: &'a FramePlan) -> Self {
        let transfer = Classifier::new(plan.transfer(), plan.value_scale());
        let scale = |slots: &Slots| slots.decode().scale / slots.format().unit() / plan.value_scale().unit();
        let of = |(slots, ranges): (&'a Arc<Slots>, &'a Arc<BlockRanges>)| Spreads {
            slots: slots.as_ref(),
            scale: scale(slots) as f32,
            ranges: ranges.as_ref(),
        };
        let spreads = plan.spreads().zip(plan.field().ranges()).map(of);
        PlacedPlan { plan, transfer, numbers: Numbers::of(plan), spreads, stored: PhantomData }
    }

    /// The value that the block around an index cell has at a sample position; `None` if it is empty.
    fn value_in(&self, cell: UVec3, q: DVec3) -> Option<f32> {
        let slots = self.plan.field().slots();
        let number = |slot: u32, place: &Place, q: DVec3| number::<S>(slots, slot, place, q) - self.numbers.bias;
        Some(self.value_of(self.number_in(cell, q, number)?))
    }

    /// The optics that are expected at a sample position of the block around an index cell; `None` if it is empty.
    fn optics_in(&self, spreads: &Spreads, cell: UVec3, q: DVec3) -> Option<Optics32> {
        let format = self.plan.field().slots().format();
        let stored = |slot: u32, end: usize| format.stored(spreads.ranges.reads()[slot as usize][end]) as f32;
        let end = |end: usize| self.number_in(cell, q, |slot, _, _| stored(slot, end) - self.numbers.bias);
        let range = [self.value_of(end(0)?), self.value_of(end(1)?)];
        let code = self.number_in(cell, q, |slot, place, q| number::<Unorm8>(spreads.slots, slot, place, q))?;
        let values = Values32 { mean: self.value_in(cell, q)?, deviation: code * spreads.scale, range };
        Some(expected(&self.transfer, &values))
    }

    /// From a stored number, less the bias, to one of the value scale.
    fn value_of(&self, number: f32) -> f32 {
        number * self.numbers.gain + self.numbers.offset
    }

    /// A number that the block around an index cell has at a sample position, by the numbers of slots there; `None` if it is empty.
    fn number_in(&self, cell: UVec3, q: DVec3, number: impl Fn(u32, &Place, DVec3) -> f32) -> Option<f32> {
        let field = self.plan.field();
        let slot = field.index().at(cell).slot()?;
        let q = q.clamp(DVec3::ZERO, field.last_sample());
        match (field.join(), field.slots().places()) {
            (Join::Blend(scheme), Places::Blocks(places)) => {
                let layout = places.layout();
                let fetch = |block| f64::from(number(layout.ordinal(block) as u32, &places.place(block), q));
                Some(interpolate(layout, scheme, q.to_array(), |block| places.row(block).level, fetch) as f32)
            }
            _ => Some(number(slot, &field.place_at(cell)?, q)),
        }
    }

    /// One segment, whose nodes lie in the blocks around the index cells that `cell` tells.
    fn one(&self, path: &Path, k: i64, cell: impl Fn(DVec3) -> UVec3) -> Segment32 {
        let Some(spreads) = &self.spreads else {
            return one((self.plan, &self.transfer), path, k, |q| self.value_in(cell(q), q));
        };
        let (nodes, length) = nodes_of(self.plan, path, k, |q| self.optics_in(spreads, cell(q), q));
        segment_of(self.plan.sampling().rule(), nodes, length)
    }
}

/// The stored number that a slot has at a clamped position.
fn number<T: Stored>(slots: &Slots, slot: u32, place: &Place, q: DVec3) -> f32 {
    match slots.samples(slot) {
        Some(samples) => trilinear(place, q, |i| T::number(samples.bytes(), i)),
        None => slots.one_sample(slot).unwrap_or_default() as f32,
    }
}

impl<S: Stored> Renderer for PlacedPlan<'_, S> {
    fn plan(&self) -> &FramePlan {
        self.plan
    }

    fn transfer(&self) -> &Classifier {
        &self.transfer
    }

    fn value(&self, q: DVec3) -> Option<f32> {
        self.value_in(self.plan.field().cell_at(q), q)
    }

    fn pixel(&self, ray: &PlanRay, runs: &[Range<i64>]) -> [f32; 4] {
        let (plan, center) = (self.plan, self.plan.rays().center);
        let domain = (plan.domain().min - center, plan.domain().max - center);
        let Some(span) = clip(ray, domain, ray.t_eye) else { return [0.0; 4] };
        let mut state = Ray32::default();
        let floor = plan.sampling().transmittance_floor();
        let has_ended = |state: &Ray32| state.transmittance < floor || state.transmittance == 0.0;
        match plan.sampling().division() {
            Division::Ray => {
                let path = Path::new(plan.sampling(), ray, span, Level(0));
                for k in runs.iter().flat_map(|run| path.first.max(run.start)..path.end.min(run.end)) {
                    state.push(self.one(&path, k, |q| plan.field().cell_at(q)));
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
                        state.push(self.one(&path, k, |_| crossing.cell));
                    }
                    if has_ended(&state) {
                        break;
                    }
                }
            }
        }
        state.rgba()
    }
}

/// The number between the eight samples around a clamped position: linear along x, then y, then z of the texture.
fn trilinear(place: &Place, q: DVec3, read: impl Fn(usize) -> f32) -> f32 {
    let last = place.n - 1;
    let s = place.axes.to_texture(place.local(q)).clamp(DVec3::ZERO, last.as_dvec3());
    let i = s.as_uvec3().min(last.saturating_sub(UVec3::ONE));
    let f = (s - i.as_dvec3()).as_vec3();
    let n = [place.n.x as usize, place.n.y as usize];
    // Along an axis with a single sample there is no neighbour.
    let at = |by: UVec3| {
        let p = (i + by).min(last);
        read(p.x as usize + n[0] * (p.y as usize + n[1] * p.z as usize))
    };
    let mix = |a: f32, b: f32, f: f32| a + (b - a) * f;
    let row = |y, z| mix(at(UVec3::new(0, y, z)), at(UVec3::new(1, y, z)), f.x);
    mix(mix(row(0, 0), row(1, 0), f.y), mix(row(0, 1), row(1, 1), f.y), f.z)
}
