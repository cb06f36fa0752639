//! Even slices from uneven ones.

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Grid, Scalar, Volume, Voxels, with_voxels};

use crate::limits::Shape;
use crate::{Limits, Note, Opened, ReadError};

impl Opened {
    /// The volume on even slices, so that it has its true proportions: if a note says that slices are unevenly spaced, each
    /// new one is the linear mix of the two around it, rounded to the volume's scalar type; else nothing changes.
    ///
    /// The first and the last slice stay where they are; between them lie as many whole steps as come nearest to the median.
    ///
    /// # Errors
    /// If the even slices would take more bytes than the limit.
    pub fn evenly_spaced(mut self, limits: &Limits) -> Result<Opened, ReadError> {
        let uneven = |n: &&mut Note| matches!(n, Note::UnevenSpacing { .. });
        let Some(note) = self.notes.iter_mut().find(uneven) else { return Ok(self) };
        let Note::UnevenSpacing { positions, min_step, median_step, max_step, .. } = note else { return Ok(self) };
        let (Some(extent), n) = (positions.last(), self.volume.grid().dims()) else { return Ok(self) };
        let n_steps = (extent / *median_step).round().max(1.0);
        let shape = Shape::claim([n.x.into(), n.y.into(), n_steps as u64 + 1], self.volume.scalar_type(), limits)?;
        let step = extent / n_steps;
        let grid = even_grid(self.volume.grid(), shape.dims, step)?;
        let n_slice = n.x as usize * n.y as usize;
        let voxels = with_voxels!(self.volume.voxels(), v => even(v, n_slice, positions, shape.dims.z, step));
        *note = Note::EvenSlices {
            n_slices: positions.len(),
            min_step: *min_step,
            max_step: *max_step,
            n_even: shape.dims.z as usize,
            step,
        };
        self.volume = Volume::new(grid, voxels)?;
        Ok(self)
    }
}

/// The grid with other slices, the first one where it was.
fn even_grid(grid: &Grid, dims: UVec3, step: f64) -> Result<Grid, ReadError> {
    let map = grid.index_to_world();
    let first_sample = map.transform_point3(DVec3::splat(0.5));
    let spacing = DVec3::new(grid.spacing().x, grid.spacing().y, step);
    Ok(Grid::from_first_sample(dims, spacing, first_sample, map.matrix3)?)
}

/// Slices of `n_slice` voxels at `positions`, ascending, resampled at `n` multiples of `step`.
fn even<T: Scalar>(voxels: &[T], n_slice: usize, positions: &[f64], n: u32, step: f64) -> Voxels {
    let slice = |i: usize| &voxels[i * n_slice..][..n_slice];
    let mut out = Vec::with_capacity(n_slice * n as usize);
    for at in (0..n).map(|k| f64::from(k) * step) {
        let after = positions.partition_point(|p| *p <= at).clamp(1, positions.len() - 1);
        let (low, high) = (positions[after - 1], positions[after]);
        let share = ((at - low) / (high - low)).clamp(0.0, 1.0);
        let mix = |(a, b): (&T, &T)| T::from_f64((1.0 - share) * a.to_f64() + share * b.to_f64());
        out.extend(slice(after - 1).iter().zip(slice(after)).map(mix));
    }
    T::wrap(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Format, WorldFrame};

    /// Two voxels a slice, whose values are ten times the slice's position.
    fn opened(positions: &[f64], median_step: f64) -> Opened {
        let grid =
            Grid::axis_aligned(UVec3::new(2, 1, positions.len() as u32), DVec3::new(1.0, 1.0, median_step)).unwrap();
        let voxels: Vec<i16> = positions.iter().flat_map(|p| [(10.0 * p) as i16, -(10.0 * p) as i16]).collect();
        let note = Note::UnevenSpacing {
            positions: positions.to_vec(),
            min_step: 1.0,
            median_step,
            max_step: 3.0,
            max_shift: 2.0,
        };
        Opened {
            volume: Volume::new(grid, voxels).unwrap(),
            format: Format::Dicom,
            frame: WorldFrame::Lps,
            unit: None,
            notes: vec![Note::GantryTilt { degrees: 1.0 }, note],
        }
    }

    #[test]
    fn what_is_linear_along_the_stack_stays_so() {
        let even = opened(&[0.0, 1.0, 2.0, 5.0, 6.1], 1.0).evenly_spaced(&Limits::default()).unwrap();
        let grid = even.volume.grid();
        assert_eq!(grid.dims(), UVec3::new(2, 1, 7));
        assert!((grid.spacing().z - 6.1 / 6.0).abs() < 1e-12);
        // The first sample stays where it was.
        assert!((grid.index_to_world().transform_point3(DVec3::splat(0.5)).z - 0.5).abs() < 1e-12);
        let expected: Vec<i16> =
            (0..7).map(|k| (f64::from(k) * 61.0 / 6.0).round() as i16).flat_map(|v| [v, -v]).collect();
        assert_eq!(even.volume.voxels(), &Voxels::I16(expected));
        assert_eq!(even.notes.len(), 2);
        assert!(even.notes[1].to_string().contains("5 slices") && even.notes[1].to_string().contains("onto 7"));
    }

    #[test]
    fn even_slices_are_left_alone_and_limits_hold() {
        let plain = Opened { notes: vec![], ..opened(&[0.0, 1.0, 2.0], 1.0) };
        assert_eq!(plain.clone().evenly_spaced(&Limits::default()).unwrap(), plain);
        let far = opened(&[0.0, 1.0, 2.0, 1e12], 1.0).evenly_spaced(&Limits { max_bytes: 1 << 20 });
        assert!(far.is_err(), "{far:?}");
    }
}
