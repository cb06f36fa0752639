//! NIfTI-2, series, vectors, colours, wide integers and pairs.

use std::io::Cursor;

use brickfield_core::{ScalarType, Voxels};
use brickfield_io::{ByteOrder, ChoiceKind, NoFiles, Note, Opened, ReadError, WorldFrame, nifti, open};

use crate::common::*;
use crate::nifti::NiftiHeader;
use crate::stored::{assert_wide, wide, wide_bytes};

/// The fields of a header of version 2 that these tests set.
#[derive(Clone)]
struct Nifti2Header {
    order: ByteOrder,
    dim: [i64; 8],
    datatype: i16,
    pixdim: [f64; 8],
    offset: i64,
    scale: [f64; 2],
    codes: [i32; 2],
    quaternion: [f64; 6],
    rows: [[f64; 4]; 3],
    magic: [u8; 8],
}

impl Nifti2Header {
    fn new(datatype: i16) -> Nifti2Header {
        Nifti2Header {
            order: ByteOrder::Little,
            dim: [3, 4, 3, 2, 1, 1, 1, 1],
            datatype,
            pixdim: [1.0, 2.0, 3.0, 4.0, 0.0, 0.0, 0.0, 0.0],
            offset: 544,
            scale: [0.0, 0.0],
            codes: [0, 0],
            quaternion: [0.0; 6],
            rows: [[0.0; 4]; 3],
            magic: *b"n+2\0\r\n\x1a\n",
        }
    }

    /// 544 bytes: the header and an empty extension mark.
    fn bytes(&self) -> Vec<u8> {
        let mut out = vec![0; 544];
        let mut put = |at: usize, little_endian: &[u8]| {
            let field = &mut out[at..at + little_endian.len()];
            field.copy_from_slice(little_endian);
            if self.order == ByteOrder::Big {
                field.reverse();
            }
        };
        put(0, &540i32.to_le_bytes());
        put(12, &self.datatype.to_le_bytes());
        self.dim.iter().enumerate().for_each(|(i, v)| put(16 + 8 * i, &v.to_le_bytes()));
        let floats =
            [(104, &self.pixdim[..]), (176, &self.scale), (352, &self.quaternion), (400, self.rows.as_flattened())];
        for (at, values) in floats {
            values.iter().enumerate().for_each(|(i, v)| put(at + 8 * i, &v.to_le_bytes()));
        }
        put(168, &self.offset.to_le_bytes());
        self.codes.iter().enumerate().for_each(|(i, v)| put(344 + 4 * i, &v.to_le_bytes()));
        put(500, &2i32.to_le_bytes());
        out[4..12].copy_from_slice(&self.magic);
        out
    }
}

/// Seeds for the fuzz target.
pub(crate) fn examples() -> Vec<Vec<u8>> {
    let two = |order| [Nifti2Header { order, ..Nifti2Header::new(2) }.bytes(), vec![1; 24]].concat();
    let colours = [NiftiHeader::new(128).bytes(), vec![1; 72]].concat();
    let series =
        [NiftiHeader { dim: [5, 4, 3, 2, 2, 2, 1, 1], ..NiftiHeader::new(1024) }.bytes(), vec![0; 768]].concat();
    vec![two(ByteOrder::Little), two(ByteOrder::Big), gzip(&two(ByteOrder::Little)), colours, series]
}

fn read(header: &[u8], data: &[u8], kind: ChoiceKind, wanted: Option<&str>) -> Result<Opened, ReadError> {
    nifti::read(Cursor::new([header, data].concat()), "scan", &NoFiles, &selecting(kind, wanted))
}

fn code(scalar: ScalarType) -> i16 {
    let codes = [2, 256, 512, 4, 768, 8, 16, 64];
    codes[ScalarType::ALL.iter().position(|s| *s == scalar).unwrap()]
}

#[test]
fn version_2_of_every_type_in_both_orders_plain_and_gzipped() {
    for scalar in ScalarType::ALL {
        for order in ORDERS {
            let header = Nifti2Header { order, ..Nifti2Header::new(code(scalar)) };
            let file = [header.bytes(), bytes(&ramp(scalar), order)].concat();
            for file in [gzip(&file), file] {
                let opened = nifti::read(Cursor::new(file), "", &NoFiles, &options()).unwrap();
                assert_ramp(&opened, scalar);
                assert_eq!((opened.unit.as_deref(), opened.notes.len()), (Some("mm"), 0));
            }
        }
    }
}

#[test]
fn version_2_is_placed_in_64_bits() {
    for order in ORDERS {
        let rows = [[0.1, 0.0, 0.0, 1.1], [0.0, 0.0, 0.3, 2.2], [0.0, 0.7, 0.0, 3.3]];
        let header = Nifti2Header { order, codes: [0, 1], rows, scale: [0.1, -0.3], ..Nifti2Header::new(2) };
        let opened = read(&header.bytes(), &[3; 24], ChoiceKind::Time, None).unwrap();
        assert_eq!(opened.frame, WorldFrame::Lps);
        assert_near(centre(&opened, 1.0, 1.0, 1.0), [-1.2, -2.5, 4.0]);
        assert_eq!(opened.volume.rescale().slope(), 0.1);
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let quaternion = [0.0, 0.0, half, 10.0, 20.0, 30.0];
        let turned = Nifti2Header { order, codes: [1, 0], quaternion, ..Nifti2Header::new(2) };
        let opened = read(&turned.bytes(), &[3; 24], ChoiceKind::Time, None).unwrap();
        assert_near(centre(&opened, 1.0, 0.0, 0.0), [-10.0, -22.0, 30.0]);
    }
}

#[test]
fn times_and_components_are_chosen() {
    let series = NiftiHeader { dim: [4, 4, 3, 2, 5, 1, 1, 1], ..NiftiHeader::new(2) };
    let data: Vec<u8> = (0..120).collect();
    for file in [false, true] {
        let read = |wanted| {
            let plain = [series.bytes(), data.clone()].concat();
            let bytes = if file { gzip(&plain) } else { plain };
            nifti::read(Cursor::new(bytes), "", &NoFiles, &selecting(ChoiceKind::Time, wanted))
        };
        let first = read(None).unwrap();
        assert_eq!(first.notes, [Note::OneOfSeveral { kind: ChoiceKind::Time, read: "0".to_owned(), n_entries: 5 }]);
        assert_eq!(first.volume.voxels(), &Voxels::U8((0..24).collect()));
        let last = read(Some("4")).unwrap();
        assert_eq!((last.volume.voxels(), last.notes.len()), (&Voxels::U8((96..120).collect()), 0));
        assert!(read(Some("5")).unwrap_err().to_string().contains("0 to 4"));
    }
    let vectors = NiftiHeader { dim: [5, 4, 3, 2, 1, 5, 1, 1], ..NiftiHeader::new(2) };
    let third = read(&vectors.bytes(), &data, ChoiceKind::Channel, Some("2")).unwrap();
    assert_eq!(third.volume.voxels(), &Voxels::U8((48..72).collect()));
    let both = NiftiHeader { dim: [5, 4, 3, 1, 2, 5, 1, 1], ..NiftiHeader::new(2) };
    let mut options = selecting(ChoiceKind::Channel, Some("3"));
    options.wanted.want(ChoiceKind::Time, "1");
    let file = [both.bytes(), data.clone()].concat();
    let opened = nifti::read(Cursor::new(file), "", &NoFiles, &options).unwrap();
    assert_eq!(opened.volume.voxels(), &Voxels::U8((84..96).collect()));
    let further = NiftiHeader { dim: [6, 4, 3, 2, 1, 1, 5, 1], ..NiftiHeader::new(2) };
    let notes = read(&further.bytes(), &data, ChoiceKind::Time, None).unwrap().notes;
    assert!(matches!(&notes[..], [Note::FirstOfAxis { axis, n_entries: 5 }] if axis == "v"));
}

#[test]
fn colours_and_complex_numbers() {
    let data: Vec<u8> = (0..96).collect();
    let every = |n: usize, first: u8| Voxels::U8((first..).step_by(n).take(24).collect());
    let rgb = NiftiHeader { scale: [2.0, 1.0], ..NiftiHeader::new(128) }.bytes();
    let opened = read(&rgb, &data[..72], ChoiceKind::Channel, None).unwrap();
    assert_eq!((opened.volume.voxels(), opened.notes), (&every(3, 1), vec![Note::Luminance]));
    assert_eq!(opened.volume.value(0), 1.0);
    assert_eq!(read(&rgb, &data[..72], ChoiceKind::Channel, Some("blue")).unwrap().volume.voxels(), &every(3, 2));
    let rgba = NiftiHeader::new(2304).bytes();
    assert_eq!(read(&rgba, &data, ChoiceKind::Channel, Some("alpha")).unwrap().volume.voxels(), &every(4, 3));
    assert_eq!(
        read(&rgba, &data[..95], ChoiceKind::Channel, None).unwrap_err().to_string(),
        "the image holds 95 bytes; 96 are promised"
    );
    let numbers: Vec<u8> = (0..48).flat_map(|i| (i as f32).to_le_bytes()).collect();
    let complex = read(&NiftiHeader::new(32).bytes(), &numbers, ChoiceKind::Channel, Some("imaginary")).unwrap();
    assert_eq!((complex.volume.voxels().at(0), complex.volume.voxels().at(23)), (1.0, 47.0));
}

#[test]
fn integers_of_64_bits() {
    let expected = Voxels::from(wide(-5, 1000).iter().map(|v| *v as i16).collect::<Vec<_>>());
    for order in ORDERS {
        let data = wide_bytes(&wide(-5, 1000), order);
        let one = NiftiHeader { order, ..NiftiHeader::new(1024) }.bytes();
        assert_wide(&read(&one, &data, ChoiceKind::Time, None).unwrap(), "int64", &expected);
        let two = Nifti2Header { order, ..Nifti2Header::new(1280) }.bytes();
        let unsigned = wide_bytes(&wide(0, 1), order);
        let expected = Voxels::U8((0..24).collect());
        assert_wide(&read(&two, &unsigned, ChoiceKind::Time, None).unwrap(), "uint64", &expected);
    }
}

#[test]
fn a_pair_opens_by_its_header_and_by_its_image() {
    let data = bytes(&ramp(ScalarType::U8), ByteOrder::Little);
    let one = NiftiHeader { magic: *b"ni1\0", offset: 0.0, ..NiftiHeader::new(2) }.bytes()[..348].to_vec();
    let two = Nifti2Header { magic: *b"ni2\0\r\n\x1a\n", offset: 0, ..Nifti2Header::new(2) }.bytes()[..540].to_vec();
    for header in [one, two] {
        for [header_name, image_name] in
            [["a.b.hdr", "a.b.img"], ["scan.hdr.gz", "scan.img.gz"], ["scan.hdr", "scan.img.gz"]]
        {
            let folder = tempfile::tempdir().unwrap();
            for (name, content) in [(header_name, &header), (image_name, &data)] {
                let content = if name.ends_with(".gz") { gzip(content) } else { content.clone() };
                std::fs::write(folder.path().join(name), content).unwrap();
            }
            for name in [header_name, image_name] {
                assert_ramp(&open(&folder.path().join(name), &options()).unwrap(), ScalarType::U8);
            }
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let image = folder.path().join("alone.img");
    std::fs::write(&image, &data).unwrap();
    let said = open(&image, &options()).unwrap_err().to_string();
    assert!(said.contains("cannot read data file \"alone.hdr\""), "{said}");
}

#[test]
fn headers_that_lie() {
    let refusal =
        |header: Nifti2Header| read(&header.bytes(), &[0; 23], ChoiceKind::Time, None).unwrap_err().to_string();
    let good = || Nifti2Header::new(2);
    assert_eq!(refusal(good()), "the image holds 23 bytes; 24 are promised");
    assert!(refusal(Nifti2Header { dim: [3, i64::MIN, 3, 2, 1, 1, 1, 1], ..good() }).contains("dim[1] is"));
    assert!(
        refusal(Nifti2Header { dim: [3, i64::MAX, 3, 2, 1, 1, 1, 1], ..good() }).contains("whose product is below")
    );
    assert!(refusal(Nifti2Header { dim: [-1, 4, 3, 2, 1, 1, 1, 1], ..good() }).contains("dim[0] is \"-1\""));
    assert!(refusal(Nifti2Header { dim: [4, 1, 1, 1, i64::MAX, 1, 1, 1], ..good() }).contains("are promised"));
    assert!(refusal(Nifti2Header { offset: -1, ..good() }).contains("vox_offset is \"-1\""));
    assert!(
        refusal(Nifti2Header { offset: 100, ..good() }).contains("vox_offset is \"100\"; expected 0 or at least 540")
    );
    assert!(refusal(Nifti2Header { magic: *b"n+2\0\n\n\x1a\n", ..good() }).contains("not NIfTI: magic is"));
    for n in [0, 3, 4, 11, 348, 539] {
        assert!(read(&good().bytes()[..n], &[], ChoiceKind::Time, None).is_err());
    }
}
