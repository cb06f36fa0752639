//! The bricks that frames share, kept from frame to frame.

use std::collections::HashMap;
use std::sync::Arc;

use brickfield_bricks::{BrickTree, TreeId};
use brickfield_core::glam::UVec3;
use brickfield_core::{BrickId, Level, TransferFunction};
use brickfield_frame::{
    Chunk, DarkRegions, DarkRuns, Field, FramePlan, IndexEntry, IndexGrid, IndexLattice, Join, MacrocellRanges,
    Occupancy, Places, Reach, Slots, Upload,
};
use bytes::Bytes;
use rayon::prelude::*;

use crate::Scene;
use crate::encode::Coding;

/// The bricks of the last frame, in their slots, and the ranges and distances of their macrocells.
///
/// A frame that needs another brick takes that brick alone from the tree; a scene that is drawn again costs nothing. Samples of u8 and
/// u16 are shared with the tree, and keep its levels in memory; all others are copied into the form of backends.
/// One residency serves one tree at a time: handed another, it begins anew.
#[derive(Debug, Default)]
pub struct Residency {
    tree: Option<TreeId>,
    upload: Upload,
    last: Option<(Scene, FramePlan)>,
    table: SlotTable,
    field: Option<Field>,
    dark: Option<DarkRegions>,
    transparent: Transparent,
    copied: Copied,
}

/// The bricks that a frame took from the tree, and the bytes of their samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct Copied {
    pub n_bricks: usize,
    pub n_bytes: usize,
}

/// Which brick is in which slot.
#[derive(Debug, Default)]
struct SlotTable {
    /// The bricks of the last frame, in the order of its cut.
    bricks: Vec<BrickId>,
    slot_of: HashMap<BrickId, u32>,
    /// Slot by slot; none of them in a free one.
    samples: Vec<Option<Arc<Chunk>>>,
    ranges: Vec<Option<Arc<MacrocellRanges>>>,
    /// Under the transfer function `of`.
    distances: Vec<Option<Arc<Chunk>>>,
    of: Option<TransferFunction>,
    /// The distances of each brick that is visible throughout.
    all_visible: Option<Arc<Chunk>>,
}

/// Which bricks of a tree a transfer function makes transparent: the levels that were asked for.
#[derive(Debug, Default)]
struct Transparent {
    of: Option<TransferFunction>,
    levels: HashMap<Level, Vec<bool>>,
}

impl Residency {
    /// The bricks of the last frame.
    pub fn bricks(&self) -> &[BrickId] {
        &self.table.bricks
    }

    /// The bricks that the last frame took from the tree.
    pub fn copied(&self) -> Copied {
        self.copied
    }

    /// Begins anew if the tree is another, or if its bricks are to be brought another way.
    pub(crate) fn serve(&mut self, tree: &BrickTree, upload: Upload) {
        if self.tree != Some(tree.id()) || self.upload != upload {
            *self = Residency { tree: Some(tree.id()), upload, ..Residency::default() };
        }
        self.copied = Copied::default();
    }

    /// The plan of a scene, if it is the last one's.
    pub(crate) fn plan_of(&self, scene: &Scene) -> Option<FramePlan> {
        self.last.as_ref().filter(|(last, _)| last == scene).map(|(_, plan)| plan.clone())
    }

    /// Remembers a scene's plan.
    pub(crate) fn remember(&mut self, scene: &Scene, plan: &FramePlan) {
        self.last = Some((scene.clone(), plan.clone()));
    }

    /// Whether a transfer function makes a brick transparent.
    pub(crate) fn is_transparent(&mut self, tree: &BrickTree, transfer: &TransferFunction, id: BrickId) -> bool {
        self.transparent.level(tree, transfer, id.level)[tree.layout().ordinal(id)]
    }

    /// The field of `bricks`: the last one, if it has the same; else the bricks that are new are copied.
    pub(crate) fn hold(&mut self, tree: &BrickTree, bricks: Vec<BrickId>) -> Field {
        self.last = None;
        if let Some(field) = self.field.as_ref().filter(|_| self.table.bricks == bricks) {
            return field.clone();
        }
        let range = tree.summary(tree.layout().root()).range;
        let coding = Coding::of(tree.scalar_type(), tree.rescale(), range).brought(self.upload);
        let source = Source::new(tree, &coding);
        self.copied = self.table.hold(bricks, |id| source.chunk(id));
        let side = tree.layout().side();
        let slots = Slots::new(coding.format, coding.decode(), Places::Even(side), self.table.samples.clone());
        let index = self.table.index(tree);
        let index = match &self.field {
            Some(before) => index.following(before.index()),
            None => index,
        };
        let field = Field::new(
            tree.layout().dims(),
            Arc::new(index),
            Arc::new(slots.expect("bricks fill their slots")),
            Join::Shared,
        );
        let field = field.expect("an index of the bricks that are in slots");
        self.field = Some(field.clone());
        field
    }

    /// The regions of the held field that a transfer function makes dark.
    pub(crate) fn dark(&mut self, tree: &BrickTree, transfer: &TransferFunction) -> DarkRegions {
        let Some(field) = &self.field else { return DarkRegions::default() };
        let is_known = self.table.of.as_ref() == Some(transfer);
        if let Some(dark) = self.dark.as_ref().filter(|dark| is_known && dark.is_of(field)) {
            return dark.clone();
        }
        let occupancy = self.table.occupancy(tree, field.slots(), transfer);
        let dark = DarkRegions::new(field, occupancy).expect("distances of the field's own bricks");
        self.dark = Some(dark.clone());
        dark
    }
}

impl SlotTable {
    /// Gives each of `bricks` a slot, and drops all others. Bricks that were there keep theirs, unless most slots are free.
    fn hold(&mut self, bricks: Vec<BrickId>, gather: impl Fn(BrickId) -> Chunk + Sync) -> Copied {
        let mut kept: HashMap<BrickId, u32> = HashMap::with_capacity(bricks.len());
        kept.extend(bricks.iter().filter_map(|id| Some((*id, *self.slot_of.get(id)?))));
        if 2 * bricks.len() < self.samples.len() {
            self.pack(&bricks);
        } else {
            let before = std::mem::replace(&mut self.slot_of, kept);
            for (_, slot) in before.iter().filter(|(id, _)| !self.slot_of.contains_key(*id)) {
                self.samples[*slot as usize] = None;
                self.ranges[*slot as usize] = None;
                self.distances[*slot as usize] = None;
            }
        }
        let mut free = (0..self.samples.len()).filter(|slot| self.samples[*slot].is_none()).collect::<Vec<_>>();
        free.reverse();
        let (mut new, mut n_slots) = (Vec::new(), self.samples.len());
        for id in bricks.iter().filter(|id| !self.slot_of.contains_key(id)) {
            let slot = free.pop().unwrap_or_else(|| {
                n_slots += 1;
                n_slots - 1
            });
            new.push((*id, slot));
        }
        self.slot_of.extend(new.iter().map(|(id, slot)| (*id, *slot as u32)));
        self.samples.resize(n_slots, None);
        self.ranges.resize(n_slots, None);
        self.distances.resize(n_slots, None);
        let chunks: Vec<Arc<Chunk>> = new.par_iter().map(|(id, _)| Arc::new(gather(*id))).collect();
        let n_bytes = chunks.iter().map(|chunk| chunk.bytes().len()).sum();
        for ((_, slot), chunk) in new.iter().zip(chunks) {
            self.samples[*slot] = Some(chunk);
        }
        self.bricks = bricks;
        Copied { n_bricks: new.len(), n_bytes }
    }

    /// Moves the bricks of `bricks` that have slots to the first slots, in their order.
    fn pack(&mut self, bricks: &[BrickId]) {
        let there: Vec<(BrickId, usize)> =
            bricks.iter().filter_map(|id| Some((*id, *self.slot_of.get(id)? as usize))).collect();
        fn of<T: Clone>(list: &[Option<T>], there: &[(BrickId, usize)]) -> Vec<Option<T>> {
            there.iter().map(|(_, slot)| list[*slot].clone()).collect()
        }
        self.samples = of(&self.samples, &there);
        self.ranges = of(&self.ranges, &there);
        self.distances = of(&self.distances, &there);
        self.slot_of = there.iter().enumerate().map(|(slot, (id, _))| (*id, slot as u32)).collect();
    }

    fn index(&self, tree: &BrickTree) -> IndexGrid {
        let layout = tree.layout();
        let entry = |id: &BrickId| {
            let cell: UVec3 = id.coords << u32::from(id.level.0);
            (cell, IndexEntry::Resident { slot: self.slot_of[id], reach: Reach::of_brick(id.level) })
        };
        let lattice = IndexLattice { cell_samples: layout.side().n_cells(), origin: 0.0 };
        IndexGrid::new(layout.n_bricks(Level(0)), lattice, self.bricks.iter().map(entry))
    }

    /// The dark macrocells under a transfer function; `None` if there are none, or too many macrocells for a map.
    fn occupancy(&mut self, tree: &BrickTree, slots: &Slots, transfer: &TransferFunction) -> Option<Arc<Occupancy>> {
        let side = slots.brick_side().filter(|side| Occupancy::fits(*side, slots.n_slots()))?;
        if self.of.as_ref() != Some(transfer) {
            self.distances.fill(None);
            self.of = Some(transfer.clone());
        }
        let (format, runs) = (slots.format(), DarkRuns::of_transfer(transfer, slots.format(), slots.decode()));
        let all_visible = self.all_visible.get_or_insert_with(|| Arc::new(Occupancy::of_visible_brick(side)));
        for (id, slot) in &self.slot_of {
            let distances = &mut self.distances[*slot as usize];
            if distances.is_none() && transfer.least_extinction(tree.summary(*id).range) > 0.0 {
                *distances = Some(all_visible.clone());
            }
        }
        let lists = self.samples.par_iter().zip(&mut self.ranges).zip(&mut self.distances);
        lists.for_each(|((samples, ranges), distances)| {
            let (Some(samples), None) = (samples, &distances) else { return };
            let ranges = ranges.get_or_insert_with(|| Arc::new(MacrocellRanges::of(side, format, samples.bytes())));
            *distances = Some(Arc::new(ranges.distances(&runs)));
        });
        Occupancy::new(side, self.distances.clone())
    }
}

impl Transparent {
    fn level(&mut self, tree: &BrickTree, transfer: &TransferFunction, level: Level) -> &[bool] {
        if self.of.as_ref() != Some(transfer) {
            *self = Transparent { of: Some(transfer.clone()), levels: HashMap::new() };
        }
        let summaries = || tree.summaries(level).par_iter();
        let of_level = || summaries().map(|summary| transfer.is_transparent(summary.range)).collect();
        self.levels.entry(level).or_insert_with(of_level)
    }
}

/// Where the samples of bricks come from.
struct Source<'a> {
    tree: &'a BrickTree,
    coding: &'a Coding,
    /// By level, the samples of all bricks, if their form is that of a backend.
    stored: Vec<Option<Bytes>>,
}

impl Source<'_> {
    fn new<'a>(tree: &'a BrickTree, coding: &'a Coding) -> Source<'a> {
        let levels = (0..tree.layout().n_levels()).map(Level);
        Source { tree, coding, stored: levels.map(|level| coding.as_stored(tree.level_samples(level))).collect() }
    }

    /// A brick's samples in the form of a backend: the tree's own, or a copy.
    fn chunk(&self, id: BrickId) -> Chunk {
        let (layout, n_bytes) = (self.tree.layout(), self.tree.n_brick_bytes());
        let extent = UVec3::splat(layout.side().n_samples());
        if let Some(stored) = &self.stored[usize::from(id.level.0)] {
            let start = n_bytes * layout.ordinal(id);
            return self.coding.chunk_of_encoded(extent, stored.slice(start..start + n_bytes));
        }
        let mut bytes = vec![0; n_bytes];
        self.tree.samples(id).copy_le_bytes(&mut bytes);
        self.coding.chunk(extent, bytes)
    }
}
