//! The value at a position.

use brickfield_core::glam::UVec3;
use brickfield_core::{BlockLayout, Interblock, Level};

use crate::{Neighbourhood, Real};

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
    let own_block = around.own_block();
    if around.is_inside(layout.inset(own_block, level(own_block)).to_array().map(T::from_f64)) {
        return fetch(own_block);
    }
    let mut value = T::ZERO;
    for (b, weight) in around.weights(layout, scheme, level).into_iter().enumerate() {
        if let (true, Some(block)) = (weight > T::ZERO, around.block(b)) {
            value = value + weight * fetch(block);
        }
    }
    value
}
