//! Level 0 as details of level 1: bricks of `brickfield-haar` in shards.
//!
//! A shard is one of `sharding_indexed` with its index at the start. Its parts lie in Morton order, so that parts near each other in space are
//! near each other in the file. A part is a brick of the samples that lie within the array: fewer than a chunk has at the upper ends.

use brickfield_core::glam::UVec3;
use brickfield_core::{Scalar, Voxels};
use brickfield_haar::{EncodeOptions, FORMAT_VERSION, Kernel, LowBand, Sample, decode_with_low, encode_bricks};
use serde_json::{Value, json};

use super::Fault;
use super::level::CHUNK_SIDE;
use crate::ReadError;
use crate::numbers::{ByteOrder, FileScalar, with_room};
use crate::ome_zarr::positions;

/// The codec's name.
pub(in super::super) const DETAILS_CODEC: &str = "brickfield.haar_details";

/// The codec's metadata.
pub(super) fn codec() -> Value {
    json!({ "name": DETAILS_CODEC, "configuration": { "version": FORMAT_VERSION } })
}

/// The file of the shard that begins at `first` of a layer of `dims` samples.
pub(super) fn shard(layer: &Voxels, dims: UVec3, first: UVec3, shard: UVec3) -> Result<Vec<u8>, Fault> {
    match layer {
        Voxels::U8(v) => shard_of(v, dims, first, shard),
        Voxels::I8(v) => shard_of(v, dims, first, shard),
        Voxels::U16(v) => shard_of(v, dims, first, shard),
        Voxels::I16(v) => shard_of(v, dims, first, shard),
        Voxels::U32(v) => shard_of(v, dims, first, shard),
        Voxels::I32(v) => shard_of(v, dims, first, shard),
        Voxels::F32(_) | Voxels::F64(_) => Err("details are those of integers".into()),
    }
}

fn shard_of<T: Sample>(layer: &[T], dims: UVec3, first: UVec3, shard: UVec3) -> Result<Vec<u8>, Fault> {
    let n_chunks = shard / CHUNK_SIDE;
    let is_within = |chunk: &UVec3| (first + *chunk * CHUNK_SIDE).cmplt(dims).all();
    let chunks = morton_order(n_chunks).into_iter().filter(is_within);
    let places: Vec<UVec3> = chunks.collect();
    let bricks: Vec<_> = places.iter().map(|chunk| brick_of(layer, dims, first + *chunk * CHUNK_SIDE)).collect();
    let encoded = encode_bricks::<T, Vec<T>>(&bricks, &encode_options())?;
    let mut index = vec![[u64::MAX; 2]; n_chunks.element_product() as usize];
    let n_index_bytes = 16 * index.len() + 4;
    let mut offset = n_index_bytes as u64;
    for (chunk, brick) in places.iter().zip(&encoded) {
        index[(chunk.x + n_chunks.x * (chunk.y + n_chunks.y * chunk.z)) as usize] = [offset, brick.len() as u64];
        offset += brick.len() as u64;
    }
    let mut file: Vec<u8> = index.into_iter().flatten().flat_map(u64::to_le_bytes).collect();
    file.extend(crc32c::crc32c(&file).to_le_bytes());
    encoded.iter().for_each(|brick| file.extend_from_slice(brick));
    Ok(file)
}

/// The kernels whose low band may be stored elsewhere; the one with fewer bytes is used.
fn encode_options() -> EncodeOptions {
    let kernels = vec![Kernel::Haar, Kernel::HaarPredicted];
    EncodeOptions { kernels, low_band: LowBand::Elsewhere, ..EncodeOptions::default() }
}

/// A chunk's samples that lie within the layer, and their extent.
fn brick_of<T: Scalar>(layer: &[T], dims: UVec3, first: UVec3) -> (UVec3, Vec<T>) {
    let extent = (dims - first).min(UVec3::splat(CHUNK_SIDE));
    let mut samples = Vec::with_capacity(extent.element_product() as usize);
    for z in first.z..first.z + extent.z {
        for y in first.y..first.y + extent.y {
            let row = first.x as usize + dims.x as usize * (y as usize + dims.y as usize * z as usize);
            samples.extend_from_slice(&layer[row..row + extent.x as usize]);
        }
    }
    (extent, samples)
}

/// All chunks of a box, along a curve that fills it cube by cube.
fn morton_order(n: UVec3) -> Vec<UVec3> {
    let spread = |i: u32| (0..10).fold(0u32, |code, bit| code | (i >> bit & 1) << (3 * bit));
    let code = |p: &UVec3| spread(p.x) | spread(p.y) << 1 | spread(p.z) << 2;
    let mut chunks: Vec<UVec3> = positions(n).collect();
    chunks.sort_by_key(code);
    chunks
}

/// The samples of a brick of details of this extent, little-endian; `low` are those of level 1, little-endian. The header is read and
/// held to the extent before anything is decoded.
pub(in super::super) fn decode_details<T: Sample + FileScalar>(
    brick: &[u8],
    extent: UVec3,
    low: &[u8],
    what: &str,
) -> Result<Vec<T>, ReadError> {
    let fault = |e| ReadError::decoder(what, e);
    let header = brickfield_haar::BrickHeader::read(brick).map_err(fault)?;
    if header.extent() != extent {
        return Err(ReadError::field(format!("extent of {what}"), header.extent(), format!("{extent}")));
    }
    let mut coarse = with_room::<T>(low.len() / T::TYPE.n_bytes())?;
    T::append(low, ByteOrder::Little, &mut coarse);
    Ok(decode_with_low(brick, &coarse).map_err(fault)?.samples)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_near_each_other_are_near_each_other_in_the_file() {
        let order = morton_order(UVec3::new(3, 2, 1));
        let [a, b, c, d, e, f] = [(0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (2, 1)].map(|(x, y)| UVec3::new(x, y, 0));
        assert_eq!(order, [a, b, c, d, e, f]);
    }
}
