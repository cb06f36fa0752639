//! The files that a header names: on disk, or in memory.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Cursor, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use crate::ReadError;

/// Bytes that can be read and sought.
pub trait ByteSource: BufRead + Seek {}
impl<T: BufRead + Seek + ?Sized> ByteSource for T {}

/// Finds the files that a header names (detached data, slices).
pub trait DataFiles {
    /// Opens the file of this name, relative to the header.
    ///
    /// # Errors
    /// If there is no such regular file.
    fn open(&self, name: &str) -> io::Result<Box<dyn ByteSource + '_>>;
}

/// The files of a folder on disk. Names may lead out of it, as NRRD and MetaImage allow; only regular files open.
#[derive(Clone, Debug)]
pub struct Folder(pub PathBuf);

impl DataFiles for Folder {
    fn open(&self, name: &str) -> io::Result<Box<dyn ByteSource + '_>> {
        Ok(Box::new(BufReader::with_capacity(1 << 16, open_regular(&self.0.join(name))?)))
    }
}

impl Folder {
    /// As [`open`](DataFiles::open), for as long as one likes.
    pub(crate) fn open_owned(&self, name: &str) -> Result<Box<dyn ByteSource>, ReadError> {
        let file = open_regular(&self.0.join(name)).map_err(|e| ReadError::io(format!("data file {name:?}"), e))?;
        Ok(Box::new(BufReader::with_capacity(1 << 16, file)))
    }
}

/// Files in memory, by name.
impl DataFiles for BTreeMap<String, Vec<u8>> {
    fn open(&self, name: &str) -> io::Result<Box<dyn ByteSource + '_>> {
        let bytes = self.get(name).ok_or(io::ErrorKind::NotFound)?;
        Ok(Box::new(Cursor::new(bytes.as_slice())))
    }
}

/// No files at all: every name is unknown.
#[derive(Clone, Copy, Debug)]
pub struct NoFiles;

impl DataFiles for NoFiles {
    fn open(&self, _: &str) -> io::Result<Box<dyn ByteSource + '_>> {
        Err(io::ErrorKind::NotFound.into())
    }
}

/// Opens a file, but no pipe and no device: a pipe could block, a device never end.
pub(crate) fn open_regular(path: &Path) -> io::Result<File> {
    if !path.metadata()?.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file"));
    }
    File::open(path)
}

pub(crate) fn open_named<'a>(files: &'a dyn DataFiles, name: &str) -> Result<Box<dyn ByteSource + 'a>, ReadError> {
    files.open(name).map_err(|e| ReadError::io(format!("data file {name:?}"), e))
}

/// Whether a path with slashes stays in the folder.
#[cfg(any(feature = "tiff", feature = "ome-zarr", feature = "vti"))]
pub(crate) fn stays_within(path: &str) -> bool {
    path.split('/').all(|part| !matches!(part, "" | "." | "..")) && !path.contains(['\\', ':', '\0'])
}

/// Bytes from the current position to the end; the position stays.
pub(crate) fn n_bytes_left(source: &mut dyn ByteSource) -> Result<u64, ReadError> {
    let measure = |s: &mut dyn ByteSource| -> io::Result<u64> {
        let here = s.stream_position()?;
        let end = s.seek(SeekFrom::End(0))?;
        s.seek(SeekFrom::Start(here))?;
        Ok(end.saturating_sub(here))
    };
    measure(source).map_err(|e| ReadError::io("the length of the file", e))
}

/// At most `max` bytes from the start of the source.
pub(crate) fn read_head(source: &mut dyn ByteSource, max: u64) -> Result<Vec<u8>, ReadError> {
    let mut head = Vec::new();
    source.take(max).read_to_end(&mut head).map_err(|e| ReadError::io("the start of the file", e))?;
    Ok(head)
}
