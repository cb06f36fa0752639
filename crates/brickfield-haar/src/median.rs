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
pub(crate) fn undo_differences<C: Coefficient>(extent: UVec3, array: &mut [C]) {
    for_rows(extent, |row, of_y, of_z| {
        let (before, after) = array.split_at_mut(row);
        let own = &mut after[..extent.x as usize];
        let rows = rows_before(before, own.len(), of_y, of_z);
        predict_row(rows, own.len(), |x, prediction| {
            own[x] = own[x].plus(prediction);
            own[x]
        });
    });
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
            for from in (1..len).step_by(PIECE) {
                let n_piece = PIECE.min(len - from);
                let rows = [n, u, nu].map(|row| &row[from - 1..][..n_piece + 1]);
                let known = Known::of(rows);
                for (i, (fixed, moving)) in known.fixed.iter().zip(&known.moving).take(n_piece).enumerate() {
                    w = sample(from + i, median_of_7(*fixed, moving.map(|d| w.plus(d))));
                }
            }
        }
    }
}

/// The seven predictions of a piece of a row, as far as they are known before the row: three, ascending, and four as differences
/// from the sample before, ascending.
struct Known<C> {
    fixed: [[C; 3]; PIECE],
    moving: [[C; 4]; PIECE],
}

impl<C: Coefficient> Known<C> {
    /// Rows begin one sample before the piece.
    #[inline(always)]
    fn of([n, u, nu]: [&[C]; 3]) -> Known<C> {
        let mut known = Known { fixed: [[C::default(); 3]; PIECE], moving: [[C::default(); 4]; PIECE] };
        let rows = n.windows(2).zip(u.windows(2)).zip(nu.windows(2));
        for (((n, u), nu), (fixed, moving)) in rows.zip(known.fixed.iter_mut().zip(&mut known.moving)) {
            let (of_n, of_u) = (n[1].minus(n[0]), u[1].minus(u[0]));
            *fixed = sorted_3([n[1], u[1], n[1].plus(u[1]).minus(nu[1])]);
            *moving = sorted_4([C::default(), of_n, of_u, of_n.plus(of_u).minus(nu[1].minus(nu[0]))]);
        }
        known
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
