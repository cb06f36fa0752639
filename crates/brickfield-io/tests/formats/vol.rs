//! VOL of VisTools: scalars and colours, z fastest.

use std::io::Cursor;

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Grid, Rescale, Volume, Voxels};
use brickfield_io::{ChoiceKind, Note, OpenOptions, Opened, ReadError, SaveNote, SaveOptions, open, save, vol};

use crate::common::selecting;

fn file(magic: &[u8], dims: [u32; 3], data: &[u8]) -> Vec<u8> {
    [magic, &dims.map(u32::to_be_bytes).concat(), data].concat()
}

/// A file of each kind.
pub(crate) fn examples() -> Vec<Vec<u8>> {
    let of = |magic: &[u8], n_bytes: usize| file(magic, [2, 1, 1], &vec![7; 2 * n_bytes]);
    vec![of(b"VOLS\n", 1), of(b"VOLB\n", 4), of(b"VOLC\n", 8), of(b"#VOLC\n", 8)]
}

fn read(bytes: &[u8]) -> Result<Opened, ReadError> {
    vol::read(Cursor::new(bytes), &OpenOptions::default())
}

#[test]
fn z_is_fastest() {
    // The value is 100 x + 10 y + z.
    let value = |x: u8, y: u8, z: u8| 100 * x + 10 * y + z;
    let data: Vec<u8> = (0..2).flat_map(|x| (0..3).flat_map(move |y| (0..4).map(move |z| value(x, y, z)))).collect();
    let opened = read(&file(b"VOLS\n", [2, 3, 4], &data)).unwrap();
    let expected: Vec<u8> =
        (0..4).flat_map(|z| (0..3).flat_map(move |y| (0..2).map(move |x| value(x, y, z)))).collect();
    assert_eq!(opened.volume.grid().dims(), UVec3::new(2, 3, 4));
    assert_eq!(*opened.volume.voxels(), Voxels::U8(expected));
    let assumed = ['x', 'y', 'z'].map(|axis| Note::SpacingAssumed { axis, reason: "is not stated in this format" });
    assert_eq!(opened.notes, assumed);
}

#[test]
fn colours_are_luminances_or_the_channel_that_is_wanted() {
    let of = |bytes: &[u8], wanted: Option<&str>| {
        let options = selecting(ChoiceKind::Channel, wanted);
        vol::read(Cursor::new(bytes), &options).unwrap()
    };
    let rgba = file(b"VOLB\n", [1, 1, 2], &[10, 20, 30, 255, 7, 7, 7, 0]);
    assert_eq!(*of(&rgba, None).volume.voxels(), Voxels::U8(vec![19, 7]));
    assert!(of(&rgba, None).notes.contains(&Note::Luminance));
    assert_eq!(*of(&rgba, Some("alpha")).volume.voxels(), Voxels::U8(vec![255, 0]));
    // Red 1023 of 1023, green 2048 of 4095, blue 0 of 1023; alpha 258, beta 772.
    let colours = (1023u32 << 22 | 2048 << 10).to_be_bytes();
    for magic in [&b"VOLC\n"[..], b"#VOLC\n"] {
        let bytes = file(magic, [1, 1, 1], &[&colours[..], &[1, 2, 3, 4]].concat());
        let values = ["red", "green", "blue", "alpha", "beta"].map(|name| of(&bytes, Some(name)).volume.value(0));
        assert_eq!(values, [65_535.0, 32_776.0, 0.0, 258.0, 772.0]);
        // 0.2126 of 65535 and 0.7152 of 32776.
        assert_eq!(of(&bytes, None).volume.value(0), 37_374.0);
    }
}

#[test]
fn another_version_and_a_wrong_length_are_named() {
    let refusal = |bytes: &[u8]| read(bytes).unwrap_err().to_string();
    let whole = file(b"VOLS\n", [4, 3, 2], &[5; 24]);
    assert_eq!(refusal(&whole[..whole.len() - 1]), "the image holds 23 bytes; 24 are promised");
    assert_eq!(refusal(&whole[..10]), "the header holds 5 bytes; 12 are promised");
    let longer = [&whole[..], b"x"].concat();
    assert_eq!(
        refusal(&longer),
        "version \"that has 1 bytes after its voxels\" is not supported; 1, which ends with them, is; 2, which names its axes, is not"
    );
    assert!(refusal(b"VOLB V2\n").starts_with("version \"VOLB V2\" is not supported"));
    assert!(refusal(&file(b"VOLS\n", [4, 0, 2], &[])).contains("dimension y"));
}

#[test]
fn eight_bits_are_saved_and_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.vol");
    let dims = UVec3::new(3, 5, 7);
    let grid = Grid::axis_aligned(dims, DVec3::new(1.0, 2.0, 3.0)).unwrap();
    let voxels: Vec<u8> = (0..105).map(|i| (i * 7 % 256) as u8).collect();
    let volume = Volume::new(grid, voxels.clone()).unwrap();
    let saved = save(&path, &volume, &SaveOptions::default()).unwrap();
    assert!(matches!(saved.notes[..], [SaveNote::PlacementLost { .. }]), "{:?}", saved.notes);
    let opened = open(&path, &OpenOptions::default()).unwrap();
    assert_eq!((opened.volume.grid().dims(), opened.volume.voxels()), (dims, &Voxels::U8(voxels.clone())));
    let wide = Volume::new(*volume.grid(), voxels.iter().map(|v| u16::from(*v)).collect::<Vec<_>>()).unwrap();
    let said = save(&folder.path().join("b.vol"), &wide, &SaveOptions::default()).unwrap_err().to_string();
    assert!(said.ends_with("VOL holds values of u8; these are u16"), "{said}");
    let sloped = Volume::rescaled(*volume.grid(), voxels, Rescale::new(2.0, 0.0).unwrap()).unwrap();
    let said = save(&folder.path().join("b.vol"), &sloped, &SaveOptions::default()).unwrap_err().to_string();
    assert!(said.ends_with("u8 with slope 2 and intercept 0") && !folder.path().join("b.vol").exists(), "{said}");
}
