//! A look at the first directory before the decoder's, which makes room for as many values as a tag claims to have.

use std::io::{self, SeekFrom};

use crate::ReadError;
use crate::files::ByteSource;

/// Reads whole numbers in a file's byte order.
struct Numbers<'a> {
    source: &'a mut dyn ByteSource,
    is_big_endian: bool,
}

impl Numbers<'_> {
    fn number(&mut self, n_bytes: usize) -> io::Result<u64> {
        let mut bytes = [0; 8];
        self.source.read_exact(&mut bytes[..n_bytes])?;
        if self.is_big_endian {
            bytes[..n_bytes].reverse();
        }
        Ok(u64::from_le_bytes(bytes))
    }
}

/// Refuses a first directory with a tag of more values than the file has bytes; leaves all other faults to the decoder.
pub(super) fn check_tags(source: &mut dyn ByteSource, n_file_bytes: u64) -> Result<(), ReadError> {
    source.seek(SeekFrom::Start(0)).map_err(|e| ReadError::io("the file", e))?;
    // A file that ends before its directory does is the decoder's to refuse.
    let longest = longest_tag(source).unwrap_or(0);
    source.seek(SeekFrom::Start(0)).map_err(|e| ReadError::io("the file", e))?;
    if longest > n_file_bytes {
        let expected = format!("at most {n_file_bytes}, the file's bytes");
        return Err(ReadError::field("number of a tag's values", longest, expected));
    }
    Ok(())
}

/// Most values of any tag of the first directory (TIFF 6.0, section 2; BigTIFF has wider counts and offsets).
fn longest_tag(source: &mut dyn ByteSource) -> io::Result<u64> {
    let mut order = [0; 2];
    source.read_exact(&mut order)?;
    let mut numbers = Numbers { source, is_big_endian: order == *b"MM" };
    let is_big = numbers.number(2)? == 43;
    if is_big {
        numbers.number(4)?;
    }
    let (n_offset, n_entries) = if is_big { (8, 8) } else { (4, 2) };
    let directory = numbers.number(n_offset)?;
    numbers.source.seek(SeekFrom::Start(directory))?;
    let mut longest = 0;
    for _ in 0..numbers.number(n_entries)? {
        numbers.number(4)?;
        longest = longest.max(numbers.number(n_offset)?);
        numbers.number(n_offset)?;
    }
    Ok(longest)
}
