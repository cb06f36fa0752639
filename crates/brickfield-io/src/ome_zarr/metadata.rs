//! The metadata of an array, read before `zarrs` acts on them.

use brickfield_core::ScalarType;
use serde_json::Value;
use zarrs::storage::ReadableStorage;

use super::bounds::Packing;
use super::json::{numbers, read_json};
use crate::error::counted;
use crate::limits::check_bytes;
use crate::{Limits, ReadError};

pub(super) struct ArrayMetadata {
    /// Samples along each axis, slowest first.
    pub(super) shape: Vec<u64>,
    pub(super) chunk_shape: Vec<u64>,
    pub(super) scalar: ScalarType,
    pub(super) packing: Packing,
    /// The document, made fit for `zarrs`.
    document: Value,
}

/// More chunks than this are not looked for.
const MAX_CHUNKS: u128 = 1 << 24;

impl ArrayMetadata {
    pub(super) fn read(store: &ReadableStorage, path: &str) -> Result<ArrayMetadata, ReadError> {
        let folder = path.trim_start_matches('/');
        let metadata = match read_json(store, &format!("{folder}/zarr.json"))? {
            Some(json) => ArrayMetadata::of_v3(&json)?,
            None => {
                let json = read_json(store, &format!("{folder}/.zarray"))?;
                ArrayMetadata::of_v2(&json.ok_or(ReadError::Missing { field: "zarr.json or .zarray of level 0" })?)?
            }
        };
        if metadata.shape.len() != metadata.chunk_shape.len() || metadata.chunk_shape.contains(&0) {
            let value = format!("{:?}", metadata.chunk_shape);
            let expected = format!("{} of at least 1", counted(metadata.shape.len(), "number", "numbers"));
            return Err(ReadError::field("chunk shape", value, expected));
        }
        Ok(metadata)
    }

    fn of_v2(json: &Value) -> Result<ArrayMetadata, ReadError> {
        let dtype = json["dtype"].as_str().unwrap_or_default();
        let scalar = match dtype.trim_start_matches(['<', '>', '|', '=']) {
            "u1" => ScalarType::U8,
            "i1" => ScalarType::I8,
            "u2" => ScalarType::U16,
            "i2" => ScalarType::I16,
            "u4" => ScalarType::U32,
            "i4" => ScalarType::I32,
            "f4" => ScalarType::F32,
            "f8" => ScalarType::F64,
            _ => return Err(ReadError::unsupported("dtype", &json["dtype"], crate::SCALARS)),
        };
        let shape = numbers(json, "shape")?;
        let packing = Packing::of_v2(&json["compressor"])?;
        let mut document = json.clone();
        let level = document.get_mut("compressor").and_then(|c| c.get_mut("level"));
        level.into_iter().for_each(state_gzip_level);
        Ok(ArrayMetadata { shape, chunk_shape: numbers(json, "chunks")?, scalar, packing, document })
    }

    fn of_v3(json: &Value) -> Result<ArrayMetadata, ReadError> {
        let scalar = match json["data_type"].as_str().unwrap_or_default() {
            "uint8" => ScalarType::U8,
            "int8" => ScalarType::I8,
            "uint16" => ScalarType::U16,
            "int16" => ScalarType::I16,
            "uint32" => ScalarType::U32,
            "int32" => ScalarType::I32,
            "float32" => ScalarType::F32,
            "float64" => ScalarType::F64,
            _ => return Err(ReadError::unsupported("data_type", &json["data_type"], crate::SCALARS)),
        };
        let grid = &json["chunk_grid"];
        if grid["name"] != "regular" {
            return Err(ReadError::unsupported("chunk_grid", &grid["name"], "regular is"));
        }
        let chunk_shape = numbers(&grid["configuration"], "chunk_shape")?;
        let packing = Packing::of_v3(&json["codecs"])?;
        Ok(ArrayMetadata { shape: numbers(json, "shape")?, chunk_shape, scalar, packing, document: json.clone() })
    }

    /// The metadata as `zarrs` has them.
    pub(super) fn for_zarrs(&self) -> Result<zarrs::array::ArrayMetadata, ReadError> {
        serde_json::from_value(self.document.clone()).map_err(|e| ReadError::decoder("the array metadata", e))
    }

    pub(super) fn chunk_bytes(&self) -> u128 {
        let samples = self.chunk_shape.iter().fold(1u128, |n, s| n.saturating_mul(u128::from(*s)));
        samples.saturating_mul(self.scalar.n_bytes() as u128)
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
