//! Even slices from uneven ones.

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Grid, Scalar, Volume, Voxels, with_voxels};

use crate::limits::CheckedShape;
use crate::numbers::with_room;
use crate::{Limits, Note, Opened};

/// Most even slices for each uneven one: stacks with wider gaps stay as they are.
const MOST_PER_SLICE: f64 = 8.0;

impl Opened {
    /// The volume on even slices, so that it has its true proportions: if a note says that slices are unevenly spaced, each
    /// new one is the linear mix of the two around it, rounded to the volume's scalar type; else nothing changes.
    ///
    /// The first and the last slice stay where they are; the step between is near the lower quartile of the file's, so that
    /// there are never fewer slices than before. Nothing changes either, and the note stays, where slices are not in order
    /// along the stack, where there would be more than eight for each, or more bytes than the limit or the memory.
    pub fn evenly_spaced(self, limits: &Limits) -> Opened {
        let resampled = self.notes.iter().enumerate().find_map(|(i, note)| match note {
            Note::UnevenSpacing { positions, .. } => Some((i, resampled(&self.volume, positions, limits)?)),
            _ => None,
        });
        let Some((i, (volume, note))) = resampled else { return self };
        let mut notes = self.notes;
        notes[i] = note;
        Opened { volume, notes, ..self }
    }
}

/// The even volume of slices at `positions`, if there can be one, and the note about it.
fn resampled(volume: &Volume, positions: &[f64], limits: &Limits) -> Option<(Volume, Note)> {
    let dims = volume.grid().dims();
    let steps = steps(positions).filter(|steps| steps.len() + 1 == dims.z as usize)?;
    let (n_slices, extent) = (positions.len(), positions[positions.len() - 1]);
    let n_steps = (extent / steps[steps.len() / 4]).round().max(steps.len() as f64);
    if n_steps > MOST_PER_SLICE * n_slices as f64 {
        return None;
    }
    let n_even = n_steps as u64 + 1;
    let shape = CheckedShape::claim([dims.x.into(), dims.y.into(), n_even], volume.scalar_type(), limits).ok()?;
    let step = extent / n_steps;
    let voxels = with_voxels!(volume.voxels(), v => even(v, &shape, positions, step))?;
    let grid = even_grid(volume.grid(), shape.dims, step)?;
    let (min_step, max_step) = (steps[0], steps[steps.len() - 1]);
    let note = Note::EvenSlices { n_slices, min_step, max_step, n_even: n_even as usize, step };
    Some((Volume::rescaled(grid, voxels, volume.rescale()).ok()?, note))
}

/// The steps between positions, the least first; `None` if the positions do not ascend from 0.
fn steps(positions: &[f64]) -> Option<Vec<f64>> {
    let mut steps: Vec<f64> = positions.windows(2).map(|w| w[1] - w[0]).collect();
    steps.sort_by(f64::total_cmp);
    let ascend = steps.iter().all(|s| s.is_finite() && *s > 0.0);
    (ascend && !steps.is_empty() && positions[0] == 0.0).then_some(steps)
}

/// The grid with other slices, the first one where it was.
fn even_grid(grid: &Grid, dims: UVec3, step: f64) -> Option<Grid> {
    let map = grid.index_to_world();
    let first_sample = map.transform_point3(DVec3::splat(0.5));
    let spacing = DVec3::new(grid.spacing().x, grid.spacing().y, step);
    Grid::from_first_sample(dims, spacing, first_sample, map.matrix3).ok()
}

/// Slices at multiples of `step`, mixed from the slices at `positions`; `None` if there is no memory for them.
fn even<T: Scalar>(voxels: &[T], shape: &CheckedShape, positions: &[f64], step: f64) -> Option<Voxels> {
    let mut out = with_room(shape.n_voxels()).ok()?;
    let n_slice = voxels.len() / positions.len();
    let slice = |i: usize| &voxels[i * n_slice..][..n_slice];
    for at in (0..shape.dims.z).map(|k| f64::from(k) * step) {
        let after = positions.partition_point(|p| *p <= at).clamp(1, positions.len() - 1);
        let (low, high) = (positions[after - 1], positions[after]);
        let share = ((at - low) / (high - low)).clamp(0.0, 1.0);
        let mix = |(a, b): (&T, &T)| T::from_f64((1.0 - share) * a.to_f64() + share * b.to_f64());
        out.extend(slice(after - 1).iter().zip(slice(after)).map(mix));
    }
    Some(T::wrap(out))
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
            choices: vec![],
        }
    }

    #[test]
    fn what_is_linear_along_the_stack_stays_so() {
        let even = opened(&[0.0, 1.0, 2.0, 5.0, 6.1], 1.0).evenly_spaced(&Limits::default());
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
    fn no_slices_are_thrown_away() {
        let n_even = |positions: &[f64], median| {
            opened(positions, median).evenly_spaced(&Limits::default()).volume.grid().dims().z
        };
        assert_eq!(n_even(&[0.0, 1.0, 10.0], 9.0), 11);
        let fine_then_coarse: Vec<f64> =
            (0..21).map(f64::from).chain((1..=20).map(|k| 20.0 + 5.0 * f64::from(k))).collect();
        assert_eq!(n_even(&fine_then_coarse, 5.0), 121);
        // One short step is not worth a fine grid.
        assert_eq!(n_even(&[0.0, 2.0, 4.0, 4.5, 6.0, 8.0], 2.0), 6);
    }

    #[test]
    fn what_cannot_be_made_even_is_left_alone() {
        let same = |opened: Opened, max_bytes| assert_eq!(opened.clone().evenly_spaced(&Limits { max_bytes }), opened);
        same(Opened { notes: vec![], ..opened(&[0.0, 1.0, 2.0], 1.0) }, 1 << 20);
        for positions in [
            &[0.0, 1.0, 2.0, 1e20][..],
            &[0.0, 1.0, 2.0, 100.0],
            &[0.0, 29.95, 0.2, 30.15],
            &[0.0, 1.0, 1.0],
            &[0.0, -1.0, -3.0],
            &[0.0],
        ] {
            same(opened(positions, 1.0), 1 << 20);
        }
        same(opened(&[0.0, 1.0, 4.0], 1.0), 16);
        // Notes that are not of this volume.
        let mut other = opened(&[0.0, 1.0, 4.0], 1.0);
        other.volume = opened(&[0.0, 1.0], 1.0).volume;
        same(other, 1 << 20);
    }
}
