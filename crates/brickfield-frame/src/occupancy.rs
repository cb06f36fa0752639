//! Which parts of bricks may show, so that rays leap over the rest.

use std::sync::Arc;

use brickfield_core::{BrickSide, glam::UVec3};

/// Cells along a macrocell's side, whatever the brick's level: 4^3 macrocells in a brick of 16^3 samples, 16^3 in one of 64^3.
pub const MACROCELL_SIDE: u32 = 4;

/// How far each macrocell of each brick is from the nearest visible one of its brick, in macrocells along the axis on which
/// they are farthest apart (Chebyshev; the distance maps of Deakin and Knoll 2019).
///
/// 0: the macrocell is visible. d: all macrocells of the brick less than d away are dark, that is, the transfer function is 0 over
/// the range of their samples, so that passing over them changes no sample.
///
/// Maps are compared by identity ([`Arc::ptr_eq`]) to tell whether a backend holds them already.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Occupancy {
    side: BrickSide,
    distances: Vec<u8>,
}

impl Occupancy {
    /// Macrocells along a brick's side.
    pub const fn n_macrocells(side: BrickSide) -> u32 {
        side.n_samples() / MACROCELL_SIDE
    }

    /// The map of bricks of which it is known what is visible: macrocell after macrocell, x fastest, brick after brick.
    ///
    /// `None` if everything is visible: then there is nothing to leap over.
    ///
    /// # Panics
    /// If the macrocells are not those of whole bricks.
    pub fn new(side: BrickSide, visible: &[bool]) -> Option<Arc<Occupancy>> {
        let n = Occupancy::n_macrocells(side) as usize;
        assert!(visible.len().is_multiple_of(n * n * n), "{} macrocells are not whole bricks", visible.len());
        if visible.iter().all(|v| *v) {
            return None;
        }
        let mut distances: Vec<u8> = visible.iter().map(|v| if *v { 0 } else { n as u8 }).collect();
        distances.chunks_exact_mut(n * n * n).for_each(|brick| spread(brick, n));
        Some(Arc::new(Occupancy { side, distances }))
    }

    /// The distances of one brick's macrocells, x fastest.
    #[inline]
    pub fn brick(&self, slot: u32) -> &[u8] {
        let n = (Occupancy::n_macrocells(self.side) as usize).pow(3);
        &self.distances[slot as usize * n..][..n]
    }

    /// The distance of a macrocell of a brick.
    #[inline]
    pub fn distance(&self, slot: u32, macrocell: UVec3) -> u8 {
        let n = Occupancy::n_macrocells(self.side);
        self.brick(slot)[(macrocell.x + n * (macrocell.y + n * macrocell.z)) as usize]
    }

    /// All distances, brick after brick; a multiple of 64.
    pub fn distances(&self) -> &[u8] {
        &self.distances
    }
}

/// From 0 (visible) and n (dark) to distances: the least over all three axes, one axis after the other.
fn spread(brick: &mut [u8], n: usize) {
    let mut last = [0u8; 4096];
    let last = &mut last[..brick.len()];
    // A step of Chebyshev's metric at a time would take n passes; along lines, the distance is the greater of what is left
    // of the other axes and the way along this one.
    for stride in [1, n, n * n] {
        last.copy_from_slice(brick);
        for (i, distance) in brick.iter_mut().enumerate() {
            let at = i / stride % n;
            let line = i - at * stride;
            let of = |j: usize| last[line + j * stride].max(j.abs_diff(at) as u8);
            *distance = (0..n).map(of).min().unwrap_or(0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_of_a_search() {
        let side = BrickSide::S32;
        let n = Occupancy::n_macrocells(side);
        let cells: Vec<UVec3> = (0..n * n * n).map(|i| UVec3::new(i % n, i / n % n, i / n / n)).collect();
        let visible: Vec<bool> =
            (0..2).flat_map(|b| cells.iter().map(move |c| (c.x * 31 + c.y * 17 + c.z * 7 + b) % 97 == 0)).collect();
        let map = Occupancy::new(side, &visible).unwrap();
        for slot in 0..2 {
            let of_brick = &visible[slot as usize * cells.len()..];
            for a in &cells {
                let far = |b: &UVec3| (a.as_ivec3() - b.as_ivec3()).abs().max_element() as u8;
                let nearest = cells.iter().zip(of_brick).filter(|(_, v)| **v).map(|(b, _)| far(b)).min();
                assert_eq!(Some(map.distance(slot, *a)), nearest);
            }
        }
    }

    #[test]
    fn where_nothing_is_visible_the_whole_brick_is_passed_over() {
        let map = Occupancy::new(BrickSide::S16, &[false; 64]).unwrap();
        assert!(map.distances().iter().all(|d| *d == 4));
        assert_eq!(Occupancy::new(BrickSide::S16, &[true; 128]), None);
    }
}
