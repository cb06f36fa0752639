//! Level 0 as details of level 1: a group as `brickfield pack --codec haar` writes it, made here by hand.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use brickfield_core::glam::UVec3;
use brickfield_haar::{EncodeOptions, Kernel, LowBand, encode};
use brickfield_haar_zarrs::{DetailArray, DetailError};
use serde_json::{Value, json};
use tempfile::TempDir;
use zarrs::array::{Array, ArrayMetadata, ArraySubset, CodecOptions, data_type};
use zarrs::filesystem::FilesystemStore;

/// Samples along z, y, x: the last chunks are short along each axis, and the shards, too.
const DIMS: [usize; 3] = [11, 21, 37];
const CHUNK: usize = 8;
/// Chunks of a shard along each axis.
const N: usize = 2;

fn sample([z, y, x]: [usize; 3]) -> u16 {
    (900.0 + 300.0 * (x as f64 / 5.0).sin() * (y as f64 / 7.0).cos() + 17.0 * z as f64) as u16
}

fn positions([nz, ny, nx]: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (0..nz).flat_map(move |z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [z, y, x])))
}

/// Means of cells of up to 2 x 2 x 2 samples, halves up.
fn mean(cell: [usize; 3]) -> u16 {
    let n = [0, 1, 2].map(|a| 2.min(DIMS[a] - 2 * cell[a]));
    let sum: u32 = positions(n).map(|p| u32::from(sample([0, 1, 2].map(|a| 2 * cell[a] + p[a])))).sum();
    let n = n.iter().product::<usize>() as u32;
    ((sum + n / 2) / n) as u16
}

fn document(shape: [usize; 3], chunk: usize, codecs: Value) -> Value {
    json!({
        "zarr_format": 3, "node_type": "array", "shape": shape, "data_type": "uint16", "fill_value": 0,
        "chunk_grid": { "name": "regular", "configuration": { "chunk_shape": [chunk, chunk, chunk] } },
        "chunk_key_encoding": { "name": "default", "configuration": { "separator": "/" } },
        "codecs": codecs,
    })
}

fn details_document() -> Value {
    let index = json!([{ "name": "bytes", "configuration": { "endian": "little" } }]);
    let codec = json!({ "name": "brickfield.haar_details", "configuration": { "version": 1 } });
    let shards = json!({ "name": "sharding_indexed", "configuration": {
        "chunk_shape": [CHUNK, CHUNK, CHUNK], "codecs": [codec], "index_codecs": index, "index_location": "start",
    } });
    document(DIMS, N * CHUNK, json!([shards]))
}

fn write(path: &Path, bytes: impl AsRef<[u8]>) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, bytes).unwrap();
}

/// A shard: its index, and the bricks of those of its chunks that lie in the array.
fn shard(of: [usize; 3]) -> Vec<u8> {
    let (mut index, mut bricks) = (Vec::new(), Vec::new());
    for chunk in positions([N; 3]) {
        let first = [0, 1, 2].map(|a| (of[a] * N + chunk[a]) * CHUNK);
        if (0..3).any(|a| first[a] >= DIMS[a]) {
            index.push([u64::MAX; 2]);
            continue;
        }
        let n = [0, 1, 2].map(|a| CHUNK.min(DIMS[a] - first[a]));
        let samples: Vec<u16> = positions(n).map(|p| sample([0, 1, 2].map(|a| first[a] + p[a]))).collect();
        let options = EncodeOptions {
            kernels: vec![Kernel::Haar, Kernel::HaarPredicted],
            low_band: LowBand::Elsewhere,
            ..EncodeOptions::default()
        };
        let brick = encode(UVec3::from([n[2], n[1], n[0]].map(|n| n as u32)), &samples, &options).unwrap();
        index.push([(16 * N * N * N + bricks.len()) as u64, brick.len() as u64]);
        bricks.extend(brick);
    }
    index.into_iter().flatten().flat_map(u64::to_le_bytes).chain(bricks).collect()
}

/// The whole group.
fn group() -> TempDir {
    let folder = TempDir::new().unwrap();
    let path = |within: &str| folder.path().join(within);
    let attributes = json!({
        "brickfield_details": { "path": "brickfield_details/0" },
        "ome": { "version": "0.5", "multiscales": [{ "datasets": [{ "path": "1" }] }] },
    });
    write(&path("zarr.json"), json!({ "zarr_format": 3, "node_type": "group", "attributes": attributes }).to_string());
    write(&path("brickfield_details/0/zarr.json"), details_document().to_string());
    let n_shards = DIMS.map(|n| n.div_ceil(N * CHUNK));
    for at @ [z, y, x] in positions(n_shards) {
        write(&path(&format!("brickfield_details/0/c/{z}/{y}/{x}")), shard(at));
    }
    let halves = DIMS.map(|n| n.div_ceil(2));
    let bytes = json!([{ "name": "bytes", "configuration": { "endian": "little" } }]);
    let metadata = ArrayMetadata::try_from(document(halves, 6, bytes).to_string().as_str()).unwrap();
    let means =
        Array::new_with_metadata(Arc::new(FilesystemStore::new(folder.path()).unwrap()), "/1", metadata).unwrap();
    means.store_metadata().unwrap();
    means.store_array_subset(&means.subset_all(), positions(halves).map(mean).collect::<Vec<u16>>()).unwrap();
    folder
}

fn open(folder: &Path) -> Result<DetailArray, DetailError> {
    DetailArray::open(Arc::new(FilesystemStore::new(folder).unwrap()), "/")
}

#[test]
fn all_samples_come_back() {
    let folder = group();
    let array = open(folder.path()).unwrap();
    assert_eq!(array.shape(), DIMS.map(|n| n as u64));
    assert_eq!(array.data_type(), &data_type::uint16());
    assert_eq!(array.retrieve_all::<u16>().unwrap(), positions(DIMS).map(sample).collect::<Vec<_>>());
}

#[test]
fn parts_come_back() {
    let folder = group();
    let array = open(folder.path()).unwrap();
    for (first, n) in
        [([0, 0, 0], [1, 1, 1]), ([10, 20, 36], [1, 1, 1]), ([3, 7, 9], [6, 11, 22]), ([5, 5, 5], [2, 0, 3])]
    {
        let part = ArraySubset::new_with_start_shape(first.map(|i| i as u64).to_vec(), n.map(|i| i as u64).to_vec());
        let expected: Vec<u16> = positions(n).map(|p| sample([0, 1, 2].map(|a| first[a] + p[a]))).collect();
        assert_eq!(array.retrieve_array_subset::<u16>(&part.unwrap()).unwrap(), expected, "{first:?} {n:?}");
    }
    let beyond = ArraySubset::new_with_ranges(&[0..2, 0..2, 30..38]);
    let error = array.retrieve_array_subset::<u16>(&beyond).unwrap_err().to_string();
    assert!(error.contains("30..38") && error.contains("[11, 21, 37]"), "{error}");
    let error = array.retrieve_all::<i16>().unwrap_err().to_string();
    // zarrs may add the name of Zarr 2.
    assert!(error.starts_with("samples of i16 are asked for of an array of uint16"), "{error}");
}

#[test]
fn damage_and_absence_are_errors() {
    let folder = group();
    let file = folder.path().join("brickfield_details/0/c/0/1/1");
    let stored = fs::read(&file).unwrap();
    for byte in (16 * N * N * N..stored.len()).step_by(11) {
        let mut damaged = stored.clone();
        damaged[byte] ^= 4;
        fs::write(&file, damaged).unwrap();
        let error = open(folder.path()).unwrap().retrieve_all::<u16>().unwrap_err().to_string();
        assert!(error.starts_with("the chunk ["), "byte {byte}: {error}");
    }
    fs::remove_file(&file).unwrap();
    let error = open(folder.path()).unwrap().retrieve_all::<u16>().unwrap_err().to_string();
    assert_eq!(error, "the chunk [0, 2, 2] of details is not stored");
}

#[test]
fn a_group_without_details_or_with_others_is_refused() {
    let folder = group();
    let error = |path: &Path| open(path).err().unwrap().to_string();
    let document = folder.path().join("brickfield_details/0/zarr.json");
    let mut other = details_document();
    other["shape"] = json!([12, 21, 38]);
    write(&document, other.to_string());
    assert!(open(folder.path()).is_ok(), "its halves are those of level 1");
    other["shape"] = json!([11, 21, 39]);
    write(&document, other.to_string());
    let text = error(folder.path());
    assert!(text.contains("[11, 21, 39]") && text.contains("[6, 11, 20]"), "{text}");
    let mut other = details_document();
    other["codecs"][0]["configuration"]["codecs"][0]["configuration"] = json!({ "version": 2 });
    write(&document, other.to_string());
    assert!(error(folder.path()).contains("brickfield.haar_details"), "{}", error(folder.path()));
    write(&folder.path().join("zarr.json"), json!({ "zarr_format": 3, "node_type": "group" }).to_string());
    assert!(error(folder.path()).contains("no attribute brickfield_details/path"), "{}", error(folder.path()));
}

/// A codec sees one array: the error says who reads two.
#[test]
fn the_array_of_details_alone_says_who_reads_it() {
    let folder = group();
    let array = open(folder.path()).unwrap();
    let error = array.details().retrieve_chunk_opt::<Vec<u16>>(&[0, 0, 0], &CodecOptions::default()).unwrap_err();
    assert!(error.to_string().contains("DetailArray reads both"), "{error}");
}
