//! The volume that is measured.

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Grid, Scalar, Volume};

/// A ball of n^3 voxels in noise: neither constant, which flatters, nor pure noise, which no scanner makes.
pub(crate) fn noisy_ball<T: Scalar>(n: u32) -> Volume {
    let half = f64::from(n) / 2.0;
    let value = |i: u32| {
        let p = UVec3::new(i % n, i / n % n, i / (n * n)).as_dvec3() - half;
        let noise = f64::from(i.wrapping_mul(2_654_435_761) >> 28);
        T::from_f64((220.0 * (1.0 - p.length() / half)).max(0.0) + noise)
    };
    let voxels: Vec<T> = (0..n.pow(3)).map(value).collect();
    let grid = Grid::axis_aligned(UVec3::splat(n), DVec3::ONE).expect("a plain grid");
    Volume::new(grid, T::wrap(voxels)).expect("voxels fill the grid")
}
