//! The octree of bricks with its data.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use brickfield_core::{BrickId, BrickLayout, Grid, Level, Rescale, ScalarType, ValueRange, Voxels, with_voxels};

use crate::sample::BrickScalar;
use crate::{Bins, BrickSamples, Downsampling, Histogram, TreeMemory, tree_memory};

/// A volume as an octree of bricks (LaMar, Hamann and Joy 1999, section 3).
///
/// Every brick holds side^3 samples of the volume's scalar type; neighbours share their border samples, bit by bit.
/// Made by [`build_tree`](crate::build_tree). It does not change afterwards; a clone is the same tree.
#[derive(Clone, Debug)]
pub struct BrickTree {
    pub(crate) id: TreeId,
    pub(crate) layout: BrickLayout,
    pub(crate) grid: Grid,
    pub(crate) downsampling: Downsampling,
    pub(crate) bins: Bins,
    pub(crate) scalar: ScalarType,
    pub(crate) rescale: Rescale,
    pub(crate) levels: Vec<TreeLevel>,
}

/// The identity of a tree: equal samples elsewhere are another tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct TreeId(u64);

impl TreeId {
    /// An identity that no other tree of this process has.
    pub(crate) fn new() -> TreeId {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        TreeId(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}

/// Trees are equal if their samples are.
impl PartialEq for BrickTree {
    fn eq(&self, other: &BrickTree) -> bool {
        let of = |t: &BrickTree| (t.layout, t.grid, t.downsampling, t.bins, t.scalar, t.rescale);
        self.id == other.id || (of(self) == of(other) && self.levels == other.levels)
    }
}

/// The range and histogram of a brick, known without its samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BrickSummary {
    /// Least and greatest value that the brick stands for: its own samples, shared borders included, and those of all
    /// bricks below it. Interpolation inside the brick, at this level or any finer one, never leaves this range.
    pub range: ValueRange,
    /// The voxels of level 0 that the brick stands for, each voxel counted in one brick per level.
    pub histogram: Histogram,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TreeLevel {
    /// The bricks one after the other, in the order of [`BrickLayout::ordinal`].
    pub(crate) samples: Arc<Voxels>,
    pub(crate) summaries: Vec<BrickSummary>,
}

impl BrickTree {
    /// Its identity: time steps of one layout have several.
    pub fn id(&self) -> TreeId {
        self.id
    }

    /// Which bricks there are, and where.
    pub fn layout(&self) -> &BrickLayout {
        &self.layout
    }

    /// Where the volume's voxels lie.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// The type of all samples: the volume's.
    pub fn scalar_type(&self) -> ScalarType {
        self.scalar
    }

    /// The map from stored samples to data values: the volume's.
    pub fn rescale(&self) -> Rescale {
        self.rescale
    }

    /// How each level was computed from the one below.
    pub fn downsampling(&self) -> Downsampling {
        self.downsampling
    }

    /// The value bins of all histograms.
    pub fn bins(&self) -> &Bins {
        &self.bins
    }

    /// Bytes of one brick's samples.
    pub fn n_brick_bytes(&self) -> usize {
        self.layout.side().n_samples_total() * self.scalar.n_bytes()
    }

    /// The samples of a brick as they are stored.
    ///
    /// # Panics
    /// If the layout has no such brick.
    pub fn samples(&self, id: BrickId) -> BrickSamples<'_> {
        let n = self.layout.side().n_samples_total();
        let start = n * self.ordinal(id);
        with_voxels!(&*self.level(id.level).samples, v => BrickScalar::borrow(&v[start..start + n]))
    }

    /// The samples of all bricks of a level, brick after brick in the order of [`BrickLayout::bricks`]; shared by all clones of the tree.
    ///
    /// # Panics
    /// If the layout has no such level.
    pub fn level_samples(&self, level: Level) -> &Arc<Voxels> {
        &self.level(level).samples
    }

    /// Range and histogram of a brick.
    ///
    /// # Panics
    /// If the layout has no such brick.
    pub fn summary(&self, id: BrickId) -> &BrickSummary {
        &self.level(id.level).summaries[self.ordinal(id)]
    }

    /// Ranges and histograms of all bricks of a level, in the order of [`BrickLayout::bricks`].
    ///
    /// # Panics
    /// If the layout has no such level.
    pub fn summaries(&self, level: Level) -> &[BrickSummary] {
        &self.level(level).summaries
    }

    /// The bytes that the tree takes.
    pub fn memory(&self) -> TreeMemory {
        tree_memory(&self.layout, self.scalar)
    }

    fn level(&self, level: Level) -> &TreeLevel {
        &self.levels[usize::from(level.0)]
    }

    fn ordinal(&self, id: BrickId) -> usize {
        assert!(self.layout.contains(id), "{id} does not exist");
        self.layout.ordinal(id)
    }
}
