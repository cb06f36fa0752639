//! Writing one level: slices are held until a layer of chunks is full.

use brickfield_core::glam::UVec3;
use brickfield_core::{Scalar, ScalarType, Voxels, with_voxels};
use serde_json::{Value, json};
use zarrs::array::{Array, CodecOptions, Element};
use zarrs::storage::{StoreKey, WritableStorage, WritableStorageTraits};

use super::super::write::{data_type, little_endian};
use super::digest::keys;
use super::layer::append;
use super::{Fault, details};
use crate::Compression;
use crate::samples::room_for;

/// Samples along a chunk's side; shards are one chunk deep.
pub(super) const CHUNK_SIDE: u32 = 32;
/// Samples of a shard along x and y.
const SHARD_SIDE: u32 = 512;

pub(super) struct LevelWriter {
    store: WritableStorage,
    array: Array<dyn WritableStorageTraits>,
    has_details: bool,
    path: String,
    metadata: Value,
    dims: UVec3,
    shard: UVec3,
    /// Slices of a layer that is not full yet.
    held: Voxels,
    /// Slices of the layers that are written.
    n_written: u32,
}

impl LevelWriter {
    /// A level of `dims` samples, as the array of a path.
    pub(super) fn new(
        store: &WritableStorage,
        path: &str,
        dims: UVec3,
        scalar: ScalarType,
        compression: Compression,
    ) -> Result<LevelWriter, Fault> {
        let shard = shard_of(dims);
        let mut codecs = vec![little_endian()];
        if compression == Compression::Lossless {
            codecs.push(json!({ "name": "zstd", "configuration": { "level": 3, "checksum": false } }));
        }
        codecs.push(checksum());
        let metadata = metadata(dims, shard, scalar, codecs);
        let array =
            Array::new_with_metadata(store.clone(), &format!("/{path}"), serde_json::from_value(metadata.clone())?)?;
        let (store, path, held) = (store.clone(), path.to_owned(), room_for(scalar, 0)?);
        Ok(LevelWriter { store, array, has_details: false, path, metadata, dims, shard, held, n_written: 0 })
    }

    /// A level of `dims` samples, as details of the next one.
    pub(super) fn of_details(
        store: &WritableStorage,
        path: &str,
        dims: UVec3,
        scalar: ScalarType,
    ) -> Result<LevelWriter, Fault> {
        // Chunks lie where those of such an array would.
        let plain = LevelWriter::new(store, path, dims, scalar, Compression::None)?;
        let metadata = metadata(dims, plain.shard, scalar, vec![details::codec()]);
        Ok(LevelWriter { has_details: true, metadata, ..plain })
    }

    pub(super) fn dims(&self) -> UVec3 {
        self.dims
    }

    pub(super) fn scalar_type(&self) -> ScalarType {
        self.held.scalar_type()
    }

    /// Slices that have come.
    pub(super) fn n_slices(&self) -> u32 {
        self.n_written + (self.held.len() / self.n_slice()) as u32
    }

    fn n_slice(&self) -> usize {
        self.dims.x as usize * self.dims.y as usize
    }

    /// Whether these are slices of the level that are still missing.
    pub(super) fn takes(&self, slices: &Voxels) -> bool {
        let n = self.n_slice();
        let fits = slices.len() / n <= (self.dims.z - self.n_slices()) as usize;
        slices.scalar_type() == self.scalar_type() && slices.len().is_multiple_of(n) && fits
    }

    /// Takes slices, and writes each layer that is full with them; the last one, too.
    pub(super) fn push(&mut self, slices: Voxels) -> Result<(), Fault> {
        let (n_slice, mut from) = (self.n_slice(), 0);
        while from < slices.len() {
            let n_layer = CHUNK_SIDE.min(self.dims.z - self.n_written) as usize * n_slice;
            if from == 0 && self.held.is_empty() && slices.len() == n_layer {
                self.write_layer(&slices)?;
                return Ok(());
            }
            let n = (n_layer - self.held.len()).min(slices.len() - from);
            append(&mut self.held, &slices, from..from + n);
            from += n;
            if self.held.len() == n_layer {
                let layer = std::mem::replace(&mut self.held, room_for(slices.scalar_type(), 0)?);
                self.write_layer(&layer)?;
            }
        }
        Ok(())
    }

    fn write_layer(&mut self, layer: &Voxels) -> Result<(), Fault> {
        let n_shards = (self.dims - 1) / self.shard + 1;
        for y in 0..n_shards.y {
            for x in 0..n_shards.x {
                match self.has_details {
                    true => self.write_details(layer, x, y)?,
                    false => with_voxels!(layer, v => self.write_shard(v, x, y)?),
                }
            }
        }
        self.n_written += (layer.len() / self.n_slice()) as u32;
        Ok(())
    }

    /// Writes a shard of the layer's details.
    fn write_details(&self, layer: &Voxels, x: u32, y: u32) -> Result<(), Fault> {
        let first = UVec3::new(x, y, 0) * self.shard;
        let n_slices = (layer.len() / self.n_slice()) as u32;
        let shard = details::shard(layer, self.dims.with_z(n_slices), first, self.shard)?;
        let z = self.n_written / CHUNK_SIDE;
        Ok(self.store.set(&self.array.chunk_key(&[z, y, x].map(u64::from)), shard.into())?)
    }

    /// Writes a shard of the layer, filled up with zeros.
    fn write_shard<T: Scalar + Element>(&self, layer: &[T], x: u32, y: u32) -> Result<(), Fault> {
        let first = [x * self.shard.x, y * self.shard.y].map(|i| i as usize);
        let [nx, ny] = [self.dims.x, self.dims.y].map(|n| n as usize);
        let [shard_x, shard_y, shard_z] = self.shard.to_array().map(|n| n as usize);
        let n_row = shard_x.min(nx - first[0]);
        let mut samples = vec![T::default(); shard_x * shard_y * shard_z];
        for (z, slice) in layer.chunks_exact(nx * ny).enumerate() {
            for (row, y) in (first[1]..ny.min(first[1] + shard_y)).enumerate() {
                let to = shard_x * (row + shard_y * z);
                let from = nx * y + first[0];
                samples[to..to + n_row].copy_from_slice(&slice[from..from + n_row]);
            }
        }
        // A shard of zeros as well: one that is missing might be a loss.
        let whole = CodecOptions::default().with_store_empty_chunks(true);
        let z = self.n_written / CHUNK_SIDE;
        Ok(self.array.store_chunk_opt(&[z, y, x].map(u64::from), samples, &whole)?)
    }

    /// The array's path, and its metadata. Those that `zarrs` writes have codecs by bare names, which not every reader takes.
    pub(super) fn metadata(&self) -> (String, &Value) {
        (self.path.clone(), &self.metadata)
    }

    pub(super) fn shard_keys(&self) -> Vec<StoreKey> {
        keys(self.array.chunk_grid_shape(), |chunk| self.array.chunk_key(chunk))
    }
}

/// Samples of a shard of an array.
fn shard_of(dims: UVec3) -> UVec3 {
    let whole_chunks = |n: u32| n.div_ceil(CHUNK_SIDE) * CHUNK_SIDE;
    let shard = UVec3::new(whole_chunks(dims.x), whole_chunks(dims.y), CHUNK_SIDE);
    shard.min(UVec3::new(SHARD_SIDE, SHARD_SIDE, CHUNK_SIDE))
}

fn metadata(dims: UVec3, shard: UVec3, scalar: ScalarType, codecs: Vec<Value>) -> Value {
    let slowest_first = |v: UVec3| [v.z, v.y, v.x];
    let chunk = [CHUNK_SIDE; 3];
    let sharding = json!({
        "name": "sharding_indexed",
        "configuration": {
            "chunk_shape": chunk,
            "codecs": codecs,
            "index_codecs": [little_endian(), checksum()],
            "index_location": "start"
        }
    });
    json!({
        "zarr_format": 3,
        "node_type": "array",
        "shape": slowest_first(dims),
        "data_type": data_type(scalar),
        "chunk_grid": { "name": "regular", "configuration": { "chunk_shape": slowest_first(shard) } },
        "chunk_key_encoding": { "name": "default", "configuration": { "separator": "/" } },
        "fill_value": 0,
        "codecs": [sharding],
        "dimension_names": ["z", "y", "x"]
    })
}

fn checksum() -> Value {
    json!({ "name": "crc32c" })
}
