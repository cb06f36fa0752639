//! The median kernel: samples to differences from their prediction, and back.
//!
//! ```text
//!        slice z - 1          slice z
//!      a ---- b                               predictions of s, by neighbours w, n, u and those between them:
//!      |      |             nw ---- n           w     n     u
//!      wu --- u              |      |           w + n - nw     w + u - wu     n + u - nu
//!                            w ---- s           w + n + u - nw - wu - nu + a
//!  (b is nu, a is their common neighbour)     the fourth smallest of the seven
//! ```

use brickfield_core::glam::UVec3;

use crate::sample::Coefficient;

/// Predictions that need no sample of the same row, for a piece of a row.
const PIECE: usize = 64;

/// The rows around a row that are known before it.
#[derive(Clone, Copy)]
enum Before<'a, C> {
    /// The first row of the first slice.
    Nothing,
    /// One row: y - 1 in the first slice, z - 1 in the first row of a slice.
    One(&'a [C]),
    /// Rows y - 1, z - 1, and the one that is before both.
    All([&'a [C]; 3]),
}

/// The differences of all samples from their predictions.
pub(crate) fn differences<C: Coefficient>(extent: UVec3, samples: &[C]) -> Vec<C> {
    let mut differences = vec![C::default(); samples.len()];
    for_rows(extent, |row, of_y, of_z| {
        let (before, after) = samples.split_at(row);
        let own = &after[..extent.x as usize];
        let out = &mut differences[row..][..own.len()];
        let rows = rows_before(before, own.len(), of_y, of_z);
        predict_row(rows, own.len(), |x, prediction| {
            out[x] = own[x].minus(prediction);
            own[x]
        });
    });
    differences
}

/// Turns differences into the samples that they were made of.
///
/// Rows of one diagonal, y + z, do not depend on each other: two at a time are undone, because a sample waits for the one before it.
pub(crate) fn undo_differences<C: Coefficient>(extent: UVec3, array: &mut [C]) {
    let [nx, ny, nz] = extent.to_array().map(|n| n as usize);
    let mut known = [Known::default(), Known::default()];
    for diagonal in 0..ny + nz - 1 {
        let zs = (diagonal + 1).saturating_sub(ny)..nz.min(diagonal + 1);
        let row_of = |z: usize| nx * (diagonal - z + ny * z);
        let (mut z, end) = (zs.start, zs.end);
        while z < end {
            let is_inner = |z: usize| z > 0 && z < diagonal;
            if z + 1 < end && is_inner(z) && is_inner(z + 1) {
                undo_rows(array, [row_of(z), row_of(z + 1)], [nx, nx * ny], &mut known);
                z += 2;
            } else {
                undo_row(array, row_of(z), nx, (diagonal > z).then_some(nx), (z > 0).then_some(nx * ny));
                z += 1;
            }
        }
    }
}

fn undo_row<C: Coefficient>(array: &mut [C], row: usize, nx: usize, of_y: Option<usize>, of_z: Option<usize>) {
    let (before, after) = array.split_at_mut(row);
    let own = &mut after[..nx];
    predict_row(rows_before(before, nx, of_y, of_z), nx, |x, prediction| {
        own[x] = own[x].plus(prediction);
        own[x]
    });
}

/// Undoes two rows, the first of which lies before the second, with all rows before them.
fn undo_rows<C: Coefficient>(array: &mut [C], rows: [usize; 2], [nx, nxy]: [usize; 2], known: &mut [Known<C>; 2]) {
    for row in rows {
        let [n, u, nu] = [nx, nxy, nx + nxy].map(|distance| array[row - distance]);
        array[row] = array[row].plus(median_of_3(n, u, n.plus(u).minus(nu)));
    }
    let [mut w, mut other_w] = rows.map(|row| array[row]);
    for from in (1..nx).step_by(PIECE) {
        let n_piece = PIECE.min(nx - from);
        for (row, known) in rows.into_iter().zip(&mut *known) {
            known.set([nx, nxy, nx + nxy].map(|distance| &array[row + from - 1 - distance..][..n_piece + 1]));
        }
        let [known, other_known] = &*known;
        let (before, after) = array.split_at_mut(rows[1] + from);
        let (own, other) = (&mut before[rows[0] + from..][..n_piece], &mut after[..n_piece]);
        for (i, (own, other)) in own.iter_mut().zip(other).enumerate().take(PIECE) {
            w = own.plus(known.prediction(i, w));
            other_w = other.plus(other_known.prediction(i, other_w));
            (*own, *other) = (w, other_w);
        }
    }
}

/// Calls `with` with the begin of each row, and the distances back to rows y - 1 and z - 1, if there are such rows.
fn for_rows(extent: UVec3, mut with: impl FnMut(usize, Option<usize>, Option<usize>)) {
    let [nx, ny, nz] = extent.to_array().map(|n| n as usize);
    for z in 0..nz {
        for y in 0..ny {
            with(nx * (y + ny * z), (y > 0).then_some(nx), (z > 0).then_some(nx * ny));
        }
    }
}

fn rows_before<C>(before: &[C], len: usize, of_y: Option<usize>, of_z: Option<usize>) -> Before<'_, C> {
    let back = |distance: usize| &before[before.len() - distance..][..len];
    match (of_y, of_z) {
        (None, None) => Before::Nothing,
        (Some(one), None) | (None, Some(one)) => Before::One(back(one)),
        (Some(y), Some(z)) => Before::All([back(y), back(z), back(y + z)]),
    }
}

/// Calls `sample` with each x and its prediction; it returns the sample there, from which the next one is predicted.
#[inline(always)]
fn predict_row<C: Coefficient>(before: Before<'_, C>, len: usize, mut sample: impl FnMut(usize, C) -> C) {
    match before {
        Before::Nothing => {
            let mut w = C::default();
            for x in 0..len {
                w = sample(x, w);
            }
        }
        Before::One(n) => {
            let mut w = sample(0, n[0]);
            for (x, pair) in (1..len).zip(n.windows(2)) {
                w = sample(x, median_of_3(w, pair[1], w.plus(pair[1]).minus(pair[0])));
            }
        }
        Before::All([n, u, nu]) => {
            let mut w = sample(0, median_of_3(n[0], u[0], n[0].plus(u[0]).minus(nu[0])));
            let mut known = Known::default();
            for from in (1..len).step_by(PIECE) {
                let n_piece = PIECE.min(len - from);
                known.set([n, u, nu].map(|row| &row[from - 1..][..n_piece + 1]));
                for i in 0..n_piece {
                    w = sample(from + i, known.prediction(i, w));
                }
            }
        }
    }
}

/// The seven predictions of a piece of a row, as far as they are known before the row: three, ascending, and four as differences
/// from the sample before, ascending.
struct Known<C> {
    fixed: [[C; PIECE]; 3],
    moving: [[C; PIECE]; 4],
}

impl<C: Coefficient> Known<C> {
    fn default() -> Known<C> {
        Known { fixed: [[C::default(); PIECE]; 3], moving: [[C::default(); PIECE]; 4] }
    }

    /// Sets the predictions of a piece. Rows begin one sample before it.
    #[inline(always)]
    fn set(&mut self, [n, u, nu]: [&[C]; 3]) {
        let len = n.len() - 1;
        let [f1, f2, f3] = &mut self.fixed;
        let [m1, m2, m3, m4] = &mut self.moving;
        let (f1, f2, f3) = (&mut f1[..len], &mut f2[..len], &mut f3[..len]);
        let (m1, m2, m3, m4) = (&mut m1[..len], &mut m2[..len], &mut m3[..len], &mut m4[..len]);
        let (n, nw, u, uw, nu, nuw) = (&n[1..], &n[..len], &u[1..], &u[..len], &nu[1..], &nu[..len]);
        for i in 0..len {
            let (of_n, of_u) = (n[i].minus(nw[i]), u[i].minus(uw[i]));
            [f1[i], f2[i], f3[i]] = sorted_3([n[i], u[i], n[i].plus(u[i]).minus(nu[i])]);
            let of_all = of_n.plus(of_u).minus(nu[i].minus(nuw[i]));
            [m1[i], m2[i], m3[i], m4[i]] = sorted_4([C::default(), of_n, of_u, of_all]);
        }
    }

    /// The prediction of sample `i` of the piece from the one before it.
    #[inline(always)]
    fn prediction(&self, i: usize, w: C) -> C {
        median_of_7(std::array::from_fn(|k| self.fixed[k][i]), std::array::from_fn(|k| self.moving[k][i].plus(w)))
    }
}

#[inline(always)]
fn order<C: Coefficient>(a: C, b: C) -> (C, C) {
    (a.min(b), a.max(b))
}

#[inline(always)]
fn sorted_3<C: Coefficient>([a, b, c]: [C; 3]) -> [C; 3] {
    let (a, b) = order(a, b);
    let (b, c) = order(b, c);
    let (a, b) = order(a, b);
    [a, b, c]
}

#[inline(always)]
fn sorted_4<C: Coefficient>([a, b, c, d]: [C; 4]) -> [C; 4] {
    let ((a, b), (c, d)) = (order(a, b), order(c, d));
    let ((a, c), (b, d)) = (order(a, c), order(b, d));
    let (b, c) = order(b, c);
    [a, b, c, d]
}

#[inline(always)]
fn median_of_3<C: Coefficient>(a: C, b: C, c: C) -> C {
    sorted_3([a, b, c])[1]
}

/// The fourth smallest of three ascending values and four ascending values.
#[inline(always)]
fn median_of_7<C: Coefficient>([a1, a2, a3]: [C; 3], [b1, b2, b3, b4]: [C; 4]) -> C {
    b4.min(a1.max(b3)).min(a2.max(b2).min(a3.max(b1)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_median_of_seven_is_the_fourth(mut a: [i16; 3], mut b: [i16; 4]) {
            let mut all = [&a[..], &b].concat();
            all.sort();
            a.sort();
            b.sort();
            prop_assert_eq!(median_of_7(a, b), all[3]);
        }

        #[test]
        fn networks_sort(a: [i32; 3], b: [i32; 4]) {
            prop_assert!(sorted_3(a).is_sorted() && sorted_4(b).is_sorted());
        }
    }

    /// A plane of any slope is predicted without difference behind its first faces, for all four predictions with slopes agree.
    #[test]
    fn a_plane_has_no_differences() {
        let extent = UVec3::new(90, 5, 4);
        let value = |x: i32, y: i32, z: i32| 3 * x - 7 * y + 2 * z;
        let samples: Vec<i32> =
            (0..4).flat_map(|z| (0..5).flat_map(move |y| (0..90).map(move |x| value(x, y, z)))).collect();
        let differences = differences(extent, &samples);
        let inner = (1..4).flat_map(|z| (1..5).flat_map(move |y| (1..90).map(move |x| x + 90 * (y + 5 * z))));
        assert!(inner.into_iter().all(|i| differences[i] == 0));
        let mut undone = differences;
        undo_differences(extent, &mut undone);
        assert_eq!(undone, samples);
    }
}
