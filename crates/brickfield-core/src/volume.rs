//! A scalar volume.

use crate::{Grid, Rescale, Scalar, ScalarType, Voxels, with_voxels};

/// A scalar volume: voxels in the type that they are stored in, their data values, and where they lie.
///
/// All values are finite: [`Volume::new`] replaces values that are not, and counts them.
#[derive(Clone, Debug, PartialEq)]
pub struct Volume {
    grid: Grid,
    voxels: Voxels,
    rescale: Rescale,
    range: ValueRange,
    non_finite: NonFinite,
}

/// A closed interval of data values.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct ValueRange {
    pub min: f64,
    pub max: f64,
}

impl ValueRange {
    /// The range of some values, NaN passed over; `None` without any.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<ValueRange> {
        let empty = (f64::INFINITY, f64::NEG_INFINITY);
        let (min, max) = values.into_iter().fold(empty, |(min, max), v| (min.min(v), max.max(v)));
        (min <= max).then_some(ValueRange { min, max })
    }

    /// The smallest range around both.
    pub fn union(self, other: ValueRange) -> ValueRange {
        ValueRange { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Whether `value` lies in the range.
    pub fn contains(self, value: f64) -> bool {
        self.min <= value && value <= self.max
    }
}

/// How many voxels of a volume were not finite, and have been replaced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct NonFinite {
    pub n_nan: usize,
    pub n_positive_infinity: usize,
    pub n_negative_infinity: usize,
}

impl NonFinite {
    /// Number of voxels that were replaced.
    pub fn total(self) -> usize {
        self.n_nan + self.n_positive_infinity + self.n_negative_infinity
    }
}

/// Why voxels are no volume.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum VolumeError {
    #[error("{n_voxels} voxels do not fill a grid of {} x {} x {}", dims.x, dims.y, dims.z)]
    Unfilled { dims: glam::UVec3, n_voxels: usize },
    #[error("values rescaled by slope {} and intercept {} reach from {} to {}; they must be finite", rescale.slope(), rescale.intercept(), range.min, range.max)]
    BeyondFinite { rescale: Rescale, range: ValueRange },
}

impl Volume {
    /// A volume of `voxels` (x fastest) on `grid`.
    ///
    /// NaN and -infinity become the least finite value, +infinity the greatest (0 where no voxel is finite);
    /// [`non_finite`](Self::non_finite) counts them.
    ///
    /// # Errors
    /// If the voxels do not fill the grid.
    pub fn new(grid: Grid, voxels: impl Into<Voxels>) -> Result<Volume, VolumeError> {
        Volume::rescaled(grid, voxels, Rescale::IDENTITY)
    }

    /// A volume whose voxels stand for other values: they stay as they are stored.
    ///
    /// # Errors
    /// If the voxels do not fill the grid, or a value is not finite once it is rescaled.
    pub fn rescaled(grid: Grid, voxels: impl Into<Voxels>, rescale: Rescale) -> Result<Volume, VolumeError> {
        let mut voxels = voxels.into();
        if voxels.len() != grid.n_voxels() {
            return Err(VolumeError::Unfilled { dims: grid.dims(), n_voxels: voxels.len() });
        }
        let range = with_voxels!(&voxels, v => finite_range(v));
        let non_finite = match &mut voxels {
            Voxels::F32(v) => replace_non_finite(v, range),
            Voxels::F64(v) => replace_non_finite(v, range),
            _ => NonFinite::default(),
        };
        let range = rescale.values(range);
        if !(range.min.is_finite() && range.max.is_finite()) {
            return Err(VolumeError::BeyondFinite { rescale, range });
        }
        Ok(Volume { grid, voxels, rescale, range, non_finite })
    }

    /// Where the voxels lie.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// The voxels as they are stored, x fastest: [`rescale`](Self::rescale) has their values.
    pub fn voxels(&self) -> &Voxels {
        &self.voxels
    }

    /// The voxels alone.
    pub fn into_voxels(self) -> Voxels {
        self.voxels
    }

    /// The map from stored voxels to values.
    pub fn rescale(&self) -> Rescale {
        self.rescale
    }

    /// The value of voxel `i`.
    ///
    /// # Panics
    /// If `i` is not below the number of voxels.
    #[inline]
    pub fn value(&self, i: usize) -> f64 {
        self.rescale.value(self.voxels.at(i))
    }

    /// The scalar type that voxels are stored in.
    pub fn scalar_type(&self) -> ScalarType {
        self.voxels.scalar_type()
    }

    /// Least and greatest value, rescaled.
    pub fn range(&self) -> ValueRange {
        self.range
    }

    /// The count of voxels that were not finite when handed to [`Volume::new`].
    pub fn non_finite(&self) -> NonFinite {
        self.non_finite
    }
}

fn finite_range<T: Scalar>(values: &[T]) -> ValueRange {
    // So many that the loop over them is kept: compilers turn it into vectors.
    const LANES: usize = 64;
    let Some(first) = values.iter().copied().find(|v| v.is_finite()) else {
        return ValueRange { min: 0.0, max: 0.0 };
    };
    let (mut min, mut max) = ([first; LANES], [first; LANES]);
    let mut widen = |lane: usize, v: T| {
        let v = if v.is_finite() { v } else { first };
        min[lane] = if v < min[lane] { v } else { min[lane] };
        max[lane] = if v > max[lane] { v } else { max[lane] };
    };
    let (groups, rest) = values.as_chunks::<LANES>();
    groups.iter().for_each(|group| (0..LANES).for_each(|lane| widen(lane, group[lane])));
    rest.iter().for_each(|v| widen(0, *v));
    let ends = min.into_iter().chain(max).map(T::to_f64);
    ValueRange::of(ends).expect("the first one is finite")
}

fn replace_non_finite<T: Scalar>(values: &mut [T], range: ValueRange) -> NonFinite {
    let mut counts = NonFinite::default();
    for v in values {
        let x = v.to_f64();
        if x.is_finite() {
            continue;
        }
        let (count, value) = if x.is_nan() {
            (&mut counts.n_nan, range.min)
        } else if x > 0.0 {
            (&mut counts.n_positive_infinity, range.max)
        } else {
            (&mut counts.n_negative_infinity, range.min)
        };
        *count += 1;
        *v = T::from_f64(value);
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec3, UVec3};

    #[test]
    fn non_finite_values_are_replaced_and_counted() {
        let grid = Grid::axis_aligned(UVec3::new(5, 1, 1), DVec3::ONE).unwrap();
        let volume = Volume::new(grid, vec![f32::NAN, -2.0, f32::INFINITY, 3.0, f32::NEG_INFINITY]).unwrap();
        assert_eq!(volume.voxels(), &Voxels::F32(vec![-2.0, -2.0, 3.0, 3.0, -2.0]));
        assert_eq!(volume.non_finite(), NonFinite { n_nan: 1, n_positive_infinity: 1, n_negative_infinity: 1 });
        assert_eq!(volume.range(), ValueRange { min: -2.0, max: 3.0 });
    }

    #[test]
    fn stored_voxels_stand_for_other_values() {
        let grid = Grid::axis_aligned(UVec3::new(3, 1, 1), DVec3::ONE).unwrap();
        let volume = Volume::rescaled(grid, vec![0u8, 100, 255], Rescale::new(0.5, -1000.0).unwrap()).unwrap();
        assert_eq!((volume.value(1), volume.range()), (-950.0, ValueRange { min: -1000.0, max: -872.5 }));
        assert_eq!(volume.voxels(), &Voxels::U8(vec![0, 100, 255]));
        let beyond = Volume::rescaled(grid, vec![0u8, 1, 255], Rescale::new(1e307, 0.0).unwrap()).unwrap_err();
        assert_eq!(
            beyond.to_string(),
            format!("values rescaled by slope {0} and intercept 0 reach from 0 to inf; they must be finite", 1e307)
        );
    }

    #[test]
    fn voxels_must_fill_the_grid() {
        let grid = Grid::axis_aligned(UVec3::new(2, 2, 2), DVec3::ONE).unwrap();
        assert_eq!(
            Volume::new(grid, vec![0u8; 7]).unwrap_err().to_string(),
            "7 voxels do not fill a grid of 2 x 2 x 2"
        );
    }
}
