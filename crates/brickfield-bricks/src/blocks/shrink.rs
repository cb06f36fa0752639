//! From the voxels of one block to its averages, with exact sums.

use std::ops::{Add, AddAssign};

use brickfield_core::glam::UVec3;
use brickfield_core::{BlockLayout, Level};

use crate::mean::{add_pairs, nearest};
use crate::sample::BrickScalar;

/// The most voxels in a block, 32^3.
const MAX_VOXELS: f64 = 32_768.0;

/// A scalar whose averages over a block are known from sums.
pub(crate) trait BlockScalar: BrickScalar {
    /// Holds the sum of 32^3 values: exact for integers.
    type Total: Copy + Default + Add<Output = Self::Total> + AddAssign + Send;
    fn total(self) -> Self::Total;
    /// The mean of `n` values, to f64 rounding.
    fn mean(total: Self::Total, n: u32) -> f64;
    /// The mean of `n` values rounded once; integer halves go up.
    fn rounded_mean(total: Self::Total, n: u32) -> Self;
}

macro_rules! integers {
    ($($t:ident $total:ident;)*) => { $(
        impl BlockScalar for $t {
            type Total = $total;
            #[inline]
            fn total(self) -> $total { $total::from(self) }
            #[inline]
            fn mean(total: $total, n: u32) -> f64 { total as f64 / f64::from(n) }
            #[inline]
            fn rounded_mean(total: $total, n: u32) -> $t { nearest(total as i64, i64::from(n)) as $t }
        }
    )* };
}
integers! { u8 u32; i8 i32; u16 u32; i16 i32; u32 u64; i32 i64; }

impl BlockScalar for f32 {
    type Total = f64;
    #[inline]
    fn total(self) -> f64 {
        f64::from(self)
    }
    #[inline]
    fn mean(total: f64, n: u32) -> f64 {
        total / f64::from(n)
    }
    #[inline]
    fn rounded_mean(total: f64, n: u32) -> f32 {
        (total / f64::from(n)) as f32
    }
}

/// Scaled down by a power of two, so that no sum overflows.
impl BlockScalar for f64 {
    type Total = f64;
    #[inline]
    fn total(self) -> f64 {
        self / MAX_VOXELS
    }
    #[inline]
    fn mean(total: f64, n: u32) -> f64 {
        total / f64::from(n) * MAX_VOXELS
    }
    #[inline]
    fn rounded_mean(total: f64, n: u32) -> f64 {
        f64::mean(total, n)
    }
}

/// The voxels of one block, in the rows of the volume.
#[derive(Clone, Copy)]
pub(crate) struct BlockVoxels<'a, T> {
    voxels: &'a [T],
    dims: UVec3,
    first: UVec3,
    extent: UVec3,
}

impl<'a, T: Copy> BlockVoxels<'a, T> {
    pub(crate) fn new(voxels: &'a [T], layout: &BlockLayout, block: UVec3) -> BlockVoxels<'a, T> {
        BlockVoxels { voxels, dims: layout.dims(), first: layout.first_voxel(block), extent: layout.extent(block) }
    }

    pub(crate) fn extent(&self) -> UVec3 {
        self.extent
    }

    pub(crate) fn n_voxels(&self) -> u32 {
        self.extent.element_product()
    }

    /// The least and the greatest voxel.
    pub(crate) fn ends(&self) -> (T, T)
    where
        T: PartialOrd,
    {
        const LANES: usize = 8;
        let first = self.rows().next().map_or(self.voxels[0], |row| row[0]);
        let (mut least, mut greatest) = ([first; LANES], [first; LANES]);
        for row in self.rows() {
            for (i, v) in row.iter().enumerate() {
                least[i % LANES] = least_of(least[i % LANES], *v);
                greatest[i % LANES] = greatest_of(greatest[i % LANES], *v);
            }
        }
        (least.into_iter().fold(first, least_of), greatest.into_iter().fold(first, greatest_of))
    }

    /// The rows of the block along x: y fastest, then z.
    pub(crate) fn rows(&self) -> impl Iterator<Item = &'a [T]> + use<'a, T> {
        let BlockVoxels { voxels, dims, first, extent } = *self;
        let [nx, ny] = [dims.x as usize, dims.y as usize];
        (0..extent.y * extent.z).map(move |row| {
            let [y, z] = [first.y + row % extent.y, first.z + row / extent.y].map(|i| i as usize);
            let start = first.x as usize + nx * (y + ny * z);
            &voxels[start..start + extent.x as usize]
        })
    }
}

/// Sums of a block's voxels over the samples of one level, x fastest.
pub(crate) struct Totals<T: BlockScalar> {
    level: Level,
    extent: UVec3,
    totals: Vec<T::Total>,
}

impl<T: BlockScalar> Totals<T> {
    /// The sums of level 1.
    pub(crate) fn of_voxels(block: BlockVoxels<'_, T>) -> Totals<T> {
        let extent = block.extent();
        let n = halved(extent);
        let mut totals = vec![T::Total::default(); n.element_product() as usize];
        add_rows(block.rows(), extent, T::total, &mut totals);
        Totals { level: Level(1), extent, totals }
    }

    /// The sums of the next level.
    pub(crate) fn next(&self) -> Totals<T> {
        let n = self.n_samples();
        let mut totals = vec![T::Total::default(); halved(n).element_product() as usize];
        add_rows(self.totals.chunks_exact(n.x as usize), n, |total| total, &mut totals);
        Totals { level: Level(self.level.0 + 1), extent: self.extent, totals }
    }

    pub(crate) fn level(&self) -> Level {
        self.level
    }

    fn n_samples(&self) -> UVec3 {
        self.level.dims_of(self.extent)
    }

    /// Each sum, x fastest, with the number of voxels in it.
    #[inline]
    pub(crate) fn each(&self, mut visit: impl FnMut(T::Total, u32)) {
        let (n, stride) = (self.n_samples(), self.level.stride());
        let covered = |axis: usize, i: u32| stride.min(self.extent[axis] - i * stride);
        for (row, totals) in self.totals.chunks_exact(n.x as usize).enumerate() {
            let n_rows = covered(1, row as u32 % n.y) * covered(2, row as u32 / n.y);
            for (x, total) in totals.iter().enumerate() {
                visit(*total, n_rows * covered(0, x as u32));
            }
        }
    }

    /// Writes the means of this level to the start of `out`, and returns its rest.
    ///
    /// Each lies between `least` and `greatest`: a mean of floats may leave the range of its values by a rounding.
    pub(crate) fn write_means<'a>(&self, least: T, greatest: T, out: &'a mut [T]) -> &'a mut [T] {
        let (means, rest) = out.split_at_mut(self.totals.len());
        let mut places = means.iter_mut();
        self.each(|total, n| {
            let mean = T::rounded_mean(total, n);
            if let Some(place) = places.next() {
                *place = greatest_of(least, least_of(greatest, mean));
            }
        });
        rest
    }

    /// The mean of all voxels of the block.
    pub(crate) fn mean(&self) -> f64 {
        let total = self.totals.iter().fold(T::Total::default(), |sum, total| sum + *total);
        T::mean(total, self.extent.element_product())
    }
}

#[inline]
fn least_of<T: PartialOrd>(a: T, b: T) -> T {
    if b < a { b } else { a }
}

#[inline]
fn greatest_of<T: PartialOrd>(a: T, b: T) -> T {
    if b > a { b } else { a }
}

fn halved(n: UVec3) -> UVec3 {
    n.map(|n| n.div_ceil(2))
}

/// Adds rows (y fastest, `n` samples in all) to half as many along each axis.
#[inline]
fn add_rows<'a, S: Copy + 'a, A: Copy + AddAssign>(
    rows: impl Iterator<Item = &'a [S]>,
    n: UVec3,
    widen: impl Fn(S) -> A,
    totals: &mut [A],
) {
    let half = halved(n);
    for (row, samples) in rows.enumerate() {
        let [y, z] = [row as u32 % n.y / 2, row as u32 / n.y / 2];
        let start = (half.x * (y + half.y * z)) as usize;
        add_pairs(samples, &widen, &mut totals[start..start + half.x as usize]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_of_the_most_voxels_are_held() {
        assert_eq!(u16::rounded_mean(32_768 * 65_535, 32_768), 65_535);
        assert_eq!(u32::rounded_mean(32_767 * 4_294_967_295, 32_767), u32::MAX);
    }
}
