//! Numbers between tags: text up to the next tag, and base64 in it.

use std::io::{self, BufRead, Read};

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

use crate::files::ByteSource;

/// The source up to the next `<`, where it ends.
pub(super) struct UntilTag<'a> {
    source: &'a mut dyn ByteSource,
}

impl<'a> UntilTag<'a> {
    pub(super) fn new(source: &'a mut dyn ByteSource) -> UntilTag<'a> {
        UntilTag { source }
    }
}

impl Read for UntilTag<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.fill_buf()?.read(buffer)?;
        self.consume(n);
        Ok(n)
    }
}

impl BufRead for UntilTag<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        let bytes = self.source.fill_buf()?;
        let end = bytes.iter().position(|b| *b == b'<').unwrap_or(bytes.len());
        Ok(&bytes[..end])
    }

    fn consume(&mut self, n: usize) {
        self.source.consume(n);
    }
}

const ENGINE: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

const QUADS_BYTES: usize = 4096;

/// Decodes base64 with white space in it and padding anywhere: VTK writes headers and data as one run or as two.
pub(super) struct Base64Reader<R> {
    text: R,
    decoded: Vec<u8>,
    n_given: usize,
}

impl<R: BufRead> Base64Reader<R> {
    pub(super) fn new(text: R) -> Base64Reader<R> {
        Base64Reader { text, decoded: Vec::new(), n_given: 0 }
    }

    fn refill(&mut self) -> io::Result<()> {
        let mut symbols = Vec::with_capacity(QUADS_BYTES);
        while symbols.len() < QUADS_BYTES {
            let bytes = self.text.fill_buf()?;
            if bytes.is_empty() {
                break;
            }
            let n = bytes.len().min(QUADS_BYTES - symbols.len());
            symbols.extend(bytes[..n].iter().filter(|b| !b.is_ascii_whitespace()));
            self.text.consume(n);
        }
        self.decoded.clear();
        self.n_given = 0;
        decode_runs(&symbols, &mut self.decoded)
    }
}

/// Each run ends with the quad that has padding, or with the last one.
fn decode_runs(mut symbols: &[u8], out: &mut Vec<u8>) -> io::Result<()> {
    while !symbols.is_empty() {
        let padded = symbols.iter().position(|b| *b == b'=');
        let end = padded.map_or(symbols.len(), |i| (i / 4 * 4 + 4).min(symbols.len()));
        let (run, rest) = symbols.split_at(end);
        ENGINE.decode_vec(run, out).map_err(|e| io::Error::new(io::ErrorKind::InvalidData, e))?;
        symbols = rest;
    }
    Ok(())
}

impl<R: BufRead> Read for Base64Reader<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.n_given == self.decoded.len() {
            self.refill()?;
        }
        let n = (&self.decoded[self.n_given..]).read(buffer)?;
        self.n_given += n;
        Ok(n)
    }
}
