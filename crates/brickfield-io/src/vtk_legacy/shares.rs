//! Bytes that are written as text as their shares of 255.

use std::io::{self, BufRead, Read};

use crate::files::ByteSource;

/// The text with each number from 0 to 1 in place of the byte that it stands for: "0.2" is "51". What is no number stays.
pub(super) struct Shares<'a> {
    source: &'a mut dyn ByteSource,
    text: Vec<u8>,
    n_given: usize,
}

/// A number is shorter.
const MAX_TOKEN_BYTES: u64 = 400;

impl<'a> Shares<'a> {
    pub(super) fn new(source: &'a mut dyn ByteSource) -> Shares<'a> {
        Shares { source, text: Vec::new(), n_given: 0 }
    }

    /// Takes the next number, or nothing at the end.
    fn refill(&mut self) -> io::Result<()> {
        let mut token = Vec::new();
        for byte in (&mut *self.source).bytes() {
            match byte? {
                space if space.is_ascii_whitespace() && token.is_empty() => {}
                space if space.is_ascii_whitespace() => break,
                byte => token.push(byte),
            }
            if token.len() as u64 > MAX_TOKEN_BYTES {
                break;
            }
        }
        self.n_given = 0;
        self.text = match std::str::from_utf8(&token).ok().and_then(|text| text.parse::<f64>().ok()) {
            Some(share) => format!("{} ", (255.0 * share).round()).into_bytes(),
            None if token.is_empty() => Vec::new(),
            None => [&token[..], b" "].concat(),
        };
        Ok(())
    }
}

impl Read for Shares<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.fill_buf()?.read(buffer)?;
        self.consume(n);
        Ok(n)
    }
}

impl BufRead for Shares<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.n_given == self.text.len() {
            self.refill()?;
        }
        Ok(&self.text[self.n_given..])
    }

    fn consume(&mut self, n: usize) {
        self.n_given += n;
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    #[test]
    fn shares_become_bytes() {
        let mut text = String::new();
        Shares::new(&mut Cursor::new("0 1\n0.2  0.00392157\tx")).read_to_string(&mut text).unwrap();
        assert_eq!(text, "0 255 51 1 x ");
    }
}
