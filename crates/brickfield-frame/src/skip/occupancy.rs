//! Which macrocells of bricks are visible, so that rays leap over the dark ones.

use std::sync::Arc;

use brickfield_core::BrickSide;

use crate::{Chunk, Chunked, ContentId};

/// Cells along a macrocell's side, whatever the brick's level: 8^3 macrocells in a brick of 16^3 samples, 32^3 in one of 64^3.
pub const MACROCELL_SIDE: u32 = 2;

/// How far each macrocell of each brick is from the nearest one of its brick of the other kind, visible or dark: in
/// macrocells along the axis on which they are farthest apart (Chebyshev; the distance maps of Deakin and Knoll 2019).
///
/// d > 0: all macrocells of the brick less than d away are dark, that is, the transfer function is 0 over the range of their
/// samples, so that passing over them changes no sample. d < 0: all less than -d away are visible, so that no ray looks
/// again there. No distance is 0; in a brick of one kind each distance is the brick's width.
#[derive(Clone, Debug)]
pub struct Occupancy {
    side: BrickSide,
    bricks: Vec<Option<Arc<Chunk>>>,
    id: ContentId,
}

/// Occupancies are equal if their distances are.
impl PartialEq for Occupancy {
    fn eq(&self, other: &Occupancy) -> bool {
        self.id == other.id || (self.side, &self.bricks) == (other.side, &other.bricks)
    }
}

impl Occupancy {
    /// Macrocells along a brick's side.
    pub const fn n_macrocells(side: BrickSide) -> u32 {
        side.n_samples() / MACROCELL_SIDE
    }

    /// Macrocells in a brick.
    pub const fn n_macrocells_total(side: BrickSide) -> usize {
        (Occupancy::n_macrocells(side) as usize).pow(3)
    }

    /// Whether a map of so many bricks fits the storage buffers that every Vulkan device has: 128 MiB.
    ///
    /// Of more bricks no map is made: their rays pass over dark bricks only.
    pub const fn fits(side: BrickSide, n_bricks: u32) -> bool {
        Occupancy::n_macrocells_total(side) as u64 * n_bricks as u64 <= 1 << 27
    }

    /// The distances in one brick, from the visibility of each macrocell: macrocell after macrocell, x fastest.
    ///
    /// # Panics
    /// If there are not as many macrocells as in a brick.
    pub fn of_brick(side: BrickSide, visible: &[bool]) -> Chunk {
        assert_eq!(visible.len(), Occupancy::n_macrocells_total(side), "macrocells of a brick of {side}");
        let mut distances = vec![0; visible.len()];
        spread(visible, Occupancy::n_macrocells(side) as usize, bytemuck::cast_slice_mut(&mut distances));
        Chunk::new(distances)
    }

    /// The distances in a brick that is visible throughout.
    pub fn of_visible_brick(side: BrickSide) -> Chunk {
        let distance = -(Occupancy::n_macrocells(side) as i8);
        Chunk::new(vec![distance as u8; Occupancy::n_macrocells_total(side)])
    }

    /// The map of bricks by their slots, each [`of_brick`](Self::of_brick).
    ///
    /// `None` if everything is visible: then there is nothing to leap over.
    ///
    /// # Panics
    /// If a brick has not as many distances as a brick has macrocells.
    pub fn new(side: BrickSide, bricks: Vec<Option<Arc<Chunk>>>) -> Option<Arc<Occupancy>> {
        let n = Occupancy::n_macrocells_total(side);
        assert!(bricks.iter().flatten().all(|b| b.bytes().len() == n), "distances of bricks of {side}");
        let any_dark = bricks.iter().flatten().any(|brick| !is_all_visible(side, bytemuck::cast_slice(brick.bytes())));
        any_dark.then(|| Arc::new(Occupancy { side, bricks, id: ContentId::new() }))
    }

    /// Samples along the side of its bricks.
    pub fn side(&self) -> BrickSide {
        self.side
    }

    /// Whether the brick in a slot has distances.
    pub fn has(&self, slot: u32) -> bool {
        self.bricks.get(slot as usize).is_some_and(Option::is_some)
    }

    /// Whether all macrocells of the brick in a slot, which has distances, are visible.
    ///
    /// # Panics
    /// If the slot has none.
    #[inline]
    pub fn is_visible_throughout(&self, slot: u32) -> bool {
        is_all_visible(self.side, self.brick(slot))
    }

    /// The distances of one brick's macrocells, x fastest.
    ///
    /// # Panics
    /// If the slot has none.
    #[inline]
    pub fn brick(&self, slot: u32) -> &[i8] {
        let brick = self.bricks[slot as usize].as_ref().expect("a plan's bricks have distances");
        bytemuck::cast_slice(brick.bytes())
    }
}

impl Chunked for Occupancy {
    fn id(&self) -> ContentId {
        self.id
    }

    fn chunk_bytes(&self) -> usize {
        Occupancy::n_macrocells_total(self.side)
    }

    fn n_chunks(&self) -> usize {
        self.bricks.len()
    }

    fn chunk(&self, i: usize) -> Option<(ContentId, &[u8])> {
        self.bricks[i].as_ref().map(|chunk| (chunk.id(), chunk.bytes()))
    }
}

/// Whether distances are those of a brick that is visible throughout: in all others they are less than the brick's width.
#[inline]
pub(super) fn is_all_visible(side: BrickSide, distances: &[i8]) -> bool {
    i32::from(distances[0]) == -(Occupancy::n_macrocells(side) as i32)
}

/// The distances of the macrocells of one brick, `n` along a side: a multiple of 8, at most 32.
fn spread(visible: &[bool], n: usize, out: &mut [i8]) {
    let dark: Vec<u32> =
        visible.chunks_exact(n).map(|row| row.iter().rev().fold(0, |w, v| w << 1 | u32::from(!v))).collect();
    let whole_row = u32::MAX >> (32 - n);
    let visible = dark.iter().map(|row| row ^ whole_row).collect();
    peel(dark, n, out, i8::wrapping_add);
    peel(visible, n, out, i8::wrapping_sub);
}

/// Counts for each cell of a set how often the set's surface can be taken off until the cell is gone: its distance to the nearest cell
/// that is not in the set; `n` if there is none.
///
/// A word is a row of `n` cells, with bit x for cell x.
///
/// ```text
/// # # # # #        # # # # .        # # # . .
/// # # # # #        # # # . .        # # . . .       4 3 2 1
/// # # # # .   ->   # # . . .   ->   # . . . .       of the last row
/// ```
fn peel(mut set: Vec<u32>, n: usize, out: &mut [i8], count: impl Fn(i8, i8) -> i8) {
    let mut below = vec![0; set.len()];
    for _ in 0..n {
        if set.iter().all(|row| *row == 0) {
            return;
        }
        for (row, out) in set.iter().zip(out.chunks_exact_mut(n)) {
            for (eight, out) in row.to_le_bytes().iter().zip(out.as_chunks_mut::<8>().0) {
                *out = std::array::from_fn(|x| count(out[x], BITS[usize::from(*eight)][x]));
            }
        }
        take_surface_off(&mut set, &mut below, n);
    }
}

/// The bits of each byte, from the lowest on.
const BITS: [[i8; 8]; 256] = {
    let mut bits = [[0; 8]; 256];
    let mut i = 0;
    while i < 256 * 8 {
        bits[i / 8][i % 8] = ((i / 8) >> (i % 8) & 1) as i8;
        i += 1;
    }
    bits
};

/// Leaves the cells whose neighbours in the brick are all in the set.
fn take_surface_off(set: &mut [u32], before: &mut [u32], n: usize) {
    set.iter_mut().for_each(|row| *row &= (*row << 1 | 1) & (*row >> 1 | 1 << (n - 1)));
    for piece in [n, n * n] {
        // Rows of a layer, then layers.
        let stride = piece / n;
        before.copy_from_slice(set);
        for (own, before) in set.chunks_exact_mut(piece).zip(before.chunks_exact(piece)) {
            own[stride..].iter_mut().zip(before).for_each(|(row, other)| *row &= other);
            own.iter_mut().zip(&before[stride..]).for_each(|(row, other)| *row &= other);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::glam::UVec3;

    fn of_bricks(side: BrickSide, visible: &[bool]) -> Option<Arc<Occupancy>> {
        let bricks = visible.chunks(Occupancy::n_macrocells_total(side));
        Occupancy::new(side, bricks.map(|v| Some(Arc::new(Occupancy::of_brick(side, v)))).collect())
    }

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
        let map = of_bricks(side, &visible).unwrap();
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
        let map = of_bricks(BrickSide::S16, &[false; 512]).unwrap();
        assert!(map.brick(0).iter().all(|d| *d == 8));
        assert_eq!(of_bricks(BrickSide::S16, &[true; 1024]), None);
    }
}
