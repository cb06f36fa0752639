//! One axis of the hierarchy: how many zones it has at each level, and which zones lie below which.

use std::ops::Range;

use brickfield_core::Level;

/// The zones along one axis, at every level.
///
/// An axis of n final zones is split floor(log2 n) times, at the finest levels: level l + 1 has half of level l's zones, rounded down.
/// Where level l has an odd number of zones, the last zone of level l + 1 has three children in place of two: a slop zone
/// (Wynn et al. 1999, section 2.2, figure 3). Above those levels the axis has one zone.
///
/// ```text
/// level 0   | 0 | 1 | 2 | 3 | 4 | 5 | 6 |      7 final zones
/// level 1   |   0   |   1   |     2     |      zone 2 is a slop zone
/// level 2   |             0             |      3 zones in level 1: this one is a slop zone, too
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SplitAxis {
    n_final: u32,
    n_splits: u8,
}

impl SplitAxis {
    /// An axis of `n_final` final zones; 0 counts as 1.
    pub fn new(n_final: u32) -> SplitAxis {
        let n_final = n_final.max(1);
        SplitAxis { n_final, n_splits: n_final.ilog2() as u8 }
    }

    /// Zones along the axis at level 0.
    #[inline]
    pub fn n_final(&self) -> u32 {
        self.n_final
    }

    /// How many levels split this axis.
    pub fn n_splits(&self) -> u8 {
        self.n_splits
    }

    /// Zones along the axis at a level; 1 above the levels that split it.
    #[inline]
    pub fn n(&self, level: Level) -> u32 {
        self.n_final >> self.shift(level)
    }

    /// Whether a zone of `level` is split along this axis: the flag of section 2.2.
    pub fn is_split(&self, level: Level) -> bool {
        (1..=self.n_splits).contains(&level.0)
    }

    /// Whether the last zone of `level` has three children along this axis: the slop flag.
    pub fn has_slop(&self, level: Level) -> bool {
        self.is_split(level) && self.n(Level(level.0 - 1)) % 2 == 1
    }

    /// The zones of the level below that lie in zone `i` of `level`: one, two, or three. None at level 0.
    #[inline]
    pub fn children(&self, level: Level, i: u32) -> Range<u32> {
        match level.0 {
            0 => 0..0,
            _ if !self.is_split(level) => i..i + 1,
            l if i + 1 == self.n(level) => 2 * i..self.n(Level(l - 1)),
            _ => 2 * i..2 * i + 2,
        }
    }

    /// The zone of the level above in which zone `i` of `level` lies.
    #[inline]
    pub fn parent(&self, level: Level, i: u32) -> u32 {
        let above = Level(level.0 + 1);
        (i >> (self.shift(above) - self.shift(level))).min(self.n(above) - 1)
    }

    /// The final zones that lie in zone `i` of `level`.
    #[inline]
    pub fn descendants(&self, level: Level, i: u32) -> Range<u32> {
        let shift = self.shift(level);
        let end = if i + 1 == self.n(level) { self.n_final } else { (i + 1) << shift };
        i << shift..end
    }

    /// The zone of `level` in which a final zone lies.
    #[inline]
    pub fn ancestor(&self, level: Level, final_zone: u32) -> u32 {
        (final_zone >> self.shift(level)).min(self.n(level) - 1)
    }

    /// The splits between `level` and the final zones.
    #[inline]
    fn shift(&self, level: Level) -> u8 {
        level.0.min(self.n_splits)
    }
}
