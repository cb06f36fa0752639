//! What is kept of a brick: the box around everything that may be seen.

use brickfield_core::ValueRange;
use brickfield_core::glam::UVec3;

use crate::{DarkValues, MinMaxArrays, SampleBox};

/// How values between the samples of a brick come about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Interpolation {
    /// From the nearest sample alone: a slice is empty if its own values are dark (the paper's rule). A position beyond the kept box
    /// must not be drawn.
    Nearest,
    /// Between samples: a gap between two slices is empty if all values from the least to the greatest of both are dark. A position
    /// beyond the kept box may be moved to it: the value there is dark as well.
    #[default]
    Trilinear,
}

/// What a classification leaves of a brick (Tong et al. 1999, section 3.2.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum Class {
    /// Nothing.
    White,
    /// A part: the brick is trimmed along the axis (0, 1, 2 for x, y, z) with the shortest interval; of equal ones along the last, so
    /// that fewer bricks are rotated.
    Grey { trimming_axis: usize },
    /// All of its side^3 samples.
    Black,
}

impl Class {
    /// The class of a brick of `side` samples a side of which `kept` is left.
    ///
    /// A last brick that is not full is never black: the paper fills its rest with empty voxels.
    pub fn of(kept: &SampleBox, side: u32) -> Class {
        match kept.n.to_array() {
            _ if kept.is_empty() => Class::White,
            n if n == [side; 3] => Class::Black,
            [x, y, z] if z <= x && z <= y => Class::Grey { trimming_axis: 2 },
            [x, y, _] if y <= x => Class::Grey { trimming_axis: 1 },
            _ => Class::Grey { trimming_axis: 0 },
        }
    }
}

/// The box around all that may be seen of a brick, or of a block whose neighbours do not count: the paper's intervals along x, y
/// and z. Empty if nothing may be seen.
///
/// The intervals are the paper's with [`Interpolation::Nearest`]; with [`Interpolation::Trilinear`] they are closed by the dark slices
/// between which and the object values lie. The paper prints "i < R_x and all i > R_x": the first is L_x.
pub fn kept_box(arrays: &MinMaxArrays, dark: &DarkValues, interpolation: Interpolation) -> SampleBox {
    if dark.covers(arrays.range()) {
        return SampleBox::EMPTY;
    }
    let intervals = [0, 1, 2].map(|axis| match interpolation {
        Interpolation::Nearest => slices_kept(arrays.along(axis), dark),
        Interpolation::Trilinear => gaps_kept(arrays.along(axis), dark),
    });
    box_of(intervals)
}

/// First and last slice with a value that is not dark.
fn slices_kept(slices: &[ValueRange], dark: &DarkValues) -> Option<[usize; 2]> {
    ends(slices.len(), |slice| dark.covers(slices[slice]))
}

/// The slices around the first and the last gap that is not dark. A slice alone is its own gap.
fn gaps_kept(slices: &[ValueRange], dark: &DarkValues) -> Option<[usize; 2]> {
    let last = slices.len() - 1;
    let [from, to] = ends(last.max(1), |gap| dark.covers(slices[gap].union(slices[last.min(gap + 1)])))?;
    Some([from, last.min(to + 1)])
}

/// The first and the last of `n` that are not dark.
pub(crate) fn ends(n: usize, is_dark: impl Fn(usize) -> bool) -> Option<[usize; 2]> {
    let first = (0..n).find(|i| !is_dark(*i))?;
    let last = (first..n).rfind(|i| !is_dark(*i))?;
    Some([first, last])
}

/// The box of three closed intervals.
pub(crate) fn box_of(intervals: [Option<[usize; 2]>; 3]) -> SampleBox {
    let [Some(x), Some(y), Some(z)] = intervals else { return SampleBox::EMPTY };
    let closed = |[from, to]: [usize; 2]| (from as u32, (to - from) as u32 + 1);
    let (x, y, z) = (closed(x), closed(y), closed(z));
    SampleBox { first: UVec3::new(x.0, y.0, z.0), n: UVec3::new(x.1, y.1, z.1) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::Rescale;

    /// A row of samples along an axis.
    fn kept(samples: &[u8], axis: usize, threshold: f64, interpolation: Interpolation) -> SampleBox {
        let mut dims = UVec3::ONE;
        dims[axis] = samples.len() as u32;
        let arrays = MinMaxArrays::of_box(samples, dims, SampleBox::whole(dims), Rescale::IDENTITY).unwrap();
        kept_box(&arrays, &DarkValues::below(threshold).unwrap(), interpolation)
    }

    #[test]
    fn interpolated_values_reach_one_slice_farther() {
        let samples = [0, 1, 0, 9, 0, 8, 2, 0];
        for axis in 0..3 {
            let interval = |threshold, interpolation| {
                let kept = kept(&samples, axis, threshold, interpolation);
                (kept.first[axis], kept.n[axis])
            };
            assert_eq!(interval(5.0, Interpolation::Nearest), (3, 3));
            assert_eq!(interval(5.0, Interpolation::Trilinear), (2, 5));
            assert_eq!(interval(1.0, Interpolation::Trilinear), (0, 8));
            assert_eq!(interval(10.0, Interpolation::Trilinear), (0, 0));
        }
    }

    #[test]
    fn classes_and_the_trimming_axis() {
        let class = |n: [u32; 3]| Class::of(&SampleBox::whole(UVec3::from(n)), 16);
        assert_eq!((class([0, 5, 5]), class([16; 3])), (Class::White, Class::Black));
        assert_eq!(class([5, 5, 5]), Class::Grey { trimming_axis: 2 });
        assert_eq!(class([5, 5, 16]), Class::Grey { trimming_axis: 1 });
        assert_eq!(class([4, 16, 16]), Class::Grey { trimming_axis: 0 });
    }
}
