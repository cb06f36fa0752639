//! From a position to a slot: a grid of cells over the volume.

use brickfield_core::Level;
use brickfield_core::glam::{DVec3, UVec3};

use crate::{Chunked, ContentId};

/// How far an entry of the index reaches: the aligned block of 2^reach cells a side has the same entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Reach(pub u8);

impl Reach {
    /// Cells along the block's side.
    #[inline]
    pub const fn n_cells(self) -> u32 {
        1 << self.0
    }

    /// The block around a cell: its first cell, and the one behind its last, which may lie beyond the grid.
    #[inline]
    pub fn block(self, cell: UVec3) -> (UVec3, UVec3) {
        let low = cell >> u32::from(self.0) << u32::from(self.0);
        (low, low + self.n_cells())
    }

    /// The resolution of a brick of an octree that reaches so far: it has as many samples as one of level 0.
    #[inline]
    pub const fn level_of_brick(self) -> Level {
        Level(self.0)
    }

    /// How far a brick of an octree reaches, by its level.
    pub const fn of_brick(level: Level) -> Reach {
        Reach(level.0)
    }
}

/// The entry of an index cell: a slot, or empty; and how far that answer reaches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IndexEntry {
    /// The block's samples are in this slot of [`Slots`](crate::Slots).
    #[allow(missing_docs)]
    Resident { slot: u32, reach: Reach },
    /// Nothing visible in the whole block: not uploaded, not sampled.
    #[allow(missing_docs)]
    Empty { reach: Reach },
}

const SLOT_BITS: u32 = 27;
const NO_SLOT: u32 = (1 << SLOT_BITS) - 1;

impl IndexEntry {
    /// Most slots that an index can tell apart.
    pub const MAX_SLOTS: u32 = NO_SLOT;

    /// The entry as a word: reach in the upper 5 bits, slot in the lower 27 (all ones: empty).
    ///
    /// # Panics
    /// If the slot is [`MAX_SLOTS`](Self::MAX_SLOTS) or above, or the reach above 31.
    pub fn pack(self) -> u32 {
        let (slot, reach) = match self {
            IndexEntry::Resident { slot, reach } => {
                assert!(slot < NO_SLOT, "slot {slot} of at most {NO_SLOT}");
                (slot, reach)
            }
            IndexEntry::Empty { reach } => (NO_SLOT, reach),
        };
        assert!(reach.0 < 32, "reach {} of at most 31", reach.0);
        u32::from(reach.0) << SLOT_BITS | slot
    }

    /// The entry of a word.
    #[inline]
    pub fn unpack(word: u32) -> IndexEntry {
        let reach = Reach((word >> SLOT_BITS) as u8);
        match word & NO_SLOT {
            NO_SLOT => IndexEntry::Empty { reach },
            slot => IndexEntry::Resident { slot, reach },
        }
    }

    /// How far the entry reaches.
    #[inline]
    pub fn reach(self) -> Reach {
        match self {
            IndexEntry::Resident { reach, .. } | IndexEntry::Empty { reach } => reach,
        }
    }

    /// The slot, if there is one.
    #[inline]
    pub fn slot(self) -> Option<u32> {
        match self {
            IndexEntry::Resident { slot, .. } => Some(slot),
            IndexEntry::Empty { .. } => None,
        }
    }
}

/// Where the cells of an index lie in sample space.
///
/// ```text
/// bricks of 4 samples share borders:    origin 0, cells of 3 samples      0--1--2--3--4--5--6
///                                                                         |cell 0  |cell 1  |
/// blocks of 4 voxels:               origin -1/2, cells of 4 samples     |-0--1--2--3-|-4--5--6--7-|
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IndexLattice {
    /// Samples of level 0 along a cell's side.
    pub cell_samples: u32,
    /// Where the first cell begins along each axis: at sample 0, or half a sample before it.
    pub origin: f64,
}

impl IndexLattice {
    /// Cells that cover a volume of `dims` samples along x, y, z; at least one each.
    pub fn n_cells(&self, dims: UVec3) -> UVec3 {
        let extent = (dims.as_dvec3() - 1.0 - 2.0 * self.origin) / f64::from(self.cell_samples);
        extent.map(f64::ceil).as_uvec3().max(UVec3::ONE)
    }
}

/// Words whose changes are brought to a device together.
const PAGE_WORDS: usize = 1024;

/// The index: one packed [`IndexEntry`] for each cell, x fastest.
#[derive(Clone, Debug)]
pub struct IndexGrid {
    dims: UVec3,
    lattice: IndexLattice,
    words: Vec<u32>,
    /// The cells of resident blocks: from the first, to the one behind the last.
    resident: Option<(UVec3, UVec3)>,
    has_empty: bool,
    /// Bit r: a resident entry reaches 2^r cells.
    reaches: u32,
    /// Bit s: slot s is named.
    slots: Vec<u64>,
    id: ContentId,
    pages: Vec<ContentId>,
}

/// Indices are equal if their entries are.
impl PartialEq for IndexGrid {
    fn eq(&self, other: &IndexGrid) -> bool {
        (self.dims, self.lattice, &self.words) == (other.dims, other.lattice, &other.words)
    }
}

impl IndexGrid {
    /// An index in which each entry fills its block around a cell, and the rest is empty. Aligned blocks that are wholly empty
    /// answer as one, so that rays cross them in one jump.
    ///
    /// # Panics
    /// If a cell lies outside.
    pub fn new(
        dims: UVec3,
        lattice: IndexLattice,
        entries: impl IntoIterator<Item = (UVec3, IndexEntry)>,
    ) -> IndexGrid {
        let n = dims.to_array().into_iter().map(|n| n as usize).product();
        let mut words = vec![IndexEntry::Empty { reach: Reach(0) }.pack(); n];
        for (cell, entry) in entries {
            fill(&mut words, dims, cell, entry);
        }
        merge_empty(&mut words, dims);
        IndexGrid::from_words(dims, lattice, words)
    }

    /// An index of packed entries, as they are.
    ///
    /// # Panics
    /// If there is not one for each cell.
    pub fn from_words(dims: UVec3, lattice: IndexLattice, words: Vec<u32>) -> IndexGrid {
        let n: usize = dims.to_array().into_iter().map(|n| n as usize).product();
        assert_eq!(words.len(), n, "entries of an index of {dims}");
        let pages = (0..n.div_ceil(PAGE_WORDS)).map(|_| ContentId::new()).collect();
        let (resident, has_empty, reaches, slots) = (None, false, 0, Vec::new());
        let mut index =
            IndexGrid { dims, lattice, words, resident, has_empty, reaches, slots, id: ContentId::new(), pages };
        index.sum_up();
        index
    }

    /// The index, whose pages keep their identity where they are equal to pages of the index before it: a device is brought the others.
    #[must_use]
    pub fn following(mut self, before: &IndexGrid) -> IndexGrid {
        if self == *before {
            return before.clone();
        }
        let pages = self.words.chunks(PAGE_WORDS).zip(before.words.chunks(PAGE_WORDS));
        for ((own, (a, b)), id) in self.pages.iter_mut().zip(pages).zip(&before.pages) {
            if a == b {
                *own = *id;
            }
        }
        self
    }

    fn sum_up(&mut self) {
        let mut row = UVec3::ZERO;
        for words in self.words.chunks(self.dims.x.max(1) as usize) {
            for (x, word) in words.iter().enumerate() {
                let IndexEntry::Resident { slot, reach } = IndexEntry::unpack(*word) else {
                    self.has_empty = true;
                    continue;
                };
                let (low, high) = reach.block(row.with_x(x as u32));
                let high = high.min(self.dims);
                let (a, b) = self.resident.unwrap_or((low, high));
                self.resident = Some((a.min(low), b.max(high)));
                self.reaches |= 1 << reach.0;
                let place = slot as usize / 64;
                if place >= self.slots.len() {
                    self.slots.resize(place + 1, 0);
                }
                self.slots[place] |= 1 << (slot % 64);
            }
            row.y += 1;
            if row.y == self.dims.y {
                row = UVec3::new(0, 0, row.z + 1);
            }
        }
    }

    /// Cells along x, y, z.
    #[inline]
    pub fn dims(&self) -> UVec3 {
        self.dims
    }

    /// Where the cells lie.
    #[inline]
    pub fn lattice(&self) -> IndexLattice {
        self.lattice
    }

    /// The packed entries, x fastest.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// Whether any cell is empty.
    pub fn has_empty(&self) -> bool {
        self.has_empty
    }

    /// The cells that hold all resident blocks: from the first, to the one behind the last; `None` if all are empty.
    pub fn resident_cells(&self) -> Option<(UVec3, UVec3)> {
        self.resident
    }

    /// How far resident entries reach, each reach once, ascending.
    pub fn resident_reaches(&self) -> impl Iterator<Item = Reach> + use<> {
        let reaches = self.reaches;
        (0..32).filter(move |r| reaches >> r & 1 == 1).map(Reach)
    }

    /// The slots that are named, each once, ascending.
    pub fn slots(&self) -> impl Iterator<Item = u32> + '_ {
        let of = |(i, bits): (usize, &u64)| {
            let bits = *bits;
            (0..64).filter(move |b| bits >> b & 1 == 1).map(move |b| 64 * i as u32 + b)
        };
        self.slots.iter().enumerate().flat_map(of)
    }

    /// The entry of a cell.
    ///
    /// # Panics
    /// If the cell lies outside.
    #[inline]
    pub fn at(&self, cell: UVec3) -> IndexEntry {
        IndexEntry::unpack(self.words[position(self.dims, cell)])
    }

    /// The box around all resident blocks in sample space, as far as the volume of `dims` samples reaches.
    pub fn resident_box(&self, dims: UVec3) -> Option<brickfield_core::Aabb> {
        let (low, high) = self.resident?;
        let face = |cell: UVec3| cell.as_dvec3() * f64::from(self.lattice.cell_samples) + self.lattice.origin;
        Some(brickfield_core::Aabb {
            min: DVec3::select(low.cmpeq(UVec3::ZERO), DVec3::splat(-0.5), face(low)),
            max: DVec3::select(high.cmpge(self.dims), dims.as_dvec3() - 0.5, face(high)),
        })
    }
}

impl Chunked for IndexGrid {
    fn id(&self) -> ContentId {
        self.id
    }

    fn chunk_bytes(&self) -> usize {
        PAGE_WORDS * size_of::<u32>()
    }

    fn n_chunks(&self) -> usize {
        self.pages.len()
    }

    fn chunk(&self, i: usize) -> Option<(ContentId, &[u8])> {
        let words = &self.words[i * PAGE_WORDS..self.words.len().min((i + 1) * PAGE_WORDS)];
        Some((self.pages[i], bytemuck::cast_slice(words)))
    }
}

#[inline]
fn position(dims: UVec3, cell: UVec3) -> usize {
    assert!(cell.cmplt(dims).all(), "cell {cell} of an index of {dims}");
    cell.x as usize + dims.x as usize * (cell.y as usize + dims.y as usize * cell.z as usize)
}

/// Writes an entry to all cells of its block around `cell`, as far as the grid reaches.
fn fill(words: &mut [u32], dims: UVec3, cell: UVec3, entry: IndexEntry) {
    assert!(cell.cmplt(dims).all(), "cell {cell} of an index of {dims}");
    let (low, high) = entry.reach().block(cell);
    let high = high.min(dims);
    for z in low.z..high.z {
        for y in low.y..high.y {
            let row = position(dims, UVec3::new(low.x, y, z));
            words[row..row + (high.x - low.x) as usize].fill(entry.pack());
        }
    }
}

/// Lets aligned blocks that are wholly empty answer as one.
fn merge_empty(words: &mut [u32], dims: UVec3) {
    let mut reach = Reach(0);
    while reach.n_cells() < dims.max_element() {
        let (empty, wider) = (IndexEntry::Empty { reach }.pack(), Reach(reach.0 + 1));
        let mut merged = false;
        for low in corners(UVec3::ZERO, dims, wider) {
            let high = dims.min(low + wider.n_cells());
            if corners(low, high, reach).all(|c| words[position(dims, c)] == empty) {
                fill(words, dims, low, IndexEntry::Empty { reach: wider });
                merged = true;
            }
        }
        if !merged {
            return;
        }
        reach = wider;
    }
}

/// The first cells of the aligned blocks of a reach between two cells.
fn corners(low: UVec3, high: UVec3, reach: Reach) -> impl Iterator<Item = UVec3> {
    let steps = move |a: u32, b: u32| (a..b).step_by(reach.n_cells() as usize);
    let rows = steps(low.z, high.z).flat_map(move |z| steps(low.y, high.y).map(move |y| (y, z)));
    rows.flat_map(move |(y, z)| steps(low.x, high.x).map(move |x| UVec3::new(x, y, z)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::HeldChunks;

    const LATTICE: IndexLattice = IndexLattice { cell_samples: 15, origin: 0.0 };

    #[test]
    fn entries_survive_packing() {
        for reach in [0, 1, 31].map(Reach) {
            for entry in [
                IndexEntry::Empty { reach },
                IndexEntry::Resident { slot: 0, reach },
                IndexEntry::Resident { slot: IndexEntry::MAX_SLOTS - 1, reach },
            ] {
                assert_eq!(IndexEntry::unpack(entry.pack()), entry);
            }
        }
    }

    #[test]
    fn a_wide_entry_fills_its_block_up_to_the_border_and_is_summed_up() {
        let entry = IndexEntry::Resident { slot: 7, reach: Reach(1) };
        let grid = IndexGrid::new(UVec3::new(5, 3, 1), LATTICE, [(UVec3::new(3, 2, 0), entry)]);
        let filled: Vec<_> = grid.words().iter().map(|w| u8::from(*w == entry.pack())).collect();
        assert_eq!(filled, [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 0]);
        assert_eq!(grid.resident_cells(), Some((UVec3::new(2, 2, 0), UVec3::new(4, 3, 1))));
        assert!(grid.has_empty());
        assert_eq!(grid.resident_reaches().collect::<Vec<_>>(), [Reach(1)]);
        assert_eq!(grid.slots().collect::<Vec<_>>(), [7]);
    }

    #[test]
    fn empty_blocks_answer_as_one() {
        let grid = IndexGrid::new(UVec3::new(4, 4, 4), LATTICE, []);
        assert_eq!(grid.at(UVec3::new(3, 0, 2)), IndexEntry::Empty { reach: Reach(2) });
        let corner = [(UVec3::ZERO, IndexEntry::Resident { slot: 0, reach: Reach(0) })];
        let grid = IndexGrid::new(UVec3::new(4, 4, 4), LATTICE, corner);
        assert_eq!(grid.at(UVec3::new(3, 0, 2)).reach(), Reach(1));
        assert_eq!(grid.at(UVec3::new(1, 1, 0)).reach(), Reach(0));
    }

    #[test]
    fn lattices_of_bricks_and_of_blocks_cover_their_volume() {
        let (bricks, blocks) = (LATTICE, IndexLattice { cell_samples: 16, origin: -0.5 });
        for (dims, of_bricks, of_blocks) in [(1, 1, 1), (16, 1, 1), (17, 2, 2), (31, 2, 2), (32, 3, 2), (33, 3, 3)] {
            assert_eq!(bricks.n_cells(UVec3::splat(dims)).x, of_bricks, "{dims}");
            assert_eq!(blocks.n_cells(UVec3::splat(dims)).x, of_blocks, "{dims}");
        }
    }

    #[test]
    fn a_following_index_is_brought_where_it_differs() {
        let dims = UVec3::new(64, 64, 1);
        let entries = |slots: &[u32]| {
            let entry = |slot: u32| (UVec3::new(0, slot, 0), IndexEntry::Resident { slot, reach: Reach(0) });
            slots.iter().map(|slot| entry(*slot)).collect::<Vec<_>>()
        };
        let before = IndexGrid::new(dims, LATTICE, entries(&[1, 2]));
        let mut held = HeldChunks::default();
        held.hold(&before);
        let same = IndexGrid::new(dims, LATTICE, entries(&[1, 2]));
        assert!(!held.has_all(&same) && held.has_all(&same.following(&before)));
        let other = IndexGrid::new(dims, LATTICE, entries(&[1, 2, 40])).following(&before);
        // The new entry, and the empty blocks around it, which are smaller now.
        assert!(held.missing(&other).into_iter().eq(std::iter::once(2..4)));
    }
}
