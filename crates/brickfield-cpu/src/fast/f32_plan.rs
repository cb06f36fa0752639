//! A plan, ready to be marched through: the field and the transfer function in f32.

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_frame::{FramePlan, IndexEntry, SampleFormat};

use super::brick::{Places, Stored, stored_at};
use super::classify::Classifier;
use super::eight::{Eight, F32s};
use super::walk::faces;

/// A plan whose bricks have N samples a side, stored as `S`.
pub(super) struct F32Plan<'a, const N: usize, S> {
    pub(super) plan: &'a FramePlan,
    pub(super) transfer: Classifier,
    /// Adds up to a position in sample space from one relative to the frame's centre.
    pub(super) center: DVec3,
    pub(super) last: DVec3,
    pub(super) numbers: Numbers,
    /// The index: cells along each axis, the packed entries, and where cells meet.
    pub(super) n_cells: [usize; 3],
    pub(super) words: &'a [u32],
    pub(super) faces: [Vec<f64>; 3],
    /// The bytes of the bricks in all slots; none in those that the index does not name.
    bricks: Vec<&'a [u8]>,
    stored: std::marker::PhantomData<S>,
}

/// From stored numbers to numbers of the value scale: (stored - bias) * gain + offset.
#[derive(Clone, Copy, Debug)]
pub(super) struct Numbers {
    pub(super) gain: f32,
    pub(super) offset: f32,
    /// The stored number nearest to the first knot; 0 but for 16-bit ones.
    pub(super) bias: f32,
}

impl Numbers {
    pub(super) fn of(plan: &FramePlan) -> Numbers {
        let (slots, values) = (plan.field().slots(), plan.value_scale());
        let decode = slots.decode();
        let gain = decode.scale / values.unit() / slots.format().unit();
        let bias = match slots.format() {
            SampleFormat::Unorm16 => slots.nearest_stored(values.origin()),
            SampleFormat::Unorm8 | SampleFormat::Unorm8x4 | SampleFormat::Float32 => 0.0,
        };
        let offset = bias * gain + values.number(decode.offset);
        Numbers { gain: gain as f32, offset: offset as f32, bias: bias as f32 }
    }
}

/// A block of index cells.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    pub(super) entry: IndexEntry,
    /// Lower corner of the brick, in sample space.
    pub(super) corner: DVec3,
}

impl<'a, const N: usize, S: Stored> F32Plan<'a, N, S> {
    pub(super) fn new(plan: &'a FramePlan) -> Self {
        let (dims, slots) = (plan.field().index().dims(), plan.field().slots());
        F32Plan {
            plan,
            center: plan.rays().center,
            last: plan.field().last_sample(),
            numbers: Numbers::of(plan),
            n_cells: dims.to_array().map(|n| n as usize),
            words: plan.field().index().words(),
            faces: dims.to_array().map(|n| faces(n, (N - 1) as f64)),
            bricks: (0..slots.n_slots())
                .map(|slot| slots.samples(slot).map_or(&[][..], |samples| samples.bytes()))
                .collect(),
            transfer: Classifier::new(plan.transfer(), plan.value_scale()),
            stored: std::marker::PhantomData,
        }
    }

    /// The block that holds sample position `q`.
    #[inline(always)]
    fn block(&self, q: DVec3) -> Block {
        self.block_of(self.cell_at(q))
    }

    /// The index cell that holds sample position `q`.
    #[inline(always)]
    pub(super) fn cell_at(&self, q: DVec3) -> UVec3 {
        const { assert!(N.is_power_of_two()) }
        let n_cells = (N - 1) as f64;
        let dims = self.plan.field().index().dims();
        // Truncation is floor: a clamped position is not negative. Half a sample away from every face, the quotient's
        // rounding does not matter.
        let sample = q.clamp(DVec3::ZERO, self.last).as_ivec3().as_dvec3();
        ((sample + 0.5) * (1.0 / n_cells)).as_ivec3().as_uvec3().min(dims - 1)
    }

    /// The block of an index cell.
    #[inline(always)]
    pub(super) fn block_of(&self, cell: UVec3) -> Block {
        let entry = self.plan.field().index().at(cell);
        let (low, _) = entry.reach().block(cell);
        Block { entry, corner: low.as_dvec3() * (N - 1) as f64 }
    }

    /// The value at a sample position, as a number of the value scale; `None` where its block is empty.
    #[inline(always)]
    pub(super) fn value(&self, q: DVec3) -> Option<f32> {
        self.value_in(&self.block(q), q)
    }

    /// The value that a block has at a sample position.
    #[inline(always)]
    pub(super) fn value_in(&self, block: &Block, q: DVec3) -> Option<f32> {
        let IndexEntry::Resident { slot, reach } = block.entry else { return None };
        let scale = 1.0 / f64::from(reach.level_of_brick().stride());
        let s = (q.clamp(DVec3::ZERO, self.last) - block.corner) * scale;
        let stored = stored_at::<N, S>(self.brick(slot), s.as_vec3().to_array(), self.numbers.bias);
        Some(stored * self.numbers.gain + self.numbers.offset)
    }

    /// The values at places in a brick, as numbers of the value scale.
    #[inline(always)]
    pub(super) fn values<V: Eight>(&self, eight: V, brick: &[u8], places: &Places<V>) -> F32s<V> {
        let stored = places.stored::<N, S>(eight, brick, self.numbers.bias);
        stored.times_plus(F32s::all(eight, self.numbers.gain), F32s::all(eight, self.numbers.offset))
    }

    /// The bytes of the brick in a slot.
    #[inline(always)]
    pub(super) fn brick(&self, slot: u32) -> &'a [u8] {
        &self.bricks[slot as usize][..N * N * N * S::N_BYTES]
    }
}
