//! A plan, ready to be marched through: the field and the transfer function in f32.

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_frame::{FramePlan, IndexEntry, SampleFormat};

use super::brick::{Nodes, Stored};
use super::classify::Classifier;

/// A plan whose bricks have N samples a side, stored as `S`.
pub(super) struct F32Plan<'a, const N: usize, S> {
    pub(super) plan: &'a FramePlan,
    pub(super) transfer: Classifier,
    /// Adds up to a position in sample space from one relative to the frame's centre.
    pub(super) center: DVec3,
    pub(super) last: DVec3,
    pub(super) numbers: Numbers,
    /// The instructions that the processor has.
    pub(super) simd: pulp::Arch,
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

/// The block of index cells that holds a position, and how far it reaches, in sample space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    pub(super) entry: IndexEntry,
    /// Lower corner of the brick.
    pub(super) corner: DVec3,
    /// The positions that belong to the block; infinite at the volume's surface.
    pub(super) low: DVec3,
    pub(super) high: DVec3,
}

impl<'a, const N: usize, S: Stored> F32Plan<'a, N, S> {
    pub(super) fn new(plan: &'a FramePlan) -> Self {
        F32Plan {
            plan,
            center: plan.rays().center,
            last: plan.field().last_sample(),
            numbers: Numbers::of(plan),
            transfer: Classifier::new(plan.transfer(), plan.value_scale()),
            simd: pulp::Arch::new(),
            stored: std::marker::PhantomData,
        }
    }

    /// The block that holds sample position `q`.
    #[inline(always)]
    pub(super) fn block(&self, q: DVec3) -> Block {
        const { assert!(N.is_power_of_two()) }
        let n_cells = (N - 1) as f64;
        let dims = self.plan.field().index().dims();
        // Truncation is floor: a clamped position is not negative. Half a sample away from every face, the quotient's
        // rounding does not matter.
        let sample = q.clamp(DVec3::ZERO, self.last).as_ivec3().as_dvec3();
        self.block_of(((sample + 0.5) * (1.0 / n_cells)).as_ivec3().as_uvec3().min(dims - 1))
    }

    /// The block of an index cell.
    #[inline(always)]
    pub(super) fn block_of(&self, cell: UVec3) -> Block {
        let (n_cells, dims) = ((N - 1) as f64, self.plan.field().index().dims());
        let entry = self.plan.field().index().at(cell);
        let (low, high) = entry.reach().block(cell);
        let corner = low.as_dvec3() * n_cells;
        Block {
            entry,
            corner,
            low: DVec3::select(low.cmpeq(UVec3::ZERO), DVec3::NEG_INFINITY, corner),
            high: DVec3::select(high.cmpge(dims), DVec3::INFINITY, high.as_dvec3() * n_cells),
        }
    }

    /// The value at a sample position, as a number of the value scale; `None` where its block is empty.
    pub(super) fn value(&self, q: DVec3) -> Option<f32> {
        self.value_in(&self.block(q), q)
    }

    /// The value that a block has at a sample position.
    pub(super) fn value_in(&self, block: &Block, q: DVec3) -> Option<f32> {
        let IndexEntry::Resident { slot, reach } = block.entry else { return None };
        let stride = f64::from(reach.level_of_brick().stride());
        let s = (q.clamp(DVec3::ZERO, self.last) - block.corner) / stride;
        let nodes = Nodes {
            origin: s.as_vec3().to_array(),
            change: [0.0; 3],
            last: [(N - 1) as f32; 3],
            bias: self.numbers.bias,
        };
        Some(self.values(&nodes, self.brick(slot), &[0.0])[0])
    }

    /// The values at nodes `at`, as numbers of the value scale.
    #[inline(always)]
    pub(super) fn values<const L: usize>(&self, nodes: &Nodes, brick: &[u8], at: &[f32; L]) -> [f32; L] {
        let mut values = nodes.stored::<N, S, L>(brick, at);
        for value in &mut values {
            *value = *value * self.numbers.gain + self.numbers.offset;
        }
        values
    }

    /// The bytes of the brick in a slot.
    #[inline(always)]
    pub(super) fn brick(&self, slot: u32) -> &'a [u8] {
        let samples =
            self.plan.field().slots().samples(slot).expect("the slots that a plan's index names hold samples");
        &samples.bytes()[..N * N * N * S::N_BYTES]
    }
}
