//! Blocks of all resolutions in one texture, without gaps.

use std::collections::BTreeSet;

use brickfield_core::glam::UVec3;
use brickfield_core::{BlockSide, Level};

/// Which texels of a texture are taken by blocks (Ljung, Lundstroem and Ynnerman 2006, section 4, figure 6).
///
/// The texture is cut into cubes of a block's side; a cube holds one block of level 0, or eight of level 1, and so on down to
/// one sample:
///
/// ```text
/// +-------+-------+
/// |       | 1 | 1 |    0: a block of level 0
/// |   0   |---+---|    1: blocks of level 1
/// |       | 1 |2|2|    2: blocks of level 2
/// |       |   |2| |
/// +-------+-------+
/// ```
///
/// A block that is short at the volume's upper end takes the cube of its longest side.
#[derive(Clone, Debug)]
pub struct Packing {
    side: BlockSide,
    /// Cubes along x and y, and how many layers of them are in use.
    columns: u32,
    rows: u32,
    n_opened: u32,
    /// For each level, the first texels of cubes that are free, as z, y, x.
    free: Vec<BTreeSet<[u32; 3]>>,
}

impl Packing {
    /// An empty texture whose layers have room for `n_cubes` in all if it were a cube, at most `max_texels` along x and y.
    pub fn new(side: BlockSide, n_cubes: u64, max_texels: u32) -> Packing {
        let most = (max_texels / side.n_voxels()).max(1);
        let columns = ((n_cubes as f64).cbrt().ceil() as u32).clamp(1, most);
        let rows = ((n_cubes as f64 / f64::from(columns)).sqrt().ceil() as u32).clamp(1, most);
        let free = side.levels().map(|_| BTreeSet::new()).collect();
        Packing { side, columns, rows, n_opened: 0, free }
    }

    /// The texture's size: as many layers as are in use, at least one.
    pub fn texels(&self) -> UVec3 {
        let layers = self.n_opened.div_ceil(self.columns * self.rows).max(1);
        UVec3::new(self.columns, self.rows, layers) * self.side.n_voxels()
    }

    /// Takes the texels of a block of a level: its first one. The texture grows along z where none is free.
    ///
    /// # Panics
    /// If the level is beyond one sample.
    pub fn take(&mut self, level: Level) -> UVec3 {
        if let Some([z, y, x]) = self.free[usize::from(level.0)].pop_first() {
            return UVec3::new(x, y, z);
        }
        if level == Level(0) {
            let i = self.n_opened;
            self.n_opened += 1;
            let cube = UVec3::new(i % self.columns, i / self.columns % self.rows, i / (self.columns * self.rows));
            return cube * self.side.n_voxels();
        }
        let texel = self.take(Level(level.0 - 1));
        let side = self.side_of(level);
        self.free[usize::from(level.0)].extend((1..8).map(|c| key(texel + corner(c) * side)));
        texel
    }

    /// Gives back the texels of a block of a level. Eight free cubes become one.
    pub fn give_back(&mut self, level: Level, texel: UVec3) {
        let side = self.side_of(level);
        let free = &mut self.free[usize::from(level.0)];
        if level == Level(0) {
            free.insert(key(texel));
            return;
        }
        let parent = texel / (2 * side) * (2 * side);
        let mut others = (0..8).map(|c| parent + corner(c) * side).filter(|t| *t != texel);
        if !others.all(|t| free.contains(&key(t))) {
            free.insert(key(texel));
            return;
        }
        (0..8).for_each(|c| {
            free.remove(&key(parent + corner(c) * side));
        });
        self.give_back(Level(level.0 - 1), parent);
    }

    /// Texels that are free.
    pub fn n_free(&self) -> u64 {
        let opened = u64::from(self.n_opened) * u64::from(self.side.n_voxels()).pow(3);
        let unopened = self.texels().as_u64vec3().element_product() - opened;
        let in_cubes = |(level, cubes): (usize, &BTreeSet<_>)| {
            cubes.len() as u64 * u64::from(self.side_of(Level(level as u8))).pow(3)
        };
        unopened + self.free.iter().enumerate().map(in_cubes).sum::<u64>()
    }

    fn side_of(&self, level: Level) -> u32 {
        self.side.n_voxels() >> level.0
    }
}

fn corner(c: u32) -> UVec3 {
    UVec3::new(c & 1, c >> 1 & 1, c >> 2)
}

fn key(texel: UVec3) -> [u32; 3] {
    [texel.z, texel.y, texel.x]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn blocks_do_not_overlap_and_leave_no_gaps(
            turns in prop::collection::vec((0..5u8, any::<prop::sample::Index>(), any::<bool>()), 1..200)
        ) {
            let side = BlockSide::V16;
            let mut packing = Packing::new(side, 8, 64);
            let mut held: Vec<(Level, UVec3)> = Vec::new();
            for (level, which, gives) in turns {
                match gives && !held.is_empty() {
                    true => {
                        let (level, texel) = held.swap_remove(which.index(held.len()));
                        packing.give_back(level, texel);
                    }
                    false => held.push((Level(level), packing.take(Level(level)))),
                }
            }
            let n = |level: Level| 16 >> level.0;
            for (i, (a, p)) in held.iter().enumerate() {
                prop_assert!((*p + n(*a)).cmple(packing.texels()).all() && *p % n(*a) == UVec3::ZERO);
                let apart = |(b, q): &(Level, UVec3)| (*p + n(*a)).cmple(*q).any() || (*q + n(*b)).cmple(*p).any();
                prop_assert!(held[i + 1..].iter().all(apart));
            }
            let taken: u64 = held.iter().map(|(level, _)| u64::from(n(*level)).pow(3)).sum();
            prop_assert_eq!(packing.n_free() + taken, packing.texels().as_u64vec3().element_product());
            held.iter().for_each(|(level, texel)| packing.give_back(*level, *texel));
            prop_assert!(packing.free[1..].iter().all(BTreeSet::is_empty), "free cubes became whole ones");
        }
    }
}
