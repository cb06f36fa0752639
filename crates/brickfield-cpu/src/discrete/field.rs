//! The field that a plan describes, evaluated in f64: the same questions that shaders ask of `package::field`.

use std::marker::PhantomData;

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Interblock, Place, ValueRange};
use brickfield_frame::{BlockPlaces, BlockRanges, FramePlan, IndexEntry, Join, Places, SampleFormat, Slots};
use brickfield_interp::{Neighbourhood, interpolate};
use brickfield_optics::ValueSpread;

/// How a sample is read from a slot's bytes.
trait Stored: Sync {
    /// The stored number of sample `i` of a slot.
    fn read(bytes: &[u8], i: usize) -> f64;
}

struct Unorm8;
struct Unorm16;
struct Float32;

impl Stored for Unorm8 {
    #[inline(always)]
    fn read(bytes: &[u8], i: usize) -> f64 {
        f64::from(bytes[i])
    }
}

impl Stored for Unorm16 {
    #[inline(always)]
    fn read(bytes: &[u8], i: usize) -> f64 {
        f64::from(u16::from_le_bytes([bytes[2 * i], bytes[2 * i + 1]]))
    }
}

impl Stored for Float32 {
    #[inline(always)]
    fn read(bytes: &[u8], i: usize) -> f64 {
        let b = &bytes[4 * i..4 * i + 4];
        f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
    }
}

/// Work on a field of any kind.
pub(super) trait Work {
    type Output;
    fn run(self, field: &impl FieldReader) -> Self::Output;
}

/// Does some work on the field of a plan.
pub(super) fn with_field<W: Work>(plan: &FramePlan, work: W) -> W::Output {
    match plan.field().slots().format() {
        SampleFormat::Unorm8 => with_join::<Unorm8, W>(plan, work),
        SampleFormat::Unorm16 => with_join::<Unorm16, W>(plan, work),
        SampleFormat::Float32 => with_join::<Float32, W>(plan, work),
        SampleFormat::Unorm8x4 => unreachable!("values are single numbers"),
    }
}

fn with_join<S: Stored, W: Work>(plan: &FramePlan, work: W) -> W::Output {
    let shared = Shared::<S> { plan, slots: plan.field().slots(), stored: PhantomData };
    match (plan.field().join(), plan.field().slots().places()) {
        (Join::Blend(scheme), Places::Blocks(places)) => with_spreads(plan, Blended { shared, places, scheme }, work),
        _ => with_spreads(plan, shared, work),
    }
}

/// Spreads are bytes, whatever the values are; they are interpolated as values are.
fn with_spreads<W: Work>(plan: &FramePlan, values: impl FieldReader, work: W) -> W::Output {
    let (Some(slots), Some(ranges)) = (plan.spreads(), plan.field().ranges()) else { return work.run(&values) };
    let shared = Shared::<Unorm8> { plan, slots, stored: PhantomData };
    match (plan.field().join(), slots.places()) {
        (Join::Blend(scheme), Places::Blocks(places)) => {
            work.run(&Spread { values, spreads: Blended { shared, places, scheme }, ranges })
        }
        _ => work.run(&Spread { values, spreads: shared, ranges }),
    }
}

/// A field: from a position to the patch that owns it, and to the value there.
pub(super) trait FieldReader: Sync {
    /// The plan whose field it is.
    fn plan(&self) -> &FramePlan;

    /// The slots whose numbers are read.
    fn slots(&self) -> &Slots;

    /// The spreads of the field's samples, as a field of their own; `None` where there are none.
    #[inline]
    fn spreads(&self) -> Option<&dyn FieldReader> {
        None
    }

    /// The patch around an index cell.
    #[inline]
    fn patch_of(&self, cell: UVec3) -> Patch {
        let field = self.plan().field();
        let IndexEntry::Resident { slot, .. } = field.index().at(cell) else { return Patch { cell, slot: None } };
        Patch { cell, slot: field.place_at(cell).map(|place| (slot, place)) }
    }

    /// The patch around an index cell, as gradients ask for it: flat blocks have values even where the index has them as empty.
    fn lit_patch_of(&self, cell: UVec3) -> Patch {
        match self.plan().field().slots().places() {
            Places::Blocks(places) => {
                Patch { cell, slot: Some((places.layout().ordinal(cell) as u32, places.place(cell))) }
            }
            _ => self.patch_of(cell),
        }
    }

    /// How many samples of level 0 two neighbouring samples of a patch are apart, at a clamped position of it.
    fn spacing(&self, patch: &Patch, q: DVec3) -> f64;

    /// The stored number that a patch has at a clamped position; `None` if it is empty.
    fn stored(&self, patch: &Patch, q: DVec3) -> Option<f64>;

    /// The samples between which the number lies that a patch has at a clamped position; `None` if it is empty.
    fn around(&self, patch: &Patch, q: DVec3) -> Option<Around>;

    /// How far the stored number may move if the position is off by `delta`; 0 if the patch is empty.
    fn moved(&self, patch: &Patch, q: DVec3, delta: DVec3) -> f64;

    /// The stored gradient at a clamped position of a patch that is not empty: its four numbers, 0 to 1, and for each the widest range of
    /// those that are interpolated in one block.
    fn codes(&self, patch: &Patch, q: DVec3) -> [Code; 4];

    /// Whether the field jumps where two resident blocks of different levels meet.
    fn jumps_between_levels(&self) -> bool;

    /// The position that the field is evaluated at.
    #[inline]
    fn clamped(&self, q: DVec3) -> DVec3 {
        q.clamp(DVec3::ZERO, self.plan().field().last_sample())
    }

    /// The index cell that owns a position.
    #[inline]
    fn cell_at(&self, q: DVec3) -> UVec3 {
        self.plan().field().cell_at(q)
    }

    /// The data value that a patch has at a clamped position; `None` if it is empty.
    #[inline]
    fn value(&self, patch: &Patch, q: DVec3) -> Option<f64> {
        let slots = self.slots();
        Some(slots.decode().value(self.stored(patch, q)? / slots.format().unit()))
    }

    /// A number at a clamped position of a patch by the numbers of flat blocks, weighted as their values are; `None` if the patch is empty.
    fn of_blocks(&self, patch: &Patch, q: DVec3, number: &dyn Fn(usize) -> f64) -> Option<f64>;

    /// What a node at a clamped position of a patch is classified by; `None` if the patch is empty.
    #[inline]
    fn values(&self, patch: &Patch, q: DVec3) -> Option<Values> {
        Some(Values::One(self.value(patch, q)?))
    }

    /// Data values between two stored numbers, without sign.
    fn gain(&self) -> f64 {
        let slots = self.slots();
        (slots.decode().scale / slots.format().unit()).abs()
    }
}

/// A part of a field with one way to fetch its values.
#[derive(Clone, Copy, Debug)]
pub(super) struct Patch {
    /// An index cell of its block.
    pub(super) cell: UVec3,
    /// Its slot and where that one's samples lie; `None` if nothing is visible there.
    slot: Option<(u32, Place)>,
}

impl Patch {
    /// Whether nothing is visible there.
    pub(super) fn is_empty(&self) -> bool {
        self.slot.is_none()
    }
}

/// What a node is classified by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Values {
    /// The data value.
    One(f64),
    /// The data values that the node stands for.
    Many(ValueSpread),
}

impl Values {
    /// The data value, or the mean of several.
    pub(super) fn value(self) -> f64 {
        match self {
            Values::One(value) => value,
            Values::Many(values) => values.mean,
        }
    }
}

/// The samples between which a number lies.
#[derive(Clone, Copy, Debug)]
pub(super) struct Around {
    /// Least and greatest of them.
    pub(super) range: (f64, f64),
    /// The widest range of those that are interpolated in one block.
    pub(super) widest: f64,
}

/// One of the numbers of a stored gradient.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Code {
    pub(super) value: f64,
    pub(super) widest: f64,
}

/// The eight samples around a position, and where it lies between them.
struct Cell {
    /// Stored numbers, x varying fastest.
    samples: [f64; 8],
    /// Place in the cell, 0 to 1.
    fraction: DVec3,
}

impl Cell {
    /// Least and greatest of the samples.
    fn range(&self) -> (f64, f64) {
        self.samples.iter().fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)))
    }
}

/// A field of which every value is one slot's ([`Join::Shared`]).
struct Shared<'a, S> {
    plan: &'a FramePlan,
    slots: &'a Slots,
    stored: PhantomData<S>,
}

impl<S: Stored> Shared<'_, S> {
    /// The samples of a slot around a clamped position.
    #[inline]
    fn cell(&self, slot: u32, place: &Place, q: DVec3) -> Option<Cell> {
        match self.slots.samples(slot) {
            Some(samples) => Some(cell_of(place, q, |i| S::read(samples.bytes(), i))),
            None => Some(Cell { samples: [self.slots.one_sample(slot)?; 8], fraction: DVec3::ZERO }),
        }
    }

    /// The numbers `channel` of a slot's stored gradients around a clamped position.
    fn cell_of_codes(&self, slot: u32, place: &Place, q: DVec3, channel: usize) -> Cell {
        let slots = self.plan.gradients().expect("a plan with stored normals has gradients");
        match slots.samples(slot) {
            Some(samples) => cell_of(place, q, |i| f64::from(samples.bytes()[4 * i + channel]) / 255.0),
            None => {
                let word = slots.one_sample(slot).expect("a flat block has a gradient") as u32;
                let code = f64::from(word.to_le_bytes()[channel]) / 255.0;
                Cell { samples: [code; 8], fraction: DVec3::ZERO }
            }
        }
    }
}

/// The samples around a clamped position, read by number.
#[inline]
fn cell_of(place: &Place, q: DVec3, read: impl Fn(usize) -> f64) -> Cell {
    let last = place.n_in_space() - 1;
    let s = place.local(q).clamp(DVec3::ZERO, last.as_dvec3());
    let i = s.as_uvec3().min(last.saturating_sub(UVec3::ONE));
    let strides = strides(place);
    let base: usize = (0..3).map(|axis| i[axis] as usize * strides[axis]).sum();
    // Along an axis with a single sample there is no neighbour.
    let next = [0, 1, 2].map(|axis| if last[axis] > 0 { strides[axis] } else { 0 });
    let corner = |c: usize| (c & 1) * next[0] + (c >> 1 & 1) * next[1] + (c >> 2) * next[2];
    Cell { samples: std::array::from_fn(|c| read(base + corner(c))), fraction: s - i.as_dvec3() }
}

impl<S: Stored> FieldReader for Shared<'_, S> {
    #[inline]
    fn plan(&self) -> &FramePlan {
        self.plan
    }

    #[inline]
    fn slots(&self) -> &Slots {
        self.slots
    }

    #[inline]
    fn stored(&self, patch: &Patch, q: DVec3) -> Option<f64> {
        let (slot, place) = patch.slot?;
        self.cell(slot, &place, q).map(|cell| trilinear(&cell))
    }

    fn around(&self, patch: &Patch, q: DVec3) -> Option<Around> {
        let (slot, place) = patch.slot?;
        let range = self.cell(slot, &place, q)?.range();
        Some(Around { range, widest: range.1 - range.0 })
    }

    fn codes(&self, patch: &Patch, q: DVec3) -> [Code; 4] {
        let (slot, place) = patch.slot.expect("a patch that is not empty");
        std::array::from_fn(|channel| Code::of(&self.cell_of_codes(slot, &place, q, channel)))
    }

    /// By the slope between samples.
    fn moved(&self, patch: &Patch, q: DVec3, delta: DVec3) -> f64 {
        let (Some((_, place)), Some(around)) = (patch.slot, self.around(patch, q)) else { return 0.0 };
        // The last two samples of a short block may be half as far apart.
        let closest = if place.is_even() { 1.0 } else { 0.5 };
        around.widest * delta.element_sum() / (closest * f64::from(place.level.stride()))
    }

    fn jumps_between_levels(&self) -> bool {
        true
    }

    fn spacing(&self, patch: &Patch, _: DVec3) -> f64 {
        patch.slot.map_or(1.0, |(_, place)| f64::from(place.level.stride()))
    }

    fn of_blocks(&self, patch: &Patch, _: DVec3, number: &dyn Fn(usize) -> f64) -> Option<f64> {
        patch.slot.map(|(slot, _)| number(slot as usize))
    }
}

/// Flat blocks that are blended.
struct Blended<'a, S> {
    shared: Shared<'a, S>,
    places: &'a BlockPlaces,
    scheme: Interblock,
}

impl<S: Stored> Blended<'_, S> {
    /// The number at a clamped position, from the samples of up to eight blocks.
    fn blended(&self, q: DVec3, mut see: impl FnMut(&Cell)) -> f64 {
        let level = |block| self.places.row(block).level;
        let fetch = |block| {
            let slot = self.places.layout().ordinal(block) as u32;
            let cell = self.shared.cell(slot, &self.places.place(block), q).expect("a flat block has samples");
            see(&cell);
            trilinear(&cell)
        };
        interpolate(self.places.layout(), self.scheme, q.to_array(), level, fetch)
    }
}

impl<S: Stored> FieldReader for Blended<'_, S> {
    #[inline]
    fn plan(&self) -> &FramePlan {
        self.shared.plan
    }

    #[inline]
    fn slots(&self) -> &Slots {
        self.shared.slots
    }

    fn stored(&self, patch: &Patch, q: DVec3) -> Option<f64> {
        patch.slot.map(|_| self.blended(q, |_| ()))
    }

    fn around(&self, patch: &Patch, q: DVec3) -> Option<Around> {
        patch.slot?;
        let mut around = Around { range: (f64::MAX, f64::MIN), widest: 0.0 };
        self.blended(q, |cell| {
            let (min, max) = cell.range();
            around.range = (around.range.0.min(min), around.range.1.max(max));
            around.widest = around.widest.max(max - min);
        });
        Some(around)
    }

    fn codes(&self, _: &Patch, q: DVec3) -> [Code; 4] {
        let level = |block| self.places.row(block).level;
        std::array::from_fn(|channel| {
            let mut widest = 0.0f64;
            let fetch = |block| {
                let slot = self.places.layout().ordinal(block) as u32;
                let code = Code::of(&self.shared.cell_of_codes(slot, &self.places.place(block), q, channel));
                widest = widest.max(code.widest);
                code.value
            };
            let value = interpolate(self.places.layout(), self.scheme, q.to_array(), level, fetch);
            Code { value, widest }
        })
    }

    /// By looking: weights and samples change.
    fn moved(&self, patch: &Patch, q: DVec3, delta: DVec3) -> f64 {
        let Some(here) = self.stored(patch, q) else { return 0.0 };
        let along = |axis: DVec3| {
            let there = |sign: f64| self.blended(self.clamped(q + sign * delta * axis), |_| ());
            (there(1.0) - here).abs().max((there(-1.0) - here).abs())
        };
        DVec3::AXES.into_iter().map(along).sum()
    }

    fn jumps_between_levels(&self) -> bool {
        false
    }

    fn of_blocks(&self, patch: &Patch, q: DVec3, number: &dyn Fn(usize) -> f64) -> Option<f64> {
        patch.slot?;
        let level = |block| self.places.row(block).level;
        let fetch = |block| number(self.places.layout().ordinal(block));
        Some(interpolate(self.places.layout(), self.scheme, q.to_array(), level, fetch))
    }

    /// The mean over the eight blocks, by their weights: as continuous as the field.
    fn spacing(&self, _: &Patch, q: DVec3) -> f64 {
        let around = Neighbourhood::around(self.places.layout(), q.to_array());
        let level = |block| self.places.row(block).level;
        let weights = around.weights(self.places.layout(), self.scheme, level).into_iter().enumerate();
        let stride = |b| around.block(b).map_or(0.0, |block| f64::from(level(block).stride()));
        weights.map(|(b, weight)| weight * stride(b)).sum()
    }
}

impl Code {
    fn of(cell: &Cell) -> Code {
        let (min, max) = cell.range();
        Code { value: trilinear(cell), widest: max - min }
    }
}

/// A field whose samples have spreads.
struct Spread<'a, V, S> {
    values: V,
    spreads: S,
    ranges: &'a BlockRanges,
}

impl<V: FieldReader, S: FieldReader> FieldReader for Spread<'_, V, S> {
    #[inline]
    fn plan(&self) -> &FramePlan {
        self.values.plan()
    }

    #[inline]
    fn slots(&self) -> &Slots {
        self.values.slots()
    }

    #[inline]
    fn spreads(&self) -> Option<&dyn FieldReader> {
        Some(&self.spreads)
    }

    fn spacing(&self, patch: &Patch, q: DVec3) -> f64 {
        self.values.spacing(patch, q)
    }

    #[inline]
    fn stored(&self, patch: &Patch, q: DVec3) -> Option<f64> {
        self.values.stored(patch, q)
    }

    fn around(&self, patch: &Patch, q: DVec3) -> Option<Around> {
        self.values.around(patch, q)
    }

    fn moved(&self, patch: &Patch, q: DVec3, delta: DVec3) -> f64 {
        self.values.moved(patch, q, delta)
    }

    fn codes(&self, patch: &Patch, q: DVec3) -> [Code; 4] {
        self.values.codes(patch, q)
    }

    fn jumps_between_levels(&self) -> bool {
        self.values.jumps_between_levels()
    }

    fn of_blocks(&self, patch: &Patch, q: DVec3, number: &dyn Fn(usize) -> f64) -> Option<f64> {
        self.values.of_blocks(patch, q, number)
    }

    fn values(&self, patch: &Patch, q: DVec3) -> Option<Values> {
        let (mean, deviation) = (self.values.value(patch, q)?, self.spreads.value(patch, q)?);
        let (format, decode) = (self.slots().format(), self.slots().decode());
        let value = |read: f32| decode.value(format.stored(read) / format.unit());
        let [a, b] = [0, 1].map(|end| self.of_blocks(patch, q, &|block| value(self.ranges.reads()[block][end])));
        // Of numbers that fall as values rise, the least stands for the greatest.
        let range = ValueRange { min: a?.min(b?), max: a?.max(b?) };
        Some(Values::Many(ValueSpread { mean, deviation, range }))
    }
}

/// How many samples neighbours along each axis of space are apart in a slot.
#[inline]
fn strides(place: &Place) -> [usize; 3] {
    let of_texture = [1, place.n.x as usize, place.n.x as usize * place.n.y as usize];
    let mut strides = [0; 3];
    for (axis, of_space) in place.axes.of_texture().into_iter().enumerate() {
        strides[of_space] = of_texture[axis];
    }
    strides
}

/// Linear along x, then y, then z.
fn trilinear(cell: &Cell) -> f64 {
    let mix = |a: f64, b: f64, f: f64| a + (b - a) * f;
    let (v, f) = (&cell.samples, cell.fraction);
    let x = [0, 2, 4, 6].map(|i| mix(v[i], v[i + 1], f.x));
    mix(mix(x[0], x[1], f.y), mix(x[2], x[3], f.y), f.z)
}
