//! One level from the level below it.

use glam::UVec3;
use rayon::prelude::*;

use brickfield_core::glam;

use crate::sample::BrickScalar;

/// How a level is computed from the finer one, A, below it. B_i lies where A_2i lies (pixel-centre alignment).
///
/// Indices beyond A's border stand for the border sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Downsampling {
    /// B_i = A_2i (LaMar, Hamann and Joy 1999, section 3.1): keeps values, aliases.
    #[default]
    Subsample,
    /// B_i = A_(2i-1)/4 + A_2i/2 + A_(2i+1)/4 along each axis: keeps constant fields, and linear ones away from the
    /// borders.
    ///
    /// The 27 samples are summed exactly for integers and rounded once, to nearest, halves up; f32 is summed in f64
    /// and rounded once; f64 is within 3 ulp of the greatest magnitude that it sums, never overflows, and is exact for
    /// constant fields above 1.5e-306.
    Average,
}

/// All samples of a level without bricks, x fastest.
#[derive(Clone, Copy)]
pub(crate) struct Dense<'a, T> {
    pub(crate) samples: &'a [T],
    pub(crate) dims: UVec3,
}

impl<'a, T> Dense<'a, T> {
    /// Row (y, z); rows beyond the border stand for the border row.
    #[inline]
    pub(crate) fn row(&self, y: usize, z: usize) -> &'a [T] {
        let [nx, ny, nz] = self.dims.to_array().map(|n| n as usize);
        let start = nx * (y.min(ny - 1) + ny * z.min(nz - 1));
        &self.samples[start..start + nx]
    }
}

/// The samples, x fastest, of the level of `dims` samples that lies above `below`.
pub(crate) fn downsample<T: BrickScalar>(below: Dense<'_, T>, dims: UVec3, how: Downsampling) -> Vec<T> {
    let n_plane = dims.x as usize * dims.y as usize;
    let mut above = vec![T::default(); n_plane * dims.z as usize];
    above.par_chunks_mut(n_plane).enumerate().for_each(|(z, plane)| match how {
        Downsampling::Subsample => subsample_plane(below, z, dims.x as usize, plane),
        Downsampling::Average => average_plane(below, z, dims.x as usize, plane),
    });
    above
}

fn subsample_plane<T: BrickScalar>(below: Dense<'_, T>, z: usize, nx: usize, plane: &mut [T]) {
    for (y, row) in plane.chunks_exact_mut(nx).enumerate() {
        let source = below.row(2 * y, 2 * z);
        for (b, a) in row.iter_mut().zip(source.iter().step_by(2)) {
            *b = *a;
        }
        if 2 * (nx - 1) >= source.len() {
            row[nx - 1] = source[source.len() - 1];
        }
    }
}

fn average_plane<T: BrickScalar>(below: Dense<'_, T>, z: usize, nx: usize, plane: &mut [T]) {
    let mut sums = vec![T::Sum::default(); below.dims.x as usize];
    for (y, row) in plane.chunks_exact_mut(nx).enumerate() {
        let at = |i: usize| below.row(clamped_tap(y, i % 3, below.dims.y), clamped_tap(z, i / 3, below.dims.z));
        sum_rows(std::array::from_fn(at), &mut sums);
        average_row(&sums, row);
    }
}

/// Sample 2i + tap - 1, kept inside [0, n).
#[inline]
fn clamped_tap(i: usize, tap: usize, n: u32) -> usize {
    (2 * i + tap).saturating_sub(1).min(n as usize - 1)
}

/// (a + c) + (b + b): exact for equal floats.
#[inline]
fn tent<S: Copy + std::ops::Add<Output = S>>(a: S, b: S, c: S) -> S {
    (a + c) + (b + b)
}

/// The tent across y (fastest) and z of nine rows: 16 times the mean.
fn sum_rows<T: BrickScalar>(rows: [&[T]; 9], sums: &mut [T::Sum]) {
    let n = sums.len();
    let rows = rows.map(|r| &r[..n]);
    for (x, sum) in sums.iter_mut().enumerate() {
        let at = |i: usize| rows[i][x].widen();
        *sum = tent(tent(at(0), at(1), at(2)), tent(at(3), at(4), at(5)), tent(at(6), at(7), at(8)));
    }
}

/// The tent along x.
fn average_row<T: BrickScalar>(sums: &[T::Sum], row: &mut [T]) {
    let last = row.len() - 1;
    let at = |i: usize| {
        let tap = |tap| sums[clamped_tap(i, tap, sums.len() as u32)];
        T::narrow(tent(tap(0), tap(1), tap(2)))
    };
    row[0] = at(0);
    row[last] = at(last);
    let inner = sums[1..].windows(3).step_by(2);
    for (b, a) in row.iter_mut().skip(1).zip(inner) {
        *b = T::narrow(tent(a[0], a[1], a[2]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(samples: &[u8], how: Downsampling) -> Vec<u8> {
        let dims = UVec3::new(samples.len() as u32, 1, 1);
        let above = UVec3::new((dims.x - 1).div_ceil(2) + 1, 1, 1);
        downsample(Dense { samples, dims }, above, how)
    }

    #[test]
    fn subsampling_takes_every_other_sample_and_the_last() {
        assert_eq!(line(&[1, 2, 3, 4, 5], Downsampling::Subsample), [1, 3, 5]);
        assert_eq!(line(&[1, 2, 3, 4], Downsampling::Subsample), [1, 3, 4]);
        assert_eq!(line(&[7], Downsampling::Subsample), [7]);
    }

    #[test]
    fn averaging_is_the_tent_with_halves_up() {
        assert_eq!(line(&[0, 4, 8, 4, 0], Downsampling::Average), [1, 6, 1]);
        assert_eq!(line(&[0, 2, 0, 0], Downsampling::Average), [1, 1, 0]);
        assert_eq!(line(&[0, 1, 0, 1], Downsampling::Average), [0, 1, 1]);
        assert_eq!(line(&[7], Downsampling::Average), [7]);
    }
}
