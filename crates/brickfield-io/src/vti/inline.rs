//! Numbers between tags: text up to the next tag, and base64 in it.

use std::io::{self, BufRead, Read};

use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use base64::{DecodeError, Engine};

use crate::error::{Damage, Shown};
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
    /// The fault after the decoded bytes, which are given all the same.
    fault: Option<Damage>,
}

impl<R: BufRead> Base64Reader<R> {
    pub(super) fn new(text: R) -> Base64Reader<R> {
        Base64Reader { text, decoded: Vec::new(), n_given: 0, fault: None }
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
        self.fault = decode_runs(&symbols, &mut self.decoded).err();
        Ok(())
    }
}

/// Each run ends with the quad that has padding, or with the last one.
fn decode_runs(mut symbols: &[u8], out: &mut Vec<u8>) -> Result<(), Damage> {
    while !symbols.is_empty() {
        let padded = symbols.iter().position(|b| *b == b'=');
        let end = padded.map_or(symbols.len(), |i| (i / 4 * 4 + 4).min(symbols.len()));
        let (run, rest) = symbols.split_at(end);
        decode_run(run, out)?;
        symbols = rest;
    }
    Ok(())
}

/// Decodes a run; of a wrong one, the quads before the fault.
fn decode_run(run: &[u8], out: &mut Vec<u8>) -> Result<(), Damage> {
    let n_before = out.len();
    let Err(fault) = ENGINE.decode_vec(run, out) else { return Ok(()) };
    let (n_good, damage) = match fault {
        DecodeError::InvalidByte(at, symbol) => {
            let found = Shown::new(char::from(symbol));
            (at.min(run.len()), Damage::NotBase64 { found })
        }
        _ => (run.len(), Damage::Base64CutOff),
    };
    out.truncate(n_before);
    // Whole quads of good symbols: this cannot fail, and if it did, the damage would be the same.
    let _ = ENGINE.decode_vec(&run[..n_good / 4 * 4], out);
    Err(damage)
}

impl<R: BufRead> Read for Base64Reader<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.n_given == self.decoded.len() && self.fault.is_none() {
            self.refill()?;
        }
        if self.n_given == self.decoded.len()
            && let Some(fault) = self.fault.take()
        {
            return Err(fault.into());
        }
        let n = (&self.decoded[self.n_given..]).read(buffer)?;
        self.n_given += n;
        Ok(n)
    }
}
