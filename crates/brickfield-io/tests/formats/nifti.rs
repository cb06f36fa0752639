use std::io::Cursor;

use brickfield_core::glam::DVec3;
use brickfield_core::{ScalarType, Voxels};
use brickfield_io::{ByteOrder, DataFiles, NoFiles, Note, Opened, ReadError, WorldFrame, nifti};

use crate::common::*;

/// The fields of a header that these tests set.
#[derive(Clone)]
pub(crate) struct NiftiHeader {
    pub(crate) order: ByteOrder,
    pub(crate) dim: [i16; 8],
    pub(crate) datatype: i16,
    pub(crate) pixdim: [f32; 8],
    pub(crate) offset: f32,
    pub(crate) scale: [f32; 2],
    pub(crate) codes: [i16; 2],
    pub(crate) quaternion: [f32; 6],
    pub(crate) rows: [[f32; 4]; 3],
    pub(crate) magic: [u8; 4],
}

impl NiftiHeader {
    pub(crate) fn new(datatype: i16) -> NiftiHeader {
        NiftiHeader {
            order: ByteOrder::Little,
            dim: [3, 4, 3, 2, 1, 1, 1, 1],
            datatype,
            pixdim: [1.0, 2.0, 3.0, 4.0, 0.0, 0.0, 0.0, 0.0],
            offset: 352.0,
            scale: [0.0, 0.0],
            codes: [0, 0],
            quaternion: [0.0; 6],
            rows: [[0.0; 4]; 3],
            magic: *b"n+1\0",
        }
    }

    /// 352 bytes: the header and an empty extension mark.
    pub(crate) fn bytes(&self) -> Vec<u8> {
        let mut out = vec![0; 352];
        let short = |v: i16| if self.order == ByteOrder::Big { v.to_be_bytes() } else { v.to_le_bytes() };
        let long = |v: [u8; 4]| if self.order == ByteOrder::Big { [v[3], v[2], v[1], v[0]] } else { v };
        let mut put = |at: usize, bytes: &[u8]| out[at..at + bytes.len()].copy_from_slice(bytes);
        put(0, &long(348i32.to_le_bytes()));
        self.dim.iter().enumerate().for_each(|(i, v)| put(40 + 2 * i, &short(*v)));
        put(70, &short(self.datatype));
        let float = |v: f32| long(v.to_le_bytes());
        self.pixdim.iter().enumerate().for_each(|(i, v)| put(76 + 4 * i, &float(*v)));
        put(108, &float(self.offset));
        self.scale.iter().enumerate().for_each(|(i, v)| put(112 + 4 * i, &float(*v)));
        put(123, &[2]);
        self.codes.iter().enumerate().for_each(|(i, v)| put(252 + 2 * i, &short(*v)));
        self.quaternion.iter().enumerate().for_each(|(i, v)| put(256 + 4 * i, &float(*v)));
        self.rows.iter().flatten().enumerate().for_each(|(i, v)| put(280 + 4 * i, &float(*v)));
        put(344, &self.magic);
        out
    }
}

fn datatype(scalar: ScalarType) -> i16 {
    match scalar {
        ScalarType::U8 => 2,
        ScalarType::I8 => 256,
        ScalarType::U16 => 512,
        ScalarType::I16 => 4,
        ScalarType::U32 => 768,
        ScalarType::I32 => 8,
        ScalarType::F32 => 16,
        ScalarType::F64 => 64,
    }
}

fn read(header: &NiftiHeader, data: &[u8], files: &dyn DataFiles) -> Result<Opened, ReadError> {
    nifti::read(Cursor::new([header.bytes(), data.to_vec()].concat()), "scan", files, &options())
}

#[test]
fn every_type_in_both_orders_plain_and_gzipped() {
    for scalar in ScalarType::ALL {
        for order in ORDERS {
            let header = NiftiHeader { order, ..NiftiHeader::new(datatype(scalar)) };
            let data = bytes(&ramp(scalar), order);
            assert_ramp(&read(&header, &data, &NoFiles).unwrap(), scalar);
            let packed = gzip(&[header.bytes(), data].concat());
            assert_ramp(&nifti::read(Cursor::new(packed), "", &NoFiles, &options()).unwrap(), scalar);
        }
    }
}

#[test]
fn a_pair_of_header_and_image() {
    let header = NiftiHeader { magic: *b"ni1\0", offset: 0.0, ..NiftiHeader::new(2) };
    let data = bytes(&ramp(ScalarType::U8), ByteOrder::Little);
    let plain = files([("scan.img", data.clone())]);
    assert_ramp(&read(&header, &[], &plain).unwrap(), ScalarType::U8);
    let packed = files([("scan.img.gz", gzip(&data))]);
    assert_ramp(&read(&header, &[], &packed).unwrap(), ScalarType::U8);
    assert!(read(&header, &[], &NoFiles).unwrap_err().to_string().contains("scan.img"));
}

#[test]
fn sform_before_qform_before_pixdim() {
    let plain = read(&NiftiHeader::new(2), &[0; 24], &NoFiles).unwrap();
    assert_eq!((plain.frame, plain.unit.as_deref()), (WorldFrame::Plain, Some("mm")));
    assert_near(centre(&plain, 1.0, 1.0, 1.0), [2.0, 3.0, 4.0]);
    // A quarter turn about z takes x to y and y to -x; qfac -1 mirrors z. Then x and y are negated.
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let mut turned =
        NiftiHeader { codes: [1, 0], quaternion: [0.0, 0.0, half, 10.0, 20.0, 30.0], ..NiftiHeader::new(2) };
    turned.pixdim[0] = -1.0;
    let by_qform = read(&turned, &[0; 24], &NoFiles).unwrap();
    assert_eq!(by_qform.frame, WorldFrame::Lps);
    assert_near(centre(&by_qform, 1.0, 0.0, 0.0), [-10.0, -22.0, 30.0]);
    assert_near(centre(&by_qform, 0.0, 1.0, 1.0), [-7.0, -20.0, 26.0]);
    let rows = [[5.0, 0.0, 0.0, 1.0], [0.0, 0.0, 6.0, 2.0], [0.0, 7.0, 0.0, 3.0]];
    let by_sform = read(&NiftiHeader { codes: [1, 2], rows, ..turned.clone() }, &[0; 24], &NoFiles).unwrap();
    assert_near(centre(&by_sform, 1.0, 1.0, 1.0), [-6.0, -8.0, 10.0]);
    assert_eq!(by_sform.volume.grid().spacing(), DVec3::new(5.0, 7.0, 6.0));
    let singular = read(&NiftiHeader { codes: [1, 2], ..turned }, &[0; 24], &NoFiles).unwrap();
    assert_near(centre(&singular, 1.0, 0.0, 0.0), [-10.0, -22.0, 30.0]);
    assert!(matches!(singular.notes[..], [Note::OrientationIgnored { .. }]));
}

#[test]
fn slope_and_intercept() {
    let scaled = |datatype, scale, data: &[u8]| {
        read(&NiftiHeader { scale, dim: [1, 2, 1, 1, 1, 1, 1, 1], ..NiftiHeader::new(datatype) }, data, &NoFiles)
            .unwrap()
    };
    let by_half = scaled(2, [0.5, -1.0], &[0, 3]);
    assert_eq!(by_half.volume.voxels(), &Voxels::U8(vec![0, 3]));
    assert_eq!([by_half.volume.value(0), by_half.volume.value(1)], [-1.0, 0.5]);
    let wide = scaled(8, [2.0, 0.5], &[1, 0, 0, 0, 255, 255, 255, 127]);
    assert_eq!([wide.volume.value(0), wide.volume.value(1)], [2.5, 4_294_967_294.5]);
    for identity in [[0.0, 9.0], [1.0, 0.0]] {
        assert_eq!(scaled(2, identity, &[0, 3]).volume.voxels(), &Voxels::U8(vec![0, 3]));
    }
    let not_finite = scaled(2, [f32::NAN, 0.0], &[0, 3]);
    assert!(matches!(not_finite.notes[..], [Note::RescaleIgnored { .. }]));
}

#[test]
fn headers_that_lie() {
    let refusal = |header: NiftiHeader| read(&header, &[0; 23], &NoFiles).unwrap_err().to_string();
    assert_eq!(refusal(NiftiHeader::new(2)), "the image holds 23 bytes; 24 are promised");
    assert_eq!(
        refusal(NiftiHeader::new(1)),
        "datatype \"binary (code 1)\" is not supported; 8 to 64 bit integers, 32 and 64 bit floats are"
    );
    assert!(
        refusal(NiftiHeader { dim: [3, -4, 3, 2, 1, 1, 1, 1], ..NiftiHeader::new(2) }).contains("dim[1] is \"-4\"")
    );
    assert!(refusal(NiftiHeader { dim: [0, 4, 3, 2, 1, 1, 1, 1], ..NiftiHeader::new(2) }).contains("dim[0]"));
    assert!(
        refusal(NiftiHeader { dim: [3, 32767, 32767, 32767, 1, 1, 1, 1], ..NiftiHeader::new(2) }).contains("limit")
    );
    assert!(refusal(NiftiHeader { offset: f32::NAN, ..NiftiHeader::new(2) }).contains("vox_offset"));
    assert!(refusal(NiftiHeader { offset: 1e15, ..NiftiHeader::new(2) }).contains("the space before vox_offset"));
    assert!(refusal(NiftiHeader { magic: *b"n+2\0", ..NiftiHeader::new(2) }).contains("not NIfTI: magic is"));
}

#[test]
fn a_bomb_stays_shut() {
    let header = NiftiHeader { dim: [3, 1000, 1000, 1, 1, 1, 1, 1], ..NiftiHeader::new(2) };
    let small = gzip(&header.bytes());
    let fault = nifti::read(Cursor::new(small), "", &NoFiles, &options()).unwrap_err();
    assert!(matches!(fault, ReadError::TooFewCompressed { .. }), "{fault}");
    let long = gzip(&[NiftiHeader::new(2).bytes(), vec![0; 1 << 24]].concat());
    let opened = nifti::read(Cursor::new(long), "", &NoFiles, &options()).unwrap();
    assert!(matches!(opened.notes[..], [Note::SurplusData]));
}
