//! What is visible inside bricks: rays leap over dark macrocells.

use brickfield_frame::MACROCELL_SIDE;

use super::brick::{Nodes, Places, at_most};
use super::eight::{Eight, LANES};

/// Distances from which on a leap reaches beyond eight short steps.
const FAR: i8 = 4;

/// Tells which segments of a ray inside one brick see nothing.
pub(super) struct Sieve<'a, const N: usize> {
    /// The segments' first nodes.
    nodes: Nodes,
    /// Distance between the rule's nodes, in segments.
    far: f32,
    /// Distances of the brick's macrocells to the nearest that is not like them; negative for visible ones.
    distances: &'a [i8],
}

/// A macrocell for each of eight nodes, along each axis.
type Macrocells = [[u32; LANES]; 3];

impl<'a, const N: usize> Sieve<'a, N> {
    const N_MACROCELLS: usize = N / MACROCELL_SIDE as usize;

    #[inline(always)]
    pub(super) fn new(nodes: Nodes, far: f32, distances: &'a [i8]) -> Self {
        Sieve { nodes, far, distances: &distances[..Self::N_MACROCELLS.pow(3)] }
    }

    /// Looks at eight segments from `first` on, by the places of their nodes: a bit for each that may see something, and where the search goes on.
    #[inline(always)]
    pub(super) fn find<V: Eight>(&self, first: i32, near: &Places<V>, far: Option<&Places<V>>) -> (u8, i32) {
        let (macrocells, distances) = self.look_up(near);
        let visible = match far {
            None => signs(distances),
            Some(far) => pairs(&macrocells, &self.look_up(far).0, &distances),
        };
        let (last, behind) = (LANES - 1, first + LANES as i32);
        if visible != 0 || distances[last] < FAR {
            return (visible, behind);
        }
        let leaves = self.leaves(macrocells.map(|macrocells| macrocells[last]), distances[last]);
        (0, leaves.max(behind))
    }

    /// The macrocells that hold nodes, and their distances.
    #[inline(always)]
    fn look_up<V: Eight>(&self, places: &Places<V>) -> (Macrocells, [i8; LANES]) {
        let [x, y, z] = places.cells;
        let (side, n) = (MACROCELL_SIDE.ilog2(), Self::N_MACROCELLS.ilog2());
        let (x, y, z) = (x.shr(side), y.shr(side), z.shr(side));
        let places = (x + y.shl(n) + z.shl(2 * n)).to_array();
        let mut distances = [0; LANES];
        for (distance, place) in distances.iter_mut().zip(places) {
            // The bound holds anyway; so the compiler knows it too.
            *distance = self.distances[place as usize & (Self::N_MACROCELLS.pow(3) - 1)];
        }
        ([x.to_array(), y.to_array(), z.to_array()], distances)
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
fn pairs(near: &Macrocells, far: &Macrocells, distances: &[i8; LANES]) -> u8 {
    let apart = |l: usize| (0..3).map(|axis| near[axis][l].abs_diff(far[axis][l])).max().unwrap_or(0);
    bits(|l| i32::from(distances[l]) <= apart(l) as i32)
}

/// A bit for each number, set for negative ones.
#[inline(always)]
fn signs(numbers: [i8; LANES]) -> u8 {
    let signs = u64::from_le_bytes(pulp::cast(numbers)) & 0x8080_8080_8080_8080;
    // Brings bit 7 of byte l to bit 56 + l.
    (signs.wrapping_mul(0x0002_0408_1020_4081) >> 56) as u8
}

/// One bit for each lane.
#[inline(always)]
fn bits(is_set: impl Fn(usize) -> bool) -> u8 {
    (0..LANES).fold(0, |bits, l| bits | u8::from(is_set(l)) << l)
}

/// The least integer not below; at most 2^31 - 128.
#[inline(always)]
fn ceil(x: f32) -> i32 {
    let down = at_most(x, 2_147_483_520.0) as i32;
    down + i32::from((down as f32) < x)
}
