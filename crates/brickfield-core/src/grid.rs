//! Where the voxels of a volume lie in the world.

use glam::{DAffine3, DMat3, DVec3, UVec3};

use crate::{Aabb, IndexPos, WorldPos};

/// Dimensions of a volume and its affine map to the world.
///
/// World = origin + direction * spacing * index; the origin is the outer corner of voxel (0, 0, 0).
/// The determinant of the direction may be negative (a mirrored volume).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    dims: UVec3,
    spacing: DVec3,
    index_to_world: DAffine3,
    world_to_index: DAffine3,
}

/// Why a grid could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum GridError {
    #[error("volume dimension {axis} is {value}; it must be at least 1")]
    EmptyDimension { axis: char, value: u32 },
    #[error("volume of {} x {} x {} voxels has more voxels than this machine can index", dims.x, dims.y, dims.z)]
    TooManyVoxels { dims: UVec3 },
    #[error("spacing {axis} is {value}; it must be finite and above 0")]
    Spacing { axis: char, value: f64 },
    #[error("origin {origin} is not finite")]
    Origin { origin: DVec3 },
    #[error(
        "direction matrix {direction} has determinant {determinant:e}; its columns must be finite and independent (|determinant| of the unit columns above 1e-6)"
    )]
    Direction { direction: DMat3, determinant: f64 },
}

const AXES: [char; 3] = ['x', 'y', 'z'];

impl Grid {
    /// A grid from the world position of the **first sample** (the centre of voxel 0), as files state it.
    ///
    /// `direction` holds one column per index axis; the columns are normalised, the lengths are in `spacing`.
    ///
    /// # Errors
    /// A zero dimension, more voxels than `usize`, a spacing that is not finite and positive, a singular direction.
    pub fn from_first_sample(
        dims: UVec3,
        spacing: DVec3,
        first_sample: DVec3,
        direction: DMat3,
    ) -> Result<Grid, GridError> {
        check_dims(dims)?;
        for (axis, value) in AXES.into_iter().zip(spacing.to_array()) {
            if !(value.is_finite() && value > 0.0) {
                return Err(GridError::Spacing { axis, value });
            }
        }
        if !first_sample.is_finite() {
            return Err(GridError::Origin { origin: first_sample });
        }
        let unit = DMat3::from_cols(
            direction.x_axis.normalize_or_zero(),
            direction.y_axis.normalize_or_zero(),
            direction.z_axis.normalize_or_zero(),
        );
        let determinant = unit.determinant();
        if determinant.is_nan() || determinant.abs() <= 1e-6 {
            return Err(GridError::Direction { direction, determinant });
        }
        let linear = unit * DMat3::from_diagonal(spacing);
        let index_to_world = DAffine3::from_mat3_translation(linear, first_sample - linear * DVec3::splat(0.5));
        Ok(Grid { dims, spacing, index_to_world, world_to_index: index_to_world.inverse() })
    }

    /// An axis-aligned grid with its outer corner at the world's origin.
    ///
    /// # Errors
    /// As [`from_first_sample`](Self::from_first_sample).
    pub fn axis_aligned(dims: UVec3, spacing: DVec3) -> Result<Grid, GridError> {
        Grid::from_first_sample(dims, spacing, spacing * 0.5, DMat3::IDENTITY)
    }

    /// Voxels along x, y, z.
    pub fn dims(&self) -> UVec3 {
        self.dims
    }

    /// Number of voxels.
    pub fn n_voxels(&self) -> usize {
        self.dims.to_array().into_iter().map(|n| n as usize).product()
    }

    /// Distance between neighbouring samples along each index axis, in world units.
    pub fn spacing(&self) -> DVec3 {
        self.spacing
    }

    /// The affine map from index space to the world.
    pub fn index_to_world(&self) -> DAffine3 {
        self.index_to_world
    }

    /// The affine map from the world to index space.
    pub fn world_to_index(&self) -> DAffine3 {
        self.world_to_index
    }

    /// World position of an index position.
    pub fn world(&self, p: IndexPos) -> WorldPos {
        WorldPos(self.index_to_world.transform_point3(p.0))
    }

    /// Index position of a world position.
    pub fn index(&self, p: WorldPos) -> IndexPos {
        IndexPos(self.world_to_index.transform_point3(p.0))
    }

    /// The box of all voxels in index space: [0, dims).
    pub fn index_box(&self) -> Aabb {
        Aabb { min: DVec3::ZERO, max: self.dims.as_dvec3() }
    }

    /// The axis-aligned world box that encloses all voxels.
    pub fn world_box(&self) -> Aabb {
        Aabb::of_points(self.index_box().corners().map(|c| self.index_to_world.transform_point3(c)))
    }
}

fn check_dims(dims: UVec3) -> Result<(), GridError> {
    for (axis, value) in AXES.into_iter().zip(dims.to_array()) {
        if value == 0 {
            return Err(GridError::EmptyDimension { axis, value });
        }
    }
    let n = dims.to_array().into_iter().try_fold(1usize, |n, d| n.checked_mul(d as usize));
    n.filter(|n| *n <= isize::MAX as usize / 8).map(|_| ()).ok_or(GridError::TooManyVoxels { dims })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_sample_lies_at_voxel_centre() {
        let direction = DMat3::from_cols(DVec3::Y, DVec3::X, -DVec3::Z);
        let grid = Grid::from_first_sample(
            UVec3::new(4, 5, 6),
            DVec3::new(1.0, 2.0, 3.0),
            DVec3::new(7.0, 8.0, 9.0),
            direction,
        )
        .unwrap();
        let at = |x, y, z| grid.world(IndexPos(DVec3::new(x, y, z))).0;
        assert_eq!(at(0.5, 0.5, 0.5), DVec3::new(7.0, 8.0, 9.0));
        assert_eq!(at(1.5, 0.5, 0.5), DVec3::new(7.0, 9.0, 9.0));
        assert_eq!(at(0.5, 1.5, 0.5), DVec3::new(9.0, 8.0, 9.0));
        assert_eq!(at(0.5, 0.5, 1.5), DVec3::new(7.0, 8.0, 6.0));
    }

    #[test]
    fn bad_grids_are_named() {
        let grid = |dims: [u32; 3], spacing: [f64; 3], direction| {
            Grid::from_first_sample(UVec3::from(dims), DVec3::from(spacing), DVec3::ZERO, direction)
                .unwrap_err()
                .to_string()
        };
        assert!(grid([4, 0, 4], [1.0; 3], DMat3::IDENTITY).contains("dimension y is 0"));
        assert!(grid([u32::MAX; 3], [1.0; 3], DMat3::IDENTITY).contains("more voxels"));
        assert!(grid([4; 3], [1.0, f64::NAN, 1.0], DMat3::IDENTITY).contains("spacing y is NaN"));
        assert!(grid([4; 3], [1.0, 1.0, -2.0], DMat3::IDENTITY).contains("spacing z is -2"));
        assert!(grid([4; 3], [1.0; 3], DMat3::ZERO).contains("determinant"));
    }
}
