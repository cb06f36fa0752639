//! TIFF files as ImageJ writes them.

use brickfield_core::Voxels;
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_io::ByteOrder::Big;
use brickfield_io::{ChoiceKind, NoFiles, Note, OpenOptions, Opened, ReadError};

use crate::common::*;
use crate::tiff::read;
use crate::tiff_bytes::{PageBytes, Values, tiff, tiff_file};

/// Pages of 2 x 2 samples: the first has 0, the second 1 and so on.
fn pages(n: u8, description: &[u8]) -> Vec<PageBytes> {
    let page = |i| PageBytes::grey(2, 2, 8, vec![i; 4]);
    let mut pages: Vec<_> = (0..n).map(page).collect();
    pages[0] = page(0).with_text(description).with_resolution(2, 4);
    pages
}

/// The first voxel of each slice.
fn slices(opened: &Opened) -> Vec<u8> {
    let Voxels::U8(values) = opened.volume.voxels() else { panic!("u8") };
    values.iter().step_by(4).copied().collect()
}

fn read_with(file: Vec<u8>, choices: &[(ChoiceKind, &str)]) -> Result<Opened, ReadError> {
    let mut options: OpenOptions = options();
    choices.iter().for_each(|(kind, entry)| options.wanted.want(*kind, *entry));
    brickfield_io::tiff::read(std::io::Cursor::new(file), &NoFiles, &options)
}

#[test]
fn a_description_in_latin_1_is_read() {
    let description = b"ImageJ=1.53t\nimages=18\nchannels=2\nslices=9\nhyperstack=true\nunit=\xb5m\nspacing=2.0\n";
    let opened = read(tiff(&pages(18, description))).unwrap();
    assert_eq!(slices(&opened), [0, 2, 4, 6, 8, 10, 12, 14, 16]);
    assert_eq!(opened.volume.grid().spacing(), DVec3::new(0.5, 0.25, 2.0));
    assert_eq!(opened.unit.as_deref(), Some("\u{b5}m"));
}

#[test]
fn channels_and_times_are_chosen() {
    let file = || tiff(&pages(12, b"ImageJ=1.53t\nimages=12\nchannels=2\nslices=3\nframes=2\n"));
    let opened = read(file()).unwrap();
    assert_eq!(slices(&opened), [0, 2, 4]);
    let first = |kind| Note::OneOfSeveral { kind, read: "0".to_owned(), n_entries: 2 };
    assert_eq!(opened.notes, [first(ChoiceKind::Channel), first(ChoiceKind::Time)]);
    let opened = read_with(file(), &[(ChoiceKind::Channel, "1"), (ChoiceKind::Time, "1")]).unwrap();
    assert_eq!((slices(&opened), &opened.notes[..]), (vec![7, 9, 11], &[][..]));
    assert_eq!(opened.choices.iter().map(|c| (c.kind, c.read)).collect::<Vec<_>>().len(), 2);
    let refused = read_with(file(), &[(ChoiceKind::Time, "2")]).unwrap_err().to_string();
    assert_eq!(refused, "time is \"2\"; expected 0 to 1");
}

#[test]
fn each_axis_has_its_unit() {
    let description = b"ImageJ=1.53t\nimages=3\nslices=3\nspacing=0.002\nunit=micron\nzunit=mm\n";
    let opened = read(tiff(&pages(3, description))).unwrap();
    assert_eq!((opened.volume.grid().spacing(), opened.notes), (DVec3::new(0.5, 0.25, 2.0), vec![]));
    let opened = read(tiff(&pages(3, b"ImageJ=1.53t\nimages=3\nslices=3\nspacing=2\nunit=pixel\n"))).unwrap();
    assert_eq!(
        opened.notes[0].to_string(),
        "the unit \"pixel\" of lengths along x, y and z is not known; they are used as they are"
    );
}

/// A stack of one page whose planes follow it, behind its tags as ImageJ has them.
fn raw_stack(description: &str, n_stored: u16) -> Vec<u8> {
    let mut page = PageBytes::grey(3, 2, 16, vec![]).with_text(description);
    page.tags.insert(279, Values::Long(vec![12]));
    page.tags.insert(273, Values::Long(vec![0]));
    let start = tiff_file(std::slice::from_ref(&page), Big, 42).len() as u64;
    page.tags.insert(273, Values::Long(vec![start]));
    let planes = (0..n_stored).flat_map(plane).flat_map(u16::to_be_bytes);
    tiff_file(&[page], Big, 42).into_iter().chain(planes).collect()
}

fn plane(i: u16) -> impl Iterator<Item = u16> {
    (0..6).map(move |sample| i * 100 + sample)
}

#[test]
fn planes_follow_a_single_page() {
    let opened = read(raw_stack("ImageJ=1.53t\nimages=9\nslices=9\n", 9)).unwrap();
    assert_eq!((opened.volume.grid().dims(), &opened.notes[..]), (UVec3::new(3, 2, 9), &[][..]));
    assert_eq!(opened.volume.voxels(), &Voxels::U16((0..9).flat_map(plane).collect()));
}

#[test]
fn channels_of_planes_that_follow_a_single_page() {
    let file = raw_stack("ImageJ=1.53t\nimages=6\nchannels=2\nslices=3\n", 6);
    let opened = read_with(file, &[(ChoiceKind::Channel, "1")]).unwrap();
    assert_eq!(opened.volume.voxels(), &Voxels::U16([1, 3, 5].into_iter().flat_map(plane).collect()));
}

#[test]
fn planes_that_follow_a_page_of_other_software() {
    let expected = Voxels::U16((0..6).flat_map(plane).collect());
    let truncated = r#"{"shape": [2, 3, 2, 3], "truncated": true}"#;
    assert_eq!(read(raw_stack(truncated, 6)).unwrap().volume.voxels(), &expected);
    let whole = r#"{"shape": [2, 3], "truncated": false}"#;
    assert_eq!(read(raw_stack(whole, 6)).unwrap().volume.grid().dims(), UVec3::new(3, 2, 1));
    // MetaMorph has a tag with a value for each plane.
    let mut page = PageBytes::grey(3, 2, 16, (0..6).flat_map(plane).flat_map(u16::to_be_bytes).collect());
    page.tags.insert(279, Values::Long(vec![12]));
    page.tags.insert(33629, Values::Long(vec![0; 6]));
    assert_eq!(read(tiff_file(&[page.clone()], Big, 42)).unwrap().volume.voxels(), &expected);
    page.tags.insert(33629, Values::Long(vec![0; 70]));
    let refused = read(tiff_file(&[page], Big, 42)).unwrap_err().to_string();
    assert_eq!(refused, "number of pages is \"1\"; expected 70, from the description");
}

#[test]
fn a_single_page_without_its_planes_is_refused() {
    let refusal = |file| read(file).unwrap_err().to_string();
    let description = "ImageJ=1.53t\nimages=900\nslices=900\n";
    let file = raw_stack(description, 40);
    let (n, start) = (file.len() - 3, file.len() - 40 * 12);
    let expected = format!("the file ends at byte {n}, within plane 40 of 900, which goes on to byte {}", start + 480);
    assert_eq!(refusal(file[..n].to_vec()), expected);
    let alone = "number of pages is \"1\"; expected 900, from the description";
    assert_eq!(refusal(raw_stack(description, 1)), alone);
    let before_tags = PageBytes::grey(3, 2, 16, vec![0; 48]).with_text(description);
    assert_eq!(refusal(tiff_file(std::slice::from_ref(&before_tags), Big, 42)), alone);
    assert_eq!(refusal(tiff_file(&[before_tags.with(259, &[8])], Big, 42)), alone);
}

#[test]
fn a_palette_is_how_values_are_shown() {
    let palette: Vec<u16> = (0..768).collect();
    let mut pages = pages(2, b"ImageJ=1.53t\nimages=2\nslices=2\n");
    pages = pages.into_iter().map(|page| page.with(262, &[3]).with(320, &palette)).collect();
    let opened = read(tiff(&pages)).unwrap();
    assert_eq!(
        (slices(&opened), &opened.notes[..]),
        (vec![0, 1], &[Note::AsStored { shown: "through a palette" }][..])
    );
}

#[test]
fn a_length_along_one_axis_only_is_noted() {
    let opened = read(tiff(&pages(2, b"ImageJ=1.53t\nimages=2\nslices=2\nunit=um\n"))).unwrap();
    assert_eq!(opened.notes, [Note::SpacingAssumed { axis: 'z', reason: "is not stated" }]);
    let opened = read(tiff(&pages(2, b"ImageJ=1.53t\nimages=2\nslices=2\n"))).unwrap();
    assert_eq!(opened.notes, []);
}

/// A file for fuzzing.
pub(crate) fn example() -> Vec<u8> {
    raw_stack("ImageJ=1.53t\nimages=9\nslices=9\n", 9)
}
