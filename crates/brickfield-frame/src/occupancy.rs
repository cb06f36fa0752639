//! Which parts of bricks may show, so that rays leap over the rest.

use std::sync::Arc;

use brickfield_core::BrickSide;
use rayon::prelude::*;

use crate::chebyshev;

/// Cells along a macrocell's side, whatever the brick's level: 8^3 macrocells in a brick of 16^3 samples, 32^3 in one of 64^3.
pub const MACROCELL_SIDE: u32 = 2;

/// How far each macrocell of each brick is from the nearest one of its brick that is not like it, visible or dark: in
/// macrocells along the axis on which they are farthest apart (Chebyshev; the distance maps of Deakin and Knoll 2019).
///
/// d > 0: all macrocells of the brick less than d away are dark, that is, the transfer function is 0 over the range of their
/// samples, so that passing over them changes no sample. d < 0: all less than -d away are visible, so that nobody need look
/// again there. No distance is 0; in a brick of one kind all are as far as the brick is wide.
///
/// Maps are compared by identity ([`Held`](crate::Held)) to tell whether a backend holds them already.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Occupancy {
    side: BrickSide,
    distances: Vec<i8>,
}

impl Occupancy {
    /// Macrocells along a brick's side.
    pub const fn n_macrocells(side: BrickSide) -> u32 {
        side.n_samples() / MACROCELL_SIDE
    }

    /// Whether a map of so many bricks fits the storage buffers that every Vulkan device has: 128 MiB.
    ///
    /// Of more bricks no map is made: their rays pass over dark bricks only.
    pub const fn fits(side: BrickSide, n_bricks: u32) -> bool {
        (Occupancy::n_macrocells(side) as u64).pow(3) * n_bricks as u64 <= 1 << 27
    }

    /// The map of bricks of which it is known what is visible: macrocell after macrocell, x fastest, brick after brick.
    ///
    /// `None` if everything is visible: then there is nothing to leap over.
    ///
    /// # Panics
    /// If the macrocells are not those of whole bricks.
    pub fn new(side: BrickSide, visible: &[bool]) -> Option<Arc<Occupancy>> {
        let n = Occupancy::n_macrocells(side) as usize;
        assert!(visible.len().is_multiple_of(n.pow(3)), "{} macrocells are not whole bricks", visible.len());
        if visible.iter().all(|v| *v) {
            return None;
        }
        let mut distances = vec![0; visible.len()];
        let bricks = distances.par_chunks_exact_mut(n.pow(3)).zip(visible.par_chunks_exact(n.pow(3)));
        bricks.for_each(|(out, visible)| of_brick(visible, n, out));
        Some(Arc::new(Occupancy { side, distances }))
    }

    /// The distances of one brick's macrocells, x fastest.
    #[inline]
    pub fn brick(&self, slot: u32) -> &[i8] {
        let n = (Occupancy::n_macrocells(self.side) as usize).pow(3);
        &self.distances[slot as usize * n..][..n]
    }

    /// All distances, brick after brick; a multiple of 512.
    pub fn distances(&self) -> &[i8] {
        &self.distances
    }
}

/// The distances of the macrocells of one brick, `n` along a side.
fn of_brick(visible: &[bool], n: usize, out: &mut [i8]) {
    let far = n as u8;
    let to = |kind: bool| {
        let mut distances: Vec<u8> = visible.iter().map(|v| if *v == kind { 0 } else { far }).collect();
        chebyshev::spread(&mut distances, [n; 3], far);
        distances
    };
    let (to_visible, to_dark) = (to(true), to(false));
    for (out, (visible, dark)) in out.iter_mut().zip(to_visible.into_iter().zip(to_dark)) {
        // One of them is 0; n is at most 32.
        *out = visible as i8 - dark as i8;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::glam::UVec3;

    #[test]
    fn distances_are_those_of_a_search() {
        [BrickSide::S16, BrickSide::S32].into_iter().for_each(check_distances);
    }

    fn check_distances(side: BrickSide) {
        let n = Occupancy::n_macrocells(side);
        let cells: Vec<UVec3> = (0..n * n * n).map(|i| UVec3::new(i % n, i / n % n, i / n / n)).collect();
        // Few visible ones in the first brick, few dark ones in the second.
        let rare = |c: &UVec3| (c.x * 31 + c.y * 17 + c.z * 7).is_multiple_of(97);
        let visible: Vec<bool> = [true, false].iter().flat_map(|v| cells.iter().map(move |c| rare(c) == *v)).collect();
        let map = Occupancy::new(side, &visible).unwrap();
        for (slot, visible) in visible.chunks(cells.len()).enumerate() {
            for ((a, is_visible), d) in cells.iter().zip(visible).zip(map.brick(slot as u32)) {
                let far = |b: &UVec3| (a.as_ivec3() - b.as_ivec3()).abs().max_element() as i8;
                let others = cells.iter().zip(visible).filter(|(_, v)| *v != is_visible);
                let nearest = others.map(|(b, _)| far(b)).min().unwrap();
                assert_eq!(*d, if *is_visible { -nearest } else { nearest });
            }
        }
    }

    #[test]
    fn maps_of_more_than_a_gibivoxel_do_not_fit_everywhere() {
        for side in [BrickSide::S16, BrickSide::S32, BrickSide::S64] {
            let n_bricks = (1u32 << 30) / side.n_samples().pow(3);
            assert!(Occupancy::fits(side, n_bricks) && !Occupancy::fits(side, n_bricks + 1));
        }
    }

    #[test]
    fn where_nothing_is_visible_the_whole_brick_is_passed_over() {
        let map = Occupancy::new(BrickSide::S16, &[false; 512]).unwrap();
        assert!(map.distances().iter().all(|d| *d == 8));
        assert_eq!(Occupancy::new(BrickSide::S16, &[true; 1024]), None);
    }
}
