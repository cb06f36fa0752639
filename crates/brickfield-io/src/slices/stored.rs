//! A volume as its header describes it, and its samples: all at once, or slice by slice.

use std::ops::Range;

use brickfield_core::{Grid, Rescale, Voxels};

use super::SliceSource;
use crate::detached::{FileParts, Promised, read_detached};
use crate::file_list::FileNames;
use crate::files::ByteSource;
use crate::limits::CheckedShape;
use crate::opened::FileFacts;
use crate::samples::{append_binary, append_text, room_for, skip_text};
use crate::stored::{DataFile, Encoding, StoredSamples};
use crate::stored_type::StoredType;
use crate::{DataFiles, Folder, Opened, ReadError, VolumeFacts};

/// All that a header says of a volume.
pub(crate) struct StoredVolume {
    pub(crate) found: FileFacts,
    pub(crate) grid: Grid,
    pub(crate) rescale: Rescale,
    pub(crate) shape: CheckedShape,
    pub(crate) stored: StoredSamples,
    pub(crate) promised: Promised,
    pub(crate) place: SamplesAt,
}

/// Where samples lie.
pub(crate) enum SamplesAt {
    /// In the source at hand, under this name in messages.
    Here(&'static str),
    /// In files apart from the header.
    Files(FileNames),
}

impl StoredVolume {
    /// Reads all samples.
    pub(crate) fn read(mut self, source: &mut dyn ByteSource, files: &dyn DataFiles) -> Result<Opened, ReadError> {
        let (shape, notes) = (&self.shape, &mut self.found.notes);
        let voxels = match &self.place {
            SamplesAt::Files(names) => read_detached(names, self.promised, shape, &self.stored, files, notes)?,
            SamplesAt::Here(name) => self.stored.read(source, &self.promised.attached(name, shape), shape, notes)?,
        };
        self.found.finish_rescaled(self.grid, voxels, self.rescale)
    }

    /// Whether a slice can be had without those after it: the type of 64-bit integers depends on all of them.
    pub(crate) fn can_be_in_order(&self) -> bool {
        !matches!(self.shape.voxel.stored, StoredType::I64 | StoredType::U64)
    }

    /// Begins to read the samples in order; all files are opened and measured first.
    pub(crate) fn slices(mut self, mut source: Box<dyn ByteSource>, folder: Folder) -> Result<StoredSlices, ReadError> {
        let (shape, stored) = (self.shape, self.stored);
        let (files, current) = match self.place {
            SamplesAt::Files(names) => {
                let parts = FileParts::new(&names, self.promised, &shape)?;
                parts.check(&names, &shape, &stored, &folder)?;
                (Some(Files { left: parts.files(), names, parts, folder }), None)
            }
            SamplesAt::Here(name) => {
                let part = self.promised.attached(name, &shape);
                stored.seek_samples(&mut *source, &part, shape.voxel)?;
                (None, Some(OneFile::new(source, &part, &shape, &stored)?))
            }
        };
        let n_left = shape.n_voxels();
        // Notes the type, if it is another one than the file's.
        shape.converted(room_for(shape.scalar, 0)?, &mut self.found.notes)?;
        let facts = self.found.described(self.grid, shape.scalar, self.rescale)?;
        Ok(StoredSlices { facts, shape, stored, files, current, n_left, n_slices: 0 })
    }
}

/// Samples that are read in order.
pub(crate) struct StoredSlices {
    facts: VolumeFacts,
    shape: CheckedShape,
    stored: StoredSamples,
    files: Option<Files>,
    current: Option<OneFile>,
    /// Voxels that have not been read.
    n_left: usize,
    n_slices: u64,
}

/// The files that have not been opened yet.
struct Files {
    names: FileNames,
    parts: FileParts,
    left: Range<usize>,
    folder: Folder,
}

/// A file in which the next voxel lies.
struct OneFile {
    name: String,
    samples: Samples,
    n_left: usize,
    /// Whether the file has no voxels after those that are wanted.
    is_to_end: bool,
    #[cfg_attr(not(feature = "gzip"), allow(dead_code, reason = "only packed data have an end of their own"))]
    n_bytes_to_end: u64,
}

enum Samples {
    Plain(Box<dyn ByteSource>),
    #[cfg(feature = "gzip")]
    Inflated(Box<dyn std::io::Read>),
}

impl OneFile {
    /// The samples of a source that has been sought to them.
    fn new(
        #[allow(unused_mut)] mut source: Box<dyn ByteSource>,
        part: &DataFile,
        shape: &CheckedShape,
        stored: &StoredSamples,
    ) -> Result<OneFile, ReadError> {
        let samples = match stored.encoding {
            #[cfg(feature = "gzip")]
            Encoding::Deflate => Samples::Inflated(stored.inflated(source, part, shape)?),
            Encoding::Text => {
                skip_text(&mut *source, part.n_before as usize * shape.voxel.n_components as usize, part.name)?;
                Samples::Plain(source)
            }
            Encoding::Raw => Samples::Plain(source),
        };
        let is_to_end = part.n_voxels == part.n_to_end();
        let n_bytes = part.n_to_end().saturating_mul(shape.voxel.n_bytes() as u128);
        let n_bytes_to_end = u64::try_from(n_bytes).unwrap_or(u64::MAX);
        Ok(OneFile { name: part.name.to_owned(), samples, n_left: part.n_wanted, is_to_end, n_bytes_to_end })
    }
}

impl StoredSlices {
    /// The file with the next voxel.
    fn file(&mut self) -> Result<&mut OneFile, ReadError> {
        if self.current.is_none() {
            let next = self.files.as_mut().and_then(|files| files.left.next().map(|i| (files, i)));
            let (files, i) = next.ok_or(ReadError::Missing { field: "a file with the rest of the data" })?;
            let name = files.names.name(i);
            let part = files.parts.part(i, &name);
            let mut source = files.folder.open_owned(&name)?;
            self.stored.seek_samples(&mut *source, &part, self.shape.voxel)?;
            self.current = Some(OneFile::new(source, &part, &self.shape, &self.stored)?);
        }
        self.current.as_mut().ok_or(ReadError::Missing { field: "a file with the rest of the data" })
    }

    /// Appends voxels of the current file, `n` at most; those read.
    fn append(&mut self, voxels: &mut Voxels, n: usize, slices: &str) -> Result<usize, ReadError> {
        let (stored, voxel) = (self.stored, self.shape.voxel);
        let file = self.file()?;
        let n = n.min(file.n_left);
        let what = format!("{slices} of {}", file.name);
        match &mut file.samples {
            Samples::Plain(source) if stored.encoding == Encoding::Text => {
                append_text(voxels, &mut **source, n, voxel, &what)?;
            }
            Samples::Plain(source) => append_binary(voxels, &mut &mut **source, n, voxel, stored.order, &what)?,
            #[cfg(feature = "gzip")]
            Samples::Inflated(source) => append_binary(voxels, &mut **source, n, voxel, stored.order, &what)?,
        }
        file.n_left -= n;
        if file.n_left == 0 {
            self.leave()?;
        }
        Ok(n)
    }

    /// What comes after the last voxel of a file: a checksum, or too much.
    fn leave(&mut self) -> Result<(), ReadError> {
        let Some(mut file) = self.current.take().filter(|file| file.is_to_end) else { return Ok(()) };
        let notes = &mut self.facts.notes;
        match &mut file.samples {
            Samples::Plain(source) => crate::stored::note_rest(&mut **source, self.stored.encoding, notes),
            #[cfg(feature = "gzip")]
            Samples::Inflated(source) => {
                crate::deflate::check_end(&mut **source, &file.name, file.n_bytes_to_end, notes)
            }
        }
    }
}

impl SliceSource for StoredSlices {
    fn facts(&self) -> &VolumeFacts {
        &self.facts
    }

    fn next_slices(&mut self, n: u32) -> Result<Voxels, ReadError> {
        let dims = self.shape.dims;
        let n_slice = dims.x as usize * dims.y as usize;
        let n_wanted = n_slice.saturating_mul(n as usize).min(self.n_left);
        let mut voxels = room_for(self.shape.scalar, n_wanted)?;
        let end = self.n_slices + (n_wanted / n_slice) as u64;
        let slices = format!("slices {} to {}", self.n_slices, end.saturating_sub(1));
        while voxels.len() < n_wanted {
            let n_missing = n_wanted - voxels.len();
            self.append(&mut voxels, n_missing, &slices)?;
        }
        self.n_left -= n_wanted;
        self.n_slices = end;
        Ok(voxels)
    }
}
