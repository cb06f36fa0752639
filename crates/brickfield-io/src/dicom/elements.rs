//! A walk over the lengths of a data set, before a parser allocates by them.

use std::io::SeekFrom;

use dicom_core::dictionary::{DataDictionary, DataDictionaryEntry};
use dicom_core::{Tag, VR};
use dicom_dictionary_std::StandardDataDictionary;

use crate::ReadError;
use crate::error::bytes;
use crate::error::check_length;
use crate::files::{ByteSource, n_bytes_left};
use crate::samples::fill;

/// How elements are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Syntax {
    ExplicitLittle,
    ExplicitBig,
    Implicit,
}

/// The missing part where a file ends within its meta group.
pub(super) const META_END: &str = "the end of the file meta group";
const UNDEFINED: u32 = u32::MAX;
const ITEM: (u16, u16) = (0xfffe, 0xe000);
const ITEM_END: (u16, u16) = (0xfffe, 0xe00d);
const SEQUENCE_END: (u16, u16) = (0xfffe, 0xe0dd);
const PIXEL_DATA: (u16, u16) = (0x7fe0, 0x0010);

/// One element's header.
struct ElementHeader {
    tag: (u16, u16),
    length: u32,
    vr: VR,
}

/// Deeper sequences than this are refused: the parser descends into them on the stack.
const MAX_DEPTH: usize = 32;

/// Checks from the current position to the end of the pixel data that no element is longer than the source, and that
/// sequences are not nested without end. Returns the position after the checked elements: the parser must not go beyond.
pub(super) fn check_lengths(source: &mut dyn ByteSource, syntax: Syntax) -> Result<u64, ReadError> {
    let n_unchecked = walk(source, syntax)?;
    let end = source.stream_position().map_err(|e| ReadError::io("the data set", e))? + n_bytes_left(source)?;
    Ok(end - n_unchecked)
}

/// Walks to the end of the pixel data; the bytes left after it.
fn walk(source: &mut dyn ByteSource, syntax: Syntax) -> Result<u64, ReadError> {
    let mut n_left = n_bytes_left(source)?;
    let mut nest = Nest { ends: Vec::new() };
    let mut in_pixel_items = false;
    let mut last_tag = None;
    loop {
        nest.leave_ended(n_left);
        let Some((header, n_header_bytes)) = read_header(source, syntax)? else {
            return match n_left {
                0 => Ok(0),
                _ if in_pixel_items => Ok(0),
                n if is_padding(source, n)? => Ok(n),
                _ => Err(ends_within_header(source, last_tag)?),
            };
        };
        last_tag = Some(header.tag);
        n_left = n_left.saturating_sub(n_header_bytes);
        if header.tag == ITEM_END || header.tag == SEQUENCE_END {
            nest.leave_delimited();
            if in_pixel_items && nest.ends.is_empty() {
                return Ok(n_left);
            }
            continue;
        }
        if header.length != UNDEFINED {
            check_element_length(&header, n_left)?;
        }
        let is_pixel_data = header.tag == PIXEL_DATA;
        let is_item_of_elements = header.tag == ITEM && !in_pixel_items;
        if header.vr == VR::SQ || header.length == UNDEFINED || is_item_of_elements {
            in_pixel_items |= is_pixel_data;
            nest.enter(&header, n_left)?;
            continue;
        }
        skip(source, u64::from(header.length))?;
        n_left -= u64::from(header.length);
        if is_pixel_data {
            return Ok(n_left);
        }
    }
}

/// Whether the last `n_left` bytes, which have just been read, are zeros that pad the file: too few for an element.
fn is_padding(source: &mut dyn ByteSource, n_left: u64) -> Result<bool, ReadError> {
    let io = |e| ReadError::io("the data set", e);
    let mut last = [0; 8];
    if n_left >= last.len() as u64 {
        return Ok(false);
    }
    source.seek(SeekFrom::Current(-(n_left as i64))).map_err(io)?;
    let n_read = fill(source, &mut last[..n_left as usize]).map_err(io)?;
    Ok(last[..n_read].iter().all(|b| *b == 0))
}

/// The file ends within the tag or the length of an element.
fn ends_within_header(source: &mut dyn ByteSource, last_tag: Option<(u16, u16)>) -> Result<ReadError, ReadError> {
    let n_file_bytes = source.stream_position().map_err(|e| ReadError::io("the data set", e))? + n_bytes_left(source)?;
    let part = match last_tag {
        Some((group, element)) => format!("the element after ({group:04x},{element:04x})"),
        None => "the first element of the data set".to_owned(),
    };
    Ok(ReadError::EndsWithin { part, n_file_bytes, end: None })
}

/// The sequences and items around an element: how many bytes are left at their ends, or nothing if a delimiter ends
/// them.
struct Nest {
    ends: Vec<Option<u64>>,
}

impl Nest {
    fn enter(&mut self, header: &ElementHeader, n_left: u64) -> Result<(), ReadError> {
        let end = (header.length != UNDEFINED).then(|| n_left - u64::from(header.length));
        self.ends.push(end);
        match self.ends.len() <= MAX_DEPTH {
            true => Ok(()),
            false => Err(ReadError::field("nesting of sequences", self.ends.len(), format!("at most {MAX_DEPTH}"))),
        }
    }

    fn leave_ended(&mut self, n_left: u64) {
        while let Some(Some(end)) = self.ends.last()
            && n_left <= *end
        {
            self.ends.pop();
        }
    }

    fn leave_delimited(&mut self) {
        if let Some(None) = self.ends.last() {
            self.ends.pop();
        }
    }
}

fn check_element_length(header: &ElementHeader, n_left: u64) -> Result<(), ReadError> {
    let value_bytes = value_bytes(header.vr);
    let expected = if u64::from(header.length) > n_left {
        format!("at most the {} left", bytes(n_left))
    } else if !header.length.is_multiple_of(value_bytes) {
        format!("a multiple of {value_bytes}")
    } else {
        return Ok(());
    };
    let (group, element) = header.tag;
    Err(ReadError::field(format!("length of element ({group:04x},{element:04x})"), header.length, expected))
}

fn skip(source: &mut dyn ByteSource, n_bytes: u64) -> Result<(), ReadError> {
    source.seek_relative(n_bytes as i64).map_err(|e| ReadError::io("the data set", e))
}

/// The next header and its length, or nothing where the source ends.
fn read_header(source: &mut dyn ByteSource, syntax: Syntax) -> Result<Option<(ElementHeader, u64)>, ReadError> {
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
        return Ok(Some((ElementHeader { tag, length: long([e, f, g, h]), vr: VR::UN }, 8)));
    }
    if syntax == Syntax::Implicit {
        let length = long([e, f, g, h]);
        return Ok(Some((ElementHeader { tag, length, vr: standard_vr(tag) }, 8)));
    }
    let vr = VR::from_binary([e, f]).unwrap_or(VR::UN);
    if has_short_form([e, f]) {
        return Ok(Some((ElementHeader { tag, length: u32::from(short(g, h)), vr }, 8)));
    }
    let mut length = [0; 4];
    if fill(source, &mut length).map_err(|e| ReadError::io("the data set", e))? < 4 {
        return Ok(None);
    }
    Ok(Some((ElementHeader { tag, length: long(length), vr }, 12)))
}

/// Value representations whose length has 16 bits (PS3.5, 7.1.2). Unknown ones have the long form, as the parser has it.
fn has_short_form(vr: [u8; 2]) -> bool {
    const SHORT: &[u8] = b"AE AS AT CS DA DS DT FL FD IS LO LT PN SH SL SS ST TM UI UL US";
    SHORT.chunks(3).any(|known| known[..2] == vr)
}

/// The dictionary's value representation, where value representations are implicit.
fn standard_vr((group, element): (u16, u16)) -> VR {
    StandardDataDictionary.by_tag(Tag(group, element)).map_or(VR::UN, |e| e.vr().relaxed())
}

/// Bytes of one value; the parser passes over whole values only, and would take up the rest as elements.
fn value_bytes(vr: VR) -> u32 {
    match vr {
        VR::OW | VR::SS | VR::US => 2,
        VR::AT | VR::FL | VR::OF | VR::OL | VR::SL | VR::UL => 4,
        VR::FD | VR::OD | VR::OV | VR::SV | VR::UV => 8,
        _ => 1,
    }
}

/// Reads the file meta group (always explicit, little-endian): its transfer syntax. The source is then at the data set.
///
/// The group ends where its length says, as the parser has it; else both would not see the same elements.
pub(super) fn read_transfer_syntax(source: &mut dyn ByteSource) -> Result<String, ReadError> {
    let fault = |e| ReadError::io("the file meta group", e);
    source.seek(SeekFrom::Start(PREAMBLE_BYTES)).map_err(fault)?;
    let mut n_group_bytes = read_group_length(source)?;
    let mut uid = None;
    while n_group_bytes > 0 {
        let missing = ReadError::Missing { field: META_END };
        let (header, n_header_bytes) = read_header(source, Syntax::ExplicitLittle)?.ok_or(missing)?;
        check_element_length(&header, n_bytes_left(source)?)?;
        n_group_bytes = n_group_bytes.saturating_sub(n_header_bytes + u64::from(header.length));
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

fn read_group_length(source: &mut dyn ByteSource) -> Result<u64, ReadError> {
    let mut value = [0; 4];
    match read_header(source, Syntax::ExplicitLittle)? {
        Some((ElementHeader { tag: (2, 0), length: 4, .. }, _)) => {}
        _ => return Err(ReadError::Missing { field: "FileMetaInformationGroupLength" }),
    }
    let n = fill(source, &mut value).map_err(|e| ReadError::io("the file meta group", e))?;
    check_length("the file meta group", n as u64, 4)?;
    Ok(u64::from(u32::from_le_bytes(value)))
}

const PREAMBLE_BYTES: u64 = 132;
const MAX_UID_BYTES: u32 = 66;
