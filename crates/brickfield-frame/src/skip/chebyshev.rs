//! Chebyshev distances on a lattice: the number of cells along the axis on which two are farthest apart.

use rayon::prelude::*;

/// Cells of a lattice below which a second thread is not worth it.
const FEW_CELLS: usize = 1 << 16;

/// Turns 0 and `farthest` into the distance of each cell to the nearest 0, no farther than `farthest`; x fastest.
///
/// Each axis in turn, upwards and downwards: a cell is at most one farther than the cell before it along this axis, and than that one's
/// neighbours along the axes before. The shortest way to a cell is straight, then diagonal in two axes, then in all three.
pub(crate) fn spread(cells: &mut [u8], [nx, ny, nz]: [usize; 3], farthest: u8) {
    debug_assert!(cells.iter().all(|d| [0, farthest].contains(d)));
    let few_layers = FEW_CELLS.div_ceil(nx * ny);
    cells.par_chunks_mut(nx * ny).with_min_len(few_layers).for_each(|layer| {
        layer.chunks_exact_mut(nx).for_each(along_row);
        up_and_down(layer, nx, ny, near);
    });
    let mut widened = vec![0; nx * ny];
    up_and_down(cells, nx * ny, nz, |layer, before| {
        widen(before, nx, &mut widened);
        layer.chunks_exact_mut(nx).zip(widened.chunks_exact(nx)).for_each(|(row, before)| near(row, before));
    });
}

/// For each of `n` pieces of so many cells what the piece before it says, from both ends.
fn up_and_down(cells: &mut [u8], piece: usize, n: usize, mut near: impl FnMut(&mut [u8], &[u8])) {
    for i in 1..n {
        let (before, own) = cells.split_at_mut(i * piece);
        near(&mut own[..piece], &before[(i - 1) * piece..]);
    }
    for i in (1..n).rev() {
        let (own, before) = cells.split_at_mut(i * piece);
        near(&mut own[(i - 1) * piece..], &before[..piece]);
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

/// Distances of a row, as far as the row before it bounds them: straight and diagonally.
fn near(row: &mut [u8], before: &[u8]) {
    let last = row.len() - 1;
    let bound = |d: &mut u8, nearest: u8| *d = (*d).min(nearest.saturating_add(1));
    for (d, around) in row[1..].iter_mut().zip(before.windows(3)) {
        bound(d, around[0].min(around[1]).min(around[2]));
    }
    bound(&mut row[0], before[0].min(before[last.min(1)]));
    bound(&mut row[last], before[last].min(before[last.saturating_sub(1)]));
}

/// The least of each cell of a layer and its neighbours in the rows beside it.
fn widen(layer: &[u8], nx: usize, out: &mut [u8]) {
    let n_others = layer.len() - nx;
    out.copy_from_slice(layer);
    out[nx..].iter_mut().zip(&layer[..n_others]).for_each(|(d, below)| *d = (*d).min(*below));
    out[..n_others].iter_mut().zip(&layer[nx..]).for_each(|(d, above)| *d = (*d).min(*above));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_of_a_search() {
        for [nx, ny, nz] in [[1, 1, 1], [9, 1, 1], [1, 7, 1], [1, 1, 8], [7, 5, 6], [2, 12, 3], [30, 3, 4]] {
            let at = |i: usize| [i % nx, i / nx % ny, i / nx / ny];
            for rare in [2, 11, 61, 997] {
                let is_near = |i: &usize| (i * 31 + 5).is_multiple_of(rare);
                let n = nx * ny * nz;
                let mut cells: Vec<u8> = (0..n).map(|i| if is_near(&i) { 0 } else { 6 }).collect();
                spread(&mut cells, [nx, ny, nz], 6);
                for (i, d) in cells.into_iter().enumerate() {
                    let far = |j: usize| (0..3).map(|axis| at(i)[axis].abs_diff(at(j)[axis])).max().unwrap();
                    let nearest = (0..n).filter(is_near).map(far).min().unwrap_or(6);
                    assert_eq!(usize::from(d), nearest.min(6), "{:?} of {nx} x {ny} x {nz}", at(i));
                }
            }
        }
    }
}
