//! Plain Zarr arrays, groups of them, and choices of OME-Zarr: image, level, channel, time.

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{ScalarType, Voxels};
use brickfield_io::{ByteOrder, ChoiceKind, Note, OpenOptions, Opened, ReadError, WorldFrame, ome_zarr};

use crate::common::*;
use crate::ome_zarr::Entries;

fn read(entries: &Entries) -> Result<Opened, ReadError> {
    ome_zarr::read_entries(entries, &options())
}

fn wanting(entries: &Entries, wishes: &[(ChoiceKind, &str)]) -> Result<Opened, ReadError> {
    let mut options = options();
    for (kind, entry) in wishes {
        options.wanted.want(*kind, *entry);
    }
    ome_zarr::read_entries(entries, &options)
}

/// An array of Zarr v2, of one chunk; `more` goes before the other fields.
fn v2(shape: &str, dtype: &str, more: &str) -> Vec<u8> {
    format!(
        r#"{{{more}"zarr_format":2,"shape":{shape},"chunks":{shape},"dtype":"{dtype}","compressor":null,"fill_value":0,"filters":null}}"#
    )
    .into_bytes()
}

const C: &str = r#""order":"C","#;

/// An array of Zarr v3.
fn v3(shape: &str, chunk: &str, data_type: &str, codecs: &str, more: &str) -> Vec<u8> {
    format!(
        r#"{{"zarr_format":3,"node_type":"array","shape":{shape},"data_type":"{data_type}","chunk_grid":{{"name":"regular","configuration":{{"chunk_shape":{chunk}}}}},"chunk_key_encoding":{{"name":"default","configuration":{{"separator":"/"}}}},"fill_value":0,"codecs":[{codecs}]{more}}}"#
    )
    .into_bytes()
}

const LITTLE: &str = r#"{"name":"bytes","configuration":{"endian":"little"}}"#;
const ZSTD: &str = r#"{"name":"zstd","configuration":{"level":1,"checksum":false}}"#;
const CRC: &str = r#"{"name":"crc32c"}"#;

fn assumed(axes: &str) -> Vec<Note> {
    axes.chars().map(|axis| Note::SpacingAssumed { axis, reason: "is not stated" }).collect()
}

fn ramp_bytes() -> Vec<u8> {
    bytes(&ramp(ScalarType::U8), ByteOrder::Little)
}

#[test]
fn a_plain_array_of_v2_and_v3() {
    let old = files([(".zarray", v2("[2,3,4]", "|u1", C)), ("0.0.0", ramp_bytes())]);
    let new = files([("zarr.json", v3("[2,3,4]", "[2,3,4]", "uint8", LITTLE, "")), ("c/0/0/0", ramp_bytes())]);
    for entries in [old, new] {
        let opened = read(&entries).unwrap();
        assert_ramp(&opened, ScalarType::U8);
        assert_eq!(opened.notes, assumed("xyz"));
        assert_eq!(opened.frame, WorldFrame::Plain);
        assert_near(centre(&opened, 0.0, 0.0, 0.0), [0.5, 0.5, 0.5]);
        let spacing = Some(DVec3::new(1.0, 2.0, 3.0));
        let mut respaced: OpenOptions = options();
        respaced.spacing = spacing;
        let opened = ome_zarr::read_entries(&entries, &respaced).unwrap();
        assert!(opened.notes.is_empty());
        assert_near(centre(&opened, 0.0, 0.0, 0.0), [0.5, 1.0, 1.5]);
    }
}

#[test]
fn one_and_two_axes() {
    let line = read(&files([(".zarray", v2("[24]", "|u1", C)), ("0", ramp_bytes())])).unwrap();
    assert_eq!(line.volume.grid().dims(), UVec3::new(24, 1, 1));
    assert_eq!(line.notes, assumed("x"));
    let plane = read(&files([(".zarray", v2("[6,4]", "|u1", C)), ("0.0", ramp_bytes())])).unwrap();
    assert_eq!(plane.volume.grid().dims(), UVec3::new(4, 6, 1));
    let point = read(&files([(".zarray", v2("[]", "|u1", C)), ("0", vec![1])])).unwrap_err().to_string();
    assert_eq!(point, "number of axes is \"0\"; expected 1 to 8");
}

#[test]
fn times_and_channels_by_the_names_of_axes() {
    // Times of 2, then channels of 3; the last channel of the last time is the ramp.
    let mut data = vec![0; 5 * 24];
    data.extend(ramp_bytes());
    let names = r#"["time","band","depth","lat","lon"]"#;
    let dimension_names = format!(r#","dimension_names":{names}"#);
    let new = v3("[2,3,2,3,4]", "[2,3,2,3,4]", "uint8", LITTLE, &dimension_names);
    let attributes = format!(r#"{{"_ARRAY_DIMENSIONS":{names}}}"#).into_bytes();
    let entries = [
        files([("zarr.json", new), ("c/0/0/0/0/0", data.clone())]),
        files([(".zarray", v2("[2,3,2,3,4]", "|u1", C)), (".zattrs", attributes), ("0.0.0.0.0", data.clone())]),
    ];
    for entries in &entries {
        let wishes = [(ChoiceKind::Time, "1"), (ChoiceKind::Channel, "2")];
        assert_ramp(&wanting(entries, &wishes).unwrap(), ScalarType::U8);
        assert!(wanting(entries, &[(ChoiceKind::Time, "2")]).is_err());
    }
    let unnamed = files([(".zarray", v2("[2,3,2,3,4]", "|u1", C)), ("0.0.0.0.0", data)]);
    let first = |n_entries| Note::FirstOfAxis { axis: String::new(), n_entries };
    assert_eq!(read(&unnamed).unwrap().notes[..2], [first(2), first(3)]);
}

#[test]
fn a_choice_that_lies_in_another_chunk() {
    let array = v3("[4,2,3,4]", "[2,2,3,4]", "uint8", LITTLE, r#","dimension_names":["t","z","y","x"]"#);
    let chunk = [vec![9; 24], ramp_bytes()].concat();
    let entries = files([("zarr.json", array), ("c/1/0/0/0", chunk)]);
    assert_ramp(&wanting(&entries, &[(ChoiceKind::Time, "3")]).unwrap(), ScalarType::U8);
    assert_eq!(
        wanting(&entries, &[(ChoiceKind::Time, "1")]).unwrap().notes.last(),
        Some(&Note::MissingChunks { n_missing: 1, n_chunks: 1 })
    );
}

#[test]
fn stored_types_that_are_no_scalar_types() {
    let array = |dtype: &str, data_type: &str, data: Vec<u8>| {
        let old = files([(".zarray", v2("[1,1,3]", dtype, C)), ("0.0.0", data.clone())]);
        let new = files([("zarr.json", v3("[1,1,3]", "[1,1,3]", data_type, LITTLE, "")), ("c/0/0/0", data)]);
        let [old, new] = [old, new].map(|entries| {
            let said_as =
                |json: &[u8]| String::from_utf8_lossy(json).replace("\"fill_value\":0", "\"fill_value\":false");
            let is_metadata = |name: &str| matches!(name, ".zarray" | "zarr.json") && data_type == "bool";
            let entry = |(name, bytes): (String, Vec<u8>)| match is_metadata(&name) {
                true => (name, said_as(&bytes).into_bytes()),
                false => (name, bytes),
            };
            read(&entries.into_iter().map(entry).collect()).unwrap()
        });
        assert_eq!(old.volume.voxels(), new.volume.voxels(), "{dtype}");
        (old.volume.voxels().clone(), old.notes.last().cloned())
    };
    let converted = |from, to| Some(Note::Converted { from, to });
    let wide = |values: [i64; 3]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    assert_eq!(array("|b1", "bool", vec![0, 1, 1]), (Voxels::U8(vec![0, 1, 1]), converted("bool", ScalarType::U8)));
    let halves = vec![0x00, 0x3c, 0x00, 0xc0, 0x01, 0x00];
    let expected = Voxels::F32(vec![1.0, -2.0, 2f32.powi(-24)]);
    assert_eq!(array("<f2", "float16", halves), (expected, converted("float16", ScalarType::F32)));
    let expected = Voxels::I16(vec![-1, 300, 5]);
    assert_eq!(array("<i8", "int64", wide([-1, 300, 5])), (expected, converted("int64", ScalarType::I16)));
    let expected = Voxels::U32(vec![1, 70_000, 5]);
    assert_eq!(array("<u8", "uint64", wide([1, 70_000, 5])), (expected, converted("uint64", ScalarType::U32)));
    let inexact = files([(".zarray", v2("[1,1,3]", "<i8", C)), ("0.0.0", wide([0, (1 << 53) + 1, 0]))]);
    let said = read(&inexact).unwrap_err().to_string();
    assert!(said.starts_with("sample 1 of chunk [0, 0, 0] is \"9007199254740993\"; expected"), "{said}");
}

#[test]
fn big_endian_and_fortran_order() {
    let ramp = ramp(ScalarType::I16);
    let Voxels::I16(values) = &ramp else { unreachable!() };
    let mut data = vec![];
    for x in 0..4 {
        for y in 0..3 {
            for z in 0..2 {
                data.extend(values[(z * 3 + y) * 4 + x].to_be_bytes());
            }
        }
    }
    let entries = files([(".zarray", v2("[2,3,4]", ">i2", r#""order":"F","#)), ("0.0.0", data)]);
    assert_ramp(&read(&entries).unwrap(), ScalarType::I16);
}

/// CRC-32C, bit by bit (RFC 3720, B.4).
fn crc32c(bytes: &[u8]) -> [u8; 4] {
    let mut sum = !0u32;
    for byte in bytes {
        sum ^= u32::from(*byte);
        for _ in 0..8 {
            sum = if sum & 1 == 1 { sum >> 1 ^ 0x82f6_3b78 } else { sum >> 1 };
        }
    }
    (!sum).to_le_bytes()
}

fn summed(bytes: Vec<u8>) -> Vec<u8> {
    let sum = crc32c(&bytes);
    [bytes, sum.to_vec()].concat()
}

fn zstd(bytes: &[u8]) -> Vec<u8> {
    zstd::encode_all(bytes, 1).unwrap()
}

/// A shard of one slice per part, which is packed and has a checksum, as has the index.
fn checked_shard() -> Entries {
    let config = format!(
        r#"{{"name":"sharding_indexed","configuration":{{"chunk_shape":[1,3,4],"codecs":[{LITTLE},{ZSTD},{CRC}],"index_codecs":[{LITTLE},{CRC}],"index_location":"end"}}}}"#
    );
    let parts = [0, 12].map(|i| summed(zstd(&ramp_bytes()[i..i + 12])));
    let words = [0, parts[0].len() as u64, parts[0].len() as u64, parts[1].len() as u64];
    let index: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).collect();
    let chunk = [parts.concat(), summed(index)].concat();
    files([("zarr.json", v3("[2,3,4]", "[2,3,4]", "uint8", &config, "")), ("c/0/0/0", chunk)])
}

#[test]
fn checksums_around_and_within_what_is_packed() {
    let array = |codecs: &str, chunk: Vec<u8>| {
        read(&files([("zarr.json", v3("[2,3,4]", "[2,3,4]", "uint8", codecs, "")), ("c/0/0/0", chunk)]))
    };
    let around = format!("{LITTLE},{ZSTD},{CRC}");
    assert_ramp(&array(&around, summed(zstd(&ramp_bytes()))).unwrap(), ScalarType::U8);
    let within = format!("{LITTLE},{CRC},{ZSTD}");
    assert_ramp(&array(&within, zstd(&summed(ramp_bytes()))).unwrap(), ScalarType::U8);
    assert_ramp(&read(&checked_shard()).unwrap(), ScalarType::U8);
    let bomb = array(&around, summed(zstd(&vec![0; 1 << 20]))).unwrap_err();
    assert!(matches!(bomb, ReadError::TooLarge { max_bytes: 24, .. }), "{bomb}");
    let mut wrong = summed(zstd(&ramp_bytes()));
    *wrong.last_mut().unwrap() ^= 1;
    assert!(array(&around, wrong).unwrap_err().to_string().contains("checksum"));
    assert!(array(&around, vec![1, 2]).is_err());
}

/// An xarray-like group: positions along an axis, and two fields.
fn group() -> Entries {
    files([
        (".zgroup", br#"{"zarr_format":2}"#.to_vec()),
        ("depth/.zarray", v2("[2]", "<f8", C)),
        ("fields/.zgroup", br#"{"zarr_format":2}"#.to_vec()),
        ("fields/salt/.zarray", v2("[2,3,4]", "|u1", C)),
        ("fields/salt/0.0.0", ramp_bytes()),
        ("fields/heat/.zarray", v2("[2,3,4]", "|u1", C)),
    ])
}

#[test]
fn a_group_of_arrays() {
    let opened = read(&group()).unwrap();
    let choice = &opened.choices[0];
    assert_eq!((choice.kind, choice.read), (ChoiceKind::Array, 1));
    assert_eq!(choice.names, ["depth", "fields/heat", "fields/salt"]);
    let read = "1 (fields/heat)".to_owned();
    assert_eq!(opened.notes[0], Note::OneOfSeveral { kind: ChoiceKind::Array, read, n_entries: 3 });
    assert_ramp(&wanting(&group(), &[(ChoiceKind::Array, "fields/salt")]).unwrap(), ScalarType::U8);
    let empty = files([(".zgroup", br#"{"zarr_format":2}"#.to_vec())]);
    let said = ome_zarr::read_entries(&empty, &options()).unwrap_err().to_string();
    assert_eq!(said, "multiscales (in zarr.json or .zattrs), or an array, is missing");
}

/// The attributes of an image of two levels and three channels, z in another unit than x and y.
fn image(name: &str) -> String {
    let axes = r#"[{"name":"c","type":"channel"},{"name":"z","type":"space","unit":"nanometer"},{"name":"y","type":"space","unit":"micrometer"},{"name":"x","type":"space","unit":"micrometer"}]"#;
    let level = |path: &str, scale: &str, shift: &str| {
        format!(
            r#"{{"path":"{path}","coordinateTransformations":[{{"type":"scale","scale":{scale}}},{{"type":"translation","translation":{shift}}}]}}"#
        )
    };
    let levels = [level("0", "[1,2000,2,2]", "[0,0,0,0]"), level("1", "[1,4000,4,4]", "[0,1000,1,1]")].join(",");
    format!(r#"{{"version":"0.4","name":"{name}","axes":{axes},"datasets":[{levels}]}}"#)
}

const OMERO: &str = r#""omero":{"channels":[{"label":"DAPI"},{"label":"GFP"},{"label":"RFP"}]}"#;

/// The files of an image below a path; the ramp is level 0 of the last channel.
fn image_files(path: &str, name: &str) -> Entries {
    let chunk = [vec![0; 48], ramp_bytes()].concat();
    let attributes = format!(r#"{{"multiscales":[{}],{OMERO}}}"#, image(name)).into_bytes();
    let entries = [
        (".zgroup", br#"{"zarr_format":2}"#.to_vec()),
        (".zattrs", attributes),
        ("0/.zarray", v2("[3,2,3,4]", "|u1", C)),
        ("0/0.0.0.0", chunk),
        ("1/.zarray", v2("[3,1,1,2]", "|u1", C)),
        ("1/0.0.0.0", vec![1, 2, 3, 4, 5, 6]),
    ];
    entries.into_iter().map(|(name, bytes)| (format!("{path}{name}"), bytes)).collect()
}

#[test]
fn levels_and_channels_of_an_image() {
    let entries = image_files("", "brain");
    let opened = wanting(&entries, &[(ChoiceKind::Channel, "rfp")]).unwrap();
    assert_ramp(&opened, ScalarType::U8);
    assert_eq!(opened.unit.as_deref(), Some("micrometer"));
    assert_eq!(opened.volume.grid().spacing(), DVec3::new(2.0, 2.0, 2.0));
    let coarse = wanting(&entries, &[(ChoiceKind::Level, "1"), (ChoiceKind::Channel, "GFP")]).unwrap();
    assert_eq!(coarse.volume.voxels(), &Voxels::U8(vec![3, 4]));
    assert_eq!(coarse.volume.grid().spacing(), DVec3::splat(4.0));
    assert_near(centre(&coarse, 0.0, 0.0, 0.0), [1.0, 1.0, 1.0]);
    let levels = &coarse.choices[0];
    assert_eq!((levels.kind, levels.n_entries, levels.read), (ChoiceKind::Level, 2, 1));
    assert!(wanting(&entries, &[(ChoiceKind::Level, "2")]).is_err());
    let unsaid = read(&entries).unwrap();
    let note = Note::OneOfSeveral { kind: ChoiceKind::Channel, read: "0 (DAPI)".to_owned(), n_entries: 3 };
    assert_eq!(unsaid.notes, [note]);
}

#[test]
fn images_of_a_series_a_well_and_labels() {
    let mut entries = image_files("0/", "first");
    entries.extend(image_files("1/", "second"));
    let channel = (ChoiceKind::Channel, "RFP");
    let check = |entries: &Entries, wanted: &str, names: [&str; 2]| {
        let opened = wanting(entries, &[(ChoiceKind::Image, wanted), channel]).unwrap();
        assert_ramp(&opened, ScalarType::U8);
        assert_eq!((opened.choices[0].kind, opened.choices[0].read), (ChoiceKind::Image, 1));
        assert_eq!(opened.choices[0].names, names);
    };
    let with = |attributes: &str| {
        let mut entries = entries.clone();
        entries.insert(".zattrs".to_owned(), attributes.as_bytes().to_vec());
        entries
    };
    check(&with(r#"{"bioformats2raw.layout":3}"#), "second", ["first", "second"]);
    check(&with("{}"), "1", ["first", "second"]);
    check(&with(r#"{"well":{"images":[{"path":"0"},{"path":"1"}]}}"#), "1", ["0", "1"]);
    check(&with(r#"{"labels":["0","1"]}"#), "1", ["0", "1"]);
    let mut listed = with(r#"{"bioformats2raw.layout":3}"#);
    listed.insert("OME/.zattrs".to_owned(), br#"{"series":["1","0"]}"#.to_vec());
    check(&listed, "first", ["second", "first"]);
    let several = format!(r#"{{"multiscales":[{},{}],{OMERO}}}"#, image("a"), image("b"));
    let mut entries = image_files("", "");
    entries.insert(".zattrs".to_owned(), several.into_bytes());
    check(&entries, "b", ["a", "b"]);
}

#[test]
fn what_is_refused_by_name() {
    let said = |attributes: &str| read(&files([(".zattrs", attributes.as_bytes().to_vec())])).unwrap_err().to_string();
    assert_eq!(
        said(r#"{"plate":{"wells":[{"path":"B/2"}]}}"#),
        "the folder is \"a plate of wells\"; expected one well of it or one field, such as B/2 or B/2/0"
    );
    let outside = r#"{"well":{"images":[{"path":"../0"}]}}"#;
    assert_eq!(said(outside), "path of an image is \"../0\"; expected a path within the folder");
    assert_eq!(said(r#"{"labels":["0"]}"#), "path of an image is \"0\"; expected a group with multiscales");
    let array = |json: Vec<u8>| read(&files([(".zarray", json)])).unwrap_err().to_string();
    let changed =
        |from: &str, to: &str| String::from_utf8(v2("[2,3,4]", "|u1", C)).unwrap().replace(from, to).into_bytes();
    assert_eq!(
        array(changed(r#""compressor":null"#, r#""compressor":{"id":"lz4"}"#)),
        "compressor \"lz4\" is not supported; gzip, zlib, zstd and blosc are"
    );
    assert_eq!(
        array(changed(r#""filters":null"#, r#""filters":[{"id":"delta","dtype":"<i2"}]"#)),
        "filter \"delta\" is not supported; none is"
    );
    assert_eq!(
        array(changed("|u1", "<c8")),
        "dtype \"\\\"<c8\\\"\" is not supported; 8 to 64 bit integers, 16 to 64 bit floats and bool are"
    );
}

/// Seeds for fuzzing.
pub(crate) fn examples() -> [Entries; 4] {
    let mut series = image_files("0/", "first");
    series.extend(image_files("1/", "second"));
    series.insert(".zattrs".to_owned(), br#"{"bioformats2raw.layout":3}"#.to_vec());
    [group(), checked_shard(), image_files("", "brain"), series]
}
