//! Voxels that lie in one or many files apart from the header.

use brickfield_core::Voxels;

use crate::error::counted;
use crate::file_list::FileNames;
use crate::files::{DataFiles, open_named};
use crate::limits::CheckedShape;
use crate::samples::allocate;
use crate::stored::{DataFile, StoredSamples};
use crate::{Note, ReadError};

/// The voxels that a header promises, and how many of them come before those that are wanted.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Promised {
    pub(crate) n_voxels: u128,
    pub(crate) n_before: u128,
}

impl Promised {
    /// The data that follow the header.
    pub(crate) fn attached(self, shape: &CheckedShape) -> DataFile<'static> {
        let Promised { n_voxels, n_before } = self;
        DataFile { name: "the data after the header", n_voxels, n_before, n_wanted: shape.n_voxels() }
    }
}

/// Reads the shape's voxels: some of those promised, which are spread evenly over the files.
///
/// All files are opened and measured before the voxels are allocated.
pub(crate) fn read_detached(
    names: &FileNames,
    promised: Promised,
    shape: &CheckedShape,
    stored: &StoredSamples,
    files: &dyn DataFiles,
    notes: &mut Vec<Note>,
) -> Result<Voxels, ReadError> {
    let n_per_file = voxels_per_file(names, promised.n_voxels)?;
    let start = promised.n_before;
    let end = start + shape.n_voxels() as u128;
    let parts = || {
        (start / n_per_file..end.div_ceil(n_per_file)).map(move |i| {
            let n_before = start.saturating_sub(i * n_per_file);
            let n_wanted = n_per_file.min(end - i * n_per_file) - n_before;
            (names.name(i as usize), n_before, n_wanted as usize)
        })
    };
    for (name, n_before, n_wanted) in parts() {
        let part = DataFile { name: &name, n_voxels: n_per_file, n_before, n_wanted };
        stored.seek_samples(&mut *open_named(files, &name)?, &part, shape.voxel)?;
    }
    let mut voxels = allocate(shape)?;
    for (name, n_before, n_wanted) in parts() {
        let part = DataFile { name: &name, n_voxels: n_per_file, n_before, n_wanted };
        let mut source = open_named(files, &name)?;
        stored.seek_samples(&mut *source, &part, shape.voxel)?;
        stored.append(&mut voxels, &mut *source, &part, shape, notes)?;
    }
    shape.converted(voxels, notes)
}

fn voxels_per_file(names: &FileNames, n_promised: u128) -> Result<u128, ReadError> {
    let n_files = names.n_files();
    if n_files == 0 || !n_promised.is_multiple_of(n_files) {
        let expected = format!("a divisor of the {}, above 0", counted(n_promised, "voxel", "voxels"));
        return Err(ReadError::field("number of data files", n_files, expected));
    }
    Ok(n_promised / n_files)
}
