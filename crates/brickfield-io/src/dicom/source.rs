//! The start of a DICOM file (PS3.10, 7): preamble and meta group, or neither; and the transfer syntax of its data set.

use std::io::{Cursor, Read, SeekFrom};

use super::elements::{Parsed, Walk, parse};
use super::headers::{Syntax, short_header};
use super::tags::Tag;
use crate::error::check_length;
use crate::files::{ByteSource, DataFiles, n_bytes_left, open_named, read_head};
use crate::limits::check_bytes;
use crate::{Format, Limits, ReadError};

/// How pixel data are packed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Codec {
    None,
    Rle,
    Jpeg,
    JpegLs,
    Jpeg2000,
    /// The transfer syntax is none of those that can be read.
    Unknown(String),
}

/// A file, its data set at the current position: if it was deflated, its unpacked copy in memory.
pub(super) struct DataSetSource<'a> {
    pub(super) source: Box<dyn ByteSource + 'a>,
    pub(super) syntax: Syntax,
    pub(super) codec: Codec,
}

impl DataSetSource<'_> {
    /// The elements up to the pixel data; a fault comes with the elements before it.
    pub(super) fn parse(&mut self) -> (Parsed, Result<(), ReadError>) {
        parse(&mut *self.source, self.syntax)
    }
}

/// The missing part where a file ends within its meta group.
pub(super) const META_END: &str = "the end of the file meta group";
const PREAMBLE_BYTES: u64 = 128;
const MAGIC: &[u8] = b"DICM";
const TRANSFER_SYNTAX: Tag = (2, 0x10);
const GROUP_LENGTH: Tag = (2, 0);
const META_GROUP: u16 = 2;
const MAX_UID_BYTES: u32 = 66;
/// Bytes that tell a file without preamble.
const HEAD_BYTES: u64 = 512;

pub(super) fn open_data_set<'a>(
    name: &str,
    files: &'a dyn DataFiles,
    limits: &Limits,
) -> Result<DataSetSource<'a>, ReadError> {
    let mut source = open_named(files, name)?;
    if n_bytes_left(&mut *source)? == 0 {
        return Err(ReadError::Empty);
    }
    let head = read_head(&mut *source, HEAD_BYTES)?;
    seek(&mut *source, start_of_elements(&head)?)?;
    let (syntax, codec) = match read_meta_group(&mut *source)? {
        Some(uid) if uid == DEFLATED => {
            source = Box::new(Cursor::new(inflated(&mut *source, limits)?));
            (Syntax::ExplicitLittle, Codec::None)
        }
        Some(uid) => meaning(&uid),
        None => (syntax_here(&mut *source)?, Codec::None),
    };
    Ok(DataSetSource { source, syntax, codec })
}

/// Where the first element lies.
fn start_of_elements(head: &[u8]) -> Result<u64, ReadError> {
    if head.get(PREAMBLE_BYTES as usize..).is_some_and(|rest| rest.starts_with(MAGIC)) {
        return Ok(PREAMBLE_BYTES + MAGIC.len() as u64);
    }
    match bare_syntax(head) {
        Some(_) => Ok(0),
        None => Err(ReadError::wrong_start(Format::Dicom, head, "128 bytes of any kind, then DICM")),
    }
}

/// How the next elements are written, where no meta group says so.
fn syntax_here(source: &mut dyn ByteSource) -> Result<Syntax, ReadError> {
    let here = source.stream_position().map_err(|e| ReadError::io("the data set", e))?;
    let head = read_head(source, HEAD_BYTES)?;
    seek(source, here)?;
    bare_syntax(&head).ok_or(ReadError::Missing { field: "TransferSyntaxUID" })
}

/// How the elements are written with which these bytes begin, if they begin with elements: the first one of group 0002 or
/// 0008 and not empty, [`MIN_ELEMENTS`] in order, none longer than a short text may be.
fn bare_syntax(head: &[u8]) -> Option<Syntax> {
    [Syntax::ExplicitLittle, Syntax::Implicit, Syntax::ExplicitBig].into_iter().find(|s| are_elements(head, *s))
}

/// Whether a file without preamble may begin like this.
pub(crate) fn begins_with_elements(head: &[u8]) -> bool {
    bare_syntax(head).is_some()
}

const MIN_ELEMENTS: usize = 3;
const MAX_TEXT_BYTES: u32 = 128;
/// FileMetaInformationVersion is the one element of the long form among the first ones: 14 bytes.
const META_VERSION: &[u8] = &[2, 0, 1, 0, b'O', b'B', 0, 0, 2, 0, 0, 0];

fn are_elements(mut head: &[u8], syntax: Syntax) -> bool {
    let mut last_tag = None;
    for _ in 0..MIN_ELEMENTS {
        if last_tag == Some(GROUP_LENGTH) && head.starts_with(META_VERSION) {
            head = head.get(META_VERSION.len() + 2..).unwrap_or(&[]);
        }
        let Some((header, rest)) = head.split_at_checked(8) else { return false };
        let Some(header) = short_header(header, syntax) else { return false };
        let in_order = match last_tag {
            None => matches!(header.tag.0, 2 | 8) && header.length > 0,
            Some(last_tag) => header.tag > last_tag,
        };
        if !in_order || header.length > MAX_TEXT_BYTES || header.length % 2 == 1 {
            return false;
        }
        last_tag = Some(header.tag);
        head = rest.get(header.length as usize..).unwrap_or(&[]);
    }
    true
}

/// Reads the file meta group (always explicit, little-endian) and its transfer syntax; the source is then at the data set.
/// Nothing if the file has no such group.
///
/// The group ends where its elements do: its length is often wrong.
fn read_meta_group(source: &mut dyn ByteSource) -> Result<Option<String>, ReadError> {
    let mut walk = Walk::new(source)?;
    let (mut uid, mut stated_end) = (None, 0);
    loop {
        let start = walk.at();
        let header = walk.read_header(Syntax::ExplicitLittle)?;
        if header.is_none() && start < stated_end {
            return Err(ReadError::Missing { field: META_END });
        }
        let Some(header) = header.filter(|h| h.tag.0 == META_GROUP) else {
            seek(source, start)?;
            return Ok(uid);
        };
        walk.check_length(&header)?;
        match header.tag {
            TRANSFER_SYNTAX if header.length <= MAX_UID_BYTES => {
                let value = walk.value(header.length as usize)?;
                uid = Some(String::from_utf8_lossy(&value).trim_end_matches(['\0', ' ']).to_owned());
            }
            GROUP_LENGTH if header.length == 4 => {
                let value = walk.value(4)?;
                check_length("the file meta group", value.len() as u64, 4)?;
                let n_bytes = value.iter().rev().fold(0, |n, byte| (n << 8) | u64::from(*byte));
                stated_end = walk.at() + n_bytes;
            }
            _ => walk.skip(u64::from(header.length))?,
        }
    }
}

fn seek(source: &mut dyn ByteSource, at: u64) -> Result<(), ReadError> {
    source.seek(SeekFrom::Start(at)).map(|_| ()).map_err(|e| ReadError::io("the data set", e))
}

const DEFLATED: &str = "1.2.840.10008.1.2.1.99";

/// Every transfer syntax with packed pixels is explicit and little-endian (PS3.5, A.4).
fn meaning(uid: &str) -> (Syntax, Codec) {
    let codec = match uid.strip_prefix("1.2.840.10008.1.2") {
        Some("") => return (Syntax::Implicit, Codec::None),
        Some(".2") => return (Syntax::ExplicitBig, Codec::None),
        Some(".1") => Codec::None,
        // Baseline, extended, lossless, lossless first-order.
        Some(".4.50" | ".4.51" | ".4.57" | ".4.70") => Codec::Jpeg,
        // Lossless, near-lossless.
        Some(".4.80" | ".4.81") => Codec::JpegLs,
        // Lossless, any.
        Some(".4.90" | ".4.91") => Codec::Jpeg2000,
        Some(".5") => Codec::Rle,
        _ => Codec::Unknown(uid.to_owned()),
    };
    (Syntax::ExplicitLittle, codec)
}

/// Room for the elements of a deflated data set besides its pixels.
const MAX_ELEMENT_BYTES: u64 = 16 << 20;

/// The rest of the source, unpacked (RFC 1951).
fn inflated(source: &mut dyn ByteSource, limits: &Limits) -> Result<Vec<u8>, ReadError> {
    let max_bytes = limits.max_bytes.saturating_add(MAX_ELEMENT_BYTES);
    let mut unpacked = Vec::new();
    let inflate = flate2::bufread::DeflateDecoder::new(source);
    let outcome = inflate.take(max_bytes.saturating_add(1)).read_to_end(&mut unpacked);
    let n_bytes = unpacked.len() as u64;
    check_bytes(n_bytes.saturating_sub(MAX_ELEMENT_BYTES).into(), limits, || "the deflated data set".to_owned())?;
    // What could be unpacked is parsed: it tells which series the damaged file is of.
    if let Err(e) = outcome
        && n_bytes == 0
    {
        return Err(ReadError::reading("the deflated data set", 0, 0, crate::deflate::damage(e)));
    }
    Ok(unpacked)
}
