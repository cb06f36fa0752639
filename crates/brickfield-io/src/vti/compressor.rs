//! The compressors of blocks: zlib, raw LZ4 blocks, and LZMA in whole .xz streams.

use std::io::{self, Read};

use flate2::read::ZlibDecoder;
use lzma_rust2::XzReader;

use crate::ReadError;
use crate::deflate::{Unpacked, check_ratio};
use crate::error::Damage;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Compressor {
    Zlib,
    Lz4,
    Lzma,
}

/// The dictionary of the strongest setting (64 MiB), and room to work.
const MAX_XZ_KIB: u32 = 80 << 10;

/// LZ4 cannot expand by more than this: a byte of a length stands for at most 255.
const MAX_LZ4_RATIO: u64 = 255;

impl Compressor {
    pub(super) fn named(name: &str) -> Result<Option<Compressor>, ReadError> {
        Ok(Some(match name {
            "" => return Ok(None),
            "vtkZLibDataCompressor" => Compressor::Zlib,
            "vtkLZ4DataCompressor" => Compressor::Lz4,
            "vtkLZMADataCompressor" => Compressor::Lzma,
            other => {
                let supported = "vtkZLibDataCompressor, vtkLZ4DataCompressor and vtkLZMADataCompressor are";
                return Err(ReadError::unsupported("compressor", other, supported));
            }
        }))
    }

    /// Holds a claim against the most that so few compressed bytes can hold; LZMA has no useful bound.
    pub(super) fn check_ratio(self, what: &str, n_compressed: u64, expected_bytes: u128) -> Result<(), ReadError> {
        match self {
            Compressor::Zlib | Compressor::Lz4 => check_ratio(what, n_compressed, expected_bytes),
            Compressor::Lzma => Ok(()),
        }
    }

    /// Unpacks a block to its size; on a fault, what was unpacked before it is kept.
    pub(super) fn unpack(self, compressed: &mut dyn Read, expected_bytes: u64, block: &mut Vec<u8>) -> io::Result<()> {
        match self {
            Compressor::Zlib => unpack_stream(ZlibDecoder::new(compressed), expected_bytes, block),
            Compressor::Lzma => {
                unpack_stream(XzReader::new_mem_limit(compressed, false, MAX_XZ_KIB), expected_bytes, block)
            }
            Compressor::Lz4 => unpack_lz4(compressed, expected_bytes, block),
        }
    }
}

fn unpack_stream(decoder: impl Read, expected_bytes: u64, block: &mut Vec<u8>) -> io::Result<()> {
    let mut unpacked = Unpacked(decoder);
    (&mut unpacked).take(expected_bytes).read_to_end(block)?;
    check_block(block.len() as u64, expected_bytes)?;
    // At the end is the checksum: a block that disagrees with it is not given.
    unpacked.read(&mut [0]).inspect_err(|_| block.clear()).map(|_| ())
}

fn unpack_lz4(compressed: &mut dyn Read, expected_bytes: u64, block: &mut Vec<u8>) -> io::Result<()> {
    let mut packed = Vec::new();
    compressed.read_to_end(&mut packed)?;
    if expected_bytes > (packed.len() as u64).saturating_mul(MAX_LZ4_RATIO) {
        return Err(Damage::Corrupt.into());
    }
    block.resize(expected_bytes as usize, 0);
    let outcome = lz4_flex::block::decompress_into(&packed, block);
    block.truncate(*outcome.as_ref().unwrap_or(&0));
    outcome.map_err(|_| Damage::Corrupt)?;
    check_block(block.len() as u64, expected_bytes)
}

fn check_block(n_bytes: u64, expected_bytes: u64) -> io::Result<()> {
    match n_bytes == expected_bytes {
        true => Ok(()),
        false => Err(Damage::ShortBlock { n_bytes, expected_bytes }.into()),
    }
}
