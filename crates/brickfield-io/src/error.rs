//! Why a file could not be opened: one line that names the thing, its value and the bound.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::{fmt, io};

use brickfield_core::{GridError, StructuredGridError, VolumeError};

use crate::{Format, GridFormat};

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

/// The fault of the bytes of a volume file.
///
/// The text is one line for any file: values from files are escaped and shortened.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum ReadError {
    #[error("the file is empty (0 bytes)")]
    Empty,
    #[error("no known volume format; it starts with {found}")]
    UnknownFormat { found: Shown },
    #[error("no known format of structured grids; it starts with {found}")]
    UnknownGridFormat { found: Shown },
    #[error("no DICOM slices, no OME-Zarr metadata and no pictures among the {} of this folder", counted(*n_entries, "entry", "entries"))]
    UnknownFolder { n_entries: usize },
    #[error("not {format}: {what} is {found}, expected {expected}")]
    WrongMagic { format: Format, what: &'static str, found: Shown, expected: &'static str },
    #[error("{format} is left out of this build (cargo feature `{feature}`)")]
    FeatureOff { format: Format, feature: &'static str },
    #[error("{format} is left out of this build (cargo feature `{feature}`)")]
    GridFeatureOff { format: GridFormat, feature: &'static str },
    #[error("{field} is missing")]
    Missing { field: &'static str },
    #[error("{} is {value}; expected {}", one_line(field), one_line(expected))]
    Field { field: String, value: Shown, expected: String },
    #[error("{what} {value} is not supported; {supported}")]
    Unsupported { what: &'static str, value: Shown, supported: &'static str },
    #[error("{what} would take {}; the limit is {}", bytes(*n_bytes), bytes(*max_bytes))]
    TooLarge { what: String, n_bytes: u128, max_bytes: u64 },
    #[error("{} holds {}; {} promised", one_line(what), bytes(*n_bytes), are(*expected_bytes))]
    Truncated { what: String, n_bytes: u64, expected_bytes: u128 },
    /// Packed data that could be unpacked up to some point: past the last byte promised there is still a checksum.
    #[error("{what} holds {}", damaged(*n_bytes, *expected_bytes, damage))]
    Damaged { what: String, n_bytes: u64, expected_bytes: u128, damage: Damage },
    /// `end` is where the part would end, as far as the file says.
    #[error("{}", ends_within(*n_file_bytes, part, *end))]
    EndsWithin { part: String, n_file_bytes: u64, end: Option<u64> },
    #[error("the file ends at byte {n_file_bytes}, before {part} at byte {start}")]
    EndsBefore { part: String, n_file_bytes: u64, start: u64 },
    #[error("{} has {}, too few for the {expected_bytes} promised", one_line(what), counted(*n_compressed_bytes, "compressed byte", "compressed bytes"))]
    TooFewCompressed { what: String, n_compressed_bytes: u64, expected_bytes: u128 },
    #[error("{} holds {}; {} promised", one_line(what), counted(*found, "sample", "samples"), are(*expected as u128))]
    TooFewSamples { what: String, found: usize, expected: usize },
    /// A chunk that is not there, of a store all of whose chunks were written.
    #[error("{what} is not stored; all chunks of this store were, so it is lost")]
    LostChunk { what: String },
    #[error("the checksum of {what} is wrong: it is damaged")]
    WrongChecksum { what: String },
    #[error("cannot read {what}: {source}")]
    Io { what: String, source: io::Error },
    #[error("no memory for {} of voxels", bytes(*n_bytes))]
    OutOfMemory { n_bytes: u128 },
    #[error("{what}: {}", one_line(&chain(&**source)))]
    Decoder { what: String, source: Box<dyn Error + Send + Sync> },
    #[error("the {what} decoder gave up on this file (it panicked)")]
    DecoderPanicked { what: &'static str },
    #[error("{0}")]
    Grid(Box<GridError>),
    #[error("{}", one_line(&.0.to_string()))]
    StructuredGrid(Box<StructuredGridError>),
    #[error("{0}")]
    Volume(#[from] VolumeError),
}

/// The fault of packed data after the bytes that could be unpacked.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum Damage {
    #[error("its compressed data are cut off")]
    CutOff,
    #[error("its compressed data are corrupt")]
    Corrupt,
    #[error("a block ends after {n_bytes} of its {}", bytes(*expected_bytes))]
    ShortBlock { n_bytes: u64, expected_bytes: u64 },
    #[error("its base64 text has the symbol {found}")]
    NotBase64 { found: Shown },
    #[error("its base64 text is cut off")]
    Base64CutOff,
}

/// Carries the damage through [`Read`](io::Read).
impl From<Damage> for io::Error {
    fn from(damage: Damage) -> io::Error {
        io::Error::new(io::ErrorKind::InvalidData, damage)
    }
}

fn damaged(n_bytes: u64, expected_bytes: u128, damage: &Damage) -> String {
    match u128::from(n_bytes) < expected_bytes {
        true => format!("{}, then {damage}; {} promised", bytes(n_bytes), are(expected_bytes)),
        false => format!("the {} promised, but {damage} at the end, where the checksum is", bytes(n_bytes)),
    }
}

fn ends_within(n_file_bytes: u64, part: &str, end: Option<u64>) -> String {
    match end {
        Some(end) => format!("the file ends at byte {n_file_bytes}, within {part}, which goes on to byte {end}"),
        None => format!("the file of {} ends within {part}", bytes(n_file_bytes)),
    }
}

impl From<GridError> for ReadError {
    fn from(fault: GridError) -> ReadError {
        ReadError::Grid(Box::new(fault))
    }
}

impl From<StructuredGridError> for ReadError {
    fn from(fault: StructuredGridError) -> ReadError {
        ReadError::StructuredGrid(Box::new(fault))
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

    /// A reader failed after `n_bytes` of the `expected_bytes` of `what`.
    pub(crate) fn reading(what: &str, n_bytes: u64, expected_bytes: u128, source: io::Error) -> ReadError {
        match source.downcast::<Damage>() {
            Ok(damage) => ReadError::Damaged { what: one_line(what), n_bytes, expected_bytes, damage },
            Err(source) => ReadError::io(what, source),
        }
    }

    /// The file does not begin as the format does.
    pub(crate) fn wrong_start(format: Format, head: &[u8], expected: &'static str) -> ReadError {
        let what = "the start of the file";
        ReadError::WrongMagic { format, what, found: Shown::of_bytes(head), expected }
    }

    #[cfg(any(feature = "vti", feature = "dicom", feature = "ome-zarr", feature = "tiff", feature = "png"))]
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

/// The text of an error and of its sources, as far as they say more.
fn chain(fault: &(dyn Error + 'static)) -> String {
    let mut text = fault.to_string();
    let mut source = fault.source();
    while let Some(fault) = source {
        let more = fault.to_string();
        if !text.contains(&more) {
            text = format!("{text}: {more}");
        }
        source = fault.source();
    }
    text
}

/// Holds the bytes that are there against those that are needed.
pub(crate) fn check_length(what: &str, n_bytes: u64, expected_bytes: u128) -> Result<(), ReadError> {
    if u128::from(n_bytes) < expected_bytes {
        return Err(ReadError::Truncated { what: what.to_owned(), n_bytes, expected_bytes });
    }
    Ok(())
}

/// A number and its noun: "1 byte", "2 bytes".
pub(crate) fn counted(n: impl fmt::Display, one: &str, many: &str) -> String {
    let n = n.to_string();
    let noun = if n == "1" { one } else { many };
    format!("{n} {noun}")
}

pub(crate) fn bytes(n: impl fmt::Display) -> String {
    counted(n, "byte", "bytes")
}

fn are(n: u128) -> String {
    counted(n, "is", "are")
}

/// The text with line breaks and other control characters replaced by spaces, at most 300 characters.
pub(crate) fn one_line(text: &str) -> String {
    text.chars().take(300).map(|c| if c.is_control() { ' ' } else { c }).collect()
}
