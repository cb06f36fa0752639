//! Min-max arrays: the least and greatest value of every slice of a brick.

use brickfield_core::glam::UVec3;
use brickfield_core::{Rescale, Scalar, ValueRange};

/// Some of the samples of a brick, of a block, or of a volume: a box of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct SampleBox {
    /// The first sample along x, y, z.
    pub first: UVec3,
    /// Samples along x, y, z: none at all if one of the counts is 0.
    pub n: UVec3,
}

impl SampleBox {
    /// No samples.
    pub const EMPTY: SampleBox = SampleBox { first: UVec3::ZERO, n: UVec3::ZERO };

    /// All samples of a box of `n`.
    pub fn whole(n: UVec3) -> SampleBox {
        SampleBox { first: UVec3::ZERO, n }
    }

    /// Whether there is no sample.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.n.cmpeq(UVec3::ZERO).any()
    }

    /// The samples of this box from `from` to before `to`, counted from its first one; `None` if there are none.
    pub(crate) fn part(&self, from: UVec3, to: UVec3) -> Option<SampleBox> {
        let (low, high) = (from.max(self.first), to.min(self.first + self.n));
        low.cmplt(high).all().then(|| SampleBox { first: low - self.first, n: high - low })
    }

    /// The least box around two that are not empty.
    pub(crate) fn union(self, other: SampleBox) -> SampleBox {
        let first = self.first.min(other.first);
        SampleBox { first, n: (self.first + self.n).max(other.first + other.n) - first }
    }

    /// Number of samples.
    pub fn n_samples(&self) -> u64 {
        self.n.as_u64vec3().element_product()
    }

    /// Whether a sample is one of the box.
    #[inline]
    pub fn contains(&self, sample: UVec3) -> bool {
        sample.cmpge(self.first).all() && sample.cmplt(self.first + self.n).all()
    }
}

/// The three min-max arrays of a brick or block (Tong et al. 1999, section 3.2.1): the least and greatest data value of every
/// slice along x, y and z.
///
/// Slices beyond the volume, where a last brick is not full, have no entry.
#[derive(Clone, Debug, PartialEq)]
pub struct MinMaxArrays {
    /// The slices along x, y and z.
    along: [Box<[ValueRange]>; 3],
}

/// Why samples have no min-max arrays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum BoxError {
    #[error("{n_samples} samples do not fill {} x {} x {}", dims.x, dims.y, dims.z)]
    Unfilled { dims: UVec3, n_samples: usize },
    #[error("a box of {} x {} x {} samples; each count must be at least 1", n.x, n.y, n.z)]
    Empty { n: UVec3 },
    #[error("a box ends at sample {end} along {axis}; there are {n} samples")]
    Beyond { axis: char, end: u64, n: u32 },
}

impl MinMaxArrays {
    /// The arrays of a box of samples, among `dims` samples of finite stored numbers, x fastest; in data values.
    ///
    /// # Errors
    /// If the samples do not fill `dims`, or the box is empty or not inside.
    pub fn of_box<T: Scalar>(
        samples: &[T],
        dims: UVec3,
        of: SampleBox,
        rescale: Rescale,
    ) -> Result<MinMaxArrays, BoxError> {
        if dims.to_array().into_iter().try_fold(1usize, |n, d| n.checked_mul(d as usize)) != Some(samples.len()) {
            return Err(BoxError::Unfilled { dims, n_samples: samples.len() });
        }
        if of.is_empty() {
            return Err(BoxError::Empty { n: of.n });
        }
        for (axis, name) in ['x', 'y', 'z'].into_iter().enumerate() {
            let end = u64::from(of.first[axis]) + u64::from(of.n[axis]);
            if end > u64::from(dims[axis]) {
                return Err(BoxError::Beyond { axis: name, end, n: dims[axis] });
            }
        }
        Ok(scan(samples, dims, of, rescale))
    }

    /// The least and greatest value of each slice along an axis: 0, 1, 2 for x, y, z.
    #[inline]
    pub fn along(&self, axis: usize) -> &[ValueRange] {
        &self.along[axis]
    }

    /// Slices along x, y, z; at least 1 each.
    #[inline]
    pub fn n_slices(&self) -> UVec3 {
        UVec3::from_array([0, 1, 2].map(|axis| self.along[axis].len() as u32))
    }

    /// The least and greatest value of all samples.
    #[inline]
    pub fn range(&self) -> ValueRange {
        // Any axis would do: each sample is in one slice of it.
        union(&self.along[2])
    }
}

/// The range of at least one slice.
#[inline]
pub(crate) fn union(slices: &[ValueRange]) -> ValueRange {
    slices[1..].iter().fold(slices[0], |all, slice| all.union(*slice))
}

/// The arrays of a box that is not empty and lies inside.
pub(crate) fn scan<T: Scalar>(samples: &[T], dims: UVec3, of: SampleBox, rescale: Rescale) -> MinMaxArrays {
    let [nx, ny, nz] = of.n.to_array().map(|n| n as usize);
    let [x0, y0, z0] = of.first.to_array().map(|i| i as usize);
    let [dx, dy, _] = dims.to_array().map(|d| d as usize);
    let row = |y: usize, z: usize| &samples[x0 + dx * (y0 + y + dy * (z0 + z))..][..nx];
    // Each of the lanes of `along_x` is a slice; those of y and z are parts of a slice.
    let mut along_x: Vec<Lanes<T>> = groups(row(0, 0)).map(Lanes::of).collect();
    let mut along_y: Vec<Lanes<T>> = (0..ny).map(|y| Lanes::of([row(y, 0)[0]; N_LANES])).collect();
    let mut along_z: Vec<Lanes<T>> = (0..nz).map(|z| Lanes::of([row(0, z)[0]; N_LANES])).collect();
    for (z, slice) in along_z.iter_mut().enumerate() {
        for (y, of_y) in along_y.iter_mut().enumerate() {
            for (group, of_x) in groups(row(y, z)).zip(&mut along_x) {
                of_x.add(&group);
                of_y.add(&group);
                slice.add(&group);
            }
        }
    }
    let along_x = (0..nx).map(|x| along_x[x / N_LANES].lane(x % N_LANES, rescale)).collect();
    let [along_y, along_z] = [along_y, along_z].map(|all| all.iter().map(|lanes| lanes.range(rescale)).collect());
    MinMaxArrays { along: [along_x, along_y, along_z] }
}

/// A row in groups of samples that are compared at once; the last group is filled with its first sample.
#[inline]
fn groups<T: Scalar>(row: &[T]) -> impl Iterator<Item = [T; N_LANES]> {
    let (full, rest) = row.as_chunks::<N_LANES>();
    let filled = rest.first().map(|first| {
        let mut group = [*first; N_LANES];
        group[..rest.len()].copy_from_slice(rest);
        group
    });
    full.iter().copied().chain(filled)
}

/// The least and greatest of some samples, in parts that are compared at once.
#[derive(Clone, Copy)]
struct Lanes<T> {
    min: [T; N_LANES],
    max: [T; N_LANES],
}

const N_LANES: usize = 16;

impl<T: Scalar> Lanes<T> {
    fn of(group: [T; N_LANES]) -> Lanes<T> {
        Lanes { min: group, max: group }
    }

    #[inline]
    fn add(&mut self, group: &[T; N_LANES]) {
        for ((v, min), max) in group.iter().zip(&mut self.min).zip(&mut self.max) {
            *min = least(*v, *min);
            *max = greatest(*v, *max);
        }
    }

    fn lane(&self, lane: usize, rescale: Rescale) -> ValueRange {
        range(self.min[lane], self.max[lane], rescale)
    }

    fn range(&self, rescale: Rescale) -> ValueRange {
        let min = self.min.into_iter().reduce(least).unwrap_or_default();
        let max = self.max.into_iter().reduce(greatest).unwrap_or_default();
        range(min, max, rescale)
    }
}

#[inline]
fn least<T: Scalar>(a: T, b: T) -> T {
    if a < b { a } else { b }
}

#[inline]
fn greatest<T: Scalar>(a: T, b: T) -> T {
    if a > b { a } else { b }
}

fn range<T: Scalar>(min: T, max: T, rescale: Rescale) -> ValueRange {
    rescale.values(ValueRange { min: min.to_f64(), max: max.to_f64() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_of_a_box() {
        let samples: Vec<i16> = (0..60).collect();
        let of = SampleBox { first: UVec3::new(1, 2, 1), n: UVec3::new(2, 2, 3) };
        let rescale = Rescale::new(-1.0, 0.0).unwrap();
        let arrays = MinMaxArrays::of_box(&samples, UVec3::new(3, 5, 4), of, rescale).unwrap();
        // Sample (x, y, z) is x + 3 y + 15 z, and stands for its negative.
        let along = |axis: usize| arrays.along(axis).iter().map(|r| (-r.max, -r.min)).collect::<Vec<_>>();
        assert_eq!(along(0), [(22.0, 55.0), (23.0, 56.0)]);
        assert_eq!(along(1), [(22.0, 53.0), (25.0, 56.0)]);
        assert_eq!(along(2), [(22.0, 26.0), (37.0, 41.0), (52.0, 56.0)]);
        assert_eq!((arrays.n_slices(), arrays.range()), (of.n, ValueRange { min: -56.0, max: -22.0 }));
    }

    #[test]
    fn boxes_without_samples_are_named() {
        let error = |n_samples: usize, first: [u32; 3], n: [u32; 3]| {
            let of = SampleBox { first: UVec3::from(first), n: UVec3::from(n) };
            let arrays = MinMaxArrays::of_box(&vec![0u8; n_samples], UVec3::new(2, 3, 4), of, Rescale::IDENTITY);
            arrays.unwrap_err().to_string()
        };
        assert_eq!(error(23, [0; 3], [1; 3]), "23 samples do not fill 2 x 3 x 4");
        assert_eq!(error(24, [0; 3], [1, 0, 1]), "a box of 1 x 0 x 1 samples; each count must be at least 1");
        assert_eq!(error(24, [0, 2, 0], [1, 2, 1]), "a box ends at sample 4 along y; there are 3 samples");
    }
}
