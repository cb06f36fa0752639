//! zlib and gzip streams, bounded by what deflate can expand.

use std::io::{self, BufRead, Read};

use flate2::bufread::{MultiGzDecoder, ZlibDecoder};

use crate::stored::note_surplus;
use crate::{Note, ReadError};

/// Deflate cannot expand by more than this (258 bytes from 2 bits).
const MAX_RATIO: u128 = 1032;

/// Holds a header's claim against what so few compressed bytes can hold at all, before allocation.
pub(crate) fn check_ratio(what: &str, n_compressed_bytes: u64, expected_bytes: u128) -> Result<(), ReadError> {
    let max_bytes = u128::from(n_compressed_bytes) * MAX_RATIO;
    if expected_bytes > max_bytes {
        return Err(ReadError::TooFewCompressed { what: what.to_owned(), n_compressed_bytes, expected_bytes });
    }
    Ok(())
}

/// The bytes of a gzip or a zlib stream, told apart by the first byte.
pub(crate) fn inflate<'a, R: BufRead + ?Sized>(source: &'a mut R) -> io::Result<Box<dyn Read + 'a>> {
    let is_gzip = source.fill_buf()?.first() == Some(&0x1f);
    Ok(match is_gzip {
        true => Box::new(MultiGzDecoder::new(source)),
        false => Box::new(ZlibDecoder::new(source)),
    })
}

/// Reads on to the end of the stream, where its checksum is: at most one byte, so that a bomb stays shut.
pub(crate) fn check_end(inflated: &mut dyn Read, what: &str, notes: &mut Vec<Note>) -> Result<(), ReadError> {
    match inflated.read(&mut [0]) {
        Ok(0) => Ok(()),
        Ok(_) => {
            note_surplus(notes);
            Ok(())
        }
        Err(e) => Err(ReadError::io(what, e)),
    }
}
