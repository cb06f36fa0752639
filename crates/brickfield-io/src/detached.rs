//! Voxels that lie in one or many files apart from the header.

use brickfield_core::Voxels;

use crate::error::counted;
use crate::file_list::FileNames;
use crate::files::{DataFiles, open_named};
use crate::limits::CheckedShape;
use crate::samples::allocate;
use crate::stored::{DataFile, StoredSamples};
use crate::{Note, ReadError};

/// Reads the shape's voxels: the first ones of `n_promised` samples that are spread evenly over the files.
///
/// All files are opened and measured before the voxels are allocated.
pub(crate) fn read_detached(
    names: &FileNames,
    n_promised: u128,
    shape: &CheckedShape,
    stored: &StoredSamples,
    files: &dyn DataFiles,
    notes: &mut Vec<Note>,
) -> Result<Voxels, ReadError> {
    let n_per_file = samples_per_file(names, n_promised)?;
    let parts = || {
        let n_voxels = shape.n_voxels() as u128;
        (0..n_voxels.div_ceil(n_per_file)).map(move |i| {
            let n_wanted = n_per_file.min(n_voxels - i * n_per_file) as usize;
            (names.name(i as usize), n_wanted)
        })
    };
    let sample_bytes = shape.scalar.n_bytes();
    for (name, n_wanted) in parts() {
        let part = DataFile { name: &name, n_samples: n_per_file, n_wanted };
        stored.seek_samples(&mut *open_named(files, &name)?, &part, sample_bytes)?;
    }
    let mut voxels = allocate(shape)?;
    for (name, n_wanted) in parts() {
        let part = DataFile { name: &name, n_samples: n_per_file, n_wanted };
        let mut source = open_named(files, &name)?;
        stored.seek_samples(&mut *source, &part, sample_bytes)?;
        stored.append(&mut voxels, &mut *source, &part, notes)?;
    }
    Ok(voxels)
}

fn samples_per_file(names: &FileNames, n_promised: u128) -> Result<u128, ReadError> {
    let n_files = names.n_files();
    if n_files == 0 || !n_promised.is_multiple_of(n_files) {
        let expected = format!("a divisor of the {}, above 0", counted(n_promised, "sample", "samples"));
        return Err(ReadError::field("number of data files", n_files, expected));
    }
    Ok(n_promised / n_files)
}
