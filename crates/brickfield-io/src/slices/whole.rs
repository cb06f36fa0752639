//! Slices of a volume that is whole in memory.

use brickfield_core::{Scalar, Voxels, with_voxels};

use super::SliceSource;
use crate::{Limits, Note, Opened, ReadError, VolumeFacts};

pub(super) struct WholeSlices {
    facts: VolumeFacts,
    voxels: Voxels,
    n_read: usize,
}

impl WholeSlices {
    pub(super) fn new(opened: Opened, limits: &Limits) -> WholeSlices {
        let Opened { volume, format, frame, unit, mut notes, choices } = opened.evenly_spaced(limits);
        let (grid, scalar, rescale) = (*volume.grid(), volume.scalar_type(), volume.rescale());
        notes.push(Note::ReadWhole { n_bytes: (volume.voxels().len() * scalar.n_bytes()) as u64 });
        let facts = VolumeFacts { grid, scalar, rescale, format, frame, unit, notes, choices };
        WholeSlices { facts, voxels: volume.into_voxels(), n_read: 0 }
    }
}

impl SliceSource for WholeSlices {
    fn facts(&self) -> &VolumeFacts {
        &self.facts
    }

    fn next_slices(&mut self, n: u32) -> Result<Voxels, ReadError> {
        fn part<T: Scalar>(voxels: &[T]) -> Voxels {
            T::wrap(voxels.to_vec())
        }
        let dims = self.facts.grid.dims();
        let n_voxels = dims.x as usize * dims.y as usize * n as usize;
        let start = self.n_read;
        self.n_read = self.voxels.len().min(start.saturating_add(n_voxels));
        Ok(with_voxels!(&self.voxels, v => part(&v[start..self.n_read])))
    }
}
