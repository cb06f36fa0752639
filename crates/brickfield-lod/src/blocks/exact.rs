//! The visible error of blocks from all of their samples: slow, to judge estimates by.

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{BlockLayout, Level, N_BLOCK_LEVELS, TransferFunction};
use rayon::prelude::*;

use super::Slab;
use super::differences::Differences;
use super::errors::LevelErrors;

/// How voxels are shown by a level's samples, within a block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Reconstruction {
    /// As the average that covers them.
    #[default]
    Constant,
    /// Linearly between the averages, constant beyond the outer ones.
    Trilinear,
}

/// The error of every block at every level, by [`BlockLayout::ordinal`]: of the differences between the slab of a voxel and the
/// slab of the value that is shown in its place, as much as [`BlockErrors`](super::BlockErrors) says is seen.
///
/// `values` hands out the data values of a block's samples, x fastest; it is called from several threads at once. A
/// conversion of colours per voxel and level.
///
/// # Errors
/// The first error of `values`, by whichever thread.
///
/// # Panics
/// If `values` hands out fewer values than [`BlockLayout::n_samples`].
pub fn exact_errors<E: Send>(
    layout: &BlockLayout,
    transfer: &TransferFunction,
    slab: Slab,
    reconstruction: Reconstruction,
    values: impl Fn(UVec3, Level) -> Result<Vec<f64>, E> + Sync,
) -> Result<Vec<LevelErrors>, E> {
    let of_block = |ordinal| {
        let (block, mut errors) = (layout.block(ordinal), [0.0; N_BLOCK_LEVELS]);
        let luv = |value: f64| slab.luv(transfer.at(value));
        let voxels: Vec<[f64; 3]> = values(block, Level(0))?.into_iter().map(luv).collect();
        for level in layout.side().levels().skip(1) {
            let samples = values(block, level)?;
            let shown = Shown::new(layout, block, level, reconstruction);
            let pairs = voxels.iter().zip(points(layout.extent(block)));
            let pairs =
                pairs.map(|(voxel, p)| DVec3::from_array(*voxel) - DVec3::from_array(luv(shown.at(&samples, p))));
            errors[usize::from(level.0)] = differences(pairs, voxels.len()).seen(layout.side(), level) as f32;
        }
        Ok(errors)
    };
    (0..layout.n_blocks_total()).into_par_iter().map(of_block).collect()
}

fn differences(voxels: impl Iterator<Item = DVec3>, n: usize) -> Differences {
    let add =
        |(squares, sum): (f64, DVec3), difference: DVec3| (squares + difference.length_squared(), sum + difference);
    let (squares, sum) = voxels.fold((0.0, DVec3::ZERO), add);
    Differences { mean_square: squares / n as f64, square_of_mean: (sum / n as f64).length_squared() }
}

fn points(n: UVec3) -> impl Iterator<Item = UVec3> {
    (0..n.z).flat_map(move |z| (0..n.y).flat_map(move |y| (0..n.x).map(move |x| UVec3::new(x, y, z))))
}

/// Two samples along an axis, and the weight of the second.
#[derive(Clone, Copy)]
struct Pair {
    samples: [u32; 2],
    weight: f64,
}

/// Which samples show each voxel of a block, axis by axis.
struct Shown {
    n: UVec3,
    pairs: [Vec<Pair>; 3],
}

impl Shown {
    fn new(layout: &BlockLayout, block: UVec3, level: Level, reconstruction: Reconstruction) -> Shown {
        let (n, extent) = (layout.n_samples(block, level), layout.extent(block));
        let (first, last) = layout.sample_ends(block, level);
        let corner = layout.first_voxel(block).as_dvec3();
        let axis = |a: usize| {
            let pair = |voxel: u32| match reconstruction {
                Reconstruction::Constant => Pair { samples: [voxel >> level.0; 2], weight: 0.0 },
                Reconstruction::Trilinear => {
                    between(f64::from(voxel), [first[a] - corner[a], last[a] - corner[a]], n[a], level)
                }
            };
            (0..extent[a]).map(pair).collect()
        };
        Shown { n, pairs: [axis(0), axis(1), axis(2)] }
    }

    fn at(&self, samples: &[f64], voxel: UVec3) -> f64 {
        let [x, y, z]: [Pair; 3] = std::array::from_fn(|a| self.pairs[a][voxel[a] as usize]);
        let sample = |i: usize, j: usize, k: usize| {
            let [i, j, k] = [x.samples[i], y.samples[j], z.samples[k]];
            samples[(i + self.n.x * (j + self.n.y * k)) as usize]
        };
        let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
        let row = |j, k| mix(sample(0, j, k), sample(1, j, k), x.weight);
        let plane = |k| mix(row(0, k), row(1, k), y.weight);
        mix(plane(0), plane(1), z.weight)
    }
}

/// The samples around a voxel's centre; all but the last of `n` lie a stride apart.
fn between(voxel: f64, [first, last]: [f64; 2], n: u32, level: Level) -> Pair {
    let stride = f64::from(level.stride());
    let place = |i: u32| if i + 1 == n { last } else { first + f64::from(i) * stride };
    let i = (((voxel - first) / stride).max(0.0) as u32).min(n.saturating_sub(2));
    let next = (i + 1).min(n - 1);
    let weight = if next == i { 0.0 } else { (voxel - place(i)) / (place(next) - place(i)) };
    Pair { samples: [i, next], weight: weight.clamp(0.0, 1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::BlockSide;

    #[test]
    fn linear_values_are_shown_exactly_between_the_outer_samples() {
        let layout = BlockLayout::new(UVec3::new(27, 5, 16), BlockSide::V16);
        let field = |p: DVec3| 3.0 + p.dot(DVec3::new(1.0, -2.0, 0.5));
        for (block, level) in layout.blocks().flat_map(|block| [0, 1, 2, 3, 4].map(|l| (block, Level(l)))) {
            let (first, last) = layout.sample_ends(block, level);
            let n = layout.n_samples(block, level);
            let place = |sample: UVec3| {
                let inner = first + sample.as_dvec3() * f64::from(level.stride());
                DVec3::select((sample + 1).cmpeq(n), last, inner)
            };
            let samples: Vec<f64> = points(n).map(|sample| field(place(sample))).collect();
            let shown = Shown::new(&layout, block, level, Reconstruction::Trilinear);
            for p in points(layout.extent(block)) {
                let at = (layout.first_voxel(block) + p).as_dvec3().clamp(first, last);
                assert!((shown.at(&samples, p) - field(at)).abs() < 1e-12, "{block} {p} of {level:?}");
            }
        }
    }
}
