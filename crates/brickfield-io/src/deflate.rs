//! zlib and gzip streams, bounded by the greatest expansion of deflate.

use std::io::{self, BufRead, ErrorKind, Read};

use flate2::bufread::{GzDecoder, ZlibDecoder};

use crate::error::Damage;
use crate::note::note_surplus;
use crate::{Note, ReadError};

/// Deflate cannot expand by more than this (258 bytes from 2 bits).
const MAX_RATIO: u128 = 1032;

/// Holds a header's claim against the most that so few compressed bytes can hold, before allocation.
pub(crate) fn check_ratio(what: &str, n_compressed_bytes: u64, expected_bytes: u128) -> Result<(), ReadError> {
    let max_bytes = u128::from(n_compressed_bytes) * MAX_RATIO;
    if expected_bytes > max_bytes {
        return Err(ReadError::TooFewCompressed { what: what.to_owned(), n_compressed_bytes, expected_bytes });
    }
    Ok(())
}

/// The bytes of a gzip or a zlib stream, told apart by the first byte.
pub(crate) fn inflate<'a>(mut source: impl BufRead + 'a) -> io::Result<Box<dyn Read + 'a>> {
    let is_gzip = source.fill_buf()?.first() == Some(&0x1f);
    Ok(match is_gzip {
        true => Box::new(Unpacked(Members { member: Some(GzDecoder::new(source)) })),
        false => Box::new(Unpacked(ZlibDecoder::new(source))),
    })
}

/// The members of a gzip stream, one after the other. Bytes behind them are no part of it, as `gzip` has it.
struct Members<R: BufRead> {
    /// `None` after the last one.
    member: Option<GzDecoder<R>>,
}

impl<R: BufRead> Read for Members<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while let Some(member) = &mut self.member {
            let n = member.read(buffer)?;
            if n > 0 || buffer.is_empty() {
                return Ok(n);
            }
            if let Some(mut source) = self.member.take().map(GzDecoder::into_inner)
                && source.fill_buf()?.first() == Some(&0x1f)
            {
                self.member = Some(GzDecoder::new(source));
            }
        }
        Ok(0)
    }
}

/// A decoder whose faults are [`Damage`].
pub(crate) struct Unpacked<R>(pub(crate) R);

/// A decoder that fails drops the bytes that it has unpacked in that call; with shorter calls less is missing from the count.
const MAX_READ_BYTES: usize = 1 << 15;

impl<R: Read> Read for Unpacked<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = buffer.len().min(MAX_READ_BYTES);
        self.0.read(&mut buffer[..n]).map_err(damage)
    }
}

/// The meaning of a decoder's error: `flate2` reports corrupt data as invalid input.
pub(crate) fn damage(fault: io::Error) -> io::Error {
    let is_of_source = fault.get_ref().is_some_and(|e| e.is::<Damage>());
    match fault.kind() {
        _ if is_of_source => fault,
        ErrorKind::UnexpectedEof => Damage::CutOff.into(),
        ErrorKind::InvalidInput | ErrorKind::InvalidData => Damage::Corrupt.into(),
        _ => fault,
    }
}

/// Reads on to the end of the stream, where its checksum is: at most one byte, so that a bomb stays shut.
///
/// `n_bytes` have been read, which are all that were promised.
pub(crate) fn check_end(
    inflated: &mut dyn Read,
    what: &str,
    n_bytes: u64,
    notes: &mut Vec<Note>,
) -> Result<(), ReadError> {
    match inflated.read(&mut [0]) {
        Ok(0) => Ok(()),
        Ok(_) => {
            note_surplus(notes);
            Ok(())
        }
        Err(e) => Err(ReadError::reading(what, n_bytes, u128::from(n_bytes), e)),
    }
}
