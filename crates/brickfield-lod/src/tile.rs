//! A brick as filters see it: where its samples lie in the world.

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Aabb, BrickId, BrickLayout, Grid, WorldPos};

/// The part of the world that a brick's samples span: LaMar's tile.
///
/// The tile ends at the first and last samples, not at the half voxels beyond them. It has no extent along an axis of
/// one sample, so that a slice is measured in two dimensions. In the world it is a parallelepiped.
///
/// A tile is a name and two references; every measure of it is computed when it is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tile<'a> {
    layout: &'a BrickLayout,
    grid: &'a Grid,
    id: BrickId,
}

impl<'a> Tile<'a> {
    /// The tile of a brick; `grid` says where the layout's samples lie.
    #[inline]
    pub fn new(layout: &'a BrickLayout, grid: &'a Grid, id: BrickId) -> Tile<'a> {
        Tile { layout, grid, id }
    }

    /// Which brick it is.
    #[inline]
    pub fn id(&self) -> BrickId {
        self.id
    }

    /// The octree that it belongs to.
    pub fn layout(&self) -> &'a BrickLayout {
        self.layout
    }

    /// Where the samples lie.
    pub fn grid(&self) -> &'a Grid {
        self.grid
    }

    /// The box that rays meet, in **index space**: it reaches half a voxel beyond the volume's outer samples.
    #[inline]
    pub fn index_box(&self) -> Aabb {
        self.layout.index_box(self.id)
    }

    /// The box from the first to the last sample, in **sample space**.
    #[inline]
    pub fn sample_box(&self) -> Aabb {
        self.layout.sample_box(self.id)
    }

    /// The centre in the world.
    #[inline]
    pub fn center(&self) -> WorldPos {
        self.world(self.sample_box().center())
    }

    /// The eight corners in the world, x varying fastest.
    #[inline]
    pub fn corners(&self) -> [WorldPos; 8] {
        let (first, [x, y, z]) = (self.world(self.sample_box().min).0, self.edges_world());
        let (x, xy, xz, yz) = (first + x, first + x + y, first + x + z, first + y + z);
        [first, x, first + y, xy, first + z, xz, yz, xy + z].map(WorldPos)
    }

    /// The edges along the index axes, as world vectors.
    #[inline]
    pub fn edges_world(&self) -> [DVec3; 3] {
        let (linear, extent) = (self.grid.index_to_world().matrix3, self.sample_box().extent());
        [linear.x_axis * extent.x, linear.y_axis * extent.y, linear.z_axis * extent.z]
    }

    /// The four diagonals as world vectors; their lengths differ where the grid is sheared.
    #[inline]
    pub fn diagonals_world(&self) -> [DVec3; 4] {
        let [x, y, z] = self.edges_world();
        [x + y + z, x + y - z, x - y + z, x - y - z]
    }

    /// Length of the longest diagonal in world units.
    #[inline]
    pub fn diagonal_world(&self) -> f64 {
        self.diagonals_world().map(DVec3::length_squared).into_iter().fold(0.0, f64::max).sqrt()
    }

    /// Longest edge of a voxel of the tile's level, in world units.
    ///
    /// An axis of one sample has no edges: it has one sample at every level.
    #[inline]
    pub fn voxel_world(&self) -> f64 {
        let is_measured = self.layout.dims().cmpgt(UVec3::ONE);
        let spacing = DVec3::select(is_measured, self.grid.spacing(), DVec3::ZERO);
        spacing.max_element() * f64::from(self.id.level.stride())
    }

    /// The least distance of a point of the tile from the plane through `eye` across the unit vector `forward`, in
    /// world units; negative for points behind.
    #[inline]
    pub fn least_depth_world(&self, eye: WorldPos, forward: DVec3) -> f64 {
        let first = self.world(self.sample_box().min).0;
        let behind = self.edges_world().map(|edge| edge.dot(forward).min(0.0));
        (first - eye.0).dot(forward) + behind.iter().sum::<f64>()
    }

    /// Whether a point lies in the tile, its faces included.
    #[inline]
    pub fn contains(&self, point: WorldPos) -> bool {
        let (b, p) = (self.sample_box(), self.grid.index(point).0 - 0.5);
        (p.cmpge(b.min) & p.cmple(b.max)).all()
    }

    #[inline]
    fn world(&self, sample: DVec3) -> WorldPos {
        WorldPos(self.grid.index_to_world().transform_point3(sample + 0.5))
    }
}
