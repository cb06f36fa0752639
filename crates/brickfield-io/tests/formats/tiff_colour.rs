//! TIFF pages of several samples a pixel, and palettes.

use std::io::Cursor;

use brickfield_core::Voxels;
use brickfield_io::{ChoiceKind, NoFiles, Note, OpenOptions, Opened, ReadError};

use crate::common::*;
use crate::tiff_bytes::{PageBytes, tiff};

fn read(pages: &[PageBytes], channel: Option<&str>) -> Result<Opened, ReadError> {
    let mut options: OpenOptions = options();
    channel.into_iter().for_each(|entry| options.wanted.want(ChoiceKind::Channel, entry));
    brickfield_io::tiff::read(Cursor::new(tiff(pages)), &NoFiles, &options)
}

#[track_caller]
fn check(page: PageBytes, channel: Option<&str>, expected: &[u8], notes: &[Note]) {
    let opened = read(&[page], channel).unwrap();
    assert_eq!(opened.volume.voxels(), &Voxels::U8(expected.to_vec()));
    assert_eq!(opened.notes, notes);
}

/// Two pixels: 10, 20, 30 and grey 7.
fn rgb() -> PageBytes {
    PageBytes::colours(2, 3, 2, 1, vec![10, 20, 30, 7, 7, 7])
}

#[test]
fn colours_are_read_as_luminance_or_one_of_them() {
    check(rgb(), None, &[19, 7], &[Note::Luminance]);
    check(rgb(), Some("green"), &[20, 7], &[]);
    check(rgb(), Some("2"), &[30, 7], &[]);
    let rgba = || PageBytes::colours(2, 4, 2, 1, vec![10, 20, 30, 255, 7, 7, 7, 128]).with(338, &[2]);
    check(rgba(), None, &[19, 7], &[Note::Luminance]);
    check(rgba(), Some("alpha"), &[255, 128], &[]);
    let refused = read(&[rgb()], Some("alpha")).unwrap_err().to_string();
    assert_eq!(refused, "channel is \"alpha\"; expected 0 to 3, or one of \"red\", \"green\", \"blue\", \"luminance\"");
}

#[test]
fn each_colour_lies_in_strips_of_its_own() {
    let planar = || PageBytes {
        chunks: vec![vec![10, 7], vec![20, 7], vec![30, 7]],
        ..PageBytes::colours(2, 3, 2, 1, vec![]).with(284, &[2])
    };
    check(planar(), None, &[19, 7], &[Note::Luminance]);
    check(planar(), Some("blue"), &[30, 7], &[]);
}

#[test]
fn colours_are_differenced_from_those_of_the_pixel_before() {
    let page = PageBytes::colours(2, 3, 2, 1, vec![10, 20, 30, 1, 2, 3]).with(317, &[2]).packed(8, zlib);
    check(page, Some("blue"), &[30, 33], &[]);
}

#[test]
fn colours_of_sixteen_bits_in_tiles() {
    let samples: Vec<u8> = (0..3 * 17 * 2u16).flat_map(|i| (i * 100).to_le_bytes()).collect();
    let page = PageBytes::grey(17, 2, 16, samples).tiled([17, 2, 1], [16, 16, 1], 6);
    let page = page.with(258, &[16; 3]).with(262, &[2]).with(277, &[3]);
    let opened = read(&[page], Some("green")).unwrap();
    assert_eq!(opened.volume.voxels(), &Voxels::U16((0..34).map(|i| 100 * (3 * i + 1)).collect()));
}

#[test]
fn a_palette_is_looked_up_unless_the_number_is_wanted() {
    // Colour i is (i, 2 i, 3 i), in the upper 8 of 16 bits.
    let palette: Vec<u16> = (1..=3).flat_map(|factor| (0..16).map(move |i| (factor * i) << 8)).collect();
    let page = || PageBytes::grey(2, 1, 4, vec![0x5f]).with(262, &[3]).with(320, &palette);
    // 0.2126 * 5 + 0.7152 * 10 + 0.0722 * 15 = 9.298.
    check(page(), None, &[9, 28], &[Note::Luminance]);
    check(page(), Some("blue"), &[15, 45], &[]);
    check(page(), Some("index"), &[5, 15], &[]);
    let short: Vec<u16> = vec![0; 30];
    let refused = read(&[page().with(320, &short)], None).unwrap_err().to_string();
    assert_eq!(refused, "colour number of page 1 of 1 is \"15\"; expected below 10, as the palette has");
}

#[test]
fn samples_that_are_no_colours_are_channels() {
    let five = || PageBytes::colours(1, 5, 2, 1, (0..10).collect());
    check(five(), Some("3"), &[3, 8], &[]);
    let first =
        |read: &str, n_entries| Note::OneOfSeveral { kind: ChoiceKind::Channel, read: read.to_owned(), n_entries };
    check(five(), None, &[0, 5], &[first("0", 5)]);
    let grey = PageBytes::colours(1, 2, 2, 1, vec![7, 255, 8, 255]).with(338, &[1]);
    check(grey, None, &[7, 8], &[first("0 (grey)", 2)]);
    let inks = PageBytes::colours(5, 4, 1, 1, vec![1, 2, 3, 4]);
    check(inks, Some("black"), &[4], &[]);
}

#[test]
fn colours_are_within_the_limits() {
    // A volume of 1 MiB - 1 voxels, from pages of three times as many bytes.
    let page = PageBytes::colours(2, 3, 1023, 1025, vec![0; 3 * 1023 * 1025]);
    let refused = read(&[page], None).unwrap_err().to_string();
    assert_eq!(refused, "a page of 1023 x 1025 samples of u8 RGB would take 3145725 bytes; the limit is 1048576 bytes");
}
