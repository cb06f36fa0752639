//! What is visible inside bricks: rays leap over dark macrocells.

use brickfield_frame::MACROCELL_SIDE;

use super::brick::{Nodes, at_least, at_most, floor_bits};

/// The runs of segments with something visible among segments `0..n`, near nodes at `nodes`, far ones `far` behind.
///
/// All three axes (and one that stands still) are done at a time.
pub(super) struct Runs<'a, const N: usize> {
    /// In macrocells: the first node, the change from node to node, and where positions end.
    origin: [f32; 4],
    change: [f32; 4],
    last: [f32; 4],
    /// Reciprocal of the change; 0 where there is none, and then the exit is infinitely far.
    inverse: [f32; 4],
    never: [f32; 4],
    /// 1 where nodes move up, -1 where they move down.
    sign: [f32; 4],
    far: f32,
    /// Distances of the brick's macrocells to the nearest visible one.
    distances: &'a [u8],
    at: i64,
    n: i64,
}

impl<'a, const N: usize> Runs<'a, N> {
    const N_MACROCELLS: usize = N / MACROCELL_SIDE as usize;

    #[inline(always)]
    pub(super) fn new(nodes: &Nodes, far: f32, distances: &'a [u8], n: i64) -> Self {
        let macrocells = |v: [f32; 3]| [v[0], v[1], v[2], 0.0].map(|x| x * (1.0 / MACROCELL_SIDE as f32));
        let change = macrocells(nodes.change);
        Runs {
            origin: macrocells(nodes.origin),
            change,
            last: macrocells(nodes.last),
            inverse: change.map(|c| if c == 0.0 { 0.0 } else { 1.0 / c }),
            never: change.map(|c| if c == 0.0 { f32::INFINITY } else { 0.0 }),
            sign: change.map(|c| if c > 0.0 { 1.0 } else { -1.0 }),
            far,
            distances: &distances[..Self::N_MACROCELLS.pow(3)],
            at: 0,
            n,
        }
    }

    /// Whether segment `j` is dark, and the first segment behind it that may not be like it.
    #[inline(always)]
    fn stretch(&self, j: i64) -> (bool, i64) {
        let n = Self::N_MACROCELLS;
        let (mut index, mut place) = ([0u32; 4], [0f32; 4]);
        for axis in 0..4 {
            let s = self.origin[axis] + self.change[axis] * j as f32;
            // A node on a face belongs to the macrocells on both sides.
            (index[axis], place[axis]) = floor_bits(at_least(at_most(s, self.last[axis]), 0.0));
            index[axis] &= n as u32 - 1;
        }
        let i = index[0] as usize + n * (index[1] as usize + n * index[2] as usize);
        let distance = self.distances[i];
        let reach = f32::from(distance.max(1)) - 0.5;
        let mut exits = [0f32; 4];
        for axis in 0..4 {
            let face = place[axis] + 0.5 + self.sign[axis] * reach;
            let exit = (face - self.origin[axis]) * self.inverse[axis] + self.never[axis];
            // The brick's own faces end the run anyway.
            exits[axis] = if face > 0.0 && face < n as f32 { exit } else { f32::INFINITY };
        }
        let exit = at_most(at_most(exits[0], exits[1]), exits[2]);
        if distance == 0 {
            return (false, ceil(exit).max(j + 1));
        }
        let next = ceil(exit - self.far);
        if next > j { (true, next) } else { (self.far == 0.0, j + 1) }
    }
}

/// The least integer not below; at most 2^31.
#[inline(always)]
fn ceil(x: f32) -> i64 {
    let x = at_most(x, 2_147_483_520.0);
    let down = x as i32;
    i64::from(down) + i64::from((down as f32) < x)
}

impl<const N: usize> Iterator for Runs<'_, N> {
    type Item = (i64, i64);

    #[inline(always)]
    fn next(&mut self) -> Option<(i64, i64)> {
        let mut from = None;
        while self.at < self.n {
            let (is_dark, next) = self.stretch(self.at);
            match (is_dark, from) {
                (true, Some(from)) => return Some((from, self.at)),
                (false, None) => from = Some(self.at),
                _ => {}
            }
            self.at = next.min(self.n);
        }
        from.map(|from| (from, self.n))
    }
}
