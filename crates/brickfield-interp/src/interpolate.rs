//! The value at a position.

use brickfield_core::glam::UVec3;
use brickfield_core::{BlockLayout, Interblock, Level};

use crate::{Neighbourhood, Real, block_weights};

/// The value at a position in sample space (sample 0 at 0), between blocks of any resolution.
///
/// `level` says at which resolution a block is. `fetch` interpolates among the samples of one block at the position, limited to
/// the block's samples; a block's [`sample_ends`](BlockLayout::sample_ends) say where they lie. It is asked once where the position lies
/// among a block's own samples, else once for each block with a weight above 0, up to eight times.
///
/// Continuous in the position if `fetch` is. Equal resolutions give trilinear interpolation of the whole volume, and a linear
/// field stays linear, both to rounding.
pub fn interpolate<T: Real>(
    layout: &BlockLayout,
    scheme: Interblock,
    position: [T; 3],
    level: impl Fn(UVec3) -> Level,
    mut fetch: impl FnMut(UVec3) -> T,
) -> T {
    let around = Neighbourhood::around(layout, position);
    let blocks: [Option<UVec3>; 8] = std::array::from_fn(|b| around.block(b));
    let inset = |block: UVec3| layout.inset(block, level(block)).to_array().map(T::from_f64);
    let own_block = blocks[around.own()].expect("a position has a block of its own");
    let own_inset = inset(own_block);
    if (0..3).all(|axis| around.rho()[axis].abs() >= own_inset[axis]) {
        return fetch(own_block);
    }
    let insets = blocks.map(|block| block.map_or([T::ONE; 3], &inset));
    let weights = block_weights(scheme, around.rho(), around.own(), &insets);
    let mut value = T::ZERO;
    for (weight, block) in weights.into_iter().zip(blocks) {
        if let (true, Some(block)) = (weight > T::ZERO, block) {
            value = value + weight * fetch(block);
        }
    }
    value
}
