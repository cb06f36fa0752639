use std::collections::BTreeMap;

use brickfield_core::glam::DVec3;
use brickfield_core::{ScalarType, Voxels};
use brickfield_io::{ByteOrder, ChoiceKind, Note, Opened, ReadError, ome_zarr, open};

use crate::common::*;

pub(crate) type Entries = BTreeMap<String, Vec<u8>>;

fn read(entries: &Entries) -> Result<Opened, ReadError> {
    ome_zarr::read_entries(entries, &options())
}

const SCALE: &str = r#"[{"type":"scale","scale":[4,3,2]},{"type":"translation","translation":[30,20,10]}]"#;
const ZYX: &str =
    r#"[{"name":"z","type":"space","unit":"micrometer"},{"name":"y","type":"space"},{"name":"x","type":"space"}]"#;

fn multiscales(axes: &str, transformations: &str) -> String {
    format!(
        r#""multiscales":[{{"version":"0.4","axes":{axes},"datasets":[{{"path":"s0","coordinateTransformations":{transformations}}}]}}]"#
    )
}

/// Version 0.4: Zarr v2.
fn v2(dtype: &str, compressor: &str, chunk: Vec<u8>) -> Entries {
    let array = format!(
        r#"{{"zarr_format":2,"shape":[2,3,4],"chunks":[2,3,4],"dtype":"{dtype}","compressor":{compressor},"fill_value":0,"order":"C","filters":null}}"#
    );
    files([
        (".zattrs", format!("{{{}}}", multiscales(ZYX, SCALE)).into_bytes()),
        (".zgroup", br#"{"zarr_format":2}"#.to_vec()),
        ("s0/.zarray", array.into_bytes()),
        ("s0/0.0.0", chunk),
    ])
}

/// Version 0.5: Zarr v3.
fn v3(data_type: &str, shape: &str, chunk: &str, codecs: &str, chunks: &[(&str, Vec<u8>)]) -> Entries {
    let group = format!(
        r#"{{"zarr_format":3,"node_type":"group","attributes":{{"ome":{{"version":"0.5",{}}}}}}}"#,
        multiscales(ZYX, SCALE)
    );
    let array = format!(
        r#"{{"zarr_format":3,"node_type":"array","shape":{shape},"data_type":"{data_type}","chunk_grid":{{"name":"regular","configuration":{{"chunk_shape":{chunk}}}}},"chunk_key_encoding":{{"name":"default","configuration":{{"separator":"/"}}}},"fill_value":7,"codecs":{codecs}}}"#
    );
    let mut entries = files([("zarr.json", group.into_bytes()), ("s0/zarr.json", array.into_bytes())]);
    entries.extend(chunks.iter().map(|(name, bytes)| (format!("s0/c/{name}"), bytes.clone())));
    entries
}

const LITTLE: &str = r#"{"name":"bytes","configuration":{"endian":"little"}}"#;

fn numpy_name(scalar: ScalarType) -> String {
    let kind = match scalar.name().as_bytes()[0] {
        b'u' => 'u',
        b'i' => 'i',
        _ => 'f',
    };
    format!("{kind}{}", scalar.n_bytes())
}

#[test]
fn every_type_and_order_of_v2() {
    for scalar in ScalarType::ALL {
        for (order, sign) in [(ByteOrder::Little, '<'), (ByteOrder::Big, '>')] {
            let sign = if scalar.n_bytes() == 1 { '|' } else { sign };
            let data = bytes(&ramp(scalar), order);
            let dtype = format!("{sign}{}", numpy_name(scalar));
            assert_ramp(&read(&v2(&dtype, "null", data.clone())).unwrap(), scalar);
            let packed = v2(&dtype, r#"{"id":"gzip","level":-1}"#, gzip(&data));
            assert_ramp(&read(&packed).unwrap(), scalar);
            let packed = v2(&dtype, r#"{"id":"zlib","level":1}"#, zlib(&data));
            assert_ramp(&read(&packed).unwrap(), scalar);
        }
    }
}

#[test]
fn every_type_of_v3_and_its_codecs() {
    for scalar in ScalarType::ALL {
        let data = bytes(&ramp(scalar), ByteOrder::Little);
        let name = numpy_name(scalar);
        let bits = 8 * scalar.n_bytes();
        let data_type = match &name[..1] {
            "u" => format!("uint{bits}"),
            "i" => format!("int{bits}"),
            _ => format!("float{bits}"),
        };
        let read = |codecs: &str, chunk: Vec<u8>| {
            read(&v3(&data_type, "[2,3,4]", "[2,3,4]", &format!("[{LITTLE}{codecs}]"), &[("0/0/0", chunk)])).unwrap()
        };
        assert_ramp(&read("", data.clone()), scalar);
        assert_ramp(&read(r#",{"name":"gzip","configuration":{"level":1}}"#, gzip(&data)), scalar);
        let zstd = zstd::encode_all(&data[..], 1).unwrap();
        assert_ramp(&read(r#",{"name":"zstd","configuration":{"level":1,"checksum":false}}"#, zstd), scalar);
    }
}

#[test]
fn scale_and_translation_place_the_first_sample() {
    let opened = read(&v2("|u1", "null", vec![0; 24])).unwrap();
    assert_eq!(opened.volume.grid().spacing(), DVec3::new(2.0, 3.0, 4.0));
    assert_near(centre(&opened, 1.0, 1.0, 1.0), [12.0, 23.0, 34.0]);
    assert_eq!(opened.unit.as_deref(), Some("micrometer"));
    // Transformations of the whole image follow those of its levels: a scale applies to their translation, too.
    let mut scaled = v2("|u1", "null", vec![0; 24]);
    let attributes = String::from_utf8(scaled[".zattrs"].clone()).unwrap();
    let of_image = r#""version":"0.4","coordinateTransformations":[{"type":"scale","scale":[1,1,10]}]"#;
    scaled.insert(".zattrs".to_owned(), attributes.replace(r#""version":"0.4""#, of_image).into_bytes());
    let opened = read(&scaled).unwrap();
    assert_eq!(opened.volume.grid().spacing(), DVec3::new(20.0, 3.0, 4.0));
    assert_near(centre(&opened, 1.0, 1.0, 1.0), [120.0, 23.0, 34.0]);
}

#[test]
fn chunks_at_the_edge_reach_beyond_it_and_missing_ones_are_filled() {
    // 3 x 2 x 2 chunks of 3 x 2 x 1 (x, y, z) over 4 x 3 x 2 voxels; only the first of each row in x is stored.
    let ramp: Vec<u8> = bytes(&ramp(ScalarType::U8), ByteOrder::Little);
    let chunk = |y0: usize, z: usize| -> Vec<u8> {
        let at = |x: usize, y: usize| if y < 3 { ramp[(z * 3 + y) * 4 + x] } else { 99 };
        [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1)].map(|(x, y)| at(x, y0 + y)).to_vec()
    };
    let chunks = [("0/0/0", chunk(0, 0)), ("0/1/0", chunk(2, 0)), ("1/0/0", chunk(0, 1)), ("1/1/0", chunk(2, 1))];
    let opened = read(&v3("uint8", "[2,3,4]", "[1,2,3]", &format!("[{LITTLE}]"), &chunks)).unwrap();
    let expected: Vec<u8> = ramp.iter().enumerate().map(|(i, v)| if i % 4 == 3 { 7 } else { *v }).collect();
    assert_eq!(opened.volume.voxels(), &Voxels::U8(expected));
    assert_eq!(opened.notes, [Note::MissingChunks { n_missing: 4, n_chunks: 8 }]);
}

#[test]
fn axes_in_any_order_and_beyond_space() {
    let axes = r#"[{"name":"t"},{"name":"x"},{"name":"c"},{"name":"y"},{"name":"z"}]"#;
    let array = r#"{"zarr_format":2,"shape":[2,4,3,3,2],"chunks":[1,4,2,3,2],"dtype":"|u1","compressor":null,"fill_value":0,"order":"C","filters":null,"dimension_separator":"/"}"#;
    let ramp = bytes(&ramp(ScalarType::U8), ByteOrder::Little);
    let mut chunk = vec![200; 48];
    for (i, value) in ramp.iter().enumerate() {
        let (x, y, z) = (i % 4, i / 4 % 3, i / 12);
        chunk[(x * 2 * 3 + y) * 2 + z] = *value;
    }
    let scale = r#"[{"type":"scale","scale":[1,2,1,3,4]}]"#;
    let entries = files([
        (".zattrs", format!("{{{}}}", multiscales(axes, scale)).into_bytes()),
        ("s0/.zarray", array.as_bytes().to_vec()),
        ("s0/0/0/0/0/0", chunk),
    ]);
    let opened = read(&entries).unwrap();
    assert_ramp(&opened, ScalarType::U8);
    assert_eq!(opened.volume.grid().spacing(), DVec3::new(2.0, 3.0, 4.0));
    let first = |kind, n_entries| Note::OneOfSeveral { kind, read: "0".to_owned(), n_entries };
    assert_eq!(opened.notes, [first(ChoiceKind::Time, 2), first(ChoiceKind::Channel, 3)]);
}

/// A shard of two parts of one slice each, the second packed as well, and its index at the end.
fn shard(parts: [Vec<u8>; 2]) -> Vec<u8> {
    let mut out = parts.concat();
    let lengths = parts.map(|p| p.len() as u64);
    for (offset, length) in [(0, lengths[0]), (lengths[0], lengths[1])] {
        out.extend(offset.to_le_bytes());
        out.extend(length.to_le_bytes());
    }
    out
}

const SHARDING: &str = r#"[{"name":"sharding_indexed","configuration":{"chunk_shape":[1,3,4],"codecs":[{"name":"bytes","configuration":{"endian":"little"}},{"name":"gzip","configuration":{"level":1}}],"index_codecs":[{"name":"bytes","configuration":{"endian":"little"}}],"index_location":"end"}}]"#;

#[test]
fn a_damaged_chunk_says_how_much_of_it_came() {
    let data: Vec<u8> = (0..24).collect();
    let packed = crate::common::gzip_unpressed(&data);
    let refusal = |chunk: &[u8]| {
        let entries = v2("|u1", r#"{"id":"gzip","level":1}"#, chunk.to_vec());
        read(&entries).unwrap_err().to_string()
    };
    assert_eq!(
        refusal(&packed[..10 + 5 + 9]),
        "chunk [0, 0, 0] holds 9 bytes, then its compressed data are cut off; 24 are promised"
    );
    assert_eq!(
        refusal(&packed[..packed.len() - 3]),
        "chunk [0, 0, 0] holds the 24 bytes promised, but its compressed data are cut off at the end, where the checksum is"
    );
    let cut = shard([packed[..15].to_vec(), gzip(&data[12..])]);
    assert_eq!(
        read(&v3("uint8", "[2,3,4]", "[2,3,4]", SHARDING, &[("0/0/0", cut)])).unwrap_err().to_string(),
        "part 1 of 2 of chunk [0, 0, 0] holds 0 bytes, then its compressed data are cut off; 12 are promised"
    );
    let short = read(&v2("|u1", "null", vec![0; 23])).unwrap_err().to_string();
    assert!(short.starts_with("chunk [0, 0, 0] of 23 bytes stored: ") && short.contains("expected 24"), "{short}");
    let json = read(&files([(".zattrs", b"{".to_vec())])).unwrap_err().to_string();
    assert!(json.starts_with(".zattrs (1 byte): "), "{json}");
}

#[test]
fn shards() {
    let ramp = bytes(&ramp(ScalarType::U8), ByteOrder::Little);
    let chunk = shard([gzip(&ramp[..12]), gzip(&ramp[12..])]);
    let opened = read(&v3("uint8", "[2,3,4]", "[2,3,4]", SHARDING, &[("0/0/0", chunk)])).unwrap();
    assert_ramp(&opened, ScalarType::U8);
    let bomb = shard([gzip(&ramp[..12]), gzip(&vec![0; 1 << 20])]);
    let fault = read(&v3("uint8", "[2,3,4]", "[2,3,4]", SHARDING, &[("0/0/0", bomb)])).unwrap_err();
    assert!(matches!(fault, ReadError::TooLarge { max_bytes: 12, .. }), "{fault}");
}

#[test]
fn bombs_and_lies() {
    let bomb = vec![0; 1 << 20];
    let gzipped = read(&v2("|u1", r#"{"id":"gzip","level":1}"#, gzip(&bomb))).unwrap_err();
    assert!(matches!(gzipped, ReadError::TooLarge { max_bytes: 24, .. }), "{gzipped}");
    let codecs = format!(r#"[{LITTLE},{{"name":"zstd","configuration":{{"level":1,"checksum":false}}}}]"#);
    let chunk = zstd::encode_all(&bomb[..], 1).unwrap();
    let zstd = read(&v3("uint8", "[2,3,4]", "[2,3,4]", &codecs, &[("0/0/0", chunk)])).unwrap_err();
    assert!(matches!(zstd, ReadError::TooLarge { max_bytes: 24, .. }), "{zstd}");
    let refusal = |shape, chunk| read(&v3("uint8", shape, chunk, &format!("[{LITTLE}]"), &[])).unwrap_err().to_string();
    assert!(refusal("[1099511627776,1,1]", "[1,1,1]").contains("dimension z is \"1099511627776\""));
    assert!(refusal("[10000,10000,10000]", "[1,1,1]").contains("limit"));
    assert!(refusal("[2,3,4]", "[10000,10000,10000]").contains("a chunk of shape"));
    assert!(refusal("[2,3,4]", "[0,1,1]").contains("chunk shape"));
    assert!(refusal("[2,3]", "[2,3]").contains("number of array dimensions"));
    assert!(refusal("[2,3,-4]", "[2,3,4]").contains("shape"));
    assert!(read(&v2("<c8", "null", vec![])).unwrap_err().to_string().contains("dtype"));
    assert!(read(&v2("|u1", "null", vec![0; 23])).is_err());
    let mut outside = v2("|u1", "null", vec![0; 24]);
    let attributes = String::from_utf8(outside[".zattrs"].clone()).unwrap().replace("\"s0\"", "\"../s0\"");
    outside.insert(".zattrs".to_owned(), attributes.into_bytes());
    assert!(read(&outside).unwrap_err().to_string().contains("a path within the folder"));
}

/// Fixtures of both versions.
pub(crate) fn examples() -> [Entries; 3] {
    let data = bytes(&ramp(ScalarType::U8), ByteOrder::Little);
    let codecs = format!(r#"[{LITTLE},{{"name":"zstd","configuration":{{"level":1,"checksum":false}}}}]"#);
    let packed = zstd::encode_all(&data[..], 1).unwrap();
    let parts = shard([gzip(&data[..12]), gzip(&data[12..])]);
    [
        v2("|u1", r#"{"id":"gzip","level":1}"#, gzip(&data)),
        v3("uint8", "[2,3,4]", "[2,3,4]", &codecs, &[("0/0/0", packed)]),
        v3("uint8", "[2,3,4]", "[2,3,4]", SHARDING, &[("0/0/0", parts)]),
    ]
}

#[test]
fn a_folder_on_disk() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in v2("|u1", "null", bytes(&ramp(ScalarType::U8), ByteOrder::Little)) {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
    assert_ramp(&open(folder.path(), &options()).unwrap(), ScalarType::U8);
}
