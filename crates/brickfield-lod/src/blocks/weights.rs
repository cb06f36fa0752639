//! How much a block matters in a view.

use brickfield_core::glam::UVec3;
use brickfield_core::{Aabb, BlockLayout, Camera, Grid, IndexPos, Projection};
use rayon::prelude::*;

use crate::{Culling, Frustum, View};

/// From where, and inside of which box, blocks are seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockView {
    /// The camera, the picture, and whether blocks beyond it are left out.
    pub view: View,
    /// The part of **index space** that is drawn; `None` for all of it.
    pub clip: Option<Aabb>,
    /// What a visible block's weight is.
    pub importance: Importance,
}

/// The weight of a visible block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Importance {
    /// 1.
    Equal,
    /// The area of its voxels in the picture, 1 where it is half of the volume's diagonal away from the eye: it falls with the
    /// square of the distance, from the block's own half diagonal on. Orthographic: 1.
    #[default]
    ProjectedArea,
}

/// A weight for each block, by [`BlockLayout::ordinal`]: 0 outside of the frustum or of the clip box.
///
/// Conservative, as [`Frustum`] is. A block outside still takes part in interpolation between it and a neighbour inside.
pub fn block_weights(layout: &BlockLayout, grid: &Grid, from: &BlockView) -> Vec<f32> {
    let frustum = Frustum::new(grid, &from.view.camera, from.view.size);
    let is_reached = |b: &Aabb| from.view.culling == Culling::Off || frustum.reaches(b);
    let is_kept = |b: &Aabb| from.clip.is_none_or(|clip| !clip.intersection(b).is_empty());
    let weight = |ordinal| {
        let b = index_box(layout, layout.block(ordinal));
        match is_kept(&b) && is_reached(&b) {
            true => importance(grid, &from.view.camera, &b, from.importance),
            false => 0.0,
        }
    };
    (0..layout.n_blocks_total()).into_par_iter().with_min_len(256).map(weight).collect()
}

/// The voxels of a block in index space.
fn index_box(layout: &BlockLayout, block: UVec3) -> Aabb {
    let min = layout.first_voxel(block);
    Aabb { min: min.as_dvec3(), max: (min + layout.extent(block)).as_dvec3() }
}

fn importance(grid: &Grid, camera: &Camera, b: &Aabb, importance: Importance) -> f32 {
    match (importance, camera.projection()) {
        (Importance::Equal, _) | (_, Projection::Orthographic { .. }) => 1.0,
        (Importance::ProjectedArea, Projection::Perspective { .. }) => {
            let half_diagonal = |b: &Aabb| 0.5 * grid.index_to_world().transform_vector3(b.extent()).length();
            let distance = grid.world(IndexPos(b.center())).0.distance(camera.eye());
            (half_diagonal(&grid.index_box()) / distance.max(half_diagonal(b))).powi(2) as f32
        }
    }
}
