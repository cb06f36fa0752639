//! A low band that is stored elsewhere: the means of cells of up to 2 x 2 x 2 samples, rounded to the nearest, halves up, as levels of
//! pyramids have them.
//!
//! The low band l of the Haar kernel is less than the mean by up to 1.5, because it rounds down along each axis. But its details say by
//! how much: a sum a + b is 2 l + (d & 1). So the sum of a cell's n samples is n l + c, where c follows from the details alone; their mean
//! is m = l + floor((c + n / 2) / n), and l is found again.
//!
//! ```text
//! samples 7 4 | d = 3   l = 5   sum = 2 * 5 + 1 = 11   m = floor(11 / 2 + 1 / 2) = 6
//! decoded: c = d & 1 = 1, l = 6 - floor((1 + 1) / 2) = 5, b = l - floor(d / 2) = 4, a = b + d = 7
//! ```

use brickfield_core::Level;
use brickfield_core::glam::UVec3;

use crate::extent::BandBox;
use crate::kernel::Kernel;
use crate::sample::Coefficient;

/// The means of the cells of an array, x fastest.
pub(crate) fn means<C: Coefficient>(extent: UVec3, values: &[C]) -> Vec<C> {
    let n = Level(1).dims_of(extent);
    let at = |p: UVec3| values[index(extent, p)].to_i64();
    let mean = |cell: UVec3| {
        let (first, end) = (2 * cell, (2 * cell + 2).min(extent));
        let corners = positions(end - first).map(|p| at(first + p));
        let n_samples = i64::from((end - first).element_product());
        C::wrap_from((corners.sum::<i64>() + n_samples / 2).div_euclid(n_samples))
    };
    positions(n).map(mean).collect()
}

/// The details of the Haar kernel that have a prediction from the means subtracted, or added again.
pub(crate) fn change_by_predictions<C: Coefficient>(
    kernel: Kernel,
    extent: UVec3,
    details: &mut [C],
    means: &[C],
    change: impl Fn(C, C) -> C,
) {
    if kernel != Kernel::HaarPredicted {
        return;
    }
    let n = Level(1).dims_of(extent);
    for band in BandBox::details(extent) {
        let differences = Differences::of(band, n);
        for z in 0..band.n.z {
            for y in 0..band.n.y {
                let row = band.row(extent, y as usize, z as usize);
                let row = &mut details[row..][..band.n.x as usize];
                differences.change_row(means, y, z, row, &change);
            }
        }
    }
}

/// The differences of means by which the details of a band are predicted: along each axis of the details (m(i - 1) - m(i + 1)) / 4, and one
/// step to one side of the outer cells (m(i) - m(i + 1)) / 2; their product is rounded to the nearest, halves up.
struct Differences {
    n: UVec3,
    has_details: [bool; 3],
}

/// Two offsets of cells, whose difference has weight 2^-bits.
#[derive(Clone, Copy)]
struct Difference {
    before: isize,
    behind: isize,
    bits: u32,
}

impl Differences {
    fn of(band: BandBox, n: UVec3) -> Differences {
        Differences { n, has_details: [0, 1, 2].map(|axis| band.first[axis] > 0) }
    }

    /// The difference along an axis at a cell; `None` if there is no other cell.
    fn along(&self, axis: usize, cell: u32) -> Option<Difference> {
        let stride = [1, self.n.x as isize, (self.n.x * self.n.y) as isize][axis];
        let (has_before, has_behind) = (cell > 0, cell + 1 < self.n[axis]);
        let (before, behind) = (if has_before { -stride } else { 0 }, if has_behind { stride } else { 0 });
        (has_before || has_behind).then_some(Difference {
            before,
            behind,
            bits: 1 + u32::from(has_before && has_behind),
        })
    }

    /// Changes each detail of a row of the band by its prediction, if it has one.
    fn change_row<C: Coefficient>(&self, means: &[C], y: u32, z: u32, row: &mut [C], change: impl Fn(C, C) -> C) {
        let [of_x, of_y, of_z] = self.has_details;
        let none = Difference { before: 0, behind: 0, bits: 0 };
        let across = [(of_y, 1, y), (of_z, 2, z)].map(|(is_asked, axis, cell)| match is_asked {
            true => self.along(axis, cell),
            false => Some(none),
        });
        let [Some(along_y), Some(along_z)] = across else { return };
        let first = index(self.n, UVec3::new(0, y, z)) as isize;
        let at = |cell: isize| means[cell as usize];
        // What is asked for along an axis is a difference, else the mean itself.
        let along_y_at = |cell: isize| match of_y {
            true => at(cell + along_y.before).minus(at(cell + along_y.behind)),
            false => at(cell),
        };
        let across_at = |cell: isize| match of_z {
            true => along_y_at(cell + along_z.before).minus(along_y_at(cell + along_z.behind)),
            false => along_y_at(cell),
        };
        let bits = along_y.bits + along_z.bits;
        let rounded = |sum: C, bits: u32| sum.plus(C::wrap_from(1 << bits >> 1)).shifted(bits);
        for (x, detail) in row.iter_mut().enumerate() {
            let cell = first + x as isize;
            let prediction = match (of_x, self.along(0, x as u32)) {
                (false, _) => rounded(across_at(cell), bits),
                (true, Some(d)) => rounded(across_at(cell + d.before).minus(across_at(cell + d.behind)), bits + d.bits),
                (true, None) => return,
            };
            *detail = change(*detail, prediction);
        }
    }
}

/// The low band of the Haar kernel from the means of cells and the kernel's details.
pub(crate) fn low_of<C: Coefficient>(extent: UVec3, means: &[C], details: &[C]) -> Vec<C> {
    let n = Level(1).dims_of(extent);
    let low = |(cell, mean): (UVec3, &C)| {
        let n_samples = (extent - 2 * cell).min(UVec3::splat(2));
        let rest = rest_of_sum(extent, n, details, cell, n_samples);
        let all = n_samples.element_product();
        mean.minus(C::wrap_from((rest + i64::from(all / 2)) >> all.trailing_zeros()))
    };
    positions(n).zip(means).map(low).collect()
}

/// By how much the sum of a cell's samples exceeds as many times its low value: 0 to 12.
fn rest_of_sum<C: Coefficient>(extent: UVec3, n: UVec3, details: &[C], cell: UVec3, n_samples: UVec3) -> i64 {
    let [has_x, has_y, has_z] = n_samples.to_array().map(|n| n == 2);
    let detail = |is_x: bool, is_y: bool, is_z: bool| {
        let step = UVec3::new(is_x.into(), is_y.into(), is_z.into());
        details[index(extent, cell + step * n)]
    };
    // Two neighbours along z of which the mean and the difference are known; only one without a neighbour.
    let along_z = |is_x: bool, is_y: bool| match has_z {
        true => pair(detail(is_x, is_y, false), detail(is_x, is_y, true)),
        false => [detail(is_x, is_y, false), C::default()],
    };
    let mut rest = if has_z { odd(detail(false, false, true)) } else { 0 };
    if has_y {
        rest = 2 * rest + along_z(false, true).map(odd).iter().sum::<i64>();
    }
    if has_x && has_y {
        let ([s0, s1], [d0, d1]) = (along_z(true, false), along_z(true, true));
        let second = if has_z { pair(s1, d1) } else { [C::default(); 2] };
        rest = 2 * rest + pair(s0, d0).into_iter().chain(second).map(odd).sum::<i64>();
    } else if has_x {
        rest = 2 * rest + along_z(true, false).map(odd).iter().sum::<i64>();
    }
    rest
}

/// Two numbers of their average and their difference.
fn pair<C: Coefficient>(average: C, difference: C) -> [C; 2] {
    let b = average.minus(difference.shifted(1));
    [b.plus(difference), b]
}

/// 1 of an odd number, 0 of an even one.
fn odd<C: Coefficient>(number: C) -> i64 {
    number.to_i64() & 1
}

fn index(n: UVec3, p: UVec3) -> usize {
    p.x as usize + n.x as usize * (p.y as usize + n.y as usize * p.z as usize)
}

fn positions(n: UVec3) -> impl Iterator<Item = UVec3> {
    (0..n.z).flat_map(move |z| (0..n.y).flat_map(move |y| (0..n.x).map(move |x| UVec3::new(x, y, z))))
}
