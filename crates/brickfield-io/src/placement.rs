//! From a file's statements about space to a [`Grid`].

use brickfield_core::Grid;
use brickfield_core::glam::{DMat3, DVec3, UVec3};

use crate::{Note, ReadError};

/// The world position of the first sample, and one world step per index axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GridPlacement {
    pub(crate) first_sample: DVec3,
    pub(crate) steps: DMat3,
}

impl GridPlacement {
    pub(crate) fn axis_aligned(spacing: DVec3, first_sample: DVec3) -> GridPlacement {
        GridPlacement { first_sample, steps: DMat3::from_diagonal(spacing) }
    }

    /// Up to three axis steps; missing ones are made up, of length 1 and orthogonal to the given ones.
    pub(crate) fn from_axes(axes: &[DVec3], first_sample: DVec3) -> GridPlacement {
        let steps = match *axes {
            [] => DMat3::IDENTITY,
            [x] => with_orthogonal(x),
            [x, y] => DMat3::from_cols(x, y, x.cross(y).normalize_or(DVec3::Z)),
            [x, y, z, ..] => DMat3::from_cols(x, y, z),
        };
        GridPlacement { first_sample, steps }
    }

    #[cfg(any(feature = "nifti", feature = "mgh"))]
    /// The same place with +x and +y negated: right-anterior-superior to left-posterior-superior and back.
    pub(crate) fn negated_xy(self) -> GridPlacement {
        self.scaled(DVec3::new(-1.0, -1.0, 1.0))
    }

    pub(crate) fn scaled(self, factors: DVec3) -> GridPlacement {
        GridPlacement { first_sample: self.first_sample * factors, steps: DMat3::from_diagonal(factors) * self.steps }
    }

    /// # Errors
    /// As [`Grid::from_first_sample`].
    pub(crate) fn grid(self, dims: UVec3) -> Result<Grid, ReadError> {
        let lengths = self.steps.to_cols_array_2d().map(|c| DVec3::from(c).length());
        Ok(Grid::from_first_sample(dims, DVec3::from(lengths), self.first_sample, self.steps)?)
    }
}

fn with_orthogonal(x: DVec3) -> DMat3 {
    match x.try_normalize() {
        Some(unit) => {
            let (y, z) = unit.any_orthonormal_pair();
            DMat3::from_cols(x, y, z)
        }
        None => DMat3::from_cols(x, DVec3::Y, DVec3::Z),
    }
}

/// A stated spacing, or 1 with a note where it is 0 or not finite. The sign is kept.
pub(crate) fn usable_spacing(stated: f64, axis: char, notes: &mut Vec<Note>) -> f64 {
    let reason = match stated {
        v if v.is_nan() => "is not a number",
        v if v.is_infinite() => "is infinite",
        0.0 => "is 0",
        v => return v,
    };
    notes.push(Note::SpacingAssumed { axis, reason });
    1.0
}

/// Whether an axis of the volume goes in another direction than that of the world.
#[cfg(any(feature = "nifti", feature = "ome-zarr"))]
pub(crate) fn is_turned(grid: &Grid, axis: usize) -> bool {
    let (spacing, step) = (grid.spacing()[axis], grid.index_to_world().matrix3.col(axis));
    (step - DVec3::AXES[axis] * spacing).length() > 1e-9 * spacing
}

/// Whether the axes of the volume are those of the world, each in its direction.
#[cfg(feature = "nifti")]
pub(crate) fn is_upright(grid: &Grid) -> bool {
    (0..3).all(|axis| !is_turned(grid, axis))
}

pub(crate) const AXES: [char; 3] = ['x', 'y', 'z'];
