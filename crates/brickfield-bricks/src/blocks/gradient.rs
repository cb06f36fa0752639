//! Gradients: the Sobel operator at full resolution, averaged to coarser levels.

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{BlockLayout, GRADIENT_ZERO, Grid, Level, Rescale, Scalar, ValueRange};

use super::positions;

/// The gradient, in data values per world unit, that no gradient of a volume exceeds: its range of values in every spacing.
pub(super) fn greatest_of(range: ValueRange, grid: &Grid) -> f64 {
    let (half, per_world) = (0.5 * range.max - 0.5 * range.min, grid.spacing().recip().length());
    (half * per_world * 2.0).min(f64::MAX)
}

/// The voxels of a volume, and what their numbers mean.
#[derive(Clone, Copy)]
pub(super) struct Voxels<'a, T> {
    pub(super) voxels: &'a [T],
    pub(super) grid: &'a Grid,
    pub(super) rescale: Rescale,
}

/// The gradients of a block's samples of a level, x fastest, as [`brickfield_core::Companion::Gradient`] has them.
pub(super) fn gradient_codes<T: Scalar>(
    volume: Voxels<T>,
    layout: &BlockLayout,
    (block, level): (UVec3, Level),
    greatest: f64,
) -> Vec<u8> {
    let (first, extent) = (layout.first_voxel(block), layout.extent(block));
    let around = Around::of(volume, first, extent);
    let n = level.dims_of(extent);
    let mut sums = vec![(DVec3::ZERO, 0u32); n.element_product() as usize];
    for voxel in positions(extent) {
        let sample = voxel / level.stride();
        let sum = &mut sums[(sample.x + n.x * (sample.y + n.y * sample.z)) as usize];
        // Parts of the greatest: whatever the values are, squares are finite.
        *sum = (sum.0 + around.gradient(voxel) / volume.grid.spacing() / greatest, sum.1 + 1);
    }
    sums.into_iter().flat_map(|(sum, count)| code(sum / f64::from(count))).collect()
}

/// No gradient, as four bytes.
pub(super) const NO_GRADIENT: [u8; 4] = [GRADIENT_ZERO, GRADIENT_ZERO, GRADIENT_ZERO, 0];

/// A gradient along the grid's axes, in parts of the greatest, as four bytes.
pub(super) fn code(gradient: DVec3) -> [u8; 4] {
    let length = gradient.length();
    // Neither has a direction: no gradient, and where all values are equal, 0 of 0.
    if length.is_nan() || length == 0.0 {
        return NO_GRADIENT;
    }
    let zero = f64::from(GRADIENT_ZERO);
    let [x, y, z] = (gradient / length).to_array().map(|c| (c * zero + zero).round() as u8);
    [x, y, z, (length.min(1.0).sqrt() * 255.0).round() as u8]
}

/// The data values of a block's voxels and one beyond on every side: at the volume's faces the outer voxels again.
pub(super) struct Around {
    pub(super) values: Vec<f64>,
    n: UVec3,
    /// Distance between the voxels before and behind each voxel of the block along an axis: 2, 1 at the volume's faces, 0 if there is none.
    distances: [Vec<f64>; 3],
}

impl Around {
    pub(super) fn of<T: Scalar>(Voxels { voxels, grid, rescale }: Voxels<T>, first: UVec3, extent: UVec3) -> Around {
        let (dims, n) = (grid.dims(), extent + 2);
        let beside = |axis: usize, i: u32| (first[axis] + i).saturating_sub(1).min(dims[axis] - 1);
        let columns: Vec<usize> = (0..n.x).map(|i| beside(0, i) as usize).collect();
        let rows = (0..n.z).flat_map(|k| (0..n.y).map(move |j| (j, k)));
        let mut values = Vec::with_capacity(n.element_product() as usize);
        for (y, z) in rows.map(|(j, k)| (beside(1, j) as usize, beside(2, k) as usize)) {
            let row = &voxels[dims.x as usize * (y + dims.y as usize * z)..][..dims.x as usize];
            values.extend(columns.iter().map(|x| rescale.value(row[*x].to_f64())));
        }
        let distance = |axis: usize| move |i: u32| f64::from(beside(axis, i + 2) - beside(axis, i));
        let distances = [0, 1, 2].map(|axis| (0..extent[axis]).map(distance(axis)).collect());
        Around { values, n, distances }
    }

    /// The slopes along the axes at a voxel of the block, in data values per voxel: weights 1, 2, 1 across (Sobel).
    fn gradient(&self, voxel: UVec3) -> DVec3 {
        let strides = [1, self.n.x as usize, (self.n.x * self.n.y) as usize];
        let centre: usize = (0..3).map(|axis| (voxel[axis] as usize + 1) * strides[axis]).sum();
        let slope = |axis: usize| {
            let distance = self.distances[axis][voxel[axis] as usize];
            if distance == 0.0 {
                return 0.0;
            }
            let (u, v) = (strides[(axis + 1) % 3], strides[(axis + 2) % 3]);
            let mut sum = 0.0;
            for (j, weight_j) in [1.0, 2.0, 1.0].into_iter().enumerate() {
                for (k, weight_k) in [1.0, 2.0, 1.0].into_iter().enumerate() {
                    let at = centre + j * u + k * v - u - v;
                    sum += weight_j * weight_k * (self.values[at + strides[axis]] - self.values[at - strides[axis]]);
                }
            }
            sum / (16.0 * distance)
        };
        DVec3::new(slope(0), slope(1), slope(2))
    }
}
