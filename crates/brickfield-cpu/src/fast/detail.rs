//! What is visible inside bricks: rays leap over dark macrocells.

use brickfield_frame::MACROCELL_SIDE;

use super::brick::{LANES, Lanes, Nodes, at_most};

/// Distances from which on a leap reaches beyond a batch of short steps.
const FAR: i8 = 5;

/// Tells which segments of a ray inside one brick see nothing.
pub(super) struct Sieve<'a, const N: usize> {
    /// The segments' first nodes.
    nodes: Nodes,
    /// Distance between the rule's nodes, in segments.
    far: f32,
    /// Distances of the brick's macrocells to the nearest that is not like them; negative for visible ones.
    distances: &'a [i8],
}

impl<'a, const N: usize> Sieve<'a, N> {
    const N_MACROCELLS: usize = N / MACROCELL_SIDE as usize;

    #[inline(always)]
    pub(super) fn new(nodes: Nodes, far: f32, distances: &'a [i8]) -> Self {
        Sieve { nodes, far, distances: &distances[..Self::N_MACROCELLS.pow(3)] }
    }

    /// Which segments of the batch from `first` on may see something, as bits; and the first one behind it that may.
    #[inline(always)]
    pub(super) fn batch(&self, first: i32) -> (u32, i32) {
        let mut at = [0f32; LANES];
        for (l, at) in at.iter_mut().enumerate() {
            *at = (first + l as i32) as f32;
        }
        let near = self.macrocells(&at);
        let distances = self.distances(&near);
        let visible = match self.far {
            0.0 => bits(|l| distances[l] < 0),
            far => {
                at.iter_mut().for_each(|at| *at += far);
                pairs(&near, &self.macrocells(&at), &distances)
            }
        };
        let (behind, distance) = (first + LANES as i32, distances[LANES - 1]);
        if visible != 0 || distance < FAR {
            return (visible, behind);
        }
        let last = [near[0][LANES - 1], near[1][LANES - 1], near[2][LANES - 1]];
        (0, self.leaves(last, distance).max(behind))
    }

    /// The distances of macrocells.
    #[inline(always)]
    fn distances(&self, [x, y, z]: &[[u32; LANES]; 3]) -> [i8; LANES] {
        let n = Self::N_MACROCELLS as u32;
        let mut distances = [0; LANES];
        for l in 0..LANES {
            let i = (x[l] + n * (y[l] + n * z[l])) as usize;
            // Holds anyway; so the compiler knows it too.
            distances[l] = self.distances[i & (Self::N_MACROCELLS.pow(3) - 1)];
        }
        distances
    }

    /// The macrocells that hold nodes, along each axis.
    #[inline(always)]
    fn macrocells(&self, at: &Lanes) -> [[u32; LANES]; 3] {
        let mut macrocells = [[0; LANES]; 3];
        for (axis, macrocells) in macrocells.iter_mut().enumerate() {
            let (cells, _) = self.nodes.cells::<N, LANES>(axis, at);
            for l in 0..LANES {
                macrocells[l] = cells[l] / MACROCELL_SIDE;
            }
        }
        macrocells
    }

    /// The first segment that is not wholly among the dark macrocells around one; the brick's own faces end it anyway.
    #[inline(always)]
    fn leaves(&self, macrocell: [u32; 3], distance: i8) -> i32 {
        let side = MACROCELL_SIDE as f32;
        let reach = f32::from(distance) - 0.5;
        let mut exit = f32::MAX;
        for ((at, origin), change) in macrocell.into_iter().zip(self.nodes.origin).zip(self.nodes.change) {
            let sign = if change > 0.0 { 1.0 } else { -1.0 };
            let face = (at as f32 + 0.5 + sign * reach) * side;
            if change != 0.0 && face > 0.0 && face < N as f32 {
                exit = at_most(exit, (face - origin) / change);
            }
        }
        ceil(exit - self.far)
    }
}

/// Which segments with two nodes may see something: those whose far node is not among the dark macrocells around the near
/// one. Those are connected, so that the transfer function is 0 between two of their values, too.
#[inline(always)]
fn pairs(near: &[[u32; LANES]; 3], far: &[[u32; LANES]; 3], distances: &[i8; LANES]) -> u32 {
    let mut apart = [0; LANES];
    for (near, far) in near.iter().zip(far) {
        for l in 0..LANES {
            apart[l] = near[l].abs_diff(far[l]).max(apart[l]);
        }
    }
    bits(|l| i32::from(distances[l]) <= apart[l] as i32)
}

/// One bit for each lane.
#[inline(always)]
fn bits(is_set: impl Fn(usize) -> bool) -> u32 {
    let mut bits = 0;
    for l in 0..LANES {
        bits |= u32::from(is_set(l)) << l;
    }
    bits
}

/// The least integer not below; at most 2^31 - 128.
#[inline(always)]
fn ceil(x: f32) -> i32 {
    let down = at_most(x, 2_147_483_520.0) as i32;
    down + i32::from((down as f32) < x)
}
