//! From a position to its brick: a grid over the bricks of level 0.

use brickfield_core::{Level, glam::UVec3};

/// What a cell of the index grid says: a brick, or nothing visible.
///
/// The level says how far the answer reaches: the cell's aligned block of 2^level cells a side has the same entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IndexEntry {
    /// The cell lies in the brick in this slot of the [`BrickSet`](crate::BrickSet).
    #[allow(missing_docs)]
    Resident { slot: u32, level: Level },
    /// Nothing visible in the whole block: not uploaded, not sampled.
    #[allow(missing_docs)]
    Transparent { level: Level },
}

const SLOT_BITS: u32 = 27;
const NO_SLOT: u32 = (1 << SLOT_BITS) - 1;

impl IndexEntry {
    /// Most bricks that an index can tell apart.
    pub const MAX_SLOTS: u32 = NO_SLOT;

    /// The entry as a word: level in the upper 5 bits, slot in the lower 27 (all ones: transparent).
    ///
    /// # Panics
    /// If the slot is [`MAX_SLOTS`](Self::MAX_SLOTS) or above, or the level above 31.
    pub fn pack(self) -> u32 {
        let (slot, level) = match self {
            IndexEntry::Resident { slot, level } => {
                assert!(slot < NO_SLOT, "slot {slot} of at most {NO_SLOT}");
                (slot, level)
            }
            IndexEntry::Transparent { level } => (NO_SLOT, level),
        };
        assert!(level.0 < 32, "level {} of at most 31", level.0);
        u32::from(level.0) << SLOT_BITS | slot
    }

    /// The entry of a word.
    pub fn unpack(word: u32) -> IndexEntry {
        let level = Level((word >> SLOT_BITS) as u8);
        match word & NO_SLOT {
            NO_SLOT => IndexEntry::Transparent { level },
            slot => IndexEntry::Resident { slot, level },
        }
    }

    /// How far the entry reaches.
    pub fn level(self) -> Level {
        match self {
            IndexEntry::Resident { level, .. } | IndexEntry::Transparent { level } => level,
        }
    }
}

/// The index grid: one packed [`IndexEntry`] for each brick of level 0, x fastest.
#[derive(Clone, Debug, PartialEq)]
pub struct IndexGrid {
    dims: UVec3,
    words: Vec<u32>,
}

impl IndexGrid {
    /// A grid in which nothing is visible.
    pub fn transparent(dims: UVec3) -> IndexGrid {
        let n = dims.to_array().into_iter().map(|n| n as usize).product();
        IndexGrid { dims, words: vec![IndexEntry::Transparent { level: Level(0) }.pack(); n] }
    }

    /// Cells along x, y, z.
    pub fn dims(&self) -> UVec3 {
        self.dims
    }

    /// The packed entries, x fastest.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// The packed entries, to change one (a mutant in conformance runs does).
    pub fn words_mut(&mut self) -> &mut [u32] {
        &mut self.words
    }

    /// Whether any cell is transparent.
    pub fn has_transparent(&self) -> bool {
        self.words.iter().any(|w| matches!(IndexEntry::unpack(*w), IndexEntry::Transparent { .. }))
    }

    /// The entry of a cell.
    ///
    /// # Panics
    /// If the cell lies outside.
    #[inline]
    pub fn at(&self, cell: UVec3) -> IndexEntry {
        IndexEntry::unpack(self.words[self.position(cell)])
    }

    /// Writes an entry to all cells of its aligned block around `cell`, as far as the grid reaches.
    ///
    /// # Panics
    /// If the cell lies outside.
    pub fn fill(&mut self, cell: UVec3, entry: IndexEntry) {
        let level = u32::from(entry.level().0);
        let low = cell >> level << level;
        let high = (low + entry.level().stride()).min(self.dims);
        for z in low.z..high.z {
            for y in low.y..high.y {
                let row = self.position(UVec3::new(low.x, y, z));
                self.words[row..row + (high.x - low.x) as usize].fill(entry.pack());
            }
        }
    }

    #[inline]
    fn position(&self, cell: UVec3) -> usize {
        assert!(cell.cmplt(self.dims).all(), "cell {cell} of an index of {}", self.dims);
        cell.x as usize + self.dims.x as usize * (cell.y as usize + self.dims.y as usize * cell.z as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_survive_packing() {
        for level in [0, 1, 31].map(Level) {
            for entry in [
                IndexEntry::Transparent { level },
                IndexEntry::Resident { slot: 0, level },
                IndexEntry::Resident { slot: IndexEntry::MAX_SLOTS - 1, level },
            ] {
                assert_eq!(IndexEntry::unpack(entry.pack()), entry);
            }
        }
    }

    #[test]
    fn a_coarse_entry_fills_its_block_up_to_the_border() {
        let mut grid = IndexGrid::transparent(UVec3::new(5, 3, 1));
        let entry = IndexEntry::Resident { slot: 7, level: Level(1) };
        grid.fill(UVec3::new(3, 2, 0), entry);
        let filled: Vec<_> = grid.words().iter().map(|w| u8::from(*w == entry.pack())).collect();
        assert_eq!(filled, [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 0]);
    }
}
