use std::io::Cursor;

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Grid, ScalarType, Volume};
use brickfield_io::{RawSpec, open_raw, raw};

use crate::common::{DIMS, ORDERS, assert_near, assert_ramp, bytes, centre, options, ramp};

#[test]
fn every_type_in_both_orders_after_a_header() {
    for scalar in ScalarType::ALL {
        for order in ORDERS {
            let spec =
                RawSpec { order, skip_bytes: 7, spacing: DVec3::new(1.0, 2.0, 3.0), ..RawSpec::new(DIMS, scalar) };
            let file = [b"7 bytes".to_vec(), bytes(&ramp(scalar), order)].concat();
            let opened = raw::read(Cursor::new(file), &spec, &options()).unwrap();
            assert_ramp(&opened, scalar);
            assert_near(centre(&opened, 1.0, 1.0, 1.0), [1.5, 3.0, 4.5]);
        }
    }
}

#[test]
fn what_is_saved_is_read_back_and_nothing_else_is_left() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ramp.raw");
    let volume = Volume::new(Grid::axis_aligned(DIMS, DVec3::ONE).unwrap(), ramp(ScalarType::I16)).unwrap();
    for order in ORDERS {
        raw::save(&path, &volume, order).unwrap();
        let spec = RawSpec { order, ..RawSpec::new(DIMS, ScalarType::I16) };
        assert_eq!(open_raw(&path, &spec, &options()).unwrap().volume, volume);
    }
    assert_eq!(folder.path().read_dir().unwrap().count(), 1);
}

#[test]
fn a_file_that_begins_like_a_known_format_is_noted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("v.raw");
    let notes = |start: &[u8]| {
        std::fs::write(&path, [start, &[0; 400]].concat()).unwrap();
        let spec = RawSpec::new(UVec3::new(1, 1, start.len() as u32 + 400), ScalarType::U8);
        let opened = open_raw(&path, &spec, &options()).unwrap();
        opened.notes.iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    let begins = [
        (&b"NRRD0004\n"[..], "NRRD"),
        (b"NDims = 3\n", "MetaImage"),
        (b"\x5c\x01\0\0", "NIfTI"),
        (b"<?xml version=\"1.0\"?><VTKFile>", "VTK XML ImageData"),
        (b"II*\0", "TIFF"),
        (b"\x89HDF", "HDF5"),
    ];
    for (start, name) in begins {
        assert_eq!(notes(start), [format!("the file begins like {name}; it is read as raw voxels, as asked")]);
    }
    assert_eq!(notes(&[[0; 128].as_slice(), b"DICM"].concat()).len(), 1);
    assert_eq!(notes(b"voxels"), [] as [&str; 0]);
    #[cfg(feature = "gzip")]
    assert_eq!(notes(&crate::common::gzip(b"\x5c\x01\0\0")).len(), 1);
}

#[test]
fn a_shape_beyond_the_file_or_the_limit_is_refused() {
    let refusal = |spec: RawSpec| raw::read(Cursor::new([0; 24]), &spec, &options()).unwrap_err().to_string();
    let spec = RawSpec::new(DIMS, ScalarType::U16);
    assert_eq!(refusal(spec), "the file holds 24 bytes; 48 are promised");
    assert!(refusal(RawSpec { skip_bytes: 25, ..spec }).contains("at most the 24 bytes"));
    assert!(refusal(RawSpec { dims: UVec3::splat(u32::MAX), ..spec }).contains("the limit is 1048576 bytes"));
    assert!(refusal(RawSpec { dims: UVec3::new(4, 0, 1), ..spec }).contains("dimension y is \"0\""));
    assert!(refusal(RawSpec { spacing: DVec3::ZERO, ..RawSpec::new(DIMS, ScalarType::U8) }).contains("spacing x is 0"));
}
