//! Where a brick lies in the world, as the criteria see it.

use brickfield_core::glam::{DAffine3, DMat3, DVec3};
use brickfield_core::{BrickId, BrickLayout, Grid, WorldPos};

/// Measures bricks of a grid in the world.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ruler {
    layout: BrickLayout,
    index_to_world: DAffine3,
}

/// The part of the world that a brick's samples span: LaMar's tile.
///
/// The tile ends at the first and last samples, not at the half voxels beyond them. It has no extent along an axis of
/// one sample, so that a slice is measured in two dimensions.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Tile {
    pub center: WorldPos,
    /// Length of the longest diagonal in world units.
    pub diagonal_world: f64,
}

impl Ruler {
    pub(crate) fn new(layout: &BrickLayout, grid: &Grid) -> Ruler {
        Ruler { layout: *layout, index_to_world: grid.index_to_world() }
    }

    pub(crate) fn tile(&self, id: BrickId) -> Tile {
        let b = self.layout.sample_box(id);
        let center = WorldPos(self.index_to_world.transform_point3(b.center() + 0.5));
        Tile { center, diagonal_world: longest_diagonal(&self.index_to_world.matrix3, b.extent()) }
    }
}

impl Tile {
    /// The tile of a brick.
    pub fn new(layout: &BrickLayout, grid: &Grid, id: BrickId) -> Tile {
        Ruler::new(layout, grid).tile(id)
    }
}

/// The four diagonals differ where the grid is sheared.
fn longest_diagonal(linear: &DMat3, extent: DVec3) -> f64 {
    let (x, y, z) = (linear.x_axis * extent.x, linear.y_axis * extent.y, linear.z_axis * extent.z);
    let squares = [x + y + z, x + y - z, x - y + z, x - y - z].map(DVec3::length_squared);
    squares.into_iter().fold(0.0, f64::max).sqrt()
}
