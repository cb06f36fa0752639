//! The metadata of an array, read before `zarrs` acts on them.

use brickfield_core::ScalarType;
use serde_json::{Value, json};
use zarrs::storage::ReadableStorage;

use super::bounds::Packing;
use super::json::{numbers, read_json};
use super::node::joined;
use super::write::little_endian;
use crate::error::counted;
use crate::limits::check_bytes;
use crate::stored_type::StoredType;
use crate::{Limits, ReadError};

pub(super) struct ArrayMetadata {
    /// Samples along each axis, slowest first.
    pub(super) shape: Vec<u64>,
    pub(super) chunk_shape: Vec<u64>,
    pub(super) stored: StoredType,
    pub(super) packing: Packing,
    /// Names of the axes (Zarr v3), or null.
    pub(super) dimension_names: Value,
    /// The document, made fit for `zarrs`.
    document: Value,
}

const SUPPORTED: &str = "8 to 64 bit integers, 16 to 64 bit floats and bool are";

/// More chunks than this are not looked for.
const MAX_CHUNKS: u128 = 1 << 24;

impl ArrayMetadata {
    /// The metadata of the array at a path without a slash in front.
    pub(super) fn read(store: &ReadableStorage, path: &str) -> Result<ArrayMetadata, ReadError> {
        let metadata = match read_json(store, &joined(path, "zarr.json"))? {
            Some(json) => ArrayMetadata::of_v3(&json)?,
            None => {
                let json = read_json(store, &joined(path, ".zarray"))?;
                ArrayMetadata::of_v2(&json.ok_or(ReadError::Missing { field: "zarr.json or .zarray of the array" })?)?
            }
        };
        if metadata.shape.len() != metadata.chunk_shape.len() || metadata.chunk_shape.contains(&0) {
            let value = format!("{:?}", metadata.chunk_shape);
            let expected = format!("{} of at least 1", counted(metadata.shape.len(), "number", "numbers"));
            return Err(ReadError::field("chunk shape", value, expected));
        }
        Ok(metadata)
    }

    /// The number of axes of the array at a path, whatever else it is.
    pub(super) fn n_axes(store: &ReadableStorage, path: &str) -> Result<usize, ReadError> {
        let json = match read_json(store, &joined(path, "zarr.json"))? {
            Some(json) => Some(json),
            None => read_json(store, &joined(path, ".zarray"))?,
        };
        Ok(json.and_then(|json| json["shape"].as_array().map(Vec::len)).unwrap_or(0))
    }

    fn of_v2(json: &Value) -> Result<ArrayMetadata, ReadError> {
        let dtype = json["dtype"].as_str().unwrap_or_default();
        let stored = match dtype.trim_start_matches(['<', '>', '|', '=']) {
            "u1" => ScalarType::U8.into(),
            "i1" => ScalarType::I8.into(),
            "u2" => ScalarType::U16.into(),
            "i2" => ScalarType::I16.into(),
            "u4" => ScalarType::U32.into(),
            "i4" => ScalarType::I32.into(),
            "f4" => ScalarType::F32.into(),
            "f8" => ScalarType::F64.into(),
            "b1" => StoredType::Bool,
            "f2" => StoredType::F16,
            "i8" => StoredType::I64,
            "u8" => StoredType::U64,
            _ => return Err(ReadError::unsupported("dtype", &json["dtype"], SUPPORTED)),
        };
        let shape = numbers(json, "shape")?;
        let packing = Packing::of_v2(json)?;
        let mut document = json.clone();
        let level = document.get_mut("compressor").and_then(|c| c.get_mut("level"));
        level.into_iter().for_each(state_gzip_level);
        let dimension_names = Value::Null;
        Ok(ArrayMetadata { shape, chunk_shape: numbers(json, "chunks")?, stored, packing, dimension_names, document })
    }

    fn of_v3(json: &Value) -> Result<ArrayMetadata, ReadError> {
        let stored = match json["data_type"].as_str().unwrap_or_default() {
            "uint8" => ScalarType::U8.into(),
            "int8" => ScalarType::I8.into(),
            "uint16" => ScalarType::U16.into(),
            "int16" => ScalarType::I16.into(),
            "uint32" => ScalarType::U32.into(),
            "int32" => ScalarType::I32.into(),
            "float32" => ScalarType::F32.into(),
            "float64" => ScalarType::F64.into(),
            "bool" => StoredType::Bool,
            "float16" => StoredType::F16,
            "int64" => StoredType::I64,
            "uint64" => StoredType::U64,
            _ => return Err(ReadError::unsupported("data_type", &json["data_type"], SUPPORTED)),
        };
        let grid = &json["chunk_grid"];
        if grid["name"] != "regular" {
            return Err(ReadError::unsupported("chunk_grid", &grid["name"], "regular is"));
        }
        let chunk_shape = numbers(&grid["configuration"], "chunk_shape")?;
        let packing = Packing::of_v3(&json["codecs"])?;
        let (shape, dimension_names) = (numbers(json, "shape")?, json["dimension_names"].clone());
        let mut document = json.clone();
        if packing.has_details() {
            // `zarrs` finds chunks; it does not decode these.
            document["codecs"][0]["configuration"]["codecs"] = json!([little_endian()]);
        }
        Ok(ArrayMetadata { shape, chunk_shape, stored, packing, dimension_names, document })
    }

    /// The metadata of an array whose chunks are the smallest parts that can be read alone: chunks, or parts of shards.
    pub(super) fn of_parts(&self) -> Result<zarrs::array::ArrayMetadata, ReadError> {
        let mut document = self.document.clone();
        if let Packing::Shard(shard) = &self.packing {
            let configuration = self.document["codecs"][0]["configuration"].clone();
            document["chunk_grid"]["configuration"]["chunk_shape"] = shard.part_shape.clone().into();
            document["codecs"] = configuration["codecs"].clone();
        }
        serde_json::from_value(document).map_err(|e| ReadError::decoder("the array metadata", e))
    }

    /// The metadata as `zarrs` has them.
    pub(super) fn for_zarrs(&self) -> Result<zarrs::array::ArrayMetadata, ReadError> {
        serde_json::from_value(self.document.clone()).map_err(|e| ReadError::decoder("the array metadata", e))
    }

    pub(super) fn chunk_bytes(&self) -> u128 {
        let samples = self.chunk_shape.iter().fold(1u128, |n, s| n.saturating_mul(u128::from(*s)));
        samples.saturating_mul(self.stored.n_bytes() as u128)
    }

    /// Holds the size of a chunk and the number of chunks against sensible bounds.
    pub(super) fn check_chunks(&self, limits: &Limits) -> Result<(), ReadError> {
        check_bytes(self.chunk_bytes(), limits, || format!("a chunk of shape {:?}", self.chunk_shape))?;
        let per_axis = self.shape.iter().zip(&self.chunk_shape).map(|(n, chunk)| u128::from(n.div_ceil(*chunk)));
        let n_chunks = per_axis.fold(1u128, |n, m| n.saturating_mul(m));
        if n_chunks > MAX_CHUNKS {
            return Err(ReadError::field("number of chunks", n_chunks, format!("at most {MAX_CHUNKS}")));
        }
        Ok(())
    }
}

/// Java writers state level -1, "default", which `zarrs` refuses; for reading, any level will do.
fn state_gzip_level(level: &mut Value) {
    if level.as_i64().is_some_and(|level| level < 0) {
        *level = Value::from(5);
    }
}
