//! One brick: its samples copied from a level, their range, and the histogram of the voxels it owns.

use brickfield_core::glam::UVec3;
use brickfield_core::{BrickId, BrickLayout, BrickSide, ValueRange};

use crate::bins::{BinTable, Histogram};
use crate::downsample::Dense;
use crate::sample::BrickScalar;
use crate::tally::Tally;

/// Copies the brick's samples; samples beyond the level's border replicate the border sample.
pub(crate) fn copy_brick<T: BrickScalar>(source: Dense<'_, T>, layout: &BrickLayout, id: BrickId, out: &mut [T]) {
    let first = first_sample(layout, id);
    match layout.side() {
        BrickSide::S16 => copy_rows::<T, 16>(source, first, out),
        BrickSide::S32 => copy_rows::<T, 32>(source, first, out),
        BrickSide::S64 => copy_rows::<T, 64>(source, first, out),
    }
}

fn copy_rows<T: BrickScalar, const N: usize>(source: Dense<'_, T>, first: UVec3, out: &mut [T]) {
    let [x, y, z] = first.to_array().map(|i| i as usize);
    for (j, row) in out.as_chunks_mut::<N>().0.iter_mut().enumerate() {
        let from = &source.row(y + j % N, z + j / N)[x..];
        // Rows of a known length are copied without a call.
        if let Some(from) = from.first_chunk() {
            *row = *from;
        } else {
            let (inside, beyond) = row.split_at_mut(from.len());
            inside.copy_from_slice(from);
            beyond.fill(from[from.len() - 1]);
        }
    }
}

/// Least and greatest of all samples of a brick.
pub(crate) fn range_of<T: BrickScalar>(samples: &[T]) -> ValueRange {
    // So many that the loop over them is kept: compilers turn it into vectors.
    const LANES: usize = 64;
    let (mut min, mut max) = ([samples[0]; LANES], [samples[0]; LANES]);
    for group in samples.as_chunks::<LANES>().0 {
        for lane in 0..LANES {
            let v = group[lane];
            min[lane] = if v < min[lane] { v } else { min[lane] };
            max[lane] = if v > max[lane] { v } else { max[lane] };
        }
    }
    let fold = |lanes: [T; LANES], pick: fn(f64, f64) -> f64| lanes.map(T::to_f64).into_iter().reduce(pick);
    ValueRange { min: fold(min, f64::min).unwrap_or(0.0), max: fold(max, f64::max).unwrap_or(0.0) }
}

/// The histogram of the voxels that a level-0 brick owns: not its upper faces, except at the volume's border. All its stored
/// numbers are in `stored`.
pub(crate) fn owned_histogram<T: BrickScalar>(
    samples: &[T],
    layout: &BrickLayout,
    id: BrickId,
    stored: ValueRange,
    table: &BinTable,
) -> Histogram {
    let n = layout.side().n_samples() as usize;
    let [nx, ny, nz] = n_owned(layout, id).to_array().map(|i| i as usize);
    let bins = [stored.min, stored.max].map(|stored| table.of(stored));
    if bins[0] == bins[1] {
        let mut histogram = Histogram::default();
        histogram.counts[bins[0]] = (nx * ny * nz) as u64;
        return histogram;
    }
    let mut tally = Tally::default();
    for slice in samples.chunks_exact(n * n).take(nz) {
        for row in slice.chunks_exact(n).take(ny) {
            tally.count(&row[..nx], table);
        }
    }
    tally.histogram()
}

/// The brick's first sample, counted in samples of its level.
fn first_sample(layout: &BrickLayout, id: BrickId) -> UVec3 {
    id.coords * layout.side().n_cells()
}

fn n_owned(layout: &BrickLayout, id: BrickId) -> UVec3 {
    let rest = layout.dims() - first_sample(layout, id);
    let is_last = (id.coords + 1).cmpeq(layout.n_bricks(id.level));
    UVec3::select(is_last, rest, UVec3::splat(layout.side().n_cells()))
}
