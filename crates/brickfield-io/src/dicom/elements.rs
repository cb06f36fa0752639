//! A walk over the lengths of a data set, before a parser allocates by them.

use std::io::SeekFrom;

use dicom_core::dictionary::{DataDictionary, DataDictionaryEntry, VirtualVr};
use dicom_core::{Tag, VR};
use dicom_dictionary_std::StandardDataDictionary;

use crate::ReadError;
use crate::files::{ByteSource, n_bytes_left};
use crate::samples::fill;

/// How elements are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Syntax {
    ExplicitLittle,
    ExplicitBig,
    Implicit,
}

const UNDEFINED: u32 = u32::MAX;
const ITEM: (u16, u16) = (0xfffe, 0xe000);
const PIXEL_DATA: (u16, u16) = (0x7fe0, 0x0010);

/// One element's header.
struct Header {
    tag: (u16, u16),
    length: u32,
    is_sequence: bool,
}

/// Checks from the current position to the end of the pixel data that no element is longer than the source.
///
/// Sequences and items are entered, so elements at every depth are seen.
pub(super) fn check_lengths(source: &mut dyn ByteSource, syntax: Syntax) -> Result<(), ReadError> {
    let mut n_left = n_bytes_left(source)?;
    let mut in_pixel_items = false;
    while let Some((header, n_header_bytes)) = read_header(source, syntax)? {
        n_left = n_left.saturating_sub(n_header_bytes);
        let is_item = header.tag == ITEM;
        let is_entered = header.is_sequence || header.length == UNDEFINED || (is_item && !in_pixel_items);
        let is_pixel_data = header.tag == PIXEL_DATA;
        if header.length != UNDEFINED {
            check_element_length(&header, n_left)?;
        }
        match is_entered {
            true => in_pixel_items |= is_pixel_data,
            false => {
                skip(source, u64::from(header.length))?;
                n_left -= u64::from(header.length);
            }
        }
        if is_pixel_data && !in_pixel_items {
            break;
        }
    }
    Ok(())
}

fn check_element_length(header: &Header, n_left: u64) -> Result<(), ReadError> {
    if u64::from(header.length) <= n_left {
        return Ok(());
    }
    let (group, element) = header.tag;
    let field = format!("length of element ({group:04x},{element:04x})");
    Err(ReadError::field(field, header.length, format!("at most the {n_left} bytes left")))
}

fn skip(source: &mut dyn ByteSource, n_bytes: u64) -> Result<(), ReadError> {
    source.seek_relative(n_bytes as i64).map_err(|e| ReadError::io("the data set", e))
}

/// The next header and its length, or nothing where the source ends.
fn read_header(source: &mut dyn ByteSource, syntax: Syntax) -> Result<Option<(Header, u64)>, ReadError> {
    let mut bytes = [0; 8];
    if fill(source, &mut bytes).map_err(|e| ReadError::io("the data set", e))? < 8 {
        return Ok(None);
    }
    let [a, b, c, d, e, f, g, h] = bytes;
    let short = |x: u8, y: u8| match syntax {
        Syntax::ExplicitBig => u16::from_be_bytes([x, y]),
        _ => u16::from_le_bytes([x, y]),
    };
    let tag = (short(a, b), short(c, d));
    let long = |x: [u8; 4]| match syntax {
        Syntax::ExplicitBig => u32::from_be_bytes(x),
        _ => u32::from_le_bytes(x),
    };
    if tag.0 == ITEM.0 {
        return Ok(Some((Header { tag, length: long([e, f, g, h]), is_sequence: false }, 8)));
    }
    if syntax == Syntax::Implicit {
        let length = long([e, f, g, h]);
        return Ok(Some((Header { tag, length, is_sequence: is_standard_sequence(tag) }, 8)));
    }
    let vr = [e, f];
    if !has_long_form(vr) {
        return Ok(Some((Header { tag, length: u32::from(short(g, h)), is_sequence: false }, 8)));
    }
    let mut length = [0; 4];
    if fill(source, &mut length).map_err(|e| ReadError::io("the data set", e))? < 4 {
        return Ok(None);
    }
    Ok(Some((Header { tag, length: long(length), is_sequence: &vr == b"SQ" }, 12)))
}

/// Value representations whose length has 32 bits (PS3.5, 7.1.2).
fn has_long_form(vr: [u8; 2]) -> bool {
    matches!(
        &vr,
        b"OB" | b"OD" | b"OF" | b"OL" | b"OV" | b"OW" | b"SQ" | b"SV" | b"UC" | b"UN" | b"UR" | b"UT" | b"UV"
    )
}

/// Where value representations are implicit, the dictionary tells which elements are sequences.
fn is_standard_sequence((group, element): (u16, u16)) -> bool {
    let entry = StandardDataDictionary.by_tag(Tag(group, element));
    entry.is_some_and(|e| e.vr() == VirtualVr::Exact(VR::SQ))
}

/// Reads the file meta group (always explicit, little-endian): its transfer syntax. The source is then at the data set.
pub(super) fn read_transfer_syntax(source: &mut dyn ByteSource) -> Result<String, ReadError> {
    let fault = |e| ReadError::io("the file meta group", e);
    source.seek(SeekFrom::Start(PREAMBLE_BYTES)).map_err(fault)?;
    let mut uid = None;
    while let Some((header, n_header_bytes)) = read_header(source, Syntax::ExplicitLittle)? {
        if header.tag.0 != 2 {
            source.seek_relative(-(n_header_bytes as i64)).map_err(fault)?;
            break;
        }
        let n_left = n_bytes_left(source)?;
        check_element_length(&header, n_left)?;
        if header.tag == (2, 0x10) && header.length <= MAX_UID_BYTES {
            let mut value = vec![0; header.length as usize];
            fill(source, &mut value).map_err(fault)?;
            uid = Some(String::from_utf8_lossy(&value).trim_end_matches(['\0', ' ']).to_owned());
        } else {
            skip(source, u64::from(header.length))?;
        }
    }
    uid.ok_or(ReadError::Missing { field: "TransferSyntaxUID" })
}

const PREAMBLE_BYTES: u64 = 132;
const MAX_UID_BYTES: u32 = 66;
