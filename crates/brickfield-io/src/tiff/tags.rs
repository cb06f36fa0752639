//! A look at the first directory before the decoder's, which makes room for as many values as a tag claims to have.

use std::io::{self, SeekFrom};

use super::fault::PageNames;
use crate::ReadError;
use crate::files::ByteSource;

/// Reads whole numbers in a file's byte order.
struct TagNumbers<'a> {
    source: &'a mut dyn ByteSource,
    is_big_endian: bool,
}

impl TagNumbers<'_> {
    fn number(&mut self, n_bytes: usize) -> io::Result<u64> {
        let mut bytes = [0; 8];
        self.source.read_exact(&mut bytes[..n_bytes])?;
        if self.is_big_endian {
            bytes[..n_bytes].reverse();
        }
        Ok(u64::from_le_bytes(bytes))
    }
}

/// Refuses a first directory beyond the end of the file, and one with a tag of more values than the file has bytes;
/// leaves all other faults to the decoder. The source is then at its start.
pub(super) fn check_tags(source: &mut dyn ByteSource, names: &PageNames) -> Result<(), ReadError> {
    source.seek(SeekFrom::Start(0)).map_err(|e| ReadError::io("the file", e))?;
    // A file that ends within its directory is the decoder's to refuse.
    let mut directory = Directory::default();
    let _ = directory.read(source);
    source.seek(SeekFrom::Start(0)).map_err(|e| ReadError::io("the file", e))?;
    let (n_file_bytes, longest) = (names.n_file_bytes, directory.longest_tag);
    match directory.start {
        None => return Err(ReadError::EndsWithin { part: "the TIFF header".to_owned(), n_file_bytes, end: None }),
        Some(start) if start >= n_file_bytes => return Err(names.ends_before_tags(0, start)),
        Some(_) => {}
    }
    if longest > n_file_bytes {
        let expected = format!("at most {n_file_bytes}, the file's bytes");
        return Err(ReadError::field("number of a tag's values", longest, expected));
    }
    Ok(())
}

/// The start and the longest tag of the first directory (TIFF 6.0, section 2; BigTIFF has wider counts and offsets).
#[derive(Default)]
struct Directory {
    start: Option<u64>,
    /// Most values of any tag.
    longest_tag: u64,
}

impl Directory {
    /// On an error, the numbers that were read before it are kept.
    fn read(&mut self, source: &mut dyn ByteSource) -> io::Result<()> {
        let mut order = [0; 2];
        source.read_exact(&mut order)?;
        let mut numbers = TagNumbers { source, is_big_endian: order == *b"MM" };
        let is_big = numbers.number(2)? == 43;
        if is_big {
            numbers.number(4)?;
        }
        let (n_offset, n_entries) = if is_big { (8, 8) } else { (4, 2) };
        let start = *self.start.insert(numbers.number(n_offset)?);
        numbers.source.seek(SeekFrom::Start(start))?;
        for _ in 0..numbers.number(n_entries)? {
            numbers.number(4)?;
            self.longest_tag = self.longest_tag.max(numbers.number(n_offset)?);
            numbers.number(n_offset)?;
        }
        Ok(())
    }
}
