//! The bricks that a backend holds, kept from frame to frame.

use std::sync::Arc;

use brickfield_bricks::{BrickSamples, BrickTree, with_brick_samples};
use brickfield_core::{BrickId, Scalar, ScalarType, TransferFunction};
use brickfield_frame::{BrickSet, Decode, IndexGrid, MacrocellRanges, Occupancy, Overview};
use rayon::prelude::*;

/// The brick set of the last frame. A frame that needs the same bricks gets the same set, and backends upload nothing.
#[derive(Clone, Debug, Default)]
pub struct Residency {
    bricks: Vec<BrickId>,
    set: Option<Arc<BrickSet>>,
    /// Of the set, once a frame asked for it.
    ranges: Option<MacrocellRanges>,
    occupancy: Option<(TransferFunction, Option<Arc<Occupancy>>)>,
    overview: Option<LastOverview>,
}

/// The overview of the last frame, and what it is of.
#[derive(Clone, Debug)]
struct LastOverview {
    index: IndexGrid,
    occupancy: Option<Arc<Occupancy>>,
    overview: Option<Arc<Overview>>,
}

impl Residency {
    /// The bricks in their slots.
    pub fn bricks(&self) -> &[BrickId] {
        &self.bricks
    }

    /// A set of exactly `bricks`, in this order: the last one if it fits. One residency serves one tree.
    pub(crate) fn hold(&mut self, tree: &BrickTree, bricks: Vec<BrickId>) -> Arc<BrickSet> {
        match &self.set {
            Some(set) if self.bricks == bricks => Arc::clone(set),
            _ => {
                let set = Arc::new(gather(tree, &bricks));
                *self =
                    Residency { bricks, set: Some(Arc::clone(&set)), ranges: None, occupancy: None, overview: None };
                set
            }
        }
    }

    /// What a transfer function shows of the held set; `None` if it shows something of every macrocell, or the set is too
    /// large for a map.
    pub(crate) fn occupancy(&mut self, transfer: &TransferFunction) -> Option<Arc<Occupancy>> {
        match &self.occupancy {
            Some((of, occupancy)) if of == transfer => occupancy.clone(),
            _ => {
                let set = self.set.as_deref().filter(|set| Occupancy::fits(set.side(), set.n_bricks()))?;
                let occupancy = self.ranges.get_or_insert_with(|| MacrocellRanges::of(set)).occupancy(transfer);
                self.occupancy = Some((transfer.clone(), occupancy.clone()));
                occupancy
            }
        }
    }

    /// The overview of an index of the held set; `None` if nothing in it is known to be dark.
    pub(crate) fn overview(&mut self, index: &IndexGrid, occupancy: Option<&Arc<Occupancy>>) -> Option<Arc<Overview>> {
        let address = |o: &Arc<Occupancy>| Arc::as_ptr(o);
        let is_of = |last: &LastOverview| {
            last.occupancy.as_ref().map(address) == occupancy.map(address) && last.index == *index
        };
        match &self.overview {
            Some(last) if is_of(last) => last.overview.clone(),
            _ => {
                let side = self.set.as_ref()?.side();
                let overview = Overview::of(side, index, occupancy.map(Arc::as_ref)).map(Arc::new);
                let (index, occupancy) = (index.clone(), occupancy.cloned());
                self.overview = Some(LastOverview { index, occupancy, overview: overview.clone() });
                overview
            }
        }
    }
}

fn gather(tree: &BrickTree, bricks: &[BrickId]) -> BrickSet {
    let side = tree.layout().side();
    let scalar = tree.scalar_type();
    let range = tree.summary(tree.layout().root()).range;
    let (format, decode) = BrickSet::encoding(scalar, range);
    let brick_bytes = side.n_samples_total() * format.n_bytes();
    let mut bytes = vec![0; brick_bytes * bricks.len()];
    bytes
        .par_chunks_exact_mut(brick_bytes)
        .zip(bricks)
        .for_each(|(out, id)| encode(tree.samples(*id), scalar, decode, out));
    BrickSet::new(side, format, decode, bytes).expect("whole bricks by construction")
}

/// Native samples to the stored form of [`BrickSet::encoding`].
fn encode(samples: BrickSamples<'_>, scalar: ScalarType, decode: Decode, out: &mut [u8]) {
    match scalar {
        ScalarType::U8 | ScalarType::U16 => samples.copy_le_bytes(out),
        ScalarType::I8 | ScalarType::I16 => {
            samples.copy_le_bytes(out);
            // Two's complement with the top bit turned is the value shifted by half its range.
            out.iter_mut().skip(scalar.n_bytes() - 1).step_by(scalar.n_bytes()).for_each(|high| *high ^= 0x80);
        }
        ScalarType::U32 | ScalarType::I32 | ScalarType::F32 | ScalarType::F64 => {
            with_brick_samples!(samples, s => encode_f32(s, decode, out));
        }
    }
}

fn encode_f32<T: Scalar>(samples: &[T], decode: Decode, out: &mut [u8]) {
    for (chunk, s) in out.chunks_exact_mut(4).zip(samples) {
        let read = (s.to_f64() - decode.offset) / decode.scale;
        chunk.copy_from_slice(&(read as f32).to_le_bytes());
    }
}
