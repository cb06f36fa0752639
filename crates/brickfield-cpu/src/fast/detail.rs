//! What is visible inside bricks: rays leap over dark macrocells.

use std::ops::Range;

use brickfield_frame::MACROCELL_SIDE;

use super::brick::{LANES, Nodes, at_most};

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

    /// Writes those of the first segments of some, at most a batch, that may see something, with room for eight more behind them; how many they
    /// are, and the first one behind that may.
    #[inline(always)]
    pub(super) fn find(&self, segments: Range<i32>, to: &mut [f32]) -> (usize, i32) {
        let (first, n) = (segments.start, segments.end - segments.start);
        let (mut bits, next) = match n <= LANES as i32 / 2 {
            true => self.batch::<{ LANES / 2 }>(first),
            false => self.batch::<LANES>(first),
        };
        if n < LANES as i32 {
            bits &= (1 << n) - 1;
        }
        let mut n_found = 0;
        for eight in 0..LANES / 8 {
            let own = (bits >> (8 * eight)) as u8;
            for (to, bit) in to[n_found..n_found + 8].iter_mut().zip(SET_BITS[usize::from(own)]) {
                *to = (first + 8 * eight as i32 + i32::from(bit)) as f32;
            }
            n_found += own.count_ones() as usize;
        }
        (n_found, next)
    }

    /// Which segments of the batch from `first` on may see something, as bits; and the first one behind it that may.
    #[inline(always)]
    fn batch<const L: usize>(&self, first: i32) -> (u32, i32) {
        let mut at = [0f32; L];
        for (l, at) in at.iter_mut().enumerate() {
            *at = (first + l as i32) as f32;
        }
        let near = self.macrocells(&at);
        let distances = self.distances(&near);
        let visible = match self.far {
            0.0 => bits::<L>(|l| distances[l] < 0),
            far => {
                at.iter_mut().for_each(|at| *at += far);
                pairs(&near, &self.macrocells(&at), &distances)
            }
        };
        let (behind, distance) = (first + L as i32, distances[L - 1]);
        if visible != 0 || distance < FAR {
            return (visible, behind);
        }
        let last = near.map(|macrocells| macrocells[L - 1]);
        (0, self.leaves(last, distance).max(behind))
    }

    /// The distances of macrocells.
    #[inline(always)]
    fn distances<const L: usize>(&self, [x, y, z]: &[[u32; L]; 3]) -> [i8; L] {
        let n = Self::N_MACROCELLS as u32;
        let mut distances = [0; L];
        for l in 0..L {
            let i = (x[l] + n * (y[l] + n * z[l])) as usize;
            // Holds anyway; so the compiler knows it too.
            distances[l] = self.distances[i & (Self::N_MACROCELLS.pow(3) - 1)];
        }
        distances
    }

    /// The macrocells that hold nodes, along each axis.
    #[inline(always)]
    fn macrocells<const L: usize>(&self, at: &[f32; L]) -> [[u32; L]; 3] {
        let mut macrocells = [[0; L]; 3];
        for (axis, macrocells) in macrocells.iter_mut().enumerate() {
            let (cells, _) = self.nodes.cells::<N, L>(axis, at);
            for l in 0..L {
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
fn pairs<const L: usize>(near: &[[u32; L]; 3], far: &[[u32; L]; 3], distances: &[i8; L]) -> u32 {
    let mut apart = [0; L];
    for (near, far) in near.iter().zip(far) {
        for l in 0..L {
            apart[l] = near[l].abs_diff(far[l]).max(apart[l]);
        }
    }
    bits::<L>(|l| i32::from(distances[l]) <= apart[l] as i32)
}

/// One bit for each lane.
#[inline(always)]
fn bits<const L: usize>(is_set: impl Fn(usize) -> bool) -> u32 {
    let mut bits = 0;
    for l in 0..L {
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

/// For each byte the places of its set bits, from the lowest on.
const SET_BITS: [[u8; 8]; 256] = {
    let mut all = [[0; 8]; 256];
    let mut byte = 0;
    while byte < 256 {
        let (mut n, mut bit) = (0, 0);
        while bit < 8 {
            if byte >> bit & 1 == 1 {
                all[byte][n] = bit as u8;
                n += 1;
            }
            bit += 1;
        }
        byte += 1;
    }
    all
};
