//! Chebyshev distances on a lattice: the number of cells along the axis on which two are farthest apart.

use rayon::prelude::*;

/// Rows of a lattice below which a second thread is not worth it.
const FEW_ROWS: usize = 512;

/// Turns 0 and `farthest` into the distance of each cell to the nearest 0, no farther than `farthest`; x fastest.
///
/// One axis after the other: along x; then the greater of that distance and the way along y; then z.
pub(crate) fn spread(cells: &mut [u8], [nx, ny, nz]: [usize; 3], farthest: u8) {
    cells.par_chunks_mut(nx).with_min_len(FEW_ROWS).for_each(along_row);
    for (stride, n) in [(1, ny), (ny, nz)] {
        let before = cells.to_vec();
        cells.par_chunks_mut(nx).enumerate().with_min_len(FEW_ROWS).for_each(|(row, out)| {
            let at = row / stride % n;
            let of = |other: usize| &before[(row + other * stride - at * stride) * nx..][..nx];
            for way in 1..usize::from(farthest).min(n) {
                if way <= at {
                    nearer(out, of(at - way), way as u8);
                }
                if at + way < n {
                    nearer(out, of(at + way), way as u8);
                }
            }
        });
    }
}

/// Distances along a row of 0 and the farthest.
fn along_row(row: &mut [u8]) {
    let closer = |last: &mut u8, d: &mut u8| {
        *d = (*d).min(last.saturating_add(1));
        *last = *d;
    };
    let mut last = u8::MAX;
    row.iter_mut().for_each(|d| closer(&mut last, d));
    last = u8::MAX;
    row.iter_mut().rev().for_each(|d| closer(&mut last, d));
}

/// Distances of a row, as far as a row `way` rows away bounds them.
fn nearer(out: &mut [u8], other: &[u8], way: u8) {
    out.iter_mut().zip(other).for_each(|(d, o)| *d = (*d).min((*o).max(way)));
}
