//! How samples are stored in a data file, and reading one file of them.

#[cfg(feature = "gzip")]
use std::io::Read;
use std::io::{self, BufRead, SeekFrom};

use brickfield_core::Voxels;

use crate::error::{bytes, check_length};
use crate::files::{ByteSource, n_bytes_left};
use crate::limits::CheckedShape;
#[cfg(feature = "gzip")]
use crate::limits::{Limits, check_bytes};
use crate::note::note_surplus;
#[cfg(feature = "gzip")]
use crate::samples::skip;
use crate::samples::{allocate, append_binary, append_text, least_text_bytes, skip_text};
use crate::stored_voxel::StoredVoxel;
use crate::{ByteOrder, Note, ReadError};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Encoding {
    Raw,
    Text,
    /// zlib or gzip, told apart by the first byte.
    #[cfg(feature = "gzip")]
    Deflate,
}

/// The bytes before the samples in each data file; of a packed one, of what it unpacks to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ByteSkip {
    Bytes(u64),
    /// The samples are the last bytes of the file (not of text).
    ToFitEnd,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct StoredSamples {
    pub(crate) encoding: Encoding,
    pub(crate) order: ByteOrder,
    pub(crate) line_skip: u64,
    pub(crate) byte_skip: ByteSkip,
}

/// One data file: how many voxels it holds, how many of them come before those that are wanted, and how many are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DataFile<'a> {
    pub(crate) name: &'a str,
    pub(crate) n_voxels: u128,
    pub(crate) n_before: u128,
    pub(crate) n_wanted: usize,
}

impl DataFile<'_> {
    /// The voxels up to the last one that is wanted.
    pub(crate) fn n_to_end(&self) -> u128 {
        self.n_before.saturating_add(self.n_wanted as u128)
    }
}

impl StoredSamples {
    /// Reads all voxels of the shape from one source.
    pub(crate) fn read(
        &self,
        source: &mut dyn ByteSource,
        part: &DataFile,
        shape: &CheckedShape,
        notes: &mut Vec<Note>,
    ) -> Result<Voxels, ReadError> {
        self.seek_samples(source, part, shape.voxel)?;
        let mut voxels = allocate(shape)?;
        self.append(&mut voxels, source, part, shape, notes)?;
        shape.converted(voxels, notes)
    }

    /// Skips to the samples and checks, before anything is allocated, that the rest of the source can hold them.
    pub(crate) fn seek_samples(
        &self,
        source: &mut dyn ByteSource,
        part: &DataFile,
        voxel: StoredVoxel,
    ) -> Result<(), ReadError> {
        for _ in 0..self.line_skip {
            if skip_line(source).map_err(|e| ReadError::io(part.name, e))? == 0 {
                return Err(ReadError::field(
                    "line skip",
                    self.line_skip,
                    format!("at most the lines of {}", part.name),
                ));
            }
        }
        match self.encoding {
            Encoding::Raw => self.seek_raw(source, part, voxel.n_bytes() as u128),
            Encoding::Text => {
                self.skip_stored_bytes(source, part.name)?;
                let n_numbers = part.n_to_end().saturating_mul(u128::from(voxel.n_components));
                check_length(part.name, n_bytes_left(source)?, least_text_bytes(n_numbers))
            }
            #[cfg(feature = "gzip")]
            Encoding::Deflate => {
                let left = n_bytes_left(source)?;
                let skip = match self.byte_skip {
                    ByteSkip::Bytes(n) => u128::from(n),
                    ByteSkip::ToFitEnd => 0,
                };
                let n_bytes = part.n_to_end().saturating_mul(voxel.n_bytes() as u128);
                crate::deflate::check_ratio(part.name, left, n_bytes.saturating_add(skip))
            }
        }
    }

    fn seek_raw(&self, source: &mut dyn ByteSource, part: &DataFile, voxel_bytes: u128) -> Result<(), ReadError> {
        let expected_bytes = part.n_voxels.saturating_mul(voxel_bytes);
        match self.byte_skip {
            ByteSkip::Bytes(_) => self.skip_stored_bytes(source, part.name)?,
            ByteSkip::ToFitEnd => {
                let surplus = u128::from(n_bytes_left(source)?).saturating_sub(expected_bytes);
                seek_forward(source, surplus as u64, part.name)?;
            }
        }
        check_length(part.name, n_bytes_left(source)?, expected_bytes)?;
        seek_forward(source, (part.n_before * voxel_bytes) as u64, part.name)
    }

    fn skip_stored_bytes(&self, source: &mut dyn ByteSource, name: &str) -> Result<(), ReadError> {
        let ByteSkip::Bytes(skip) = self.byte_skip else {
            return Err(ReadError::field("byte skip", -1, "at least 0 unless the encoding is raw or gzip"));
        };
        let left = n_bytes_left(source)?;
        if skip > left {
            return Err(ReadError::field("byte skip", skip, format!("at most the {} of {name}", bytes(left))));
        }
        seek_forward(source, skip, name)
    }

    /// Appends the wanted voxels; the source is where [`seek_samples`](Self::seek_samples) left it.
    pub(crate) fn append(
        &self,
        voxels: &mut Voxels,
        source: &mut dyn ByteSource,
        part: &DataFile,
        shape: &CheckedShape,
        notes: &mut Vec<Note>,
    ) -> Result<(), ReadError> {
        match self.encoding {
            Encoding::Raw => append_binary(voxels, source, part.n_wanted, shape.voxel, self.order, part.name)?,
            Encoding::Text => {
                let n_before = part.n_before as usize * shape.voxel.n_components as usize;
                skip_text(source, n_before, part.name)?;
                append_text(voxels, source, part.n_wanted, shape.voxel, part.name)?;
            }
            #[cfg(feature = "gzip")]
            Encoding::Deflate => return self.append_inflated(voxels, source, part, shape, notes),
        }
        match part.n_voxels == part.n_to_end() {
            true => note_rest(source, self.encoding, notes),
            false => Ok(()),
        }
    }

    #[cfg(feature = "gzip")]
    fn append_inflated(
        &self,
        voxels: &mut Voxels,
        source: &mut dyn ByteSource,
        part: &DataFile,
        shape: &CheckedShape,
        notes: &mut Vec<Note>,
    ) -> Result<(), ReadError> {
        let voxel_bytes = shape.voxel.n_bytes() as u128;
        let mut inflated = self.inflated(source, part, shape)?;
        append_binary(voxels, &mut inflated, part.n_wanted, shape.voxel, self.order, part.name)?;
        if part.n_voxels == part.n_to_end() {
            let n_bytes = saturated(part.n_to_end() * voxel_bytes);
            crate::deflate::check_end(&mut inflated, part.name, n_bytes, notes)?;
        }
        Ok(())
    }
}

#[cfg(feature = "gzip")]
impl StoredSamples {
    /// The unpacked bytes of a source from the first voxel that is wanted on.
    pub(crate) fn inflated<'a>(
        &self,
        mut source: impl ByteSource + 'a,
        part: &DataFile,
        shape: &CheckedShape,
    ) -> Result<Box<dyn Read + 'a>, ReadError> {
        let voxel_bytes = shape.voxel.n_bytes() as u128;
        let n_skip = match self.byte_skip {
            ByteSkip::Bytes(n) => n,
            ByteSkip::ToFitEnd => {
                let n_bytes = measure_inflated(&mut source, part.name, &shape.limits)?;
                let expected_bytes = part.n_voxels.saturating_mul(voxel_bytes);
                check_length(part.name, n_bytes, expected_bytes)?;
                n_bytes - expected_bytes as u64
            }
        };
        let mut inflated = crate::deflate::inflate(source).map_err(|e| ReadError::io(part.name, e))?;
        skip(&mut inflated, n_skip, &format!("what is to be skipped of {}", part.name))?;
        skip(&mut inflated, saturated(part.n_before * voxel_bytes), part.name)?;
        Ok(inflated)
    }
}

#[cfg(feature = "gzip")]
pub(crate) fn saturated(n: u128) -> u64 {
    u64::try_from(n).unwrap_or(u64::MAX)
}

/// Bytes of the whole unpacked stream, of which none are kept; the source stays where it is.
#[cfg(feature = "gzip")]
fn measure_inflated(source: &mut dyn ByteSource, name: &str, limits: &Limits) -> Result<u64, ReadError> {
    let start = source.stream_position().map_err(|e| ReadError::io(name, e))?;
    let mut inflated = crate::deflate::inflate(&mut *source).map_err(|e| ReadError::io(name, e))?;
    let (mut n_bytes, mut piece) = (0u64, vec![0; 1 << 15]);
    loop {
        match inflated.read(&mut piece) {
            Ok(0) => break,
            Ok(n) => n_bytes += n as u64,
            Err(e) => return Err(ReadError::reading(name, n_bytes, u128::from(n_bytes) + 1, e)),
        }
        check_bytes(n_bytes.into(), limits, || format!("{name}, unpacked,"))?;
    }
    drop(inflated);
    source.seek(SeekFrom::Start(start)).map_err(|e| ReadError::io(name, e))?;
    Ok(n_bytes)
}

/// Notes that data go on after the last voxel.
pub(crate) fn note_rest(
    source: &mut dyn ByteSource,
    encoding: Encoding,
    notes: &mut Vec<Note>,
) -> Result<(), ReadError> {
    if has_surplus(source, encoding)? {
        note_surplus(notes);
    }
    Ok(())
}

fn has_surplus(source: &mut dyn ByteSource, encoding: Encoding) -> Result<bool, ReadError> {
    let left = n_bytes_left(source)?;
    // A line end after raw data is common and harmless.
    Ok(left > 2 && encoding == Encoding::Raw)
}

pub(crate) fn seek_forward(source: &mut dyn ByteSource, n_bytes: u64, what: &str) -> Result<(), ReadError> {
    let offset = i64::try_from(n_bytes).unwrap_or(i64::MAX);
    source.seek(SeekFrom::Current(offset)).map(|_| ()).map_err(|e| ReadError::io(what, e))
}

/// Skips one line; the bytes skipped.
fn skip_line(source: &mut (impl BufRead + ?Sized)) -> io::Result<usize> {
    let mut n = 0;
    loop {
        let bytes = source.fill_buf()?;
        if bytes.is_empty() {
            return Ok(n);
        }
        let line_end = bytes.iter().position(|b| *b == b'\n');
        let n_skip = line_end.map_or(bytes.len(), |i| i + 1);
        source.consume(n_skip);
        n += n_skip;
        if line_end.is_some() {
            return Ok(n);
        }
    }
}
