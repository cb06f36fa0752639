//! The chunks of a store as items that are fetched.

use brickfield_core::glam::UVec3;
use brickfield_core::{BlockLayout, Level};
use brickfield_io::ome_zarr::{ObjectRange, StoredChunk, ZarrLevels};
use brickfield_lod::FetchItem;

use super::DeliveryError;
use crate::store::finest_above;

/// Chunks of the levels below one, as items, and where their bytes lie.
pub(super) struct Chunks {
    pub(super) items: Vec<FetchItem>,
    pub(super) bytes: Vec<ObjectRange>,
}

impl Chunks {
    /// The chunks of all levels that are finer than `known`, from the finest on.
    pub(super) fn below(known: Level, levels: &ZarrLevels, layout: &BlockLayout) -> Result<Chunks, DeliveryError> {
        let mut chunks = Chunks { items: Vec::new(), bytes: Vec::new() };
        let mut last = None;
        for level in (0..known.0).map(Level) {
            let stored = finest_above(levels, level);
            if last.replace(stored) != Some(stored) {
                chunks.add(levels, stored, level, layout)?;
            }
        }
        if levels.has_details(0) {
            chunks.refine(layout);
        }
        Ok(chunks)
    }

    fn add(
        &mut self,
        levels: &ZarrLevels,
        stored: usize,
        level: Level,
        layout: &BlockLayout,
    ) -> Result<(), DeliveryError> {
        let shifts = levels.shifts(stored).unwrap_or(UVec3::ZERO);
        for StoredChunk { first, extent, bytes, n_bytes } in levels.stored_chunks(stored)? {
            let (low, high) = (first << shifts, ((first + extent) << shifts).min(layout.dims()));
            let side = UVec3::splat(layout.side().n_voxels());
            let is_whole =
                (low % side == UVec3::ZERO) && (0..3).all(|i| high[i] == layout.dims()[i] || high[i] % side[i] == 0);
            if !is_whole {
                return Err(DeliveryError::Chunks { level: stored, first, extent, side: layout.side() });
            }
            let (first_block, end_block) = (low / side, (high - 1) / side + 1);
            self.items.push(FetchItem { level, first_block, end_block, n_bytes, refines: None });
            self.bytes.push(bytes);
        }
        Ok(())
    }

    /// Details refine the item of level 1 that has their samples.
    fn refine(&mut self, layout: &BlockLayout) {
        let mut holders = vec![None; layout.n_blocks_total()];
        for (i, item) in self.items.iter().enumerate().filter(|(_, item)| item.level == Level(1)) {
            item.blocks().for_each(|block| holders[layout.ordinal(block)] = Some(i));
        }
        let fine = self.items.iter_mut().filter(|item| item.level == Level(0));
        fine.for_each(|item| item.refines = holders[layout.ordinal(item.first_block)]);
    }
}
