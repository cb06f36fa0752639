//! The eight blocks around a position.

use brickfield_core::glam::UVec3;
use brickfield_core::{BlockLayout, Interblock, Level};

use crate::{Real, block_weights};

/// The eight blocks that meet nearest to a position, and where it lies between them.
///
/// Block b of 0 to 7 is on the upper side along x, y, z if bit 0, 1, 2 of b is set (the paper's block b + 1):
///
/// ```text
///         rho < 0 | rho > 0           6 ---- 7
///     -------- block's face --------  |      |       z above 0 to 3
///       block 0   |   block 1         4 ---- 5
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbourhood<T> {
    /// The block that holds the position.
    own_block: UVec3,
    /// Its number among the eight.
    own: usize,
    /// For each axis, how far the position is past the blocks' common face, in voxels. Infinite where there is no block on
    /// the other side.
    rho: [T; 3],
}

impl<T: Real> Neighbourhood<T> {
    /// The neighbourhood of a position in sample space (sample 0 at 0), which is limited to the volume.
    ///
    /// A departure from the paper's equation 3, which names blocks beyond the volume's upper faces: there, as at the lower faces,
    /// the neighbour is missing, and no weight goes to it.
    pub fn around(layout: &BlockLayout, position: [T; 3]) -> Neighbourhood<T> {
        let side = T::from_f64(f64::from(layout.side().n_voxels()));
        let (half, n_blocks) = (T::from_f64(0.5), layout.n_blocks().to_array());
        let mut own = 0;
        let along = [0, 1, 2].map(|axis| {
            let past_first_face = position[axis] + half;
            let block = (past_first_face / side).floor_to(n_blocks[axis] - 1);
            let past_face = past_first_face - T::from_f64(f64::from(block)) * side;
            let is_upper = past_face < half * side;
            own |= usize::from(is_upper) << axis;
            let rho = match is_upper {
                true if block == 0 => T::INFINITY,
                true => past_face,
                false if block + 1 == n_blocks[axis] => T::ZERO - T::INFINITY,
                false => past_face - side,
            };
            (block, rho)
        });
        Neighbourhood { own_block: UVec3::from(along.map(|a| a.0)), own, rho: along.map(|a| a.1) }
    }

    /// The number, among the eight, of the block that holds the position.
    #[inline]
    pub fn own(&self) -> usize {
        self.own
    }

    /// The block that holds the position.
    #[inline]
    pub fn own_block(&self) -> UVec3 {
        self.own_block
    }

    /// Whether the position is among the samples of its own block, which keep `inset` away from other blocks.
    #[inline]
    pub fn is_inside(&self, inset: [T; 3]) -> bool {
        (0..3).all(|axis| self.rho[axis].abs() >= inset[axis])
    }

    /// The weights of the eight blocks, by the levels of blocks.
    pub fn weights(&self, layout: &BlockLayout, scheme: Interblock, level: impl Fn(UVec3) -> Level) -> [T; 8] {
        let inset = |block: UVec3| layout.inset(block, level(block)).to_array().map(T::from_f64);
        let insets = std::array::from_fn(|b| self.block(b).map_or([T::ONE; 3], &inset));
        block_weights(scheme, self.rho, self.own, &insets)
    }

    /// How far the position is past the blocks' common face along each axis, in voxels; infinite where no block is on the other side.
    #[inline]
    pub fn rho(&self) -> [T; 3] {
        self.rho
    }

    /// Block `b` of the eight; `None` where the volume has none.
    #[inline]
    pub fn block(&self, b: usize) -> Option<UVec3> {
        let mut block = self.own_block;
        for axis in 0..3 {
            let (is_upper, own_is_upper) = (b >> axis & 1 == 1, self.own >> axis & 1 == 1);
            if is_upper == own_is_upper {
                continue;
            }
            if self.rho[axis].abs() == T::INFINITY {
                return None;
            }
            block[axis] = if is_upper { block[axis] + 1 } else { block[axis] - 1 };
        }
        Some(block)
    }
}
