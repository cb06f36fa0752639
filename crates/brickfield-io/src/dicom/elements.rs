//! The elements of a data set (PS3.5, 7): every length is held against the file, and the elements of [`super::tags`] are kept.

use std::io::SeekFrom;

use super::headers::{ElementHeader, ITEM, Syntax, UNDEFINED, long_header, reverse_words, short_header, word_bytes};
use super::tags::{DOUBLE_PIXELS, FLOAT_PIXELS, PIXELS, Tag, kept_vr};
use crate::ReadError;
use crate::error::bytes;
use crate::files::{ByteSource, n_bytes_left};
use crate::samples::fill;

/// The elements that are kept of a data set or of a sequence's item.
#[derive(Debug, Default)]
pub(super) struct DataSet {
    pub(super) elements: Vec<(Tag, Value)>,
}

#[derive(Debug)]
pub(super) enum Value {
    /// Numbers have their low byte first, whatever the syntax.
    Plain {
        vr: [u8; 2],
        bytes: Vec<u8>,
    },
    Items(Vec<DataSet>),
}

/// The pixel data of a file: where their bytes lie.
#[derive(Debug)]
pub(super) struct PixelElement {
    pub(super) tag: Tag,
    pub(super) vr: [u8; 2],
    pub(super) parts: PixelParts,
}

#[derive(Debug)]
pub(super) enum PixelParts {
    Whole(Extent),
    /// The items of encapsulated pixel data (PS3.5, A.4). The first one is the offset table, and may be empty.
    Fragments(Vec<Extent>),
}

/// Bytes of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Extent {
    pub(super) start: u64,
    pub(super) n_bytes: u64,
}

/// The elements before the pixel data, and the pixel data if there are any.
#[derive(Debug, Default)]
pub(super) struct Parsed {
    pub(super) elements: DataSet,
    pub(super) pixels: Option<PixelElement>,
}

/// Reads from the current position to the end of the pixel data. A fault comes with the elements before it.
pub(super) fn parse(source: &mut dyn ByteSource, syntax: Syntax) -> (Parsed, Result<(), ReadError>) {
    let mut parsed = Parsed::default();
    let outcome = Walk::new(source).and_then(|mut walk| walk.top_level(syntax, &mut parsed));
    (parsed, outcome)
}

const ITEM_END: Tag = (0xfffe, 0xe00d);
const SEQUENCE_END: Tag = (0xfffe, 0xe0dd);

/// Deeper sequences than this are refused: the walk descends into them on the stack.
const MAX_DEPTH: usize = 32;
/// Longer values are not kept; they are far beyond what the kept elements need.
const MAX_KEPT_BYTES: u32 = 1 << 20;

pub(super) struct Walk<'a> {
    source: &'a mut dyn ByteSource,
    at: u64,
    end: u64,
    last_tag: Option<Tag>,
}

impl<'a> Walk<'a> {
    pub(super) fn new(source: &'a mut dyn ByteSource) -> Result<Walk<'a>, ReadError> {
        let at = source.stream_position().map_err(fault)?;
        let end = at + n_bytes_left(source)?;
        Ok(Walk { source, at, end, last_tag: None })
    }

    pub(super) fn at(&self) -> u64 {
        self.at
    }

    fn top_level(&mut self, syntax: Syntax, out: &mut Parsed) -> Result<(), ReadError> {
        while let Some(header) = self.next_header(syntax)? {
            if matches!(header.tag, PIXELS | FLOAT_PIXELS | DOUBLE_PIXELS) {
                out.pixels = Some(self.pixel_element(&header, syntax)?);
                return Ok(());
            }
            self.element(&header, syntax, 0, Some(&mut out.elements))?;
        }
        Ok(())
    }

    /// Reads or passes over the value of an element that is no delimiter.
    fn element(
        &mut self,
        header: &ElementHeader,
        syntax: Syntax,
        depth: usize,
        keep: Option<&mut DataSet>,
    ) -> Result<(), ReadError> {
        let kept = keep.filter(|_| kept_vr(header.tag).is_some());
        if header.length != UNDEFINED {
            self.check_length(header)?;
        }
        match kept {
            Some(set) if header.length == UNDEFINED || &header.vr == b"SQ" => {
                let mut items = Vec::new();
                let outcome = self.items(header, syntax, depth + 1, Some(&mut items));
                set.elements.push((header.tag, Value::Items(items)));
                outcome
            }
            None if header.length == UNDEFINED => self.items(header, syntax, depth + 1, None),
            Some(set) if header.length <= MAX_KEPT_BYTES => {
                let vr = if &header.vr == b"UN" { kept_vr(header.tag).unwrap_or(*b"UN") } else { header.vr };
                let mut bytes = self.value(header.length as usize)?;
                if syntax == Syntax::ExplicitBig {
                    reverse_words(&mut bytes, word_bytes(vr));
                }
                set.elements.push((header.tag, Value::Plain { vr, bytes }));
                Ok(())
            }
            _ => self.skip(u64::from(header.length)),
        }
    }

    /// The items of a sequence, to its end or its delimiter.
    fn items(
        &mut self,
        sequence: &ElementHeader,
        syntax: Syntax,
        depth: usize,
        mut keep: Option<&mut Vec<DataSet>>,
    ) -> Result<(), ReadError> {
        check_depth(depth)?;
        // Of unknown representation and length: its elements are implicit (PS3.5, 6.2.2, note 2).
        let is_unknown = &sequence.vr == b"UN" && sequence.length == UNDEFINED && syntax == Syntax::ExplicitLittle;
        let syntax = if is_unknown { Syntax::Implicit } else { syntax };
        let end = self.end_of(sequence.length);
        while self.at < end {
            let Some(header) = self.next_header(syntax)? else { return Ok(()) };
            match header.tag {
                SEQUENCE_END => return Ok(()),
                ITEM => {
                    if header.length != UNDEFINED {
                        self.check_length(&header)?;
                    }
                    let mut item = DataSet::default();
                    let outcome = self.item(header.length, syntax, depth + 1, keep.is_some().then_some(&mut item));
                    if let Some(items) = &mut keep {
                        items.push(item);
                    }
                    outcome?;
                }
                ITEM_END => {}
                _ => self.element(&header, syntax, depth, None)?,
            }
        }
        Ok(())
    }

    fn item(
        &mut self,
        length: u32,
        syntax: Syntax,
        depth: usize,
        mut keep: Option<&mut DataSet>,
    ) -> Result<(), ReadError> {
        check_depth(depth)?;
        let end = self.end_of(length);
        while self.at < end {
            let Some(header) = self.next_header(syntax)? else { return Ok(()) };
            match header.tag {
                ITEM_END => return Ok(()),
                SEQUENCE_END => {}
                _ => self.element(&header, syntax, depth, keep.as_deref_mut())?,
            }
        }
        Ok(())
    }

    fn end_of(&self, length: u32) -> u64 {
        match length {
            UNDEFINED => u64::MAX,
            length => self.at + u64::from(length),
        }
    }

    fn pixel_element(&mut self, header: &ElementHeader, syntax: Syntax) -> Result<PixelElement, ReadError> {
        let parts = match header.length {
            UNDEFINED => PixelParts::Fragments(self.fragments(syntax)?),
            length => {
                self.check_length(header)?;
                PixelParts::Whole(Extent { start: self.at, n_bytes: u64::from(length) })
            }
        };
        Ok(PixelElement { tag: header.tag, vr: header.vr, parts })
    }

    /// The items of encapsulated pixel data, up to the delimiter or to the end of the file.
    fn fragments(&mut self, syntax: Syntax) -> Result<Vec<Extent>, ReadError> {
        let mut fragments = Vec::new();
        while let Some(header) = self.read_header(syntax)?
            && header.tag == ITEM
        {
            self.check_length(&header)?;
            fragments.push(Extent { start: self.at, n_bytes: u64::from(header.length) });
            self.skip(u64::from(header.length))?;
        }
        Ok(fragments)
    }

    /// The next header, or nothing at the end of the file; a few zeros may pad it.
    fn next_header(&mut self, syntax: Syntax) -> Result<Option<ElementHeader>, ReadError> {
        let start = self.at;
        if let Some(header) = self.read_header(syntax)? {
            self.last_tag = Some(header.tag);
            return Ok(Some(header));
        }
        match self.is_padding(start)? {
            true => Ok(None),
            false => Err(self.ends_within_header()),
        }
    }

    /// The next header, or nothing where the file ends before it does.
    pub(super) fn read_header(&mut self, syntax: Syntax) -> Result<Option<ElementHeader>, ReadError> {
        let mut bytes = [0; 12];
        let n_read = fill(self.source, &mut bytes[..8]).map_err(fault)?;
        self.at += n_read as u64;
        if n_read < 8 {
            return Ok(None);
        }
        if let Some(header) = short_header(&bytes[..8], syntax) {
            return Ok(Some(header));
        }
        let n_read = fill(self.source, &mut bytes[8..]).map_err(fault)?;
        self.at += n_read as u64;
        Ok((n_read == 4).then(|| long_header(&bytes, syntax)))
    }

    /// Whether the file's last bytes, from `start`, are zeros: too few for an element.
    fn is_padding(&mut self, start: u64) -> Result<bool, ReadError> {
        let mut last = [0; 8];
        if self.end - start >= last.len() as u64 {
            return Ok(false);
        }
        self.source.seek(SeekFrom::Start(start)).map_err(fault)?;
        let n_read = fill(self.source, &mut last).map_err(fault)?;
        Ok(last[..n_read].iter().all(|b| *b == 0))
    }

    /// The file ends within the tag or the length of an element.
    fn ends_within_header(&self) -> ReadError {
        let part = match self.last_tag {
            Some((group, element)) => format!("the element after ({group:04x},{element:04x})"),
            None => "the first element of the data set".to_owned(),
        };
        ReadError::EndsWithin { part, n_file_bytes: self.end, end: None }
    }

    pub(super) fn check_length(&self, header: &ElementHeader) -> Result<(), ReadError> {
        let n_left = self.end.saturating_sub(self.at);
        let value_bytes = word_bytes(header.vr) as u32;
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

    /// The bytes of a value, whose length has been checked.
    pub(super) fn value(&mut self, n_bytes: usize) -> Result<Vec<u8>, ReadError> {
        let mut value = vec![0; n_bytes];
        let n_read = fill(self.source, &mut value).map_err(fault)?;
        self.at += n_read as u64;
        value.truncate(n_read);
        Ok(value)
    }

    pub(super) fn skip(&mut self, n_bytes: u64) -> Result<(), ReadError> {
        self.at += n_bytes;
        self.source.seek_relative(n_bytes as i64).map_err(fault)
    }
}

fn fault(e: std::io::Error) -> ReadError {
    ReadError::io("the data set", e)
}

fn check_depth(depth: usize) -> Result<(), ReadError> {
    match depth <= MAX_DEPTH {
        true => Ok(()),
        false => Err(ReadError::field("nesting of sequences", depth, format!("at most {MAX_DEPTH}"))),
    }
}
