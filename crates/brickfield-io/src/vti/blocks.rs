//! The header of binary data, and compressed blocks.

use std::io::{self, Read};

use super::compressor::Compressor;
use super::document::WordSize;
use crate::error::check_length;
use crate::samples::fill_named;
use crate::{ByteOrder, ReadError};

/// Reads the words of a data header.
pub(super) struct WordReader<'a> {
    pub(super) reader: &'a mut dyn Read,
    pub(super) size: WordSize,
    pub(super) order: ByteOrder,
    pub(super) what: &'a str,
}

impl WordReader<'_> {
    fn next(&mut self) -> Result<u64, ReadError> {
        let mut bytes = [0; 8];
        let n_expected = self.size.n_bytes();
        let what = format!("a word of the header of {}", self.what);
        let n = fill_named(self.reader, &mut bytes[..n_expected], &what)?;
        check_length(&what, n as u64, n_expected as u128)?;
        Ok(match (self.order, self.size) {
            (ByteOrder::Little, _) => u64::from_le_bytes(bytes),
            (ByteOrder::Big, WordSize::Eight) => u64::from_be_bytes(bytes),
            (ByteOrder::Big, WordSize::Four) => u64::from_be_bytes(bytes) >> 32,
        })
    }
}

impl WordSize {
    pub(super) fn n_bytes(self) -> usize {
        match self {
            WordSize::Four => 4,
            WordSize::Eight => 8,
        }
    }
}

/// The header of data that are not compressed: their length.
///
/// A length of 32 bits wraps round in files of 4 GiB and more, which VTK reads all the same.
pub(super) fn check_plain(words: &mut WordReader, n_left: u64, n_bytes: u64) -> Result<(), ReadError> {
    let stated = words.next()?;
    let expected = match words.size {
        WordSize::Four => n_bytes & 0xffff_ffff,
        WordSize::Eight => n_bytes,
    };
    if stated != expected {
        let expected = format!("{expected}, from the extent and the type");
        return Err(ReadError::field(format!("length of {}", words.what), stated, expected));
    }
    check_length(words.what, n_left, n_bytes.into())
}

/// Compressed blocks, decoded one after the other.
pub(super) struct Blocks<'a> {
    source: &'a mut dyn Read,
    compressor: Compressor,
    /// Bytes of each block, compressed and not; the last one first.
    sizes: Vec<(u64, u64)>,
    block: Vec<u8>,
    n_given: usize,
    /// The fault after the bytes of the block, which are given all the same.
    fault: Option<io::Error>,
}

/// The header of compressed data: number of blocks, their size, the size of a partial last one, compressed sizes.
pub(super) fn read_blocks<'a>(
    mut words: WordReader<'a>,
    n_left: u64,
    compressor: Compressor,
    expected_bytes: u64,
) -> Result<Blocks<'a>, ReadError> {
    let what = words.what;
    let [n_blocks, block_bytes, partial_bytes] = [words.next()?, words.next()?, words.next()?];
    let n_whole = if partial_bytes > 0 { n_blocks.saturating_sub(1) } else { n_blocks };
    let n_bytes = u128::from(n_whole) * u128::from(block_bytes) + u128::from(partial_bytes);
    if n_bytes != u128::from(expected_bytes) {
        let expected = format!("{expected_bytes}, from the extent and the type");
        return Err(ReadError::field(format!("length of {what}"), n_bytes, expected));
    }
    if block_bytes == 0 && n_whole > 0 {
        return Err(ReadError::field(format!("block size of {what}"), block_bytes, "at least 1"));
    }
    check_length(what, n_left, u128::from(n_blocks) * words.size.n_bytes() as u128)?;
    compressor.check_ratio(what, n_left, n_bytes)?;
    let mut sizes = Vec::new();
    for i in 0..n_blocks {
        let n = if i < n_whole { block_bytes } else { partial_bytes };
        sizes.push((words.next()?, n));
    }
    sizes.reverse();
    Ok(Blocks { source: words.reader, compressor, sizes, block: Vec::new(), n_given: 0, fault: None })
}

impl Blocks<'_> {
    fn decode_next(&mut self, n_compressed: u64, expected_bytes: u64) -> io::Result<()> {
        self.block.clear();
        self.n_given = 0;
        let mut compressed = (&mut *self.source).take(n_compressed);
        self.compressor.unpack(&mut compressed, expected_bytes, &mut self.block)?;
        io::copy(&mut compressed, &mut io::sink()).map(|_| ())
    }
}

impl Read for Blocks<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while self.n_given == self.block.len() {
            if let Some(fault) = self.fault.take() {
                return Err(fault);
            }
            match self.sizes.pop() {
                Some((n_compressed, n_bytes)) => self.fault = self.decode_next(n_compressed, n_bytes).err(),
                None => return Ok(0),
            }
        }
        let n = (&self.block[self.n_given..]).read(buffer)?;
        self.n_given += n;
        Ok(n)
    }
}
