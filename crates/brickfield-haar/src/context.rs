//! Contexts: how large a coefficient is expected to be, from those of the row and the slice before.
//!
//! ```text
//!   slice z - 1        slice z         weights of magnitudes
//!     . 1 .             1 2 1          row y - 1
//!     1 2 1             s              row y: the whole row has its contexts before its first coefficient is decoded
//!     . 1 .
//! ```

/// Contexts of coefficients.
pub(crate) const N_CLASSES: usize = 16;
/// Contexts of coefficients, and of rows that may be all 0.
pub(crate) const N_CONTEXTS: usize = N_CLASSES + 3;

/// Weighted sums from which on the next class begins.
const CLASS_BEGINS: [u16; N_CLASSES - 1] = [1, 2, 4, 6, 9, 13, 19, 28, 40, 60, 100, 160, 280, 560, 1280];
const GREATEST_BEGIN: usize = CLASS_BEGINS[N_CLASSES - 2] as usize;
/// Magnitudes above count as this one, so that sums of weights fit 16 bits.
const GREATEST_MAGNITUDE: u16 = 4000;

static CLASS_OF_SUM: [u8; GREATEST_BEGIN + 1] = class_of_sum();

const fn class_of_sum() -> [u8; GREATEST_BEGIN + 1] {
    let mut classes = [0; GREATEST_BEGIN + 1];
    let (mut sum, mut class) = (0, 0);
    while sum <= GREATEST_BEGIN {
        if class < N_CLASSES - 1 && sum == CLASS_BEGINS[class] as usize {
            class += 1;
        }
        classes[sum] = class as u8;
        sum += 1;
    }
    classes
}

/// The magnitudes of a box of coefficients, as far as contexts look back: one slice, and the rows of the next.
#[derive(Debug)]
pub(crate) struct Neighbours {
    nx: usize,
    ny: usize,
    /// Rows of nx + 2: the first and the last magnitude are there twice.
    slice: Vec<u16>,
    previous: Vec<u16>,
    /// Whether each row of a slice is all 0.
    is_zero: Vec<bool>,
    is_zero_previous: Vec<bool>,
    sums: Vec<u16>,
    y: usize,
    z: usize,
}

impl Neighbours {
    /// Of a box of nx by ny by any number of coefficients, none of which is known yet.
    pub(crate) fn new(nx: usize, ny: usize) -> Neighbours {
        let slice = vec![0; (nx + 2) * ny];
        let is_zero = vec![false; ny];
        Neighbours {
            nx,
            ny,
            previous: slice.clone(),
            slice,
            is_zero_previous: is_zero.clone(),
            is_zero,
            sums: vec![0; nx],
            y: 0,
            z: 0,
        }
    }

    /// The context of the flag of the next row: one for each number of zero rows among the two before it.
    #[inline]
    pub(crate) fn flag_context(&self) -> usize {
        let above = self.y > 0 && self.is_zero[self.y - 1];
        let behind = self.z > 0 && self.is_zero_previous[self.y];
        N_CLASSES + usize::from(above) + usize::from(behind)
    }

    /// The class of each coefficient of the next row.
    #[inline]
    pub(crate) fn classes(&mut self, classes: &mut [u8]) {
        let len = self.nx + 2;
        let row = |slice: &'_ [u16], y: usize| -> std::ops::Range<usize> { y * len..(y * len + len).min(slice.len()) };
        let above = (self.y > 0).then(|| &self.slice[row(&self.slice, self.y - 1)]);
        let behind = (self.z > 0).then(|| {
            let ys = [self.y, self.y.saturating_sub(1), (self.y + 1).min(self.ny - 1)];
            ys.map(|y| &self.previous[row(&self.previous, y)])
        });
        let sums = &mut self.sums;
        match (above, behind) {
            (None, None) => sums.fill(GREATEST_BEGIN as u16),
            (Some(above), None) => {
                for (sum, a) in sums.iter_mut().zip(above.windows(3)) {
                    let of_above = a[0] + 2 * a[1] + a[2];
                    *sum = 2 * of_above + of_above / 2;
                }
            }
            (None, Some([own, less, more])) => {
                for (((sum, o), l), m) in sums.iter_mut().zip(own.windows(3)).zip(&less[1..]).zip(&more[1..]) {
                    let of_behind = o[0] + 2 * o[1] + o[2] + l + m;
                    *sum = of_behind + of_behind / 2;
                }
            }
            (Some(above), Some([own, less, more])) => {
                let rows = above.windows(3).zip(own.windows(3)).zip(&less[1..]).zip(&more[1..]);
                for (sum, (((a, o), l), m)) in sums.iter_mut().zip(rows) {
                    *sum = a[0] + 2 * a[1] + a[2] + o[0] + 2 * o[1] + o[2] + l + m;
                }
            }
        }
        for (class, &sum) in classes.iter_mut().zip(&*sums) {
            *class = CLASS_OF_SUM[usize::from(sum).min(GREATEST_BEGIN)];
        }
    }

    /// Passes a row that is all 0.
    #[inline]
    pub(crate) fn pass_zero(&mut self) {
        let len = self.nx + 2;
        self.slice[self.y * len..][..len].fill(0);
        self.pass(true);
    }

    /// Passes a row with these magnitudes.
    #[inline]
    pub(crate) fn pass_row(&mut self, magnitudes: impl Iterator<Item = u16>) {
        let len = self.nx + 2;
        let row = &mut self.slice[self.y * len..][..len];
        for (own, magnitude) in row[1..].iter_mut().zip(magnitudes) {
            *own = magnitude.min(GREATEST_MAGNITUDE);
        }
        (row[0], row[len - 1]) = (row[1], row[len - 2]);
        self.pass(false);
    }

    fn pass(&mut self, is_zero: bool) {
        self.is_zero[self.y] = is_zero;
        self.y += 1;
        if self.y == self.ny {
            std::mem::swap(&mut self.slice, &mut self.previous);
            std::mem::swap(&mut self.is_zero, &mut self.is_zero_previous);
            (self.y, self.z) = (0, self.z + 1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_begin_where_they_say() {
        for (class, &begin) in CLASS_BEGINS.iter().enumerate() {
            assert_eq!(usize::from(CLASS_OF_SUM[usize::from(begin) - 1]), class);
            assert_eq!(usize::from(CLASS_OF_SUM[usize::from(begin)]), class + 1);
        }
    }

    /// Where neighbours do not exist, others stand in for them: equal magnitudes make equal sums, or nearly in the first row of a slice.
    #[test]
    fn others_stand_in_for_neighbours() {
        let mut neighbours = Neighbours::new(3, 2);
        let mut classes = [0; 3];
        neighbours.classes(&mut classes);
        assert_eq!(classes, [15; 3], "nothing is known before the first row");
        for expected in [40, 36, 40, 36] {
            neighbours.pass_row([4; 3].into_iter());
            neighbours.classes(&mut classes);
            assert_eq!(neighbours.sums, [expected; 3]);
        }
    }

    /// The weights of the drawing, by one magnitude of 1 at a time.
    #[test]
    fn magnitudes_have_their_weights() {
        let sum_at_middle = |place: usize| {
            let mut neighbours = Neighbours::new(3, 3);
            // Rows of slice z - 1, then the row before in slice z.
            for row in 0..4 {
                neighbours.pass_row((0..3).map(|x| u16::from(3 * row + x == place)));
            }
            neighbours.classes(&mut [0; 3]);
            neighbours.sums[1]
        };
        let weights: Vec<u16> = (0..12).map(sum_at_middle).collect();
        assert_eq!(weights, [0, 1, 0, 1, 2, 1, 0, 1, 0, 1, 2, 1]);
    }

    #[test]
    fn flags_count_the_zero_rows_before() {
        let mut neighbours = Neighbours::new(2, 2);
        let mut contexts = Vec::new();
        for is_zero in [true, true, false, true, true] {
            contexts.push(neighbours.flag_context() - N_CLASSES);
            match is_zero {
                true => neighbours.pass_zero(),
                false => neighbours.pass_row([1; 2].into_iter()),
            }
        }
        assert_eq!(contexts, [0, 1, 1, 1, 0]);
    }
}
