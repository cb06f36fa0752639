//! Sums of voxels along a row, and their means.

use std::ops::AddAssign;

/// floor(sum / n + 1/2): the nearest integer to the mean of `n` numbers, halves up.
#[inline]
pub(crate) fn nearest(sum: i64, n: i64) -> i64 {
    match n & (n - 1) {
        0 => (sum + n / 2) >> n.trailing_zeros(),
        _ => sum.div_euclid(n) + i64::from(2 * sum.rem_euclid(n) >= n),
    }
}

/// Adds a row to one of half as many sums, two neighbours to each; the last of an odd number alone.
#[inline]
pub(crate) fn add_pairs<S: Copy, A: Copy + AddAssign>(row: &[S], widen: &impl Fn(S) -> A, sums: &mut [A]) {
    let (pairs, odd) = row.as_chunks::<2>();
    for (sum, [a, b]) in sums.iter_mut().zip(pairs) {
        let mut pair = widen(*a);
        pair += widen(*b);
        *sum += pair;
    }
    if let ([last], Some(sum)) = (odd, sums.last_mut()) {
        *sum += widen(*last);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integer_halves_go_up() {
        assert_eq!([nearest(3, 2), nearest(-3, 2), nearest(-1, 2), nearest(7, 1)], [2, -1, 0, 7]);
        assert_eq!([nearest(9, 6), nearest(-9, 6), nearest(-10, 6), nearest(10, 3)], [2, -1, -2, 3]);
    }
}
