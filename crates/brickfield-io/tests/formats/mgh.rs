use std::io::Cursor;

use brickfield_core::ScalarType;
use brickfield_core::glam::DVec3;
use brickfield_io::{ByteOrder, ChoiceKind, Note, Opened, ReadError, WorldFrame, mgh};

use crate::common::*;

/// The fields of a header that these tests set.
#[derive(Clone)]
pub(crate) struct MghHeader {
    version: i32,
    sizes: [i32; 4],
    code: i32,
    is_oriented: i16,
    spacing: [f32; 3],
    directions: [f32; 9],
    centre: [f32; 3],
}

impl MghHeader {
    pub(crate) fn new(code: i32) -> MghHeader {
        MghHeader {
            version: 1,
            sizes: [4, 3, 2, 1],
            code,
            is_oriented: 1,
            spacing: [2.0, 3.0, 4.0],
            directions: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            centre: [10.0, 20.0, 30.0],
        }
    }

    pub(crate) fn bytes(&self) -> Vec<u8> {
        let integers = [self.version].into_iter().chain(self.sizes).chain([self.code, 0]).flat_map(i32::to_be_bytes);
        let floats = self.spacing.into_iter().chain(self.directions).chain(self.centre).flat_map(f32::to_be_bytes);
        let mut out: Vec<u8> = integers.chain(self.is_oriented.to_be_bytes()).chain(floats).collect();
        out.resize(284, 0);
        out
    }
}

/// Seeds for the fuzz target.
pub(crate) fn examples() -> Vec<Vec<u8>> {
    let plain = [MghHeader { sizes: [4, 3, 2, 2], ..MghHeader::new(4) }.bytes(), vec![1; 96]].concat();
    let unoriented = [MghHeader { is_oriented: 0, ..MghHeader::new(0) }.bytes(), vec![1; 24]].concat();
    vec![gzip(&plain), plain, unoriented]
}

fn read(header: &MghHeader, data: &[u8]) -> Result<Opened, ReadError> {
    mgh::read(Cursor::new([header.bytes(), data.to_vec()].concat()), &options())
}

#[test]
fn every_type_plain_and_gzipped_with_a_footer() {
    let types = [ScalarType::U8, ScalarType::I32, ScalarType::F32, ScalarType::I16, ScalarType::U16];
    for (scalar, code) in types.into_iter().zip([0, 1, 3, 4, 10]) {
        let data = bytes(&ramp(scalar), ByteOrder::Big);
        for footer in [0, 20, 500] {
            let file = [MghHeader::new(code).bytes(), data.clone(), vec![7; footer]].concat();
            for file in [gzip(&file), file] {
                let opened = mgh::read(Cursor::new(file), &options()).unwrap();
                assert_ramp(&opened, scalar);
                assert!(opened.notes.is_empty());
            }
        }
    }
}

#[test]
fn directions_and_centre_become_left_posterior_superior() {
    let opened = read(&MghHeader::new(0), &[0; 24]).unwrap();
    assert_eq!((opened.frame, opened.unit.as_deref()), (WorldFrame::Lps, Some("mm")));
    assert_eq!(opened.volume.grid().spacing(), DVec3::new(2.0, 3.0, 4.0));
    // The voxel of index (2, 1.5, 1) lies at the centre.
    assert_near(centre(&opened, 2.0, 1.5, 1.0), [-10.0, -20.0, 30.0]);
    assert_near(centre(&opened, 3.0, 2.5, 2.0), [-12.0, -23.0, 34.0]);
    // Coronal, as FreeSurfer conforms volumes: x to the left, y down, z to the front.
    let coronal = MghHeader { directions: [-1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0], ..MghHeader::new(0) };
    let opened = read(&coronal, &[0; 24]).unwrap();
    assert_near(centre(&opened, 3.0, 2.5, 2.0), [-8.0, -24.0, 27.0]);
    let unstated = read(&MghHeader { is_oriented: 0, ..MghHeader::new(0) }, &[0; 24]).unwrap();
    assert_near(centre(&unstated, 3.0, 2.5, 2.0), [1.0, -1.0, -1.0]);
    assert!(matches!(unstated.notes[..], [Note::SpacingAssumed { axis: 'x', .. }, _, _]));
}

#[test]
fn of_several_frames_one_is_read() {
    let header = MghHeader { sizes: [4, 3, 2, 3], ..MghHeader::new(0) };
    let file = [header.bytes(), (0..72).collect(), vec![9; 20]].concat();
    let read = |wanted| mgh::read(Cursor::new(&file), &selecting(ChoiceKind::Time, wanted)).unwrap();
    let first = read(None);
    assert_eq!(first.notes, [Note::OneOfSeveral { kind: ChoiceKind::Time, read: "0".to_owned(), n_entries: 3 }]);
    assert_eq!(first.volume.voxels().at(23), 23.0);
    assert_eq!(read(Some("2")).volume.voxels().at(0), 48.0);
}

#[test]
fn headers_that_lie() {
    let refusal = |header: MghHeader| read(&header, &[0; 23]).unwrap_err().to_string();
    let good = || MghHeader::new(0);
    assert_eq!(refusal(good()), "the image holds 23 bytes; 24 are promised");
    assert!(refusal(MghHeader { version: 2, ..good() }).contains("expected 1, the version"));
    assert_eq!(refusal(MghHeader { sizes: [4, 0, 2, 1], ..good() }), "height is \"0\"; expected 1 to 2147483647");
    assert!(refusal(MghHeader { sizes: [1, 1, 1, i32::MAX], ..good() }).contains("2147483647 are promised"));
    assert!(refusal(MghHeader { sizes: [i32::MAX; 4], ..good() }).contains("the limit is"));
    assert!(refusal(MghHeader { centre: [f32::NAN; 3], ..good() }).contains("is not finite"));
    assert!(!refusal(MghHeader { directions: [0.0; 9], ..good() }).is_empty());
}
