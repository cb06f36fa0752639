//! The field that a plan draws: a value for every position.
//!
//! Three questions, kept apart:
//!
//! - **Index** ([`IndexGrid`]): from a position to a slot, and how far that answer reaches.
//! - **Place** ([`Places`]): where a slot's samples lie in the texture and in space, and how far apart they are.
//! - **Join** ([`Join`]): how a value between two slots comes about.

mod atlas;
mod blocks;
mod index;
mod packing;
mod slots;

use std::sync::Arc;

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Aabb, BlockLayout, Companion, Interblock, Level, Place};

pub use atlas::{AtlasShape, Room, RoomChange, TextureLayout, TextureShape};
pub use blocks::{BlockPlaces, BlockRanges, BlockRow, BlockSamples};
pub use index::{IndexEntry, IndexGrid, IndexLattice, Reach};
pub use packing::Packing;
pub use slots::{Decode, Places, SampleFormat, Slots, SlotsError};

/// The field of a plan. Shares its parts with the fields of other frames.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    dims: UVec3,
    index: Arc<IndexGrid>,
    slots: Arc<Slots>,
    join: Join,
    companions: Companions,
    ranges: Option<Arc<BlockRanges>>,
}

/// The companions of a field's samples, by [`Companion`]; `None` where a frame needs none.
pub(crate) type Companions = [Option<Arc<Slots>>; Companion::ALL.len()];

/// How a value between two slots comes about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Join {
    /// Slots share their border samples: every position lies in one slot (LaMar, Hamann and Joy 1999, section 3.1).
    /// Of flat blocks: the block that holds a position, alone.
    #[default]
    Shared,
    /// Flat blocks share no samples: a value is one of up to eight of them (Ljung, Lundstroem and Ynnerman 2006, section 3.2).
    Blend(Interblock),
}

/// Parts that do not make a field.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum FieldError {
    #[error("a volume of {dims} samples: every side must be at least 1")]
    NoSamples { dims: UVec3 },
    #[error(
        "an index of {index} cells for a volume of {dims} samples, whose cells of {cell_samples} samples are {expected}"
    )]
    IndexDims { index: UVec3, dims: UVec3, cell_samples: u32, expected: UVec3 },
    #[error("the index names slot {slot}, which holds no samples: there are {n_slots} slots")]
    NoSuchSlot { slot: u32, n_slots: u32 },
    #[error(
        "an index of cells of {cell_samples} samples from sample {origin} on for bricks of {side} samples, which have {} cells from sample 0 on", side - 1
    )]
    CellOfBricks { cell_samples: u32, origin: f64, side: u32 },
    #[error(
        "flat blocks of {side} voxels over {blocks} voxels, for a volume of {dims} and an index of cells of {cell_samples} samples from sample {origin} on"
    )]
    OtherBlocks { side: u32, blocks: UVec3, dims: UVec3, cell_samples: u32, origin: f64 },
    #[error(
        "the index names slot {slot} at {cell}: of flat blocks that is the block's number, {expected}, and each cell is one"
    )]
    SlotOfBlock { cell: UVec3, slot: u32, expected: u32 },
    #[error("slots that are blended: only flat blocks are")]
    BlendOfBricks,
    #[error("{companion} of other samples: they lie at the places of the field's")]
    OtherCompanions { companion: Companion },
    #[error("ranges of {n_ranges} flat blocks, and {n_blocks} flat blocks")]
    Ranges { n_ranges: usize, n_blocks: usize },
}

impl Field {
    /// A field over a volume of `dims` samples.
    ///
    /// # Errors
    /// A volume without samples; an index that does not cover it, or that names a slot without samples; evenly placed bricks
    /// of another size than the index's cells.
    pub fn new(dims: UVec3, index: Arc<IndexGrid>, slots: Arc<Slots>, join: Join) -> Result<Field, FieldError> {
        if dims.min_element() == 0 {
            return Err(FieldError::NoSamples { dims });
        }
        let lattice = index.lattice();
        let expected = lattice.n_cells(dims);
        if index.dims() != expected {
            let cell_samples = lattice.cell_samples;
            return Err(FieldError::IndexDims { index: index.dims(), dims, cell_samples, expected });
        }
        if let Some(slot) = index.slots().find(|slot| !slots.has_samples(*slot)) {
            return Err(FieldError::NoSuchSlot { slot, n_slots: slots.n_slots() });
        }
        match slots.places() {
            Places::Even(side) if side.n_cells() != lattice.cell_samples || lattice.origin != 0.0 => {
                let IndexLattice { cell_samples, origin } = lattice;
                return Err(FieldError::CellOfBricks { cell_samples, origin, side: side.n_samples() });
            }
            Places::Blocks(places) => check_blocks(dims, &index, places.layout())?,
            _ if join != Join::Shared => return Err(FieldError::BlendOfBricks),
            _ => {}
        }
        Ok(Field { dims, index, slots, join, companions: Companions::default(), ranges: None })
    }

    /// The field with companions of its samples.
    ///
    /// # Errors
    /// Companions of other samples.
    pub fn with_companions(mut self, companion: Companion, slots: Arc<Slots>) -> Result<Field, FieldError> {
        if !slots.are_companions_of(&self.slots) {
            return Err(FieldError::OtherCompanions { companion });
        }
        self.companions[companion as usize] = Some(slots);
        Ok(self)
    }

    /// The field with the ranges of its flat blocks' voxels.
    ///
    /// # Errors
    /// If not each flat block has one.
    pub fn with_ranges(mut self, ranges: Arc<BlockRanges>) -> Result<Field, FieldError> {
        let n_ranges = ranges.reads().len();
        let n_blocks = match self.slots.places() {
            Places::Blocks(places) => places.rows().len(),
            Places::Even(_) | Places::Table { .. } => 0,
        };
        if n_ranges != n_blocks {
            return Err(FieldError::Ranges { n_ranges, n_blocks });
        }
        self.ranges = Some(ranges);
        Ok(self)
    }

    /// A field of parts that may not fit.
    pub(crate) fn unchecked(
        dims: UVec3,
        index: Arc<IndexGrid>,
        slots: Arc<Slots>,
        join: Join,
        (companions, ranges): (Companions, Option<Arc<BlockRanges>>),
    ) -> Field {
        Field { dims, index, slots, join, companions, ranges }
    }

    /// Samples of the volume along x, y, z, at level 0.
    #[inline]
    pub fn dims(&self) -> UVec3 {
        self.dims
    }

    /// From a position to a slot.
    #[inline]
    pub fn index(&self) -> &Arc<IndexGrid> {
        &self.index
    }

    /// The samples.
    #[inline]
    pub fn slots(&self) -> &Arc<Slots> {
        &self.slots
    }

    /// The companions of the samples; `None` where the frame needs none.
    #[inline]
    pub fn companions(&self, companion: Companion) -> Option<&Arc<Slots>> {
        self.companions[companion as usize].as_ref()
    }

    /// The ranges of flat blocks' voxels; `None` where the frame needs none.
    #[inline]
    pub fn ranges(&self) -> Option<&Arc<BlockRanges>> {
        self.ranges.as_ref()
    }

    /// How a value between two slots comes about.
    #[inline]
    pub fn join(&self) -> Join {
        self.join
    }

    /// The last sample of the volume, in sample space: positions are clamped to [0, last].
    #[inline]
    pub fn last_sample(&self) -> DVec3 {
        (self.dims - 1).as_dvec3()
    }

    /// The volume's box in sample space: half a sample beyond the outer ones.
    pub fn volume_box(&self) -> Aabb {
        Aabb { min: DVec3::splat(-0.5), max: self.dims.as_dvec3() - 0.5 }
    }

    /// The index cell that owns a position, which is clamped to the volume's samples.
    #[inline]
    pub fn cell_at(&self, sample_position: DVec3) -> UVec3 {
        let lattice = self.index.lattice();
        let past_first = sample_position.clamp(DVec3::ZERO, self.last_sample()) - lattice.origin;
        // Truncation is floor where it is not negative, and 0 below.
        (past_first / f64::from(lattice.cell_samples)).as_uvec3().min(self.index.dims() - 1)
    }

    /// The box that the block of an index cell owns, in sample space; without end where the index ends.
    #[inline]
    pub fn block_box(&self, cell: UVec3) -> Aabb {
        let lattice = self.index.lattice();
        let (low, high) = self.index.at(cell).reach().block(cell);
        let face = |cell: UVec3| cell.as_dvec3() * f64::from(lattice.cell_samples) + lattice.origin;
        Aabb {
            min: DVec3::select(low.cmpeq(UVec3::ZERO), DVec3::NEG_INFINITY, face(low)),
            max: DVec3::select(high.cmpge(self.index.dims()), DVec3::INFINITY, face(high)),
        }
    }

    /// Where the samples of the block around an index cell lie; `None` if nothing is visible there.
    ///
    /// Of evenly placed bricks the texel is left at 0: backends choose their atlas.
    #[inline]
    pub fn place_at(&self, cell: UVec3) -> Option<Place> {
        let IndexEntry::Resident { slot, reach } = self.index.at(cell) else { return None };
        Some(match self.slots.places() {
            Places::Even(side) => {
                let lattice = self.index.lattice();
                let first = reach.block(cell).0.as_dvec3() * f64::from(lattice.cell_samples) + lattice.origin;
                let n = UVec3::splat(side.n_samples());
                Place::even(UVec3::ZERO, n, reach.level_of_brick(), first)
            }
            Places::Table { places, .. } => places[slot as usize],
            Places::Blocks(places) => places.place(cell),
        })
    }

    /// The resolution of the block around an index cell; of an empty one the finest.
    #[inline]
    pub fn level_at(&self, cell: UVec3) -> Level {
        match (self.index.at(cell), self.slots.places()) {
            (IndexEntry::Empty { .. }, _) => Level(0),
            (IndexEntry::Resident { reach, .. }, Places::Even(_)) => reach.level_of_brick(),
            (IndexEntry::Resident { slot, .. }, Places::Table { places, .. }) => places[slot as usize].level,
            (IndexEntry::Resident { .. }, Places::Blocks(places)) => places.row(cell).level,
        }
    }

    /// Whether any slot that is read is coarser than level 0.
    pub fn has_coarse(&self) -> bool {
        self.levels().any(|level| level > Level(0))
    }

    /// Whether slots of different levels are read.
    pub fn has_several_levels(&self) -> bool {
        let mut levels = self.levels();
        levels.next().is_some_and(|first| levels.any(|level| level != first))
    }

    /// The level of a field that is one array of samples: flat blocks that are blended, all of one level and in the texture as in
    /// the volume.
    pub fn dense_level(&self) -> Option<Level> {
        match (self.slots.places(), self.join) {
            (Places::Blocks(places), Join::Blend(scheme)) => places.dense_level(scheme),
            _ => None,
        }
    }

    /// Whether values come about between flat blocks whose samples lie apart in the texture.
    pub fn blends_between(&self) -> bool {
        matches!(self.join, Join::Blend(_)) && self.dense_level().is_none()
    }

    /// Whether flat blocks at the volume's upper ends have a smaller extent.
    pub fn has_short_blocks(&self) -> bool {
        match self.slots.places() {
            Places::Blocks(places) => places.has_short_blocks(),
            _ => false,
        }
    }

    /// The levels of the slots that are read: those in the index, and all flat blocks that are blended.
    fn levels(&self) -> Box<dyn Iterator<Item = Level> + '_> {
        match (self.slots.places(), self.join) {
            (Places::Even(_), _) => Box::new(self.index.resident_reaches().map(Reach::level_of_brick)),
            (Places::Table { places, .. }, _) => Box::new(self.index.slots().map(|slot| places[slot as usize].level)),
            (Places::Blocks(places), Join::Blend(_)) => Box::new(places.rows().iter().map(|row| row.level)),
            (Places::Blocks(places), _) => Box::new(self.index.slots().map(|slot| places.rows()[slot as usize].level)),
        }
    }
}

/// Whether an index is one of flat blocks: a cell for each block, whose slot is the block's number.
fn check_blocks(dims: UVec3, index: &IndexGrid, layout: &BlockLayout) -> Result<(), FieldError> {
    let (IndexLattice { cell_samples, origin }, side) = (index.lattice(), layout.side().n_voxels());
    if layout.dims() != dims || cell_samples != side || origin != -0.5 {
        return Err(FieldError::OtherBlocks { side, blocks: layout.dims(), dims, cell_samples, origin });
    }
    for (expected, cell) in layout.blocks().enumerate() {
        let expected = expected as u32;
        match index.at(cell) {
            IndexEntry::Resident { slot, reach } if slot != expected || reach != Reach(0) => {
                return Err(FieldError::SlotOfBlock { cell, slot, expected });
            }
            _ => {}
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::{Axes, BrickSide};

    const LATTICE: IndexLattice = IndexLattice { cell_samples: 15, origin: 0.0 };

    fn slots(n: usize) -> Arc<Slots> {
        let bytes = vec![0; n * 4096];
        let decode = Decode { scale: 255.0, offset: 0.0 };
        Arc::new(Slots::even(BrickSide::S16, SampleFormat::Unorm8, decode, &bytes).unwrap())
    }

    fn index(dims: UVec3, slot: u32) -> Arc<IndexGrid> {
        Arc::new(IndexGrid::new(dims, LATTICE, [(UVec3::ZERO, IndexEntry::Resident { slot, reach: Reach(0) })]))
    }

    fn error(dims: UVec3, index: Arc<IndexGrid>, slots: Arc<Slots>) -> String {
        Field::new(dims, index, slots, Join::Shared).unwrap_err().to_string()
    }

    #[test]
    fn parts_that_do_not_fit_are_named() {
        let (dims, cells) = (UVec3::new(31, 16, 1), UVec3::new(2, 1, 1));
        assert!(Field::new(dims, index(cells, 0), slots(1), Join::Shared).is_ok());
        assert!(error(dims, index(cells, 1), slots(1)).contains("names slot 1, which holds no samples: there are 1"));
        assert!(error(UVec3::new(0, 1, 1), index(cells, 0), slots(1)).contains("every side must be at least 1"));
        assert!(error(UVec3::splat(16), index(cells, 0), slots(1)).contains("whose cells of 15 samples are [1, 1, 1]"));
        let of_32 = Slots::even(BrickSide::S32, SampleFormat::Unorm8, Decode { scale: 1.0, offset: 0.0 }, &[0; 32768]);
        assert!(error(dims, index(cells, 0), Arc::new(of_32.unwrap())).contains("bricks of 32 samples, which have 31"));
    }

    #[test]
    fn a_brick_begins_at_its_blocks_corner_and_has_its_reach_for_a_level() {
        let dims = UVec3::new(61, 31, 16);
        let entries = [(UVec3::new(2, 0, 0), IndexEntry::Resident { slot: 0, reach: Reach(1) })];
        let index = Arc::new(IndexGrid::new(UVec3::new(4, 2, 1), LATTICE, entries));
        let field = Field::new(dims, index, slots(1), Join::Shared).unwrap();
        let place = field.place_at(UVec3::new(3, 1, 0)).unwrap();
        assert_eq!((place.level, place.first, place.n), (Level(1), DVec3::new(30.0, 0.0, 0.0), UVec3::splat(16)));
        assert_eq!(place.axes, Axes::Xyz);
        assert!(field.place_at(UVec3::ZERO).is_none() && field.has_coarse() && !field.has_several_levels());
        let b = field.block_box(UVec3::new(3, 1, 0));
        assert_eq!((b.min.x, b.max.x, b.min.y), (30.0, f64::INFINITY, f64::NEG_INFINITY));
        assert_eq!(field.cell_at(DVec3::new(45.0, -3.0, 99.0)), UVec3::new(3, 0, 0));
    }
}
