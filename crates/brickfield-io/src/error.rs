//! Why a file could not be opened: one line that names the thing, its value and the bound.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::{fmt, io};

use brickfield_core::{GridError, VolumeError};

use crate::Format;

/// A file that could not be opened, and why.
#[derive(Debug, thiserror::Error)]
#[error("{}: {fault}", one_line(&path.display().to_string()))]
#[allow(missing_docs)]
pub struct OpenError {
    pub path: PathBuf,
    #[source]
    pub fault: ReadError,
}

impl OpenError {
    pub(crate) fn new(path: &Path, fault: ReadError) -> OpenError {
        OpenError { path: path.to_owned(), fault }
    }
}

/// What is wrong with the bytes of a volume file.
///
/// The text is one line, whatever the file holds: values from files are escaped and shortened.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum ReadError {
    #[error("the file is empty (0 bytes)")]
    Empty,
    #[error("no known volume format; it starts with {found}")]
    UnknownFormat { found: Shown },
    #[error("no DICOM slices and no OME-Zarr metadata among the {n_entries} entries of this folder")]
    UnknownFolder { n_entries: usize },
    #[error("not {format}: {what} is {found}, expected {expected}")]
    WrongMagic { format: Format, what: &'static str, found: Shown, expected: &'static str },
    #[error("{format} is left out of this build (cargo feature `{feature}`)")]
    FeatureOff { format: Format, feature: &'static str },
    #[error("{field} is missing")]
    Missing { field: &'static str },
    #[error("{field} is {value}; expected {expected}")]
    Field { field: String, value: Shown, expected: String },
    #[error("{what} {value} is not supported; {supported}")]
    Unsupported { what: &'static str, value: Shown, supported: &'static str },
    #[error("{what} would take {n_bytes} bytes; the limit is {max_bytes} bytes")]
    TooLarge { what: String, n_bytes: u128, max_bytes: u64 },
    #[error("{what} holds {n_bytes} bytes; {expected_bytes} are promised")]
    Truncated { what: String, n_bytes: u64, expected_bytes: u128 },
    #[error("{what} has {n_compressed_bytes} compressed bytes, too few for the {expected_bytes} promised")]
    TooFewCompressed { what: String, n_compressed_bytes: u64, expected_bytes: u128 },
    #[error("{what} holds {found} samples; {expected} are promised")]
    TooFewSamples { what: String, found: usize, expected: usize },
    #[error("cannot read {what}: {source}")]
    Io { what: String, source: io::Error },
    #[error("no memory for {n_bytes} bytes of voxels")]
    OutOfMemory { n_bytes: u128 },
    #[error("{what}: {}", one_line(&source.to_string()))]
    Decoder { what: String, source: Box<dyn Error + Send + Sync> },
    #[error("the {what} decoder gave up on this file (it panicked)")]
    DecoderPanicked { what: &'static str },
    #[error("{0}")]
    Grid(Box<GridError>),
    #[error("{0}")]
    Volume(#[from] VolumeError),
}

impl From<GridError> for ReadError {
    fn from(fault: GridError) -> ReadError {
        ReadError::Grid(Box::new(fault))
    }
}

impl ReadError {
    pub(crate) fn field(field: impl Into<String>, value: impl fmt::Display, expected: impl Into<String>) -> ReadError {
        ReadError::Field { field: field.into(), value: Shown::new(value), expected: expected.into() }
    }

    pub(crate) fn unsupported(what: &'static str, value: impl fmt::Display, supported: &'static str) -> ReadError {
        ReadError::Unsupported { what, value: Shown::new(value), supported }
    }

    pub(crate) fn io(what: impl fmt::Display, source: io::Error) -> ReadError {
        ReadError::Io { what: one_line(&what.to_string()), source }
    }

    #[cfg(any(feature = "vti", feature = "nifti", feature = "dicom", feature = "ome-zarr", feature = "tiff"))]
    pub(crate) fn decoder(what: impl fmt::Display, source: impl Into<Box<dyn Error + Send + Sync>>) -> ReadError {
        ReadError::Decoder { what: one_line(&what.to_string()), source: source.into() }
    }
}

/// A value from a file as it is shown in a message: quoted, escaped, at most 60 characters.
#[derive(Clone, PartialEq, Eq)]
pub struct Shown(String);

const MAX_SHOWN_CHARS: usize = 60;

impl Shown {
    /// The text of `value`, made fit for one line.
    pub fn new(value: impl fmt::Display) -> Shown {
        Shown(shortened(&value.to_string()))
    }

    pub(crate) fn of_bytes(bytes: &[u8]) -> Shown {
        Shown::new(String::from_utf8_lossy(&bytes[..bytes.len().min(16)]))
    }
}

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "\"{}\"", self.0.escape_debug())
    }
}

impl fmt::Debug for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

fn shortened(text: &str) -> String {
    match text.char_indices().nth(MAX_SHOWN_CHARS) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_owned(),
    }
}

/// The text with line breaks and other control characters replaced by spaces, at most 300 characters.
pub(crate) fn one_line(text: &str) -> String {
    text.chars().take(300).map(|c| if c.is_control() { ' ' } else { c }).collect()
}
