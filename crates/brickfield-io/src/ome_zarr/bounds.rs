//! How chunks are packed, and proof that a stored chunk unpacks to its claimed size, before `zarrs` unpacks it.
//!
//! The decoders of `zarrs` read gzip and zstd to their end, however long that is.

use std::io::{self, Read};

use serde_json::Value;

use super::json::numbers;
use super::pack::DETAILS_CODEC;
use crate::ReadError;
use crate::deflate::damage;
use crate::error::bytes;

/// The codec of the bytes of a chunk, or of the parts of a shard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Compressor {
    None,
    Gzip,
    Zlib,
    Zstd,
    Blosc,
    /// Details of the next level ([`brickfield_haar`]).
    HaarDetails,
}

/// The one compressor of some bytes, and the checksums in it and around it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Codecs {
    compressor: Compressor,
    n_inner_checksums: u64,
    n_outer_checksums: u64,
}

/// CRC-32C stands behind the bytes.
const CHECKSUM_BYTES: u64 = 4;

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Packing {
    Plain(Codecs),
    Shard(Shard),
}

/// A shard: chunks in a chunk, found by an index of offset and length at one end.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Shard {
    pub(super) part_shape: Vec<u64>,
    pub(super) codecs: Codecs,
    pub(super) is_index_first: bool,
    pub(super) index_has_checksum: bool,
}

impl Compressor {
    fn named(name: &str) -> Result<Compressor, ReadError> {
        match name {
            "gzip" => Ok(Compressor::Gzip),
            "zlib" | "numcodecs.zlib" => Ok(Compressor::Zlib),
            "zstd" | "numcodecs.zstd" => Ok(Compressor::Zstd),
            "blosc" | "numcodecs.blosc" => Ok(Compressor::Blosc),
            DETAILS_CODEC => Ok(Compressor::HaarDetails),
            _ => Err(ReadError::unsupported("compressor", name, "gzip, zlib, zstd and blosc are")),
        }
    }
}

impl Packing {
    /// Whether the parts of shards are details, to which samples of the next level belong.
    pub(super) fn has_details(&self) -> bool {
        matches!(self, Packing::Shard(shard) if shard.codecs.compressor == Compressor::HaarDetails)
    }

    pub(super) fn of_v2(array: &Value) -> Result<Packing, ReadError> {
        let mut filters = array["filters"].as_array().into_iter().flatten();
        if let Some(filter) = filters.next() {
            return Err(ReadError::unsupported("filter", filter["id"].as_str().unwrap_or_default(), "none is"));
        }
        let compressor = match &array["compressor"] {
            Value::Null => Compressor::None,
            other => Compressor::named(other["id"].as_str().unwrap_or_default())?,
        };
        Ok(Packing::Plain(Codecs { compressor, n_inner_checksums: 0, n_outer_checksums: 0 }))
    }

    pub(super) fn of_v3(codecs: &Value) -> Result<Packing, ReadError> {
        let first = codecs.as_array().and_then(|list| list.first());
        let Some(shard) = first.filter(|codec| codec["name"] == "sharding_indexed") else {
            return Ok(Packing::Plain(Codecs::of(codecs)?));
        };
        let configuration = &shard["configuration"];
        let index_codecs = configuration["index_codecs"].as_array().into_iter().flatten();
        Ok(Packing::Shard(Shard {
            part_shape: numbers(configuration, "chunk_shape")?,
            codecs: Codecs::of(&configuration["codecs"])?,
            is_index_first: configuration["index_location"] == "start",
            index_has_checksum: index_codecs.clone().any(|codec| codec["name"] == "crc32c"),
        }))
    }

    /// Checks that the stored bytes unpack to no more than the chunk has.
    pub(super) fn check(
        &self,
        stored: &[u8],
        chunk_shape: &[u64],
        sample_bytes: u64,
        what: &str,
    ) -> Result<(), ReadError> {
        let n_bytes = |shape: &[u64]| shape.iter().fold(sample_bytes, |n, s| n.saturating_mul(*s));
        match self {
            Packing::Plain(codecs) => check_stream(*codecs, stored, n_bytes(chunk_shape), what),
            Packing::Shard(shard) => {
                let parts = shard.parts(stored, chunk_shape, what)?;
                for (i, part) in parts.iter().enumerate() {
                    let what = format!("part {} of {} of {what}", i + 1, parts.len());
                    check_stream(shard.codecs, part, n_bytes(&shard.part_shape), &what)?;
                }
                Ok(())
            }
        }
    }
}

impl Codecs {
    /// One compressor at most; all other codecs but checksums change no lengths.
    fn of(codecs: &Value) -> Result<Codecs, ReadError> {
        let mut found = Codecs { compressor: Compressor::None, n_inner_checksums: 0, n_outer_checksums: 0 };
        for codec in codecs.as_array().into_iter().flatten() {
            let name = codec.as_str().or(codec["name"].as_str()).unwrap_or_default();
            match (name, found.compressor) {
                ("bytes" | "endian" | "transpose", _) => {}
                ("crc32c", Compressor::None) => found.n_inner_checksums += 1,
                ("crc32c", _) => found.n_outer_checksums += 1,
                (_, Compressor::None) => found.compressor = Compressor::named(name)?,
                _ => return Err(ReadError::unsupported("second compressor", name, "one is")),
            }
        }
        Ok(found)
    }
}

impl Shard {
    /// The stored bytes of each part that is there.
    fn parts<'a>(&self, stored: &'a [u8], chunk_shape: &[u64], what: &str) -> Result<Vec<&'a [u8]>, ReadError> {
        let bad = |field: &str, value: String, expected: String| {
            ReadError::field(format!("{field} of {what}"), value, expected)
        };
        let fits = self.part_shape.len() == chunk_shape.len() && !self.part_shape.contains(&0);
        if !fits {
            let value = format!("{:?}", self.part_shape);
            return Err(bad("part shape", value, format!("a divisor of {chunk_shape:?}")));
        }
        let per_axis = chunk_shape.iter().zip(&self.part_shape).map(|(n, part)| u128::from(n.div_ceil(*part)));
        let n_parts = per_axis.fold(1u128, |n, m| n.saturating_mul(m));
        let checksum_bytes = if self.index_has_checksum { 4 } else { 0 };
        let index_bytes = n_parts.saturating_mul(16).saturating_add(checksum_bytes);
        if index_bytes > stored.len() as u128 {
            return Err(bad(
                "index length",
                index_bytes.to_string(),
                format!("at most the {} stored", bytes(stored.len())),
            ));
        }
        let start = if self.is_index_first { 0 } else { stored.len() - index_bytes as usize };
        let index = &stored[start..start + (n_parts * 16) as usize];
        let word = |bytes: &[u8]| bytes.iter().rev().fold(0u64, |n, b| n << 8 | u64::from(*b));
        let mut parts = Vec::new();
        for entry in index.chunks_exact(16) {
            let (offset, n_bytes) = (word(&entry[..8]), word(&entry[8..]));
            if (offset, n_bytes) == (u64::MAX, u64::MAX) {
                continue;
            }
            let end = offset.checked_add(n_bytes).filter(|end| *end <= stored.len() as u64);
            let end = end.ok_or_else(|| {
                bad("index entry", format!("{offset} + {n_bytes}"), format!("within {}", bytes(stored.len())))
            })?;
            parts.push(&stored[offset as usize..end as usize]);
        }
        Ok(parts)
    }
}

/// Checks that stored bytes unpack to no more than `max_bytes`.
pub(super) fn check_stream(codecs: Codecs, stored: &[u8], max_bytes: u64, what: &str) -> Result<(), ReadError> {
    if codecs.n_outer_checksums > 0 && !ends_with_checksum(stored) {
        return Err(ReadError::WrongChecksum { what: what.to_owned() });
    }
    let n_packed = (stored.len() as u64).saturating_sub(CHECKSUM_BYTES * codecs.n_outer_checksums);
    let stored = &stored[..n_packed as usize];
    let max_bytes = max_bytes.saturating_add(CHECKSUM_BYTES * codecs.n_inner_checksums);
    let unpacked = match codecs.compressor {
        // A brick's header states its samples, and is held to them before they are decoded.
        Compressor::None | Compressor::HaarDetails => return Ok(()),
        Compressor::Gzip => n_unpacked(flate2::read::GzDecoder::new(stored), max_bytes),
        Compressor::Zlib => n_unpacked(flate2::read::ZlibDecoder::new(stored), max_bytes),
        Compressor::Zstd => {
            let decoder = zstd::Decoder::with_buffer(stored).map_err(|e| ReadError::io(what, e))?;
            n_unpacked(decoder, max_bytes)
        }
        Compressor::Blosc => Ok(blosc_bytes(stored)),
    };
    let n_bytes = unpacked.map_err(|(n_bytes, fault)| ReadError::reading(what, n_bytes, max_bytes.into(), fault))?;
    if n_bytes > max_bytes {
        return Err(ReadError::TooLarge {
            what: format!("{what}, unpacked,"),
            n_bytes: u128::from(n_bytes),
            max_bytes,
        });
    }
    Ok(())
}

/// Whether the last bytes are the CRC-32C of those before.
fn ends_with_checksum(stored: &[u8]) -> bool {
    let parts = stored.split_last_chunk::<{ CHECKSUM_BYTES as usize }>();
    parts.is_some_and(|(bytes, checksum)| crc32c::crc32c(bytes).to_le_bytes() == *checksum)
}

/// Bytes that come out, counted up to one more than allowed and not kept; on a fault, the bytes that came before.
fn n_unpacked(decoder: impl Read, max_bytes: u64) -> Result<u64, (u64, io::Error)> {
    let mut unpacked = decoder.take(max_bytes.saturating_add(1));
    let (mut n_bytes, mut chunk) = (0, [0; 8192]);
    loop {
        match unpacked.read(&mut chunk) {
            Ok(0) => return Ok(n_bytes),
            Ok(n) => n_bytes += n as u64,
            Err(fault) => return Err((n_bytes, damage(fault))),
        }
    }
}

/// The claims of a blosc buffer's header; the decoder allocates and checks by them.
fn blosc_bytes(stored: &[u8]) -> u64 {
    stored.get(4..8).and_then(|b| b.try_into().ok()).map_or(0, |b| u64::from(u32::from_le_bytes(b)))
}
