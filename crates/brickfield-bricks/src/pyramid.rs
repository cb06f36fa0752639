//! All levels of a volume, slice by slice: in memory are sums for one slice of each level.

use std::ops::AddAssign;

use brickfield_core::glam::UVec3;
use brickfield_core::{Level, N_BLOCK_LEVELS, Scalar, ScalarType, Voxels, with_voxels};
use rayon::prelude::*;

use crate::mean::{add_pairs, nearest};

/// The coarsest level of a [`Pyramid`]: 64 bits hold the sum of 2^30 voxels of 32 bits.
pub const MAX_PYRAMID_LEVEL: Level = Level(10);

/// Samples along each side that the coarsest level of a pyramid has at most, if [`MAX_PYRAMID_LEVEL`] allows.
const COARSEST_SIDE: u32 = 32;
/// Blocks have levels up to this one.
const BLOCK_LEVELS: u8 = N_BLOCK_LEVELS as u8 - 1;

/// Samples of a level along x, y, z: ceil(dims / 2^level).
pub fn level_dims(dims: UVec3, level: Level) -> UVec3 {
    level.dims_of(dims)
}

/// The coarsest level that is worth storing: every level of blocks is there, and the coarsest is at most 32 samples a side (up to
/// 32,768 voxels), but none follows the level of one sample.
pub fn coarsest_level(dims: UVec3) -> Level {
    let is_enough = |l: &u8| {
        let side = level_dims(dims, Level(*l)).max_element();
        side == 1 || (*l >= BLOCK_LEVELS && side <= COARSEST_SIDE)
    };
    (0..MAX_PYRAMID_LEVEL.0).find(is_enough).map_or(MAX_PYRAMID_LEVEL, Level)
}

/// Slices that are none of the volume's.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum SliceError {
    #[error("slices of {found} samples; those before are {expected}")]
    Type { found: ScalarType, expected: ScalarType },
    #[error("{n_samples} samples are no whole slices of {} x {} samples", dims.x, dims.y)]
    Ragged { n_samples: usize, dims: UVec3 },
    #[error("{n_slices} slices; the volume has {}", dims.z)]
    TooMany { n_slices: usize, dims: UVec3 },
}

/// The levels above 0 of a volume whose slices come one after the other.
///
/// A sample of level l is the mean of the up to 2^l voxels a side that it covers, fewer at the upper ends: as the samples of
/// [`BlockVolume`](crate::BlockVolume), but for all levels. Means of integers are exact, rounded once, halves up; means of f32 are
/// summed in f64 and rounded once; means of f64 are within 1e-14 of the greatest magnitude that they sum (above 1e-290).
///
/// ```text
/// slice of level 0     0   1   2   3   4   5   6
/// level 1                  0       1       2   3     each out as soon as its last slice is in
/// level 2                          0           1
/// ```
///
/// Memory: 8 bytes for each sample of one slice of each level, 8/3 bytes for each voxel of a slice of level 0.
pub struct Pyramid {
    dims: UVec3,
    scalar: ScalarType,
    planes: Box<dyn Planes>,
    n_slices: u32,
}

impl Pyramid {
    /// The levels 1 to `coarsest` (at most [`MAX_PYRAMID_LEVEL`]) of a volume of `dims` voxels. A zero dimension counts as one.
    pub fn new(dims: UVec3, scalar: ScalarType, coarsest: Level) -> Pyramid {
        fn planes<T: PyramidScalar>(dims: UVec3, coarsest: Level) -> Box<dyn Planes> {
            Box::new((1..=coarsest.0).map(|l| Plane::<T>::new(dims, Level(l))).collect::<Vec<_>>())
        }
        let (dims, coarsest) = (dims.max(UVec3::ONE), coarsest.min(MAX_PYRAMID_LEVEL));
        let planes = match scalar {
            ScalarType::U8 => planes::<u8>(dims, coarsest),
            ScalarType::I8 => planes::<i8>(dims, coarsest),
            ScalarType::U16 => planes::<u16>(dims, coarsest),
            ScalarType::I16 => planes::<i16>(dims, coarsest),
            ScalarType::U32 => planes::<u32>(dims, coarsest),
            ScalarType::I32 => planes::<i32>(dims, coarsest),
            ScalarType::F32 => planes::<f32>(dims, coarsest),
            ScalarType::F64 => planes::<f64>(dims, coarsest),
        };
        Pyramid { dims, scalar, planes, n_slices: 0 }
    }

    /// Takes the next slices of level 0, x fastest, and hands out the slices of other levels that are complete with them, a slice of
    /// a level after those before it.
    ///
    /// # Errors
    /// Samples of another type, a part of a slice, more slices than the volume has. Then none is taken.
    pub fn push(&mut self, slices: &Voxels, emit: &mut dyn FnMut(Level, Voxels)) -> Result<(), SliceError> {
        let (dims, expected) = (self.dims, self.scalar);
        let n_slices = whole_slices(slices, dims, expected)?;
        let n_all = self.n_slices as usize + n_slices;
        if n_all > dims.z as usize {
            return Err(SliceError::TooMany { n_slices: n_all, dims });
        }
        for i in 0..n_slices {
            self.planes.push(slices, i, emit);
        }
        self.n_slices = n_all as u32;
        Ok(())
    }

    /// Whether all slices of the volume have been taken, so that all of the other levels have been handed out.
    pub fn is_complete(&self) -> bool {
        self.n_slices == self.dims.z
    }
}

/// The number of slices that samples are.
fn whole_slices(slices: &Voxels, dims: UVec3, expected: ScalarType) -> Result<usize, SliceError> {
    let (n_samples, n_slice) = (slices.len(), dims.x as usize * dims.y as usize);
    match slices.scalar_type() {
        found if found != expected => Err(SliceError::Type { found, expected }),
        _ if !n_samples.is_multiple_of(n_slice) => Err(SliceError::Ragged { n_samples, dims }),
        _ => Ok(n_samples / n_slice),
    }
}

/// A scalar whose sums over 2^30 voxels are held.
trait PyramidScalar: Scalar {
    type Sum: Copy + Default + AddAssign + Send + Sync;
    fn sum(self) -> Self::Sum;
    /// The mean of `n` values rounded once; integer halves go up.
    fn mean(sum: Self::Sum, n: u64) -> Self;
    /// The samples, if they are of this type.
    fn of(voxels: &Voxels) -> &[Self];
}

/// Keeps sums of 2^30 values of f64 finite; a power of two changes no digit.
const F64_SCALE: f64 = 1.0 / (1u64 << 30) as f64;

macro_rules! scalars {
    ($($t:ident $v:ident $sum:ty, $widen:expr, $mean:expr;)*) => { $(
        impl PyramidScalar for $t {
            type Sum = $sum;
            #[inline]
            fn sum(self) -> $sum { $widen(self) }
            #[inline]
            fn mean(sum: $sum, n: u64) -> $t { $mean(sum, n) as $t }
            fn of(voxels: &Voxels) -> &[$t] {
                match voxels {
                    Voxels::$v(samples) => samples,
                    _ => &[],
                }
            }
        }
    )* };
}
scalars! {
    u8 U8 i64, i64::from, |s, n| nearest(s, n as i64);
    i8 I8 i64, i64::from, |s, n| nearest(s, n as i64);
    u16 U16 i64, i64::from, |s, n| nearest(s, n as i64);
    i16 I16 i64, i64::from, |s, n| nearest(s, n as i64);
    u32 U32 i64, i64::from, |s, n| nearest(s, n as i64);
    i32 I32 i64, i64::from, |s, n| nearest(s, n as i64);
    f32 F32 f64, f64::from, |s: f64, n| s / n as f64;
    f64 F64 f64, |v| v * F64_SCALE, |s: f64, n| s / n as f64 / F64_SCALE;
}

/// The planes of all levels above 0.
trait Planes: Send {
    /// Adds slice `i` of some.
    fn push(&mut self, slices: &Voxels, i: usize, emit: &mut dyn FnMut(Level, Voxels));
}

/// The sums for the slice of one level that is not complete yet.
struct Plane<T: PyramidScalar> {
    level: Level,
    /// Voxels of the volume.
    dims: UVec3,
    sums: Vec<T::Sum>,
    /// Slices of this level that are complete.
    n_complete: u32,
    /// Slices of the level below that are in the sums.
    n_added: u32,
}

/// A pass over fewer rows than this is one thread's.
const MIN_ROWS: usize = 32;

impl<T: PyramidScalar> Plane<T> {
    fn new(dims: UVec3, level: Level) -> Plane<T> {
        let n = level_dims(dims, level);
        Plane { level, dims, sums: vec![T::Sum::default(); n.x as usize * n.y as usize], n_complete: 0, n_added: 0 }
    }

    /// Adds a slice of the level below, whose samples are sums of `nx` in a row.
    fn add<S: Copy + Sync>(&mut self, below: &[S], nx: usize, widen: impl Fn(S) -> T::Sum + Sync) {
        let n = level_dims(self.dims, self.level).x as usize;
        let pair_rows = below.par_chunks(2 * nx).with_min_len(MIN_ROWS);
        self.sums.par_chunks_mut(n).with_min_len(MIN_ROWS).zip(pair_rows).for_each(|(sums, rows)| {
            rows.chunks(nx).for_each(|row| add_pairs(row, &widen, sums));
        });
        self.n_added += 1;
    }

    /// Whether all slices of the level below that the slice covers are in.
    fn is_full(&self) -> bool {
        let n_below = level_dims(self.dims, Level(self.level.0 - 1)).z;
        self.n_added == 2 || 2 * self.n_complete + self.n_added == n_below
    }

    fn means(&self) -> Vec<T> {
        let (n, stride) = (level_dims(self.dims, self.level), self.level.stride());
        let covered = |axis: usize, i: u32| u64::from(stride.min(self.dims[axis] - i * stride));
        let n_slices = covered(2, self.n_complete);
        let mut means = vec![T::default(); self.sums.len()];
        let rows = means.par_chunks_mut(n.x as usize).zip(self.sums.par_chunks(n.x as usize));
        rows.with_min_len(MIN_ROWS).enumerate().for_each(|(y, (means, sums))| {
            let n_rows = n_slices * covered(1, y as u32);
            for (x, (mean, sum)) in means.iter_mut().zip(sums).enumerate() {
                *mean = T::mean(*sum, n_rows * covered(0, x as u32));
            }
        });
        means
    }

    fn begin_next(&mut self) {
        self.sums.fill(T::Sum::default());
        (self.n_complete, self.n_added) = (self.n_complete + 1, 0);
    }
}

impl<T: PyramidScalar> Planes for Vec<Plane<T>> {
    fn push(&mut self, slices: &Voxels, i: usize, emit: &mut dyn FnMut(Level, Voxels)) {
        let Some(first) = self.first_mut() else { return };
        let n_slice = first.dims.x as usize * first.dims.y as usize;
        first.add(&T::of(slices)[i * n_slice..(i + 1) * n_slice], first.dims.x as usize, T::sum);
        for l in 0..self.len() {
            let (below, above) = self.split_at_mut(l + 1);
            let plane = &mut below[l];
            if !plane.is_full() {
                return;
            }
            emit(plane.level, T::wrap(plane.means()));
            if let Some(next) = above.first_mut() {
                next.add(&plane.sums, level_dims(plane.dims, plane.level).x as usize, |sum| sum);
            }
            plane.begin_next();
        }
    }
}

/// Averages of samples that are averages themselves, each weighted by the voxels that it covers.
///
/// `samples` are those of a box of `extent` voxels, x fastest: along axis i each covers 2^`shifts[i]` voxels, fewer at the upper end.
/// Each of the result covers 2^`level` voxels a side. Exact up to the rounding of the samples; integer halves go up.
///
/// # Errors
/// If the box has another number of samples.
pub fn average_box(samples: &Voxels, extent: UVec3, shifts: UVec3, level: Level) -> Result<Voxels, SliceError> {
    fn of<T: Scalar>(samples: &[T], extent: UVec3, shifts: UVec3, level: Level) -> Voxels {
        let spans = [0, 1, 2].map(|axis| Spans::new(extent[axis], shifts[axis], level));
        let n = UVec3::from(spans.each_ref().map(Spans::n_coarse));
        let mut means = Vec::with_capacity(n.element_product() as usize);
        for z in 0..n.z {
            for y in 0..n.y {
                means.extend((0..n.x).map(|x| rounded::<T>(weighted_mean(samples, &spans, [x, y, z]))));
            }
        }
        T::wrap(means)
    }
    let n = [0, 1, 2].map(|axis| Spans::new(extent[axis], shifts[axis], level).n_fine);
    let (n_samples, dims) = (samples.len(), UVec3::from(n));
    match n.into_iter().map(|n| n as usize).product::<usize>() == n_samples {
        true => Ok(with_voxels!(samples, v => of(v, extent, shifts, level))),
        false => Err(SliceError::Ragged { n_samples, dims }),
    }
}

/// Along one axis: the samples of a box, and those that they are averaged to.
struct Spans {
    extent: u32,
    stride: u32,
    n_fine: u32,
    /// Fine samples of a coarse one.
    ratio: u32,
}

impl Spans {
    fn new(extent: u32, shift: u32, level: Level) -> Spans {
        let stride = 1 << shift;
        Spans { extent, stride, n_fine: extent.div_ceil(stride), ratio: (level.stride() / stride).max(1) }
    }

    fn n_coarse(&self) -> u32 {
        self.n_fine.div_ceil(self.ratio)
    }

    /// The fine samples of a coarse one, each with the voxels that it covers.
    fn of(&self, coarse: u32) -> impl Iterator<Item = (usize, f64)> {
        let fine = coarse * self.ratio..((coarse + 1) * self.ratio).min(self.n_fine);
        fine.map(|i| (i as usize, f64::from(self.stride.min(self.extent - i * self.stride))))
    }
}

fn weighted_mean<T: Scalar>(samples: &[T], spans: &[Spans; 3], at: [u32; 3]) -> f64 {
    let [nx, ny, _] = spans.each_ref().map(|span| span.n_fine as usize);
    let (mut sum, mut n_voxels) = (0.0, 0.0);
    for (z, of_z) in spans[2].of(at[2]) {
        for (y, of_y) in spans[1].of(at[1]) {
            for (x, of_x) in spans[0].of(at[0]) {
                let weight = of_z * of_y * of_x;
                sum += samples[x + nx * (y + ny * z)].to_f64() * F64_SCALE * weight;
                n_voxels += weight;
            }
        }
    }
    sum / n_voxels / F64_SCALE
}

/// Integer halves go up.
fn rounded<T: Scalar>(mean: f64) -> T {
    match T::TYPE {
        ScalarType::F32 | ScalarType::F64 => T::from_f64(mean),
        _ => T::from_f64((mean + 0.5).floor()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_of_the_most_voxels_are_held() {
        let n = 1 << 30;
        assert_eq!(u32::mean(n * i64::from(u32::MAX), n as u64), u32::MAX);
        assert_eq!(u32::mean((n - 1) * i64::from(u32::MAX), n as u64 - 1), u32::MAX);
        assert_eq!(f64::mean((0..1 << 10).map(|_| f64::MAX.sum()).sum(), 1 << 10), f64::MAX);
    }

    #[test]
    fn the_coarsest_level_serves_blocks_and_is_small() {
        let coarsest = |x, y, z| coarsest_level(UVec3::new(x, y, z)).0;
        assert_eq!(
            [coarsest(1, 1, 1), coarsest(8, 3, 1), coarsest(64, 64, 64), coarsest(1024, 1024, 1024)],
            [0, 3, 5, 5]
        );
        assert_eq!([coarsest(1025, 1, 1), coarsest(2048, 1024, 1024), coarsest(u32::MAX, 1, 1)], [6, 6, 10]);
    }
}
