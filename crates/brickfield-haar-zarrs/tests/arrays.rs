//! Arrays of `zarrs` in files, which know of the codec only by their metadata: nothing here names the crate but this line.

use brickfield_haar_zarrs as _;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::{Value, json};
use tempfile::TempDir;
use zarrs::array::{Array, ArrayMetadata, ArraySubset, Element, ElementOwned};
use zarrs::filesystem::FilesystemStore;
use zarrs::storage::ReadableWritableListableStorage;

fn haar(configuration: Value) -> Value {
    json!({ "name": "brickfield.haar", "configuration": configuration })
}

fn metadata(data_type: &str, shape: &[u64], chunk_shape: &[u64], codecs: Value) -> ArrayMetadata {
    let document = json!({
        "zarr_format": 3,
        "node_type": "array",
        "shape": shape,
        "data_type": data_type,
        "chunk_grid": { "name": "regular", "configuration": { "chunk_shape": chunk_shape } },
        "chunk_key_encoding": { "name": "default", "configuration": { "separator": "/" } },
        "fill_value": 0,
        "codecs": codecs,
    });
    ArrayMetadata::try_from(document.to_string().as_str()).unwrap()
}

fn store(folder: &Path) -> ReadableWritableListableStorage {
    Arc::new(FilesystemStore::new(folder).unwrap())
}

/// Writes an array, and reads it again through another store that only knows the folder.
fn write<T: Element>(folder: &Path, metadata: ArrayMetadata, samples: &[T]) {
    let array = Array::new_with_metadata(store(folder), "/a", metadata).unwrap();
    array.store_metadata().unwrap();
    array.store_array_subset(&array.subset_all(), samples).unwrap();
}

fn read<T: ElementOwned>(folder: &Path) -> Result<Vec<T>, String> {
    let array = Array::open(store(folder), "/a").map_err(|error| error.to_string())?;
    array.retrieve_array_subset(&array.subset_all()).map_err(|error| error.to_string())
}

/// All files of the array but its metadata.
fn chunk_files(folder: &Path) -> Vec<PathBuf> {
    let inside = |entry: fs::DirEntry| {
        let path = entry.path();
        if path.is_dir() { chunk_files(&path) } else { vec![path] }
    };
    let files = fs::read_dir(folder).unwrap().flat_map(|entry| inside(entry.unwrap()));
    files.filter(|path| !path.ends_with("zarr.json")).collect()
}

/// A wave with noise; `as` keeps its low bits for narrow types.
fn wave(n: u64) -> impl Iterator<Item = i64> {
    (0..n as i64).map(|i| 50 + (40.0 * (i as f64 / 11.0).sin()) as i64 + i * i % 3)
}

#[test]
fn an_array_of_every_type_is_read_by_its_metadata_alone() {
    macro_rules! check {
        ($($t:ident $name:literal;)*) => { $(
            let folder = TempDir::new().unwrap();
            let samples: Vec<$t> = wave(13 * 21 * 34).map(|s| (s * 1_234_567 % 100_003) as $t).collect();
            write(folder.path(), metadata($name, &[13, 21, 34], &[8, 9, 16], json!([haar(json!({}))])), &samples);
            assert_eq!(read::<$t>(folder.path()).unwrap(), samples, $name);
            assert_eq!(chunk_files(folder.path()).len(), 2 * 3 * 3);
        )* };
    }
    check! { u8 "uint8"; u16 "uint16"; u32 "uint32"; i8 "int8"; i16 "int16"; i32 "int32"; }
}

#[test]
fn chunks_have_one_to_five_dimensions() {
    for (shape, chunk_shape) in [
        (vec![333], vec![50]),
        (vec![33, 21], vec![8, 21]),
        (vec![9, 17, 21], vec![4, 5, 21]),
        (vec![2, 9, 17, 21], vec![1, 4, 16, 16]),
        (vec![2, 3, 5, 9, 11], vec![1, 1, 4, 8, 8]),
        (vec![5, 3, 9, 11], vec![4, 1, 8, 8]),
    ] {
        let folder = TempDir::new().unwrap();
        let samples: Vec<u16> = wave(shape.iter().product()).map(|s| s as u16).collect();
        write(folder.path(), metadata("uint16", &shape, &chunk_shape, json!([haar(json!({}))])), &samples);
        assert_eq!(read::<u16>(folder.path()).unwrap(), samples, "{shape:?}");
    }
}

fn sharded(inner: Value) -> Value {
    json!([{
        "name": "sharding_indexed",
        "configuration": {
            "chunk_shape": [8, 8, 8],
            "codecs": inner,
            "index_codecs": [{ "name": "bytes", "configuration": { "endian": "little" } }, { "name": "crc32c" }],
            "index_location": "end",
        },
    }])
}

#[test]
fn a_sharded_array_with_crc32c_and_transpose() {
    for codecs in [
        sharded(json!([haar(json!({}))])),
        sharded(json!([haar(json!({ "storage": "packed" })), { "name": "crc32c" }])),
        sharded(json!([{ "name": "transpose", "configuration": { "order": [2, 0, 1] } }, haar(json!({}))])),
        json!([haar(json!({ "kernels": ["5/3"] })), { "name": "crc32c" }]),
    ] {
        let folder = TempDir::new().unwrap();
        let samples: Vec<i16> = wave(19 * 30 * 35).map(|s| (s * 123 - 9000) as i16).collect();
        write(folder.path(), metadata("int16", &[19, 30, 35], &[16, 16, 32], codecs.clone()), &samples);
        assert_eq!(read::<i16>(folder.path()).unwrap(), samples, "{codecs}");
        assert_eq!(chunk_files(folder.path()).len(), 2 * 2 * 2);
    }
}

#[test]
fn parts_of_chunks_are_read_and_written() {
    for codecs in [json!([haar(json!({}))]), sharded(json!([haar(json!({})), { "name": "crc32c" }]))] {
        let folder = TempDir::new().unwrap();
        let mut samples: Vec<u32> = wave(20 * 20 * 20).map(|s| s as u32).collect();
        write(folder.path(), metadata("uint32", &[20, 20, 20], &[16, 16, 16], codecs), &samples);

        let array = Array::open(store(folder.path()), "/a").unwrap();
        let part = ArraySubset::new_with_ranges(&[3..18, 5..6, 0..20]);
        let read_part: Vec<u32> = array.retrieve_array_subset(&part).unwrap();
        let of_part: Vec<usize> = (3..18).flat_map(|z| (0..20).map(move |x| x + 20 * (5 + 20 * z))).collect();
        assert_eq!(read_part, of_part.iter().map(|&i| samples[i]).collect::<Vec<_>>());

        let new: Vec<u32> = (0..15 * 20).map(|i| 4_000_000_000 + i).collect();
        array.store_array_subset(&part, new.as_slice()).unwrap();
        of_part.iter().zip(&new).for_each(|(&i, &sample)| samples[i] = sample);
        assert_eq!(read::<u32>(folder.path()).unwrap(), samples);
    }
}

#[test]
fn a_bounded_error_keeps_its_bound() {
    let folder = TempDir::new().unwrap();
    let samples: Vec<u16> = wave(16 * 16 * 16).map(|s| (s * 7919 % 5000) as u16).collect();
    let codecs = json!([haar(json!({ "max_error": 5 }))]);
    write(folder.path(), metadata("uint16", &[16, 16, 16], &[16, 16, 16], codecs), &samples);
    let errors = read::<u16>(folder.path()).unwrap().into_iter().zip(&samples).map(|(a, &b)| a.abs_diff(b));
    assert_eq!(errors.max(), Some(5));
}

/// With the checksum of the codec itself, and with that of `crc32c` behind it.
#[test]
fn damaged_files_are_errors() {
    for codecs in [
        json!([haar(json!({}))]),
        json!([haar(json!({})), { "name": "crc32c" }]),
        sharded(json!([haar(json!({}))])),
        sharded(json!([haar(json!({})), { "name": "crc32c" }])),
    ] {
        let folder = TempDir::new().unwrap();
        let samples: Vec<u8> = wave(16 * 16 * 16).map(|s| s as u8).collect();
        write(folder.path(), metadata("uint8", &[16, 16, 16], &[16, 16, 16], codecs.clone()), &samples);
        let file = chunk_files(folder.path()).remove(0);
        let chunk = fs::read(&file).unwrap();
        for i in (0..chunk.len()).step_by(7) {
            let mut damaged = chunk.clone();
            damaged[i] ^= 0x10;
            fs::write(&file, damaged).unwrap();
            assert!(read::<u8>(folder.path()).is_err(), "byte {i} of {} with {codecs}", chunk.len());
        }
        for n in (0..chunk.len()).step_by(11) {
            fs::write(&file, &chunk[..n]).unwrap();
            assert!(read::<u8>(folder.path()).is_err(), "{n} bytes of {} with {codecs}", chunk.len());
        }
        fs::write(&file, &chunk).unwrap();
        assert_eq!(read::<u8>(folder.path()).unwrap(), samples);
    }
}

#[test]
fn a_wrong_configuration_is_an_error_that_names_the_key() {
    for (configuration, expected) in [
        (json!({ "level": 3 }), r#"has the key "level"; its keys are version, kernels"#),
        (json!({ "levels": 16 }), "levels = 16, but levels is null or an integer from 0 to 15"),
        (json!({ "kernels": ["haar", "db4"] }), r#"kernels = ["haar","db4"]"#),
        (json!({ "max_error": -1 }), "max_error = -1"),
        (json!({ "version": 2 }), "version = 2, but version is 1"),
        (json!({ "storage": "raw" }), r#"storage = "raw""#),
    ] {
        let metadata = metadata("uint8", &[8], &[8], json!([haar(configuration)]));
        let folder = TempDir::new().unwrap();
        let error = Array::new_with_metadata(store(folder.path()), "/a", metadata).err().unwrap().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn the_name_alone_is_a_codec() {
    let folder = TempDir::new().unwrap();
    let samples: Vec<u8> = wave(64).map(|s| s as u8).collect();
    write(folder.path(), metadata("uint8", &[64], &[64], json!(["brickfield.haar"])), &samples);
    assert_eq!(read::<u8>(folder.path()).unwrap(), samples);
}

#[test]
fn other_types_and_shapes_are_refused_by_name() {
    let folder = TempDir::new().unwrap();
    let error = |data_type: &str, shape: &[u64]| {
        let metadata = metadata(data_type, shape, shape, json!([haar(json!({}))]));
        let array = Array::new_with_metadata(store(folder.path()), "/a", metadata).unwrap();
        let n: u64 = shape.iter().product();
        let error = match data_type {
            "float32" => array.store_array_subset(&array.subset_all(), vec![1.0f32; n as usize]),
            "float64" => array.store_array_subset(&array.subset_all(), vec![1.0f64; n as usize]),
            "uint64" => array.store_array_subset(&array.subset_all(), vec![1u64; n as usize]),
            _ => array.store_array_subset(&array.subset_all(), vec![1u8; n as usize]),
        };
        error.unwrap_err().to_string()
    };
    for data_type in ["float32", "float64", "uint64"] {
        let error = error(data_type, &[4, 4]);
        assert!(error.contains(&format!("the chunk has {data_type}")) && error.contains("uint16"), "{error}");
    }
    let error = error("uint8", &[2, 3, 4, 5]);
    assert!(error.contains("at most three dimensions") && error.contains("[2, 3, 4, 5]"), "{error}");
}

#[test]
fn the_metadata_of_the_readme_are_an_array() {
    let readme = include_str!("../README.md");
    let document = readme.split("```json\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    let folder = TempDir::new().unwrap();
    let array =
        Array::new_with_metadata(store(folder.path()), "/a", ArrayMetadata::try_from(document).unwrap()).unwrap();
    let chunk: Vec<u16> = wave(64 * 64 * 64).map(|s| s as u16).collect();
    array.store_chunk(&[1, 2, 3], chunk.as_slice()).unwrap();
    assert_eq!(array.retrieve_chunk::<Vec<u16>>(&[1, 2, 3]).unwrap(), chunk);
}
