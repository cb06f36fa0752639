//! Positions in the three spaces, as distinct types.

use glam::DVec3;

/// A position in index space: voxel (i, j, k) covers [i, i+1), its sample lies at i + 1/2. Unit: voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IndexPos(pub DVec3);

/// A position in sample space: sample (i, j, k) lies at the integer i. Unit: voxels.
///
/// Sample space is index space shifted by half a voxel; interpolation cells are its unit cubes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SamplePos(pub DVec3);

/// A position in world space. Unit: that of the grid's spacing, usually millimetres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorldPos(pub DVec3);

impl From<IndexPos> for SamplePos {
    fn from(p: IndexPos) -> SamplePos {
        SamplePos(p.0 - 0.5)
    }
}

impl From<SamplePos> for IndexPos {
    fn from(p: SamplePos) -> IndexPos {
        IndexPos(p.0 + 0.5)
    }
}
