//! XML with a bound on its length, numbers and appended data not counted.

use std::io::{self, BufRead, Read};

use quick_xml::Reader;

use crate::ReadError;
use crate::files::ByteSource;
use crate::lines::MAX_HEADER_BYTES;

/// A source that gives only so many bytes of XML; skipped bytes do not count.
pub(super) struct Metered<'a> {
    pub(super) source: &'a mut dyn ByteSource,
    pub(super) n_bytes_left: u64,
}

impl Read for Metered<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.fill_buf()?.read(buffer)?;
        self.consume(n);
        Ok(n)
    }
}

impl BufRead for Metered<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.n_bytes_left == 0 {
            return Err(io::Error::other(format!("the XML outside of arrays is longer than {MAX_HEADER_BYTES} bytes")));
        }
        self.source.fill_buf()
    }

    fn consume(&mut self, n: usize) {
        self.n_bytes_left = self.n_bytes_left.saturating_sub(n as u64);
        self.source.consume(n);
    }
}

/// Skips to the next tag.
pub(super) fn skip_text(reader: &mut Reader<Metered>) -> io::Result<()> {
    let mut stream = reader.stream();
    loop {
        let bytes = stream.fill_buf()?;
        let n = bytes.iter().position(|b| *b == b'<').unwrap_or(bytes.len());
        let is_found = n < bytes.len();
        let is_end = bytes.is_empty();
        stream.consume(n);
        stream.get_mut().n_bytes_left += n as u64;
        if is_found || is_end {
            return Ok(());
        }
    }
}

/// The position after the underscore that marks the start of appended data.
pub(super) fn find_underscore(reader: &mut Reader<Metered>) -> Result<u64, ReadError> {
    let mut stream = reader.stream();
    let mut byte = [0];
    loop {
        match stream.read(&mut byte) {
            Ok(1) if byte[0] == b'_' => return Ok(stream.offset()),
            Ok(1) if byte[0].is_ascii_whitespace() => {}
            Ok(0) => return Err(ends_within_document(stream.offset())),
            Ok(_) => return Err(ReadError::Missing { field: "the underscore at the start of AppendedData" }),
            Err(e) => return Err(ReadError::io("the document", e)),
        }
    }
}

pub(super) fn ends_within_document(n_file_bytes: u64) -> ReadError {
    ReadError::EndsWithin { part: "the XML document".to_owned(), n_file_bytes, end: None }
}
