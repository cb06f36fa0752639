use std::io::Cursor;

use brickfield_core::glam::DVec3;
use brickfield_core::{ScalarType, Voxels};
use brickfield_io::{ByteOrder, ChoiceKind, DataFiles, NoFiles, Note, Opened, ReadError, WorldFrame, metaimage};

use crate::common::*;

fn read(header: &str, data: &[u8], files: &dyn DataFiles) -> Result<Opened, ReadError> {
    metaimage::read(Cursor::new([header.as_bytes(), data].concat()), files, &options())
}

fn header(element: &str, more: &str, data_file: &str) -> String {
    format!(
        "ObjectType = Image\nNDims = 3\n{more}\nDimSize = 4 3 2\nElementType = {element}\nElementDataFile = {data_file}\n"
    )
}

/// Seeds for the fuzz target.
pub(crate) fn examples() -> Vec<String> {
    let file = |n_channels: usize, sizes: &str| {
        format!(
            "Modality: MET_MOD_CT\nNDims: 4\nDimSize: {sizes}\nElementType: MET_LONG_LONG\n\
             ElementNumberOfChannels: {n_channels}\nBinaryData: False\nElementDataFile: LOCAL\n{}",
            "1 ".repeat(24)
        )
    };
    vec![file(1, "2 3 2 2"), file(3, "2 2 2 1"), file(4, "2 3 1 1")]
}

fn element(scalar: ScalarType) -> &'static str {
    match scalar {
        ScalarType::U8 => "MET_UCHAR",
        ScalarType::I8 => "MET_CHAR",
        ScalarType::U16 => "MET_USHORT",
        ScalarType::I16 => "MET_SHORT",
        ScalarType::U32 => "MET_UINT",
        ScalarType::I32 => "MET_LONG",
        ScalarType::F32 => "MET_FLOAT",
        ScalarType::F64 => "MET_DOUBLE",
    }
}

#[test]
fn every_type_order_and_encoding() {
    for scalar in ScalarType::ALL {
        let ramp = ramp(scalar);
        let plain = header(element(scalar), "BinaryData = False", "LOCAL");
        assert_ramp(&read(&plain, text(&ramp).as_bytes(), &NoFiles).unwrap(), scalar);
        for order in ORDERS {
            let msb = if order == ByteOrder::Big { "True" } else { "False" };
            let more = format!("BinaryData = True\nBinaryDataByteOrderMSB = {msb}");
            let data = bytes(&ramp, order);
            assert_ramp(&read(&header(element(scalar), &more, "LOCAL"), &data, &NoFiles).unwrap(), scalar);
            #[cfg(feature = "gzip")]
            {
                let packed = header(element(scalar), &format!("{more}\nCompressedData = True"), "LOCAL");
                assert_ramp(&read(&packed, &zlib(&data), &NoFiles).unwrap(), scalar);
                assert_ramp(&read(&packed, &gzip(&data), &NoFiles).unwrap(), scalar);
            }
        }
    }
}

#[test]
fn detached_data_in_one_file_a_list_or_a_pattern() {
    let data = bytes(&ramp(ScalarType::U8), ByteOrder::Little);
    let with_head = [b"head".to_vec(), data.clone()].concat();
    let whole = files([("all of it.raw", with_head)]);
    for skip in ["4", "-1"] {
        let header = header("MET_UCHAR", &format!("HeaderSize = {skip}"), "all of it.raw");
        assert_ramp(&read(&header, &[], &whole).unwrap(), ScalarType::U8);
    }
    let slices = files([("s1.raw", data[..12].to_vec()), ("s2.raw", data[12..].to_vec())]);
    for names in ["LIST\ns1.raw\ns2.raw", "LIST 2\ns1.raw\ns2.raw\n", "s%d.raw 1 2 1", "s%d.raw"] {
        assert_ramp(&read(&header("MET_UCHAR", "", names), &[], &slices).unwrap(), ScalarType::U8);
    }
}

#[test]
fn spacing_offset_and_directions() {
    let more =
        "ElementSpacing = 2 3 4\nOffset = 10 20 30\nTransformMatrix = 0 1 0 1 0 0 0 0 -1\nAnatomicalOrientation = RAI";
    let opened = read(&header("MET_UCHAR", more, "LOCAL"), &[0; 24], &NoFiles).unwrap();
    assert_near(centre(&opened, 1.0, 1.0, 1.0), [13.0, 22.0, 26.0]);
    assert_eq!((opened.frame, opened.volume.grid().spacing()), (WorldFrame::Lps, DVec3::new(2.0, 3.0, 4.0)));
    let sized = read(&header("MET_UCHAR", "ElementSize = 2 3 4", "LOCAL"), &[0; 24], &NoFiles).unwrap();
    assert_eq!((sized.frame, sized.volume.grid().spacing()), (WorldFrame::Plain, DVec3::new(2.0, 3.0, 4.0)));
}

#[test]
fn two_and_four_dimensions() {
    let flat = "NDims = 2\nDimSize = 4 3\nElementSpacing = 2 3\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n";
    let flat = read(flat, &[0; 12], &NoFiles).unwrap();
    assert_eq!(flat.volume.grid().spacing(), DVec3::new(2.0, 3.0, 1.0));
    let series = |wanted: Option<&str>| {
        let header = "NDims = 4\nDimSize = 4 3 2 5\nElementSpacing = 1 1 1 9\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n";
        let data: Vec<u8> = (0..120).collect();
        let file = [header.as_bytes(), &data].concat();
        metaimage::read(Cursor::new(file), &NoFiles, &selecting(ChoiceKind::Time, wanted)).unwrap()
    };
    let first = series(None);
    assert_eq!(first.notes, [Note::OneOfSeveral { kind: ChoiceKind::Time, read: "0".to_owned(), n_entries: 5 }]);
    assert_eq!(first.volume.voxels(), &Voxels::U8((0..24).collect()));
    let fourth = series(Some("3"));
    assert_eq!((fourth.volume.voxels(), fourth.notes.len()), (&Voxels::U8((72..96).collect()), 0));
}

#[test]
fn colours_and_vectors() {
    let read = |element: &str, n: usize, wanted: Option<&str>| {
        let header = format!(
            "NDims = 1\nDimSize = 2\nElementNumberOfChannels = {n}\nElementType = {element}\nElementDataFile = LOCAL\n"
        );
        let data = if element == "MET_UCHAR" { (1..).take(2 * n).collect() } else { floats(2 * n) };
        let file = [header.into_bytes(), data].concat();
        metaimage::read(Cursor::new(file), &NoFiles, &selecting(ChoiceKind::Channel, wanted)).unwrap()
    };
    let colours = read("MET_UCHAR", 3, None);
    assert_eq!((colours.volume.voxels(), &colours.notes[..]), (&Voxels::U8(vec![2, 5]), &[Note::Luminance][..]));
    assert_eq!(read("MET_UCHAR", 4, Some("alpha")).volume.voxels(), &Voxels::U8(vec![4, 8]));
    let vectors = read("MET_FLOAT", 3, None);
    assert_eq!(vectors.notes, [Note::OneOfSeveral { kind: ChoiceKind::Channel, read: "0".to_owned(), n_entries: 3 }]);
    assert_eq!(vectors.volume.voxels(), &Voxels::F32(vec![0.5, 3.5]));
    assert_eq!(read("MET_FLOAT", 2, Some("1")).volume.voxels(), &Voxels::F32(vec![1.5, 3.5]));
}

fn floats(n: usize) -> Vec<u8> {
    (0..n).flat_map(|i| (i as f32 + 0.5).to_le_bytes()).collect()
}

#[test]
fn lines_with_colons_and_any_first_key() {
    let colons = "ObjectType: Image\nNDims: 3\nDimSize: 4 3 2\nElementType: MET_UCHAR\nElementDataFile: LOCAL\n";
    let other = "Modality = MET_MOD_CT\nNDims = 3\nDimSize = 4 3 2\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n";
    let folder = tempfile::tempdir().unwrap();
    for header in [colons, other] {
        let file = [header.as_bytes(), &bytes(&ramp(ScalarType::U8), ByteOrder::Little)].concat();
        assert_ramp(&metaimage::read(Cursor::new(&file), &NoFiles, &options()).unwrap(), ScalarType::U8);
        // Told by its content: the name says nothing.
        std::fs::write(folder.path().join("scan"), &file).unwrap();
        assert_ramp(&brickfield_io::open(&folder.path().join("scan"), &options()).unwrap(), ScalarType::U8);
    }
}

#[test]
fn headers_that_lie() {
    let refusal = |element, more| read(&header(element, more, "LOCAL"), &[0; 23], &NoFiles).unwrap_err().to_string();
    assert_eq!(refusal("MET_UCHAR", ""), "the data after the header holds 23 bytes; 24 are promised");
    assert!(refusal("MET_STRING", "").contains("ElementType \"MET_STRING\" is not supported"));
    assert_eq!(
        refusal("MET_UCHAR", "ElementNumberOfChannels = 0"),
        "ElementNumberOfChannels is \"0\"; expected 1 to 32768"
    );
    assert_eq!(
        refusal("MET_UCHAR", "ElementNumberOfChannels = 3"),
        "the data after the header holds 23 bytes; 72 are promised"
    );
    assert!(refusal("MET_UCHAR", "TransformMatrix = 1 2 3").contains("9 numbers"));
    assert!(refusal("MET_UCHAR", "HeaderSize = 99").contains("byte skip"));
}
