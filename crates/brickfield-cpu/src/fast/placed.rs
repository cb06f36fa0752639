//! A plan whose slots are of several sizes, or flat blocks.

use std::marker::PhantomData;
use std::ops::Range;
use std::sync::Arc;

use brickfield_core::Place;
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_frame::{BlockRanges, FramePlan, Join, Places, PlanRay, Slots};
use brickfield_interp::interpolate;

use super::brick::{Stored, Unorm8};
use super::classify::{Classifier, Optics32};
use super::eight::Eight;
use super::f32_plan::Numbers;
use super::prefiltered::{Values32, expected};
use super::segment::Ray32;
use super::{Renderer, single};

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

    /// The optics that are expected at a sample position of the block around an index cell, in a slot.
    fn optics_of(&self, spreads: &Spreads, slot: u32, cell: UVec3, q: DVec3) -> Option<Optics32> {
        let format = self.plan.field().slots().format();
        let stored = |slot: u32, end: usize| format.stored(spreads.ranges.reads()[slot as usize][end]) as f32;
        let end = |end: usize| self.number_of(slot, cell, q, |slot, _, _| stored(slot, end) - self.numbers.bias);
        let range = [self.decoded(end(0)?), self.decoded(end(1)?)];
        let code = self.number_of(slot, cell, q, |slot, place, q| number::<Unorm8>(spreads.slots, slot, place, q))?;
        let values = Values32 { mean: self.value_of(slot, cell, q)?, deviation: code * spreads.scale, range };
        Some(expected(&self.transfer, &values))
    }

    /// The value that the block around an index cell, in a slot, has at a sample position.
    fn value_of(&self, slot: u32, cell: UVec3, q: DVec3) -> Option<f32> {
        let slots = self.plan.field().slots();
        let number = |slot: u32, place: &Place, q: DVec3| number::<S>(slots, slot, place, q) - self.numbers.bias;
        Some(self.decoded(self.number_of(slot, cell, q, number)?))
    }

    /// From a stored number, less the bias, to one of the value scale.
    fn decoded(&self, number: f32) -> f32 {
        number * self.numbers.gain + self.numbers.offset
    }

    /// A number that the block around an index cell, in a slot, has at a sample position, by the numbers of slots there.
    fn number_of(&self, slot: u32, cell: UVec3, q: DVec3, number: impl Fn(u32, &Place, DVec3) -> f32) -> Option<f32> {
        let field = self.plan.field();
        let q = q.clamp(DVec3::ZERO, field.last_sample());
        match (field.join(), field.slots().places()) {
            (Join::Blend(scheme), Places::Blocks(places)) => {
                let layout = places.layout();
                let fetch = |block| f64::from(number(layout.ordinal(block) as u32, &places.place(block), q));
                Some(interpolate(layout, scheme, q.to_array(), |block| places.row(block).level, fetch) as f32)
            }
            (_, Places::Blocks(places)) => Some(number(slot, &places.place(cell), q)),
            _ => Some(number(slot, &field.place_at(cell)?, q)),
        }
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

    fn value_in(&self, cell: UVec3, q: DVec3) -> Option<f32> {
        let slot = self.plan.field().index().at(cell).slot()?;
        self.value_of(slot, cell, q)
    }

    fn is_prefiltered(&self) -> bool {
        self.spreads.is_some()
    }

    fn expected_in(&self, cell: UVec3, q: DVec3) -> Option<Optics32> {
        let slot = self.plan.field().index().at(cell).slot()?;
        self.optics_of(self.spreads.as_ref()?, slot, cell, q)
    }

    /// Flat blocks have values even where the index has them as empty.
    fn value_beside(&self, cell: UVec3, q: DVec3) -> Option<f32> {
        match self.plan.field().slots().places() {
            Places::Blocks(places) => self.value_of(places.layout().ordinal(cell) as u32, cell, q),
            _ => self.value_in(cell, q),
        }
    }

    fn codes(&self, cell: UVec3, q: DVec3) -> [f32; 4] {
        let field = self.plan.field();
        let q = q.clamp(DVec3::ZERO, field.last_sample());
        let (Some(gradients), Places::Blocks(places)) = (self.plan.gradients(), field.slots().places()) else {
            return [0.0; 4];
        };
        let layout = places.layout();
        let of_block = |block: UVec3, channel: usize| {
            let slot = layout.ordinal(block) as u32;
            match gradients.samples(slot) {
                Some(codes) => {
                    trilinear(&places.place(block), q, |i| f32::from(codes.bytes()[4 * i + channel])) / 255.0
                }
                None => {
                    let word = gradients.one_sample(slot).unwrap_or_default() as u32;
                    f32::from(word.to_le_bytes()[channel]) / 255.0
                }
            }
        };
        std::array::from_fn(|channel| match field.join() {
            Join::Blend(scheme) => {
                let level = |block| places.row(block).level;
                let fetch = |block| f64::from(of_block(block, channel));
                interpolate(layout, scheme, q.to_array(), level, fetch) as f32
            }
            _ => of_block(cell, channel),
        })
    }

    fn march(&self, _: impl Eight, ray: &PlanRay, runs: &[Range<i64>], state: &mut Ray32) {
        single::march_singly(self, ray, runs, state);
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
