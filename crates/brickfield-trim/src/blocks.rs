//! Flat blocks whose values are blended with those of their neighbours.

use std::cmp::Ordering;

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Axes, BlockLayout, Level, Place, ValueRange};
use rayon::prelude::*;

use crate::keep::{box_of, ends};
use crate::slices::union;
use crate::{DarkValues, MinMaxArrays, SampleBox};

/// Why flat blocks cannot be trimmed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum BlocksError {
    #[error("{n_found} {what}; the layout has {n_blocks} blocks")]
    Count { what: &'static str, n_found: usize, n_blocks: usize },
    #[error("block ({}, {}, {}) is at level {}; blocks of {side} voxels have levels 0 to {}", block.x, block.y, block.z, level.0, coarsest.0)]
    Level { block: UVec3, level: Level, side: u32, coarsest: Level },
    #[error("block ({}, {}, {}) has {} x {} x {} slices; at level {} it has {} x {} x {} samples", block.x, block.y, block.z, n_slices.x, n_slices.y, n_slices.z, level.0, n.x, n.y, n.z)]
    Slices { block: UVec3, level: Level, n_slices: UVec3, n: UVec3 },
}

/// What is kept of each flat block, in its own samples, where values between blocks are blended (Ljung, Lundstroem and Ynnerman 2006,
/// section 3.2; all three schemes). Levels and min-max arrays by [`BlockLayout::ordinal`].
///
/// A gap between two slices of a block is empty if all values are dark that a blend there may have: those of the block, and those of
/// the up to 26 blocks around it at the same place. So is the gap between the block's outer slice and its neighbour's:
///
/// ```text
///         block 0            |            block 1
///     o     o     o     o    |       x               x
///                       ^------------^                     the last gap of block 0 and the first of block 1
///                            ^-------^---------------^     blends of block 2, above, with samples of block 1
/// ```
///
/// Where nothing is kept of a block, its neighbours' blends need one value of it: any value of its range. Elsewhere a position beyond the
/// kept box is moved to it. Blends with such values are dark wherever the values differ from those of the whole blocks.
///
/// Without blending (the nearest block alone) each block is trimmed by [`kept_box`](crate::kept_box).
///
/// # Errors
/// If there is not one level and one set of arrays for each block, if a level is too coarse, or if arrays have not a block's slices.
pub fn trim_blocks(
    layout: &BlockLayout,
    levels: &[Level],
    arrays: &[MinMaxArrays],
    dark: &DarkValues,
) -> Result<Vec<SampleBox>, BlocksError> {
    check(layout, levels, arrays)?;
    let blocks = Blocks { layout, levels, arrays, dark };
    Ok((0..arrays.len()).into_par_iter().map(|ordinal| blocks.kept_box(layout.block(ordinal))).collect())
}

/// The place of the kept samples of a flat block, from a texel on, whose texture runs along the axes of space.
///
/// # Panics
/// If nothing is kept, or the block has not these samples at this level.
pub fn block_place(layout: &BlockLayout, block: UVec3, level: Level, kept: &SampleBox, texel: UVec3) -> Place {
    let (n, end) = (layout.n_samples(block, level), kept.first + kept.n);
    assert!(!kept.is_empty() && end.cmple(n).all(), "{kept:?} of a block of {n} samples");
    let (first, last) = layout.sample_ends(block, level);
    let position = |sample: UVec3| {
        let before_last = first + sample.as_dvec3() * f64::from(level.stride());
        DVec3::select((sample + 1).cmpeq(n), last, before_last)
    };
    Place { texel, n: kept.n, level, first: position(kept.first), last: position(end - 1), axes: Axes::Xyz }
}

fn check(layout: &BlockLayout, levels: &[Level], arrays: &[MinMaxArrays]) -> Result<(), BlocksError> {
    let n_blocks = layout.n_blocks_total();
    for (what, n_found) in [("levels", levels.len()), ("min-max arrays", arrays.len())] {
        if n_found != n_blocks {
            return Err(BlocksError::Count { what, n_found, n_blocks });
        }
    }
    let coarsest = layout.side().one_sample();
    for ((block, &level), of_block) in layout.blocks().zip(levels).zip(arrays) {
        if level > coarsest {
            return Err(BlocksError::Level { block, level, side: layout.side().n_voxels(), coarsest });
        }
        let (n_slices, n) = (of_block.n_slices(), layout.n_samples(block, level));
        if n_slices != n {
            return Err(BlocksError::Slices { block, level, n_slices, n });
        }
    }
    Ok(())
}

struct Blocks<'a> {
    layout: &'a BlockLayout,
    levels: &'a [Level],
    arrays: &'a [MinMaxArrays],
    dark: &'a DarkValues,
}

/// A closed interval of positions along an axis, in sample space.
#[derive(Clone, Copy)]
struct Stretch {
    from: f64,
    to: f64,
}

/// Where the slices of a block lie along an axis; the last gap may be shorter than the others.
#[derive(Clone, Copy)]
struct Row {
    first: f64,
    last: f64,
    stride: f64,
    n: usize,
}

impl Row {
    fn position(&self, slice: usize) -> f64 {
        if slice + 1 == self.n { self.last } else { self.first + slice as f64 * self.stride }
    }
}

impl Blocks<'_> {
    fn kept_box(&self, block: UVec3) -> SampleBox {
        let around: Vec<UVec3> = self.around(block).collect();
        let all = around.iter().map(|b| self.arrays(*b).range()).reduce(ValueRange::union);
        if all.is_some_and(|range| self.dark.covers(range)) {
            return SampleBox::EMPTY;
        }
        box_of([0, 1, 2].map(|axis| {
            let last = self.arrays(block).along(axis).len() - 1;
            // Gap g lies before slice g.
            let is_dark = |gap: usize| self.dark.covers(self.values(&around, block, axis, gap));
            let [from, to] = ends(last + 2, is_dark)?;
            Some([from.saturating_sub(1), last.min(to)])
        }))
    }

    /// All values that a blend with `block` may have in a gap: those of the blocks around it at the positions of the gap.
    fn values(&self, around: &[UVec3], block: UVec3, axis: usize, gap: usize) -> ValueRange {
        let stretch = self.stretch(block, axis, gap);
        // Past the samples of the block before it, on this axis, a block counts; as far as those of the block behind it.
        let may_count = |other: &UVec3| {
            let mut beside = *other;
            beside[axis] = block[axis];
            match other[axis].cmp(&block[axis]) {
                Ordering::Less => stretch.from < self.row(beside, axis).first,
                Ordering::Equal => true,
                Ordering::Greater => stretch.to > self.row(beside, axis).last,
            }
        };
        let own = self.slices_at(block, axis, stretch);
        around.iter().filter(|b| may_count(b)).map(|b| self.slices_at(*b, axis, stretch)).fold(own, ValueRange::union)
    }

    /// Where a gap lies along an axis: between two slices, or from an outer slice to the neighbour's, or to the volume's end.
    fn stretch(&self, block: UVec3, axis: usize, gap: usize) -> Stretch {
        let own = self.row(block, axis);
        let mut beside = block;
        let from = match gap {
            0 if block[axis] == 0 => f64::NEG_INFINITY,
            0 => {
                beside[axis] -= 1;
                self.row(beside, axis).last
            }
            _ => own.position(gap - 1),
        };
        let to = match gap {
            _ if gap < own.n => own.position(gap),
            _ if block[axis] + 1 == self.layout.n_blocks()[axis] => f64::INFINITY,
            _ => {
                beside[axis] = block[axis] + 1;
                self.row(beside, axis).first
            }
        };
        Stretch { from, to }
    }

    /// The values of the slices of a block that interpolation reads in a stretch, which is limited to the block's samples.
    fn slices_at(&self, block: UVec3, axis: usize, stretch: Stretch) -> ValueRange {
        let (slices, row) = (self.arrays(block).along(axis), self.row(block, axis));
        let first = (0..row.n).rfind(|i| row.position(*i) <= stretch.from).unwrap_or(0);
        let last = (first..row.n).find(|i| row.position(*i) >= stretch.to).unwrap_or(row.n - 1);
        union(&slices[first..=last])
    }

    fn row(&self, block: UVec3, axis: usize) -> Row {
        let level = self.level(block);
        let (first, last) = self.layout.sample_ends(block, level);
        let n = self.arrays(block).along(axis).len();
        Row { first: first[axis], last: last[axis], stride: f64::from(level.stride()), n }
    }

    /// The block and all that touch it.
    fn around(&self, block: UVec3) -> impl Iterator<Item = UVec3> {
        let (from, to) = (block.saturating_sub(UVec3::ONE), (block + 1).min(self.layout.n_blocks() - 1));
        (from.z..=to.z)
            .flat_map(move |z| (from.y..=to.y).flat_map(move |y| (from.x..=to.x).map(move |x| UVec3::new(x, y, z))))
    }

    fn level(&self, block: UVec3) -> Level {
        self.levels[self.layout.ordinal(block)]
    }

    fn arrays(&self, block: UVec3) -> &MinMaxArrays {
        &self.arrays[self.layout.ordinal(block)]
    }
}
