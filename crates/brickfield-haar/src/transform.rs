//! Samples to bands and back.

use brickfield_core::Level;
use brickfield_core::glam::UVec3;

use crate::extent::{BandBox, ExtentError, MAX_LEVELS, n_samples};
use crate::kernel::{Kernel, lift, unlift};
use crate::means;
use crate::sample::{Coefficient, Sample};

/// A brick as a low band and seven detail bands for each level below it.
///
/// ```text
///  level 0, n samples            level 0, transformed          level 1, transformed
///  +-----------+                 +-----+-----+                 +--+--+
///  |           |                 | low | d_x |                 |lo| d|       low band of the coarsest level:
///  |           |  -- x, y, z --> |     |     |  -- x, y, z --> +--+--+       an array of its own
///  |           |                 +-----+-----+                 | d| d|
///  |           |                 | d_y | d_xy|                 +--+--+
///  +-----------+                 +-----+-----+
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bands<C> {
    kernel: Kernel,
    extent: UVec3,
    /// One array for each level from 0, of the level's extent: the low band lies in its first corner, and details behind it.
    /// What the corner holds has no meaning.
    details: Vec<Vec<C>>,
    low: Vec<C>,
}

/// Why samples cannot be transformed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum TransformError {
    #[error(transparent)]
    Extent(#[from] ExtentError),
    #[error("a brick of {extent} has {expected} samples, but {given} are given")]
    Samples { extent: UVec3, expected: usize, given: usize },
    #[error("{given} levels of a brick; at most {MAX_LEVELS} can be made")]
    Levels { given: u8 },
    #[error("the kernel {0} has no bands")]
    NoBands(Kernel),
}

impl<C: Coefficient> Bands<C> {
    /// Transforms samples, of which x varies fastest, `n_levels` times. An axis with an odd number passes its last sample on to the
    /// low band; an axis of one sample is left as it is.
    ///
    /// # Errors
    /// If the number of samples is not the extent's, or extent, kernel or levels are outside of their bounds.
    pub fn of_samples<T>(kernel: Kernel, extent: UVec3, samples: &[T], n_levels: u8) -> Result<Bands<C>, TransformError>
    where
        T: Sample<Coefficient = C>,
    {
        let expected = n_samples(extent)?;
        if samples.len() != expected {
            return Err(TransformError::Samples { extent, expected, given: samples.len() });
        }
        if n_levels > MAX_LEVELS {
            return Err(TransformError::Levels { given: n_levels });
        }
        if !kernel.has_bands() {
            return Err(TransformError::NoBands(kernel));
        }
        Ok(Bands::of(kernel, extent, samples.iter().map(|s| s.widen()).collect(), n_levels))
    }

    /// Transforms values in the extent's number.
    pub(crate) fn of(kernel: Kernel, extent: UVec3, mut low: Vec<C>, n_levels: u8) -> Bands<C> {
        let mut details = Vec::with_capacity(usize::from(n_levels));
        for level in 0..n_levels {
            let n = Level(level).dims_of(extent);
            let transformed = forward(kernel, n, low);
            low = copy_box(&transformed, n, BandBox::low(n));
            details.push(transformed);
        }
        Bands { kernel, extent, details, low }
    }

    /// The details of a brick whose low band is stored elsewhere: the means of its cells.
    pub(crate) fn below_means(kernel: Kernel, extent: UVec3, values: Vec<C>) -> Bands<C> {
        let means = means::means(extent, &values);
        let mut bands = Bands { kernel, ..Bands::of(Kernel::Haar, extent, values, 1) };
        means::change_by_predictions(kernel, extent, &mut bands.details[0], &means, C::minus);
        bands
    }

    /// The bands of the Haar kernel of those that are [`below_means`](Self::below_means), whose low band is the means.
    pub(crate) fn without_means(self) -> Bands<C> {
        let Bands { kernel, extent, mut details, low: means } = self;
        means::change_by_predictions(kernel, extent, &mut details[0], &means, C::plus);
        let low = means::low_of(extent, &means, &details[0]);
        Bands { kernel: Kernel::Haar, extent, details, low }
    }

    /// Bands that are all 0.
    pub(crate) fn zero(kernel: Kernel, extent: UVec3, n_levels: u8, from: Level) -> Bands<C> {
        let array = |level: u8| vec![C::default(); Level(level).dims_of(extent).element_product() as usize];
        let details = (0..n_levels).map(|l| if l < from.0 { Vec::new() } else { array(l) }).collect();
        Bands { kernel, extent, details, low: array(n_levels) }
    }

    /// The kernel.
    pub fn kernel(&self) -> Kernel {
        self.kernel
    }

    /// The number of levels above level 0: the level of the low band.
    pub fn n_levels(&self) -> u8 {
        self.details.len() as u8
    }

    /// The extent of a level: ceil(extent / 2^level).
    pub fn extent(&self, level: Level) -> UVec3 {
        level.dims_of(self.extent)
    }

    /// The low band, x fastest: the coarsest level.
    pub fn low(&self) -> &[C] {
        &self.low
    }

    pub(crate) fn low_mut(&mut self) -> &mut [C] {
        &mut self.low
    }

    /// The details between `level` and the next one, and their boxes in this array of the level's extent.
    pub(crate) fn details(&self, level: Level) -> &[C] {
        &self.details[usize::from(level.0)]
    }

    pub(crate) fn details_mut(&mut self, level: Level) -> &mut [C] {
        &mut self.details[usize::from(level.0)]
    }

    /// Values of a level, x fastest: level 0 is all samples, [`Bands::n_levels`] is the low band. A finer level is computed from a
    /// coarser one and its details.
    ///
    /// # Panics
    /// If the level is above [`Bands::n_levels`].
    pub fn into_level(mut self, level: Level) -> Vec<C> {
        assert!(level.0 <= self.n_levels(), "level {} of a brick with {} levels", level.0, self.n_levels());
        let mut low = self.low;
        for l in (level.0..self.details.len() as u8).rev() {
            let n = Level(l).dims_of(self.extent);
            let mut transformed = self.details.pop().expect("an array for each level");
            paste_box(&mut transformed, n, BandBox::low(n), &low);
            low = inverse(self.kernel, n, transformed);
        }
        low
    }

    /// Sets details with a magnitude below `bound` to 0: the thresholding of Saladi et al. 2003. Returns the number of details that
    /// were changed.
    pub fn threshold(&mut self, bound: u64) -> usize {
        let mut n_changed = 0;
        for (level, array) in self.details.iter_mut().enumerate() {
            let n = Level(level as u8).dims_of(self.extent);
            for band in BandBox::details(n) {
                for_rows(band, n, |row| {
                    for c in &mut array[row] {
                        if *c != C::default() && c.magnitude() < bound {
                            *c = C::default();
                            n_changed += 1;
                        }
                    }
                });
            }
        }
        n_changed
    }
}

/// Calls `with` with the range of each row of a box in an array of extent `all`.
fn for_rows(band: BandBox, all: UVec3, mut with: impl FnMut(std::ops::Range<usize>)) {
    for z in 0..band.n.z as usize {
        for y in 0..band.n.y as usize {
            let first = band.row(all, y, z);
            with(first..first + band.n.x as usize);
        }
    }
}

fn copy_box<C: Coefficient>(array: &[C], all: UVec3, band: BandBox) -> Vec<C> {
    let mut copy = Vec::with_capacity(band.n.element_product() as usize);
    for_rows(band, all, |row| copy.extend_from_slice(&array[row]));
    copy
}

fn paste_box<C: Coefficient>(array: &mut [C], all: UVec3, band: BandBox, values: &[C]) {
    let mut rows = values.chunks_exact(band.n.x as usize);
    for_rows(band, all, |row| array[row].copy_from_slice(rows.next().expect("a row of values for each of the box")));
}

/// One level of the transform, along x, then y, then z.
fn forward<C: Coefficient>(kernel: Kernel, n: UVec3, mut array: Vec<C>) -> Vec<C> {
    let mut other = vec![C::default(); array.len()];
    for (n_lines, len) in lines_of(n) {
        if n_lines == 1 {
            continue;
        }
        for (from, to) in array.chunks_exact(n_lines * len).zip(other.chunks_exact_mut(n_lines * len)) {
            let (even, odd) = to.split_at_mut(n_lines.div_ceil(2) * len);
            split_lines(from, even, odd, len);
            lift(kernel, even, odd, len);
        }
        std::mem::swap(&mut array, &mut other);
    }
    array
}

/// Undoes [`forward`].
fn inverse<C: Coefficient>(kernel: Kernel, n: UVec3, mut array: Vec<C>) -> Vec<C> {
    let mut other = vec![C::default(); array.len()];
    for (n_lines, len) in lines_of(n).into_iter().rev() {
        if n_lines == 1 {
            continue;
        }
        for (from, to) in array.chunks_exact_mut(n_lines * len).zip(other.chunks_exact_mut(n_lines * len)) {
            let (even, odd) = from.split_at_mut(n_lines.div_ceil(2) * len);
            unlift(kernel, even, odd, len);
            merge_lines(even, odd, to, len);
        }
        std::mem::swap(&mut array, &mut other);
    }
    array
}

/// For each axis the number of its lines, and the elements of a line: along x single samples, along y rows, along z slices.
fn lines_of(n: UVec3) -> [(usize, usize); 3] {
    let [x, y, z] = n.to_array().map(|n| n as usize);
    [(x, 1), (y, x), (z, x * y)]
}

fn split_lines<C: Coefficient>(from: &[C], even: &mut [C], odd: &mut [C], len: usize) {
    if len == 1 {
        for (pair, (a, b)) in from.chunks_exact(2).zip(even.iter_mut().zip(odd.iter_mut())) {
            (*a, *b) = (pair[0], pair[1]);
        }
        if even.len() > odd.len() {
            even[odd.len()] = from[from.len() - 1];
        }
        return;
    }
    for (i, line) in from.chunks_exact(len).enumerate() {
        let half = if i % 2 == 0 { &mut *even } else { &mut *odd };
        half[i / 2 * len..][..len].copy_from_slice(line);
    }
}

fn merge_lines<C: Coefficient>(even: &[C], odd: &[C], to: &mut [C], len: usize) {
    if len == 1 {
        for (pair, (&a, &b)) in to.chunks_exact_mut(2).zip(even.iter().zip(odd)) {
            (pair[0], pair[1]) = (a, b);
        }
        if let (true, Some(last)) = (even.len() > odd.len(), to.last_mut()) {
            *last = even[odd.len()];
        }
        return;
    }
    for (i, line) in to.chunks_exact_mut(len).enumerate() {
        let half = if i % 2 == 0 { even } else { odd };
        line.copy_from_slice(&half[i / 2 * len..][..len]);
    }
}
