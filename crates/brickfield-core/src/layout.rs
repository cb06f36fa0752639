//! The geometry of the brick octree, without its data.

use std::fmt;

use glam::{DVec3, UVec3};

use crate::{Aabb, BrickId, Level};

/// Samples along one side of a brick: 16, 32 or 64.
///
/// Neighbours share their border samples, so a brick of n samples a side holds n - 1 cells a side.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs)]
pub enum BrickSide {
    S16,
    S32,
    S64,
}

/// A brick side that is not offered.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("a brick side of {n_samples} samples is not offered: choose 16, 32 or 64")]
#[allow(missing_docs)]
pub struct BrickSideError {
    pub n_samples: u32,
}

impl BrickSide {
    /// All sides, ascending.
    pub const ALL: [BrickSide; 3] = [BrickSide::S16, BrickSide::S32, BrickSide::S64];

    /// The side of `n_samples` samples.
    ///
    /// # Errors
    /// If `n_samples` is not 16, 32 or 64.
    pub fn new(n_samples: u32) -> Result<BrickSide, BrickSideError> {
        BrickSide::ALL.into_iter().find(|s| s.n_samples() == n_samples).ok_or(BrickSideError { n_samples })
    }

    /// Samples along a side.
    pub const fn n_samples(self) -> u32 {
        match self {
            BrickSide::S16 => 16,
            BrickSide::S32 => 32,
            BrickSide::S64 => 64,
        }
    }

    /// Cells along a side: one less than samples.
    pub const fn n_cells(self) -> u32 {
        self.n_samples() - 1
    }

    /// Samples in a brick.
    pub const fn n_samples_total(self) -> usize {
        (self.n_samples() as usize).pow(3)
    }
}

impl fmt::Display for BrickSide {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.n_samples().fmt(f)
    }
}

/// The octree of bricks over a volume (LaMar, Hamann and Joy 1999, section 3): which bricks there are, and where.
///
/// Level 0 is the finest. Sample i of level l lies at sample position 2^l * i (pixel-centre alignment), so a brick of
/// level l covers (n - 1) * 2^l cells of level 0 along each axis, exactly its up to eight children.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BrickLayout {
    dims: UVec3,
    side: BrickSide,
    /// Bricks of level 0 along x, y, z. The count is stored, so that a descent never divides.
    n_bricks: UVec3,
    n_levels: u8,
}

impl BrickLayout {
    /// The layout over a volume of `dims` samples. A zero dimension counts as one.
    pub fn new(dims: UVec3, side: BrickSide) -> BrickLayout {
        let dims = dims.max(UVec3::ONE);
        let n_bricks = UVec3::from(dims.to_array().map(|n| (n - 1).div_ceil(side.n_cells()).max(1)));
        let n_levels = 1 + n_bricks.max_element().next_power_of_two().trailing_zeros() as u8;
        BrickLayout { dims, side, n_bricks, n_levels }
    }

    /// Samples of the volume along x, y, z.
    pub fn dims(&self) -> UVec3 {
        self.dims
    }

    /// Samples along a brick's side.
    pub fn side(&self) -> BrickSide {
        self.side
    }

    /// Number of levels; the coarsest has one brick.
    pub fn n_levels(&self) -> u8 {
        self.n_levels
    }

    /// The coarsest level.
    pub fn root(&self) -> BrickId {
        BrickId { level: Level(self.n_levels - 1), coords: UVec3::ZERO }
    }

    /// Samples of a level along x, y, z: ceil((dims - 1) / 2^level) + 1.
    pub fn level_dims(&self, level: Level) -> UVec3 {
        UVec3::from(self.dims.to_array().map(|n| (n - 1).div_ceil(level.stride()) + 1))
    }

    /// Bricks of a level along x, y, z.
    #[inline]
    pub fn n_bricks(&self, level: Level) -> UVec3 {
        ((self.n_bricks - 1) >> u32::from(level.0).min(31)) + 1
    }

    /// Number of bricks of a level.
    pub fn n_bricks_total(&self, level: Level) -> usize {
        self.n_bricks(level).to_array().into_iter().map(|n| n as usize).product()
    }

    /// All bricks of a level, x fastest: the order of [`ordinal`](Self::ordinal).
    pub fn bricks(&self, level: Level) -> impl Iterator<Item = BrickId> + use<> {
        let n = self.n_bricks(level);
        (0..n.z).flat_map(move |z| {
            (0..n.y).flat_map(move |y| (0..n.x).map(move |x| BrickId { level, coords: UVec3::new(x, y, z) }))
        })
    }

    /// The position of a brick among the bricks of its level, x fastest.
    pub fn ordinal(&self, id: BrickId) -> usize {
        let n = self.n_bricks(id.level);
        let (x, y, z) = (id.coords.x as usize, id.coords.y as usize, id.coords.z as usize);
        x + n.x as usize * (y + n.y as usize * z)
    }

    /// Whether the brick exists.
    pub fn contains(&self, id: BrickId) -> bool {
        id.level.0 < self.n_levels && id.coords.cmplt(self.n_bricks(id.level)).all()
    }

    /// The bricks one level finer that tile `id` exactly: one to eight, none for level 0.
    #[inline]
    pub fn children(&self, id: BrickId) -> impl Iterator<Item = BrickId> + use<> {
        let finer = id.level.0.checked_sub(1).map(Level);
        let n = finer.map_or(UVec3::ZERO, |l| self.n_bricks(l));
        (0..8u32).filter_map(move |i| {
            let coords = id.coords * 2 + UVec3::new(i & 1, i >> 1 & 1, i >> 2);
            coords.cmplt(n).all().then(|| BrickId { level: finer.unwrap_or(id.level), coords })
        })
    }

    /// The box that a brick owns, in **sample space**: half-open, cut at the last sample.
    ///
    /// Along an axis of one sample the box has no extent.
    #[inline]
    pub fn sample_box(&self, id: BrickId) -> Aabb {
        let cells = f64::from(self.side.n_cells()) * f64::from(id.level.stride());
        let min = id.coords.as_dvec3() * cells;
        Aabb { min, max: (min + cells).min((self.dims - 1).as_dvec3()) }
    }

    /// The box that a brick owns, in **index space**: the bricks of any level tile [0, dims) exactly.
    ///
    /// First and last bricks include the half voxels before the first and after the last sample.
    #[inline]
    pub fn index_box(&self, id: BrickId) -> Aabb {
        let b = self.sample_box(id);
        let first = id.coords.cmpeq(UVec3::ZERO);
        let last = (id.coords + 1).cmpeq(self.n_bricks(id.level));
        Aabb {
            min: DVec3::select(first, DVec3::ZERO, b.min + 0.5),
            max: DVec3::select(last, self.dims.as_dvec3(), b.max + 0.5),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_brick_of_64_has_250047_cells() {
        // LaMar et al. 1999, section 3.1: "effective" voxels of a 64^3 tile, and 12,097 extra ones.
        assert_eq!(BrickSide::S64.n_cells().pow(3), 250_047);
        assert_eq!(BrickSide::S64.n_samples_total() - 250_047, 12_097);
    }

    proptest! {
        #[test]
        fn every_level_tiles_the_index_box(x in 1u32..200, y in 1u32..90, z in 1u32..40, side in 0usize..3) {
            let layout = BrickLayout::new(UVec3::new(x, y, z), BrickSide::ALL[side]);
            for level in (0..layout.n_levels()).map(Level) {
                let boxes: Vec<_> = layout.bricks(level).map(|id| layout.index_box(id)).collect();
                let volume: f64 = boxes.iter().map(|b| b.extent().element_product()).sum();
                prop_assert_eq!(volume, f64::from(x * y * z));
                prop_assert!(boxes.iter().all(|b| !b.is_empty()));
            }
            prop_assert_eq!(layout.n_bricks(layout.root().level), UVec3::ONE);
        }

        #[test]
        fn children_tile_their_parent(x in 1u32..400, y in 1u32..100, z in 1u32..50) {
            let layout = BrickLayout::new(UVec3::new(x, y, z), BrickSide::S16);
            for level in (1..layout.n_levels()).map(Level) {
                for id in layout.bricks(level) {
                    let parent = layout.index_box(id);
                    let parts: Vec<_> = layout.children(id).map(|c| layout.index_box(c)).collect();
                    let volume: f64 = parts.iter().map(|b| b.extent().element_product()).sum();
                    prop_assert_eq!(volume, parent.extent().element_product());
                    prop_assert!(parts.iter().all(|b| b.union(&parent) == parent));
                }
            }
        }
    }
}
