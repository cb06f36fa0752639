//! Directories of tags: the skeleton of a TIFF file (TIFF 6.0, section 2; BigTIFF has wider counts and offsets).

use std::collections::HashSet;
use std::io::{self, ErrorKind, SeekFrom};

use crate::files::{ByteSource, n_bytes_left, read_head};
use crate::format::is_tiff;
use crate::numbers::with_room;
use crate::{ByteOrder, Format, ReadError};

/// A TIFF file after its header.
pub(super) struct TiffFile<'a> {
    source: Box<dyn ByteSource + 'a>,
    /// Where the source is, if that is known: a seek empties its buffer, and strips often follow each other.
    position: Option<u64>,
    pub(super) n_bytes: u64,
    pub(super) order: ByteOrder,
    is_big: bool,
    /// Position of the first directory.
    first: u64,
}

/// The tags of a page. Their values are read when they are asked for.
#[derive(Clone, Debug)]
pub(super) struct Directory {
    entries: Vec<Entry>,
    /// Position of the next directory, 0 if there is none.
    next: u64,
    /// The page in messages: "page 3".
    pub(super) page: String,
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    tag: u16,
    kind: u16,
    n_values: u64,
    /// The values if they fit, else their position.
    field: [u8; 8],
}

/// A page in the chain of directories.
#[derive(Clone, Copy, Debug)]
pub(super) struct PageStart {
    pub(super) start: u64,
    /// It is a reduced copy of another page.
    pub(super) is_reduced: bool,
}

const NEW_SUBFILE_TYPE: u16 = 254;

/// More bytes than this are not read for one tag: a table of 8 million strips.
const MAX_TAG_BYTES: u64 = 64 << 20;

impl<'a> TiffFile<'a> {
    pub(super) fn open(mut source: Box<dyn ByteSource + 'a>) -> Result<TiffFile<'a>, ReadError> {
        source.seek(SeekFrom::Start(0)).map_err(|e| ReadError::io("the file", e))?;
        let n_bytes = n_bytes_left(&mut *source)?;
        if n_bytes == 0 {
            return Err(ReadError::Empty);
        }
        let head = read_head(&mut *source, 16)?;
        if !is_tiff(&head) {
            return Err(ReadError::wrong_start(Format::Tiff, &head, "II or MM, then 42 or 43"));
        }
        let order = if head[0] == b'M' { ByteOrder::Big } else { ByteOrder::Little };
        let is_big = head[..4].contains(&43);
        let field = if is_big { head.get(8..16) } else { head.get(4..8) };
        match field {
            Some(field) => Ok(TiffFile { source, position: None, n_bytes, order, is_big, first: number(field, order) }),
            None => Err(ReadError::EndsWithin { part: "the TIFF header".to_owned(), n_file_bytes: n_bytes, end: None }),
        }
    }

    /// The pages of the file's chain, in order. Directories that overlap or return to an earlier one are refused: each of
    /// them would cost as much as a whole one.
    pub(super) fn pages(&mut self) -> Result<Vec<PageStart>, ReadError> {
        let (mut pages, mut seen, mut n_tag_bytes) = (Vec::new(), HashSet::new(), 0);
        let mut start = self.first;
        while start != 0 {
            let name = page_name(pages.len() as u64);
            if !seen.insert(start) {
                return Err(ReadError::field(format!("position of the tags of {name}"), start, "no earlier page's"));
            }
            let directory = self.directory(start, name)?;
            n_tag_bytes += self.directory_bytes(directory.entries.len() as u64);
            if n_tag_bytes > self.n_bytes {
                let expected = format!("at most {}, the file's", self.n_bytes);
                return Err(ReadError::field("number of bytes of all tags", n_tag_bytes, expected));
            }
            let is_reduced = self.number(&directory, NEW_SUBFILE_TYPE)?.unwrap_or(0) & 1 == 1;
            pages.push(PageStart { start, is_reduced });
            start = directory.next;
        }
        if pages.is_empty() {
            return Err(ReadError::Missing { field: "a page" });
        }
        Ok(pages)
    }

    /// The directory at a position.
    pub(super) fn directory(&mut self, start: u64, page: String) -> Result<Directory, ReadError> {
        let n_file_bytes = self.n_bytes;
        if start >= n_file_bytes {
            return Err(ReadError::EndsBefore { part: format!("the tags of {page}"), n_file_bytes, start });
        }
        let (entries, next) = self.entries(start).map_err(|e| self.tags_fault(&page, e))?;
        Ok(Directory { entries, next, page })
    }

    fn entries(&mut self, start: u64) -> io::Result<(Vec<Entry>, u64)> {
        let (n_count, n_field) = if self.is_big { (8, 8) } else { (2, 4) };
        let mut count = [0; 8];
        self.read_exact(start, &mut count[..n_count])?;
        let n_entries = number(&count[..n_count], self.order);
        if self.directory_bytes(n_entries) > self.n_bytes {
            return Err(ErrorKind::UnexpectedEof.into());
        }
        let mut bytes = vec![0; self.directory_bytes(n_entries) as usize - n_count];
        self.read_exact(start + n_count as u64, &mut bytes)?;
        let (tags, next) = bytes.split_at(bytes.len() - n_field);
        let entries = tags.chunks_exact(4 + 2 * n_field).map(|entry| self.entry(entry, n_field)).collect();
        Ok((entries, number(next, self.order)))
    }

    fn entry(&self, entry: &[u8], n_field: usize) -> Entry {
        let mut field = [0; 8];
        field[..n_field].copy_from_slice(&entry[4 + n_field..]);
        Entry {
            tag: number(&entry[..2], self.order) as u16,
            kind: number(&entry[2..4], self.order) as u16,
            n_values: number(&entry[4..4 + n_field], self.order),
            field,
        }
    }

    fn directory_bytes(&self, n_entries: u64) -> u64 {
        let (n_around, n_entry) = if self.is_big { (16, 20) } else { (6, 12) };
        n_entries.saturating_mul(n_entry).saturating_add(n_around)
    }

    /// The first whole number of a tag.
    pub(super) fn number(&mut self, directory: &Directory, tag: u16) -> Result<Option<u64>, ReadError> {
        Ok(self.numbers(directory, tag)?.and_then(|numbers| numbers.first().copied()))
    }

    /// All whole numbers of a tag; none where it has values of another kind.
    pub(super) fn numbers(&mut self, directory: &Directory, tag: u16) -> Result<Option<Vec<u64>>, ReadError> {
        let Some(entry) = directory.find(tag).filter(|e| matches!(e.kind, 1 | 3 | 4 | 6..=9 | 13 | 16..=18)) else {
            return Ok(None);
        };
        let bytes = self.bytes_of(&entry, &directory.page)?;
        let mut numbers = with_room(entry.n_values as usize)?;
        numbers.extend(bytes.chunks_exact(entry.value_bytes()).map(|value| number(value, self.order)));
        Ok(Some(numbers))
    }

    /// The fraction of a tag, if it is a finite number above 0.
    pub(super) fn fraction(&mut self, directory: &Directory, tag: u16) -> Result<Option<f64>, ReadError> {
        let Some(entry) = directory.find(tag).filter(|e| e.kind == 5) else { return Ok(None) };
        let bytes = self.bytes_of(&entry, &directory.page)?;
        let parts = bytes.get(..4).zip(bytes.get(4..8));
        let value = parts.map(|(n, d)| number(n, self.order) as f64 / number(d, self.order) as f64);
        Ok(value.filter(|v| v.is_finite() && *v > 0.0))
    }

    /// All numbers of a tag of 64-bit floats; none where it is missing or has values of another kind.
    pub(super) fn doubles(&mut self, directory: &Directory, tag: u16) -> Result<Vec<f64>, ReadError> {
        let Some(entry) = directory.find(tag).filter(|e| e.kind == 12) else { return Ok(Vec::new()) };
        let bytes = self.bytes_of(&entry, &directory.page)?;
        Ok(bytes.chunks_exact(8).map(|value| f64::from_bits(number(value, self.order))).collect())
    }

    /// The bytes of a tag, whatever their kind; empty where it is missing.
    pub(super) fn bytes(&mut self, directory: &Directory, tag: u16) -> Result<Vec<u8>, ReadError> {
        directory.find(tag).map_or(Ok(Vec::new()), |entry| self.bytes_of(&entry, &directory.page))
    }

    /// The texts of a tag, which may be there several times: UTF-8, or else Latin-1, which has a character for each byte.
    pub(super) fn texts(&mut self, directory: &Directory, tag: u16) -> Result<Vec<String>, ReadError> {
        let entries: Vec<Entry> = directory.entries.iter().filter(|e| e.tag == tag).copied().collect();
        let text = |entry: &Entry| Ok(text_of(self.bytes_of(entry, &directory.page)?));
        entries.iter().map(text).collect()
    }

    fn bytes_of(&mut self, entry: &Entry, page: &str) -> Result<Vec<u8>, ReadError> {
        if entry.n_values > self.n_bytes {
            let expected = format!("at most {}, the file's bytes", self.n_bytes);
            return Err(ReadError::field("number of a tag's values", entry.n_values, expected));
        }
        let n_bytes = entry.n_values * entry.value_bytes() as u64;
        let n_field = if self.is_big { 8 } else { 4 };
        if n_bytes <= n_field {
            return Ok(entry.field[..n_bytes as usize].to_vec());
        }
        if n_bytes > MAX_TAG_BYTES {
            let what = format!("tag {} of {page}", entry.tag);
            return Err(ReadError::TooLarge { what, n_bytes: n_bytes.into(), max_bytes: MAX_TAG_BYTES });
        }
        let start = number(&entry.field[..n_field as usize], self.order);
        let end = start.saturating_add(n_bytes);
        if end > self.n_bytes {
            let part = format!("the tags of {page}");
            return Err(ReadError::EndsWithin { part, n_file_bytes: self.n_bytes, end: Some(end) });
        }
        self.read_bytes(start, n_bytes).map_err(|e| self.tags_fault(page, e))
    }

    /// Bytes at a position; the caller has held them against the file's length.
    pub(super) fn read_bytes(&mut self, start: u64, n_bytes: u64) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        bytes.try_reserve_exact(n_bytes as usize)?;
        bytes.resize(n_bytes as usize, 0);
        self.read_exact(start, &mut bytes)?;
        Ok(bytes)
    }

    fn read_exact(&mut self, start: u64, bytes: &mut [u8]) -> io::Result<()> {
        if self.position.take() != Some(start) {
            self.source.seek(SeekFrom::Start(start))?;
        }
        self.source.read_exact(bytes)?;
        self.position = Some(start + bytes.len() as u64);
        Ok(())
    }

    fn tags_fault(&self, page: &str, fault: io::Error) -> ReadError {
        let part = format!("the tags of {page}");
        match fault.kind() {
            ErrorKind::UnexpectedEof => ReadError::EndsWithin { part, n_file_bytes: self.n_bytes, end: None },
            _ => ReadError::io(part, fault),
        }
    }
}

impl Directory {
    fn find(&self, tag: u16) -> Option<Entry> {
        self.entries.iter().find(|e| e.tag == tag).copied()
    }

    /// The number of a tag's values, 0 without it.
    pub(super) fn n_values(&self, tag: u16) -> u64 {
        self.find(tag).map_or(0, |entry| entry.n_values)
    }

    pub(super) fn contains(&self, tag: u16) -> bool {
        self.find(tag).is_some()
    }
}

impl Entry {
    /// Bytes of one value of its kind; kinds that are not known have bytes.
    fn value_bytes(&self) -> usize {
        match self.kind {
            3 | 8 => 2,
            4 | 9 | 11 | 13 => 4,
            5 | 10 | 12 | 16..=18 => 8,
            _ => 1,
        }
    }
}

/// Pages are counted from 0 here, and from 1 in messages.
pub(super) fn page_name(page: u64) -> String {
    format!("page {}", page.saturating_add(1))
}

/// A whole number of up to 8 bytes.
fn number(bytes: &[u8], order: ByteOrder) -> u64 {
    let join = |n: u64, b: &u8| n << 8 | u64::from(*b);
    match order {
        ByteOrder::Big => bytes.iter().fold(0, join),
        ByteOrder::Little => bytes.iter().rev().fold(0, join),
    }
}

fn text_of(bytes: Vec<u8>) -> String {
    let end = bytes.iter().rposition(|b| *b != 0).map_or(0, |last| last + 1);
    match str::from_utf8(&bytes[..end]) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes[..end].iter().map(|b| char::from(*b)).collect(),
    }
}
