//! Weights of edges and of blocks.

use brickfield_core::Interblock;

use crate::Real;

/// The weight of the upper one of two blocks with a common face (equations 8 to 10), at a position `rho` past the face. The samples
/// of the lower and the upper block keep `lower` and `upper` away from it, both above 0; all in one unit.
///
/// 0 where only the lower block counts, 1 where only the upper one does.
#[inline]
pub fn edge_weight<T: Real>(scheme: Interblock, rho: T, lower: T, upper: T) -> T {
    let half = T::from_f64(0.5);
    let split_at_face = |inset: T| (half + half * rho / inset).clamp_01();
    match scheme {
        Interblock::MinimumDistance => split_at_face(lower.min(upper)),
        Interblock::BoundarySplit if rho < T::ZERO => split_at_face(lower),
        Interblock::BoundarySplit => split_at_face(upper),
        Interblock::MaximumDistance => ((rho + lower) / (lower + upper)).clamp_01(),
    }
}

/// The weights of the eight blocks around a position, which add up to 1 (equations 6 and 7).
///
/// `rho` and `own` are the [`Neighbourhood`](crate::Neighbourhood)'s; `insets` says for each block and axis how far its
/// samples keep away from the common face, in the unit of `rho`. The insets of missing blocks may be any number above 0.
///
/// A departure from equation 6, which lets a block across an edge or a corner have weight where the position lies among the
/// samples of its own block: block 0 is fine, blocks 1 and 2 are coarse, so that the weights e13 of edge 1-3 and e23 of edge 2-3 are
/// above 0 although those of 0-1 and 0-2 are not, and block 3 gets e13 e23. The paper says that samples inside a block are not
/// affected, and its first pass relies on it. So no block but the own one has more weight than `1 - |rho| / inset`
/// of the own block, on the axis where that is greatest: 0 among its samples, 1 at its faces, and no limit where all
/// resolutions are equal.
#[inline]
pub fn block_weights<T: Real>(scheme: Interblock, rho: [T; 3], own: usize, insets: &[[T; 3]; 8]) -> [T; 8] {
    let edge = |axis: usize, lower: usize| {
        edge_weight(scheme, rho[axis], insets[lower][axis], insets[lower | 1 << axis][axis])
    };
    let towards = |b: usize, axis: usize| match b >> axis & 1 {
        0 => T::ONE - edge(axis, b),
        _ => edge(axis, b ^ 1 << axis),
    };
    let outside = |axis: usize| (T::ONE - rho[axis].abs() / insets[own][axis]).clamp_01();
    let most = outside(0).max(outside(1)).max(outside(2));
    let mut weights = std::array::from_fn(|b| {
        let weight = towards(b, 0) * towards(b, 1) * towards(b, 2);
        if b == own { weight } else { weight.min(most) }
    });
    let sum = weights.into_iter().fold(T::ZERO, |sum, weight| sum + weight);
    weights.iter_mut().for_each(|weight| *weight = *weight / sum);
    weights
}
