use std::io::Cursor;

use brickfield_core::ScalarType;
use brickfield_core::glam::DVec3;
use brickfield_io::{ByteOrder, DataFiles, NoFiles, Note, Opened, ReadError, WorldFrame, nrrd};
use proptest::prelude::*;

use crate::common::*;

fn read(header: &str, data: &[u8], files: &dyn DataFiles) -> Result<Opened, ReadError> {
    let file = [header.as_bytes(), data].concat();
    nrrd::read(Cursor::new(file), files, &options())
}

/// A header of the ramp's sizes, with `more` lines.
fn header(scalar: &str, more: &str) -> String {
    format!("NRRD0005\n# a comment\ntype: {scalar}\ndimension: 3\nsizes: 4 3 2\nkey:=value: 3\n{more}\n\n")
}

fn type_name(scalar: ScalarType) -> &'static str {
    match scalar {
        ScalarType::U8 => "unsigned char",
        ScalarType::I8 => "signed char",
        ScalarType::U16 => "ushort",
        ScalarType::I16 => "short",
        ScalarType::U32 => "uint32_t",
        ScalarType::I32 => "int",
        ScalarType::F32 => "float",
        ScalarType::F64 => "double",
    }
}

fn order_name(order: ByteOrder) -> &'static str {
    match order {
        ByteOrder::Little => "little",
        ByteOrder::Big => "big",
    }
}

#[test]
fn every_type_order_and_encoding() {
    for scalar in ScalarType::ALL {
        let ramp = ramp(scalar);
        let plain = header(type_name(scalar), "encoding: ascii");
        assert_ramp(&read(&plain, text(&ramp).as_bytes(), &NoFiles).unwrap(), scalar);
        for order in ORDERS {
            let header =
                |encoding| header(type_name(scalar), &format!("endian: {}\nencoding: {encoding}", order_name(order)));
            assert_ramp(&read(&header("raw"), &bytes(&ramp, order), &NoFiles).unwrap(), scalar);
            #[cfg(feature = "gzip")]
            assert_ramp(&read(&header("gzip"), &gzip(&bytes(&ramp, order)), &NoFiles).unwrap(), scalar);
        }
    }
}

#[test]
fn skips_come_before_the_samples() {
    let data = bytes(&ramp(ScalarType::U8), ByteOrder::Little);
    let lines = [b"one\ntwo\n123".to_vec(), data.clone()].concat();
    assert_ramp(
        &read(&header("uint8", "encoding: raw\nline skip: 2\nbyte skip: 3"), &lines, &NoFiles).unwrap(),
        ScalarType::U8,
    );
    assert_ramp(&read(&header("uint8", "encoding: raw\nbyteskip: -1"), &lines, &NoFiles).unwrap(), ScalarType::U8);
    let past = read(&header("uint8", "encoding: raw\nline skip: 9"), b"one\ntwo", &NoFiles).unwrap_err();
    assert!(past.to_string().contains("line skip"), "{past}");
}

#[cfg(feature = "gzip")]
#[test]
fn byte_skip_of_gzip_counts_unpacked_bytes() {
    let data = [b"123".to_vec(), bytes(&ramp(ScalarType::U8), ByteOrder::Little)].concat();
    assert_ramp(&read(&header("uint8", "encoding: gz\nbyte skip: 3"), &gzip(&data), &NoFiles).unwrap(), ScalarType::U8);
}

#[test]
fn detached_data_in_one_file_a_list_or_a_pattern() {
    let data = bytes(&ramp(ScalarType::U8), ByteOrder::Little);
    let whole = files([("all.raw", data.clone())]);
    assert_ramp(&read(&header("uchar", "encoding: raw\ndata file: all.raw"), &[], &whole).unwrap(), ScalarType::U8);
    let slices = files([("s 08.raw", data[..12].to_vec()), ("s 10.raw", data[12..].to_vec())]);
    let list = header("uchar", "encoding: raw\ndata file: LIST\ns 08.raw\ns 10.raw");
    assert_ramp(&read(&list, &[], &slices).unwrap(), ScalarType::U8);
    let slices = files([("s08", data[..12].to_vec()), ("s10", data[12..].to_vec())]);
    let pattern = header("uchar", "encoding: raw\ndatafile: s%02d 8 10 2");
    assert_ramp(&read(&pattern, &[], &slices).unwrap(), ScalarType::U8);
    let rows: Vec<_> = data.chunks(4).map(<[u8]>::to_vec).collect();
    let rows: std::collections::BTreeMap<_, _> =
        rows.into_iter().enumerate().map(|(i, row)| (format!("r{}", 6 - i), row)).collect();
    let pattern = header("uchar", "encoding: raw\ndata file: r%d 6 1 -1 1");
    assert_ramp(&nrrd::read(Cursor::new(pattern), &rows, &options()).unwrap(), ScalarType::U8);
}

#[test]
fn spaces_become_left_posterior_superior() {
    let placed = |space: &str| {
        let more = format!(
            "encoding: raw\n{space}\nspace directions: (0,2,0) (3,0,0) (0,0,-4)\nspace origin: (10,20,30)\nspace units: \"mm\" \"mm\" \"mm\""
        );
        read(&header("uchar", &more), &[0; 24], &NoFiles).unwrap()
    };
    let lps = placed("space: LPS");
    assert_near(centre(&lps, 1.0, 1.0, 1.0), [13.0, 22.0, 26.0]);
    assert_eq!((lps.frame, lps.unit.as_deref()), (WorldFrame::Lps, Some("mm")));
    assert_eq!(lps.volume.grid().spacing(), DVec3::new(2.0, 3.0, 4.0));
    assert_near(centre(&placed("space: right-anterior-superior"), 1.0, 1.0, 1.0), [-13.0, -22.0, 26.0]);
    assert_near(centre(&placed("space: LAS"), 1.0, 1.0, 1.0), [13.0, -22.0, 26.0]);
    let plain = placed("space dimension: 3");
    assert_near(centre(&plain, 1.0, 1.0, 1.0), [13.0, 22.0, 26.0]);
    assert_eq!(plain.frame, WorldFrame::Plain);
}

#[test]
fn each_axis_has_its_unit() {
    let opened = |more: &str| read(&header("uchar", &format!("encoding: raw\n{more}")), &[0; 24], &NoFiles).unwrap();
    for more in [
        "space dimension: 3\nspace directions: (1,0,0) (0,1,0) (0,0,2)\nspace units: \"um\" \"micron\" \"mm\"",
        "spacings: 1 1 2\nunits: \"um\" \"\" \"mm\"",
    ] {
        let opened = opened(more);
        assert_eq!((opened.volume.grid().spacing(), opened.unit.as_deref()), (DVec3::new(1.0, 1.0, 2e3), Some("um")));
        assert!(opened.notes.is_empty());
    }
}

#[test]
fn without_directions_spacings_and_bounds_count() {
    let placed = |more: &str| read(&header("uchar", &format!("encoding: raw\n{more}")), &[0; 24], &NoFiles).unwrap();
    let opened = placed("spacings: 1 NaN 0.5\naxis mins: 10 20 nan\naxis maxs: nan 26 nan");
    assert_eq!(opened.volume.grid().spacing(), DVec3::new(1.0, 2.0, 0.5));
    assert_near(centre(&opened, 0.0, 0.0, 0.0), [10.5, 21.0, 0.0]);
    let node = placed("axis mins: 0 0 0\naxis maxs: 3 4 5\ncenters: node node node");
    assert_near(centre(&node, 3.0, 2.0, 1.0), [3.0, 4.0, 5.0]);
    let zero = placed("spacings: 1 0 1");
    assert!(matches!(zero.notes[..], [Note::SpacingAssumed { axis: 'y', .. }]));
}

#[test]
fn not_finite_values_are_noted() {
    let data = format!("nan inf -3 {}", "2 ".repeat(21));
    let opened = read(&header("float", "encoding: text"), data.as_bytes(), &NoFiles).unwrap();
    assert_eq!(
        opened.notes[0].to_string(),
        "2 voxels are not finite and were replaced: 1 NaN and 0 -infinity by -3, 1 +infinity by 2"
    );
}

#[test]
fn headers_that_lie() {
    let refusal = |more: &str| read(&header("uchar", more), &[0; 24], &NoFiles).unwrap_err().to_string();
    assert_eq!(refusal("encoding: bzip2"), "encoding \"bzip2\" is not supported; raw, ascii and gzip are");
    assert_eq!(refusal("encoding: raw\nbyte skip: 1"), "the data after the header holds 23 bytes; 24 are promised");
    assert!(refusal("encoding: raw\ndata file: gone.raw").contains("gone.raw"));
    assert!(refusal("encoding: raw\ndata file: s%d 1 99999999999 1").contains("number of data files"));
    assert!(refusal("encoding: raw\ndata file: LIST").contains("data file"));
    assert!(refusal("encoding: raw\nspace directions: (1,0,0) (1,0,0) (0,0,1)").contains("determinant"));
    assert!(refusal("encoding: raw\nspace directions: (1,0,0) (1,0,0").contains("space directions"));
    assert!(refusal("encoding: ascii").contains("24"));
}

proptest! {
    #[test]
    fn no_header_panics(header in "(NRRD0004\n)?((sizes|type|dimension|encoding|endian|space|data file|spacings): [ -~]{0,20}\n){0,8}\n?[ -~]{0,30}") {
        let _ = nrrd::read(Cursor::new(header), &NoFiles, &options());
    }
}
