//! How samples are stored in a data file, and reading one file of them.

use std::io::{self, BufRead, SeekFrom};

use brickfield_core::Voxels;

use crate::error::{bytes, check_length};
use crate::files::{ByteSource, n_bytes_left};
use crate::note::note_surplus;
#[cfg(feature = "gzip")]
use crate::samples::skip;
use crate::samples::{append_binary, append_text, least_text_bytes};
use crate::{ByteOrder, Note, ReadError};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Encoding {
    Raw,
    Text,
    /// zlib or gzip, told apart by the first byte.
    #[cfg(feature = "gzip")]
    Deflate,
}

/// The bytes before the samples in each data file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ByteSkip {
    Bytes(u64),
    /// The samples are the last bytes of the file (raw only).
    ToFitEnd,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct StoredSamples {
    pub(crate) encoding: Encoding,
    pub(crate) order: ByteOrder,
    pub(crate) line_skip: u64,
    pub(crate) byte_skip: ByteSkip,
}

/// One data file: how many samples it holds, and how many of them (the first ones) are wanted.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DataFile<'a> {
    pub(crate) name: &'a str,
    pub(crate) n_samples: u128,
    pub(crate) n_wanted: usize,
}

impl StoredSamples {
    /// Skips to the samples and checks, before anything is allocated, that the rest of the source can hold them.
    pub(crate) fn seek_samples(
        &self,
        source: &mut dyn ByteSource,
        part: &DataFile,
        sample_bytes: usize,
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
        let expected_bytes = part.n_samples.saturating_mul(sample_bytes as u128);
        match self.encoding {
            Encoding::Raw => self.seek_raw(source, part.name, expected_bytes),
            Encoding::Text => {
                self.skip_stored_bytes(source, part.name)?;
                let left = n_bytes_left(source)?;
                check_length(part.name, left, least_text_bytes(part.n_wanted))
            }
            #[cfg(feature = "gzip")]
            Encoding::Deflate => {
                let left = n_bytes_left(source)?;
                let skip = u128::from(self.compressed_skip()?);
                crate::deflate::check_ratio(part.name, left, skip + (part.n_wanted * sample_bytes) as u128)
            }
        }
    }

    fn seek_raw(&self, source: &mut dyn ByteSource, name: &str, expected_bytes: u128) -> Result<(), ReadError> {
        match self.byte_skip {
            ByteSkip::Bytes(_) => self.skip_stored_bytes(source, name)?,
            ByteSkip::ToFitEnd => {
                let surplus = u128::from(n_bytes_left(source)?).saturating_sub(expected_bytes);
                seek_forward(source, surplus as u64, name)?;
            }
        }
        check_length(name, n_bytes_left(source)?, expected_bytes)
    }

    fn skip_stored_bytes(&self, source: &mut dyn ByteSource, name: &str) -> Result<(), ReadError> {
        let ByteSkip::Bytes(skip) = self.byte_skip else {
            return Err(ReadError::field("byte skip", -1, "at least 0 unless the encoding is raw"));
        };
        let left = n_bytes_left(source)?;
        if skip > left {
            return Err(ReadError::field("byte skip", skip, format!("at most the {} of {name}", bytes(left))));
        }
        seek_forward(source, skip, name)
    }

    #[cfg(feature = "gzip")]
    fn compressed_skip(&self) -> Result<u64, ReadError> {
        match self.byte_skip {
            ByteSkip::Bytes(n) => Ok(n),
            ByteSkip::ToFitEnd => Err(ReadError::field("byte skip", -1, "at least 0 unless the encoding is raw")),
        }
    }

    /// Appends the wanted samples; the source is where [`seek_samples`](Self::seek_samples) left it.
    pub(crate) fn append(
        &self,
        voxels: &mut Voxels,
        source: &mut dyn ByteSource,
        part: &DataFile,
        notes: &mut Vec<Note>,
    ) -> Result<(), ReadError> {
        match self.encoding {
            Encoding::Raw => append_binary(voxels, source, part.n_wanted, self.order, part.name)?,
            Encoding::Text => append_text(voxels, source, part.n_wanted, part.name)?,
            #[cfg(feature = "gzip")]
            Encoding::Deflate => {
                let mut inflated = crate::deflate::inflate(source).map_err(|e| ReadError::io(part.name, e))?;
                skip(&mut inflated, self.compressed_skip()?, &format!("what is to be skipped of {}", part.name))?;
                let n_before = voxels.len();
                append_binary(voxels, &mut inflated, part.n_wanted, self.order, part.name)?;
                if part.n_samples == part.n_wanted as u128 {
                    let n_bytes = (voxels.len() - n_before) * voxels.scalar_type().n_bytes();
                    crate::deflate::check_end(&mut inflated, part.name, n_bytes as u64, notes)?;
                }
                return Ok(());
            }
        }
        if part.n_samples == part.n_wanted as u128 && has_surplus(source, self.encoding)? {
            note_surplus(notes);
        }
        Ok(())
    }
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
