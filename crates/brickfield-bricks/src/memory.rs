//! The memory of a tree: stored, shared and padding bytes.

use brickfield_core::glam::U64Vec3;
use brickfield_core::{BrickLayout, Level, ScalarType};

use crate::BrickSummary;

/// Bytes of one level. `stored = unique + shared + padding`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LevelMemory {
    /// Number of bricks.
    pub n_bricks: u64,
    /// Bytes of all samples of all bricks.
    pub stored_bytes: u64,
    /// Bytes of the level's samples, each counted once.
    pub unique_bytes: u64,
    /// Bytes of border samples that are stored again in a neighbour (LaMar et al. 1999, section 3.1).
    pub shared_bytes: u64,
    /// Bytes of samples beyond the level's border, which replicate border samples.
    pub padding_bytes: u64,
    /// Bytes of ranges and histograms.
    pub summary_bytes: u64,
}

/// Bytes of a tree, per level (finest first) and in all.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct TreeMemory {
    pub levels: Vec<LevelMemory>,
    pub total: LevelMemory,
}

/// The memory of a tree over `layout`, without building it.
///
/// While it is built, [`build_tree`](crate::build_tree) also holds two neighbouring levels, not level 0, without bricks.
pub fn tree_memory(layout: &BrickLayout, scalar: ScalarType) -> TreeMemory {
    let levels: Vec<_> = (0..layout.n_levels()).map(|l| level_memory(layout, Level(l), scalar)).collect();
    let total = levels.iter().fold(LevelMemory::default(), |sum, level| sum.plus(level));
    TreeMemory { levels, total }
}

impl LevelMemory {
    /// Bytes of samples and summaries.
    pub fn bytes(&self) -> u64 {
        self.stored_bytes.saturating_add(self.summary_bytes)
    }

    fn plus(self, other: &LevelMemory) -> LevelMemory {
        LevelMemory {
            n_bricks: self.n_bricks.saturating_add(other.n_bricks),
            stored_bytes: self.stored_bytes.saturating_add(other.stored_bytes),
            unique_bytes: self.unique_bytes.saturating_add(other.unique_bytes),
            shared_bytes: self.shared_bytes.saturating_add(other.shared_bytes),
            padding_bytes: self.padding_bytes.saturating_add(other.padding_bytes),
            summary_bytes: self.summary_bytes.saturating_add(other.summary_bytes),
        }
    }
}

fn level_memory(layout: &BrickLayout, level: Level, scalar: ScalarType) -> LevelMemory {
    let (unique, n_bricks) = (layout.level_dims(level).as_u64vec3(), layout.n_bricks(level).as_u64vec3());
    let bytes = |n_samples: u64| n_samples.saturating_mul(scalar.n_bytes() as u64);
    // Along an axis, k bricks hold k - 1 samples twice.
    let (n_inside, n_unique) = (product(unique + n_bricks - 1), product(unique));
    let n_stored = product(n_bricks).saturating_mul(layout.side().n_samples_total() as u64);
    LevelMemory {
        n_bricks: product(n_bricks),
        stored_bytes: bytes(n_stored),
        unique_bytes: bytes(n_unique),
        shared_bytes: bytes(n_inside - n_unique),
        padding_bytes: bytes(n_stored - n_inside),
        summary_bytes: product(n_bricks).saturating_mul(size_of::<BrickSummary>() as u64),
    }
}

/// The product, or the greatest number where that is less.
pub(crate) fn product(n: U64Vec3) -> u64 {
    n.to_array().into_iter().fold(1, u64::saturating_mul)
}
