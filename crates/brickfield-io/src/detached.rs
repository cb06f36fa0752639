//! Voxels that lie in one or many files apart from the header.

use std::ops::Range;

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
    /// The data in the same file as the header.
    pub(crate) fn attached(self, name: &'static str, shape: &CheckedShape) -> DataFile<'static> {
        let Promised { n_voxels, n_before } = self;
        DataFile { name, n_voxels, n_before, n_wanted: shape.n_voxels() }
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
    let parts = FileParts::new(names, promised, shape)?;
    parts.check(names, shape, stored, files)?;
    let mut voxels = allocate(shape)?;
    for i in parts.files() {
        let name = names.name(i);
        let part = parts.part(i, &name);
        let mut source = open_named(files, &name)?;
        stored.seek_samples(&mut *source, &part, shape.voxel)?;
        stored.append(&mut voxels, &mut *source, &part, shape, notes)?;
    }
    shape.converted(voxels, notes)
}

/// Voxels that are spread evenly over files, and which of them are wanted.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FileParts {
    n_per_file: u128,
    start: u128,
    end: u128,
}

impl FileParts {
    /// # Errors
    /// If the voxels cannot be spread evenly over the files.
    pub(crate) fn new(names: &FileNames, promised: Promised, shape: &CheckedShape) -> Result<FileParts, ReadError> {
        let n_per_file = voxels_per_file(names, promised.n_voxels)?;
        let start = promised.n_before;
        Ok(FileParts { n_per_file, start, end: start + shape.n_voxels() as u128 })
    }

    /// The numbers of the files with voxels that are wanted.
    pub(crate) fn files(&self) -> Range<usize> {
        (self.start / self.n_per_file) as usize..self.end.div_ceil(self.n_per_file) as usize
    }

    /// What is wanted of a file.
    pub(crate) fn part<'a>(&self, i: usize, name: &'a str) -> DataFile<'a> {
        let before_file = i as u128 * self.n_per_file;
        let n_before = self.start.saturating_sub(before_file);
        let n_wanted = (self.n_per_file.min(self.end - before_file) - n_before) as usize;
        DataFile { name, n_voxels: self.n_per_file, n_before, n_wanted }
    }

    /// Opens and measures all files.
    pub(crate) fn check(
        &self,
        names: &FileNames,
        shape: &CheckedShape,
        stored: &StoredSamples,
        files: &dyn DataFiles,
    ) -> Result<(), ReadError> {
        for i in self.files() {
            let name = names.name(i);
            stored.seek_samples(&mut *open_named(files, &name)?, &self.part(i, &name), shape.voxel)?;
        }
        Ok(())
    }
}

fn voxels_per_file(names: &FileNames, n_promised: u128) -> Result<u128, ReadError> {
    let n_files = names.n_files();
    if n_files == 0 || !n_promised.is_multiple_of(n_files) {
        let expected = format!("a divisor of the {}, above 0", counted(n_promised, "voxel", "voxels"));
        return Err(ReadError::field("number of data files", n_files, expected));
    }
    Ok(n_promised / n_files)
}
