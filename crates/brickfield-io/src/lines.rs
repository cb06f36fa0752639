//! Text headers, line by line, with a bound on their length.

use std::io::{BufRead, Read};

use crate::ReadError;
use crate::files::ByteSource;

/// Longest text header that is read.
pub(crate) const MAX_HEADER_BYTES: u64 = 16 << 20;

pub(crate) struct HeaderLines<'a> {
    source: &'a mut dyn ByteSource,
    n_bytes_left: u64,
}

impl<'a> HeaderLines<'a> {
    pub(crate) fn new(source: &'a mut dyn ByteSource) -> HeaderLines<'a> {
        HeaderLines { source, n_bytes_left: MAX_HEADER_BYTES }
    }

    /// The next line without its end, or nothing at the end of the file. Bytes that are not UTF-8 are replaced.
    pub(crate) fn next_line(&mut self) -> Result<Option<String>, ReadError> {
        let mut line = Vec::new();
        let n = (&mut self.source)
            .take(self.n_bytes_left)
            .read_until(b'\n', &mut line)
            .map_err(|e| ReadError::io("the header", e))?;
        self.n_bytes_left -= n as u64;
        if self.n_bytes_left == 0 {
            let (n_bytes, max_bytes) = (u128::from(MAX_HEADER_BYTES) + 1, MAX_HEADER_BYTES);
            return Err(ReadError::TooLarge { what: "the text header".to_owned(), n_bytes, max_bytes });
        }
        let text = String::from_utf8_lossy(&line);
        Ok((n > 0).then(|| text.trim_end_matches(['\n', '\r']).to_owned()))
    }

    /// The lines that are not blank, to the end of the file, without white space around them.
    pub(crate) fn rest(&mut self) -> Result<Vec<String>, ReadError> {
        let mut lines = Vec::new();
        while let Some(line) = self.next_line()? {
            if !line.trim().is_empty() {
                lines.push(line.trim().to_owned());
            }
        }
        Ok(lines)
    }
}

/// All numbers of a white-space separated field.
pub(crate) fn numbers<T: std::str::FromStr>(field: &'static str, text: &str) -> Result<Vec<T>, ReadError> {
    text.split_whitespace().map(|t| t.parse().map_err(|_| ReadError::field(field, t, "a number"))).collect()
}
