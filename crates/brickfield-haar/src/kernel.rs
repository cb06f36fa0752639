//! Kernels: how samples become coefficients.

use std::fmt;

use crate::sample::Coefficient;

/// How samples become coefficients that are mostly small. All are reversible in integers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kernel {
    /// Averages s = floor((a + b) / 2) and details d = a - b of neighbouring pairs, along x, then y, then z: the S-transform, which
    /// is the Haar wavelet of Saladi, Pinnamaneni and Meyer 2003 made reversible.
    Haar,
    /// The same averages, and details minus their prediction from the two neighbouring averages, floor((s_left - s_right + 2) / 4):
    /// the TS-transform of Zandi, Allen, Schwartz and Boliek 1995. Beside the first and the last pair it is
    /// floor((s_left - s_right + 1) / 2) with the pair's own average in place of the missing one.
    HaarPredicted,
    /// The reversible 5/3 filter of Le Gall and Tabatabai 1988 by lifting, as in JPEG 2000 (ISO 15444-1, annex F).
    LeGall53,
    /// Each sample minus the median of seven predictions from its seven neighbours with lower or equal indices
    /// (the format in the README lists them). No bands: a level is the average of decoded samples, as of [`Kernel::Haar`].
    Median,
}

impl Kernel {
    /// All kernels, in the order of their numbers in the format.
    pub const ALL: [Kernel; 4] = [Kernel::Haar, Kernel::HaarPredicted, Kernel::LeGall53, Kernel::Median];

    /// The kernels whose level l + 1 is the S-transform's average of level l, so that bricks with different ones of these kernels
    /// make one pyramid.
    pub const AVERAGING: [Kernel; 3] = [Kernel::Haar, Kernel::HaarPredicted, Kernel::Median];

    /// The kernel's name: `haar`, `haar-predicted`, `5/3`, `median`.
    pub const fn name(self) -> &'static str {
        match self {
            Kernel::Haar => "haar",
            Kernel::HaarPredicted => "haar-predicted",
            Kernel::LeGall53 => "5/3",
            Kernel::Median => "median",
        }
    }

    /// Whether the kernel makes a low band and details.
    pub const fn has_bands(self) -> bool {
        !matches!(self, Kernel::Median)
    }
}

impl fmt::Display for Kernel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Turns the even lines into averages and the odd lines into details, in place. A line has `len` elements; there is one even line
/// more than odd ones, or none.
pub(crate) fn lift<C: Coefficient>(kernel: Kernel, even: &mut [C], odd: &mut [C], len: usize) {
    if odd.is_empty() {
        return;
    }
    match kernel {
        Kernel::LeGall53 => {
            each_between(odd, even, len, |d, left, right| d.minus(left.plus(right).shifted(1)));
            each_beside(even, odd, len, |s, left, right| s.plus(left.plus(right).plus(C::wrap_from(2)).shifted(2)));
        }
        _ => {
            for (a, b) in even.iter_mut().zip(odd.iter_mut()) {
                let d = a.minus(*b);
                (*a, *b) = (b.plus(d.shifted(1)), d);
            }
            if kernel == Kernel::HaarPredicted {
                each_prediction(odd, even, len, |d, prediction| d.minus(prediction));
            }
        }
    }
}

/// Undoes [`lift`].
pub(crate) fn unlift<C: Coefficient>(kernel: Kernel, even: &mut [C], odd: &mut [C], len: usize) {
    if odd.is_empty() {
        return;
    }
    match kernel {
        Kernel::LeGall53 => {
            each_beside(even, odd, len, |s, left, right| s.minus(left.plus(right).plus(C::wrap_from(2)).shifted(2)));
            each_between(odd, even, len, |d, left, right| d.plus(left.plus(right).shifted(1)));
        }
        _ => {
            if kernel == Kernel::HaarPredicted {
                each_prediction(odd, even, len, |d, prediction| d.plus(prediction));
            }
            for (s, d) in even.iter_mut().zip(odd.iter_mut()) {
                let b = s.minus(d.shifted(1));
                (*s, *d) = (b.plus(*d), b);
            }
        }
    }
}

/// Changes odd line i by even lines i and i + 1; a missing one is the mirrored one, i.
fn each_between<C: Coefficient>(odd: &mut [C], even: &[C], len: usize, change: impl Fn(C, C, C) -> C) {
    let inner = (even.len() - len).min(odd.len());
    let (body, last) = odd.split_at_mut(inner);
    for ((d, &left), &right) in body.iter_mut().zip(even).zip(&even[len..]) {
        *d = change(*d, left, right);
    }
    for (d, &left) in last.iter_mut().zip(&even[inner..]) {
        *d = change(*d, left, left);
    }
}

/// Changes even line i by odd lines i - 1 and i; a missing one is the mirrored one.
fn each_beside<C: Coefficient>(even: &mut [C], odd: &[C], len: usize, change: impl Fn(C, C, C) -> C) {
    let (first, rest) = even.split_at_mut(len);
    for (s, &right) in first.iter_mut().zip(odd) {
        *s = change(*s, right, right);
    }
    let inner = (odd.len() - len).min(rest.len());
    let (body, last) = rest.split_at_mut(inner);
    for ((s, &left), &right) in body.iter_mut().zip(odd).zip(&odd[len..]) {
        *s = change(*s, left, right);
    }
    for (s, &left) in last.iter_mut().zip(&odd[inner..]) {
        *s = change(*s, left, left);
    }
}

/// Changes the detail of line i by its prediction from the averages i - 1 and i + 1.
fn each_prediction<C: Coefficient>(odd: &mut [C], even: &[C], len: usize, change: impl Fn(C, C) -> C) {
    let one_sided = |left: C, right: C| left.minus(right).plus(C::wrap_from(1)).shifted(1);
    if even.len() == len {
        return;
    }
    let (first, rest) = odd.split_at_mut(len);
    for ((d, &own), &right) in first.iter_mut().zip(even).zip(&even[len..]) {
        *d = change(*d, one_sided(own, right));
    }
    let inner = (even.len() - 2 * len).min(rest.len());
    let (body, last) = rest.split_at_mut(inner);
    for ((d, &left), &right) in body.iter_mut().zip(even).zip(&even[2 * len..]) {
        *d = change(*d, left.minus(right).plus(C::wrap_from(2)).shifted(2));
    }
    for ((d, &left), &own) in last.iter_mut().zip(&even[inner..]).zip(&even[inner + len..]) {
        *d = change(*d, one_sided(left, own));
    }
}
