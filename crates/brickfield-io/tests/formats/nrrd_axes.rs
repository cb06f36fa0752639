//! NRRD with axes that are not of space.

use std::io::Cursor;

use brickfield_core::Voxels;
use brickfield_io::{ChoiceKind, DataFiles, NoFiles, Note, Opened, ReadError, nrrd};

use crate::common::*;

/// Seeds for the fuzz target.
pub(crate) fn examples() -> Vec<String> {
    let more = [
        "kinds: list domain domain domain",
        "kinds: RGB-color domain domain domain",
        "kinds: domain domain domain time",
        "kinds: list domain domain domain\nSegment0_ID:=a\nSegment0_Layer:=2",
    ];
    let file = |more: &&str| {
        format!("NRRD0004\ntype: int64\ndimension: 4\nsizes: 3 2 1 3\nencoding: ascii\n{more}\n\n{}", "1 ".repeat(18))
    };
    more.iter().map(file).collect()
}

/// Samples count up from 0.
fn read(sizes: &str, more: &str, kind: ChoiceKind, wanted: Option<&str>) -> Result<Opened, ReadError> {
    read_with(sizes, more, true, &NoFiles, kind, wanted)
}

fn read_with(
    sizes: &str,
    more: &str,
    attached: bool,
    files: &dyn DataFiles,
    kind: ChoiceKind,
    wanted: Option<&str>,
) -> Result<Opened, ReadError> {
    let n = sizes.split(' ').map(|n| n.parse::<usize>().unwrap()).product::<usize>();
    let dimension = sizes.split(' ').count();
    let header = format!("NRRD0004\ntype: uchar\ndimension: {dimension}\nsizes: {sizes}\n{more}\n\n");
    let data: Vec<u8> = (0..n).map(|i| i as u8).collect();
    let data = match more {
        more if more.contains("ascii") => text(&Voxels::U8(data)).into_bytes(),
        #[cfg(feature = "gzip")]
        more if more.contains("gzip") => gzip(&data),
        _ => data,
    };
    let data = if attached { data } else { vec![] };
    nrrd::read(Cursor::new([header.into_bytes(), data].concat()), files, &selecting(kind, wanted))
}

fn every(n: usize, first: u8, step: usize) -> Voxels {
    Voxels::U8((first..).step_by(step).take(n).collect())
}

fn one_of(kind: ChoiceKind, read: &str, n_entries: u64) -> [Note; 1] {
    [Note::OneOfSeveral { kind, read: read.to_owned(), n_entries }]
}

fn encodings() -> Vec<&'static str> {
    let mut encodings = vec!["encoding: raw", "encoding: ascii"];
    if cfg!(feature = "gzip") {
        encodings.push("encoding: gzip");
    }
    encodings
}

#[test]
fn a_list_before_space_has_the_numbers_of_a_voxel() {
    for encoding in encodings() {
        for kind in ["list", "vector", "3-vector", "none"] {
            let more = format!(
                "{encoding}\nkinds: {kind} domain domain domain\nspace directions: none (1,0,0) (0,1,0) (0,0,1)"
            );
            let opened = read("3 4 3 2", &more, ChoiceKind::Channel, None).unwrap();
            assert_eq!((opened.volume.grid().dims(), opened.volume.voxels()), (DIMS, &every(24, 0, 3)));
            assert_eq!(opened.notes, one_of(ChoiceKind::Channel, "0", 3));
            let last = read("3 4 3 2", &more, ChoiceKind::Channel, Some("2")).unwrap();
            assert_eq!((last.volume.voxels(), last.notes.len()), (&every(24, 2, 3), 0));
            assert_eq!((last.choices[0].n_entries, last.choices[0].read), (3, 2));
        }
    }
    let flat = read("1 4 3 2", "encoding: raw\nkinds: vector domain domain domain", ChoiceKind::Channel, None).unwrap();
    assert_eq!((flat.volume.grid().dims(), flat.notes.len()), (DIMS, 0));
    let tensors =
        read("2 3 4 2", "encoding: raw\nkinds: list vector domain domain", ChoiceKind::Channel, Some("5")).unwrap();
    assert_eq!(tensors.volume.voxels(), &every(8, 5, 6));
}

#[test]
fn colours_become_their_luminance_or_a_channel() {
    for kind in ["RGB-color", "3-color"] {
        let more = format!("encoding: raw\nkinds: {kind} domain domain domain");
        let opened = read("3 4 3 2", &more, ChoiceKind::Channel, None).unwrap();
        assert_eq!((opened.volume.voxels(), opened.notes), (&every(24, 1, 3), vec![Note::Luminance]));
        let blue = read("3 4 3 2", &more, ChoiceKind::Channel, Some("blue")).unwrap();
        assert_eq!((blue.volume.voxels(), blue.notes.len()), (&every(24, 2, 3), 0));
    }
    let more = "encoding: ascii\nkinds: RGBA-color domain domain domain";
    let alpha = read("4 4 3 2", more, ChoiceKind::Channel, Some("alpha")).unwrap();
    assert_eq!(alpha.volume.voxels(), &every(24, 3, 4));
    assert_eq!(read("4 4 3 2", more, ChoiceKind::Channel, None).unwrap().notes, [Note::Luminance]);
    let hsv = read("3 4 3 2", "encoding: raw\nkinds: HSV-color space space space", ChoiceKind::Channel, Some("value"))
        .unwrap();
    assert_eq!(hsv.volume.voxels(), &every(24, 2, 3));
}

#[test]
fn volumes_behind_space_are_times() {
    for encoding in encodings() {
        for more in ["kinds: domain domain domain time", "kinds: domain domain domain list", "content: series"] {
            let more = format!("{encoding}\n{more}");
            let first = read("4 3 2 5", &more, ChoiceKind::Time, None).unwrap();
            assert_eq!((first.volume.grid().dims(), first.volume.voxels()), (DIMS, &every(24, 0, 1)));
            assert_eq!(first.notes, one_of(ChoiceKind::Time, "0", 5));
            for (wanted, start) in [("3", 72), ("4", 96)] {
                let later = read("4 3 2 5", &more, ChoiceKind::Time, Some(wanted)).unwrap();
                assert_eq!((later.volume.voxels(), later.notes.len()), (&every(24, start, 1), 0));
            }
        }
    }
    let vectors =
        read("4 3 2 3", "encoding: raw\nkinds: domain domain domain vector", ChoiceKind::Channel, Some("1")).unwrap();
    assert_eq!(vectors.volume.voxels(), &every(24, 24, 1));
    let between =
        read("4 3 5 2", "encoding: raw\nkinds: domain domain list domain", ChoiceKind::Time, None).unwrap_err();
    assert_eq!(
        between.to_string(),
        "axis between those of space, \"5 entries of axis 2 (list)\" is not supported; before or behind them it is"
    );
}

#[test]
fn a_time_of_detached_files_is_found_in_its_files() {
    let data: Vec<u8> = (0..120).collect();
    let slices: std::collections::BTreeMap<_, _> =
        data.chunks(12).enumerate().map(|(i, slice)| (format!("s{i}"), slice.to_vec())).collect();
    let whole = files([("all", data.clone())]);
    // Files of 40 samples: the second time begins in the first file.
    let odd = files([("s0", data[..40].to_vec()), ("s1", data[40..80].to_vec()), ("s2", data[80..].to_vec())]);
    for (names, files) in [("s%d 0 9 1", &slices), ("all", &whole), ("s%d 0 2 1", &odd)] {
        let more = format!("encoding: raw\ndata file: {names}");
        for time in 0..5u8 {
            let wanted = Some(time.to_string());
            let opened = read_with("4 3 2 5", &more, false, files, ChoiceKind::Time, wanted.as_deref()).unwrap();
            assert_eq!(opened.volume.voxels(), &every(24, 24 * time, 1), "{names}");
        }
    }
}

#[test]
fn layers_and_series_of_slicer() {
    let segments = "encoding: raw\nkinds: list domain domain domain\nspace: LPS\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\n\
                    Segment0_ID:=Segment_1\nSegment0_Layer:=0\nSegment0_Name:=liver\nSegment1_ID:=Segment_2\nSegment1_Layer:=1\n\
                    Segment1_Name:=vessels\nSegment2_ID:=Segment_3\nSegment2_Layer:=1";
    let opened = read("2 4 3 2", segments, ChoiceKind::Array, None).unwrap();
    assert_eq!(opened.notes, one_of(ChoiceKind::Array, "0 (liver)", 2));
    assert_eq!(opened.choices[0].names, ["liver", "vessels, Segment_3"]);
    let second = read("2 4 3 2", segments, ChoiceKind::Array, Some("1")).unwrap();
    assert_eq!(second.volume.voxels(), &every(24, 1, 2));
    let series = "encoding: raw\nkinds: list domain domain domain\nMultiVolume.NumberOfFrames:=2";
    assert_eq!(read("2 4 3 2", series, ChoiceKind::Time, None).unwrap().notes, one_of(ChoiceKind::Time, "0", 2));
    let series =
        "encoding: raw\nkinds: list domain domain domain\naxis 0 index type:=numeric\naxis 0 index values:=0 1";
    assert_eq!(read("2 4 3 2", series, ChoiceKind::Time, Some("1")).unwrap().volume.voxels(), &every(24, 1, 2));
}

#[test]
fn axes_that_lie() {
    let kinds = "encoding: raw\nkinds: list domain domain domain";
    let refusal = |sizes: &str, data: &[u8]| {
        let header = format!("NRRD0004\ntype: uchar\ndimension: 4\nsizes: {sizes}\n{kinds}\n\n");
        nrrd::read(Cursor::new([header.as_bytes(), data].concat()), &NoFiles, &options()).unwrap_err().to_string()
    };
    assert_eq!(refusal("3 4 3 2", &[0; 71]), "the data after the header holds 71 bytes; 72 are promised");
    assert_eq!(refusal("40000 1 1 1", &[0; 9]), "number of components is \"40000\"; expected 1 to 32768");
    assert!(refusal("4294967296 4294967296 2 2", &[]).contains("whose product is below 18446744073709551616"));
}

#[cfg(feature = "gzip")]
#[test]
fn samples_at_the_end_of_a_gzip_stream() {
    let data = bytes(&ramp(brickfield_core::ScalarType::U8), brickfield_io::ByteOrder::Little);
    let packed = |n_before: usize| files([("v.gz", gzip(&[vec![9; n_before], data.clone()].concat()))]);
    let header =
        "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4 3 2\nencoding: gzip\nbyte skip: -1\ndata file: v.gz\n\n";
    for n_before in [0, 7, 100_000] {
        let opened = nrrd::read(Cursor::new(header), &packed(n_before), &options()).unwrap();
        assert_ramp(&opened, brickfield_core::ScalarType::U8);
        assert!(opened.notes.is_empty());
    }
    let refusal = |files| nrrd::read(Cursor::new(header), &files, &options()).unwrap_err().to_string();
    assert_eq!(refusal(packed(2 << 20)), "v.gz, unpacked, would take 1081344 bytes; the limit is 1048576 bytes");
    assert_eq!(refusal(files([("v.gz", gzip(&data[..23]))])), "v.gz holds 23 bytes; 24 are promised");
    let cut = gzip_unpressed(&data);
    assert!(refusal(files([("v.gz", cut[..30].to_vec())])).contains("its compressed data are cut off"));
}
