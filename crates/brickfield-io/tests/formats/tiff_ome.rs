//! TIFF files with OME-XML: planes, units, images, channels, files, levels.

use std::collections::BTreeMap;
use std::io::Cursor;

use brickfield_core::Voxels;
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_io::{ChoiceKind, Note, OpenOptions, Opened, ReadError, tiff};

use crate::common::*;
use crate::tiff_bytes::{PageBytes, tiff as file};

fn ome(inside: &str) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?><OME xmlns=\"http://www.openmicroscopy.org/Schemas/OME/2016-06\" \
         UUID=\"urn:uuid:own\">{inside}</OME>"
    )
}

/// An image of planes of 2 x 2 samples.
fn image(pixels: &str, inside: &str) -> String {
    format!(
        "<Image ID=\"Image:0\"><Pixels DimensionOrder=\"XYCZT\" SizeX=\"2\" SizeY=\"2\" {pixels}>{inside}</Pixels></Image>"
    )
}

/// Pages of 2 x 2 samples, each of one value.
fn pages(values: impl IntoIterator<Item = u8>, description: &str) -> Vec<u8> {
    let mut pages: Vec<_> = values.into_iter().map(|i| PageBytes::grey(2, 2, 8, vec![i; 4])).collect();
    pages[0] = pages[0].clone().with_text(description);
    file(&pages)
}

fn read_with(
    bytes: Vec<u8>,
    files: &BTreeMap<String, Vec<u8>>,
    choices: &[(ChoiceKind, &str)],
) -> Result<Opened, ReadError> {
    let mut options: OpenOptions = options();
    choices.iter().for_each(|(kind, entry)| options.wanted.want(*kind, *entry));
    tiff::read(Cursor::new(bytes), files, &options)
}

fn read(bytes: Vec<u8>) -> Result<Opened, ReadError> {
    read_with(bytes, &BTreeMap::new(), &[])
}

/// The first voxel of each slice.
fn slices(opened: &Opened) -> Vec<u8> {
    let Voxels::U8(values) = opened.volume.voxels() else { panic!("u8") };
    values.iter().step_by(4).copied().collect()
}

#[test]
fn planes_are_where_tiff_data_says() {
    let reversed: String =
        (0..9).map(|z| format!("<TiffData FirstZ=\"{z}\" IFD=\"{}\" PlaneCount=\"1\"/>", 8 - z)).collect();
    let opened = read(pages(0..9, &ome(&image("SizeC=\"1\" SizeT=\"1\" SizeZ=\"9\"", &reversed)))).unwrap();
    assert_eq!((slices(&opened), &opened.notes[..]), (vec![8, 7, 6, 5, 4, 3, 2, 1, 0], &[][..]));
}

#[test]
fn interleaved_channels_are_told_apart() {
    // Stored slice by slice, channel 1 first, though the document's order is another.
    let plane = |page: u64| format!("<TiffData FirstC=\"{}\" FirstZ=\"{}\" IFD=\"{page}\"/>", 1 - page % 2, page / 2);
    let inside = format!("<Channel Name=\"DAPI\"/><Channel Name=\"GFP\"/>{}", (0..6).map(plane).collect::<String>());
    let bytes = || pages(0..6, &ome(&image("SizeC=\"2\" SizeZ=\"3\" SizeT=\"1\"", &inside)));
    let opened = read(bytes()).unwrap();
    assert_eq!(slices(&opened), [1, 3, 5]);
    assert_eq!(opened.notes[0].to_string(), "one of 2 channels was read: 0 (DAPI)");
    let opened = read_with(bytes(), &BTreeMap::new(), &[(ChoiceKind::Channel, "gfp")]).unwrap();
    assert_eq!((slices(&opened), &opened.notes[..]), (vec![0, 2, 4], &[][..]));
}

#[test]
fn times_are_chosen() {
    let bytes = || pages(0..6, &ome(&image("SizeC=\"1\" SizeZ=\"2\" SizeT=\"3\"", "<TiffData/>")));
    assert_eq!(slices(&read_with(bytes(), &BTreeMap::new(), &[(ChoiceKind::Time, "2")]).unwrap()), [4, 5]);
    assert_eq!(read(bytes()).unwrap().notes[0].to_string(), "one of 3 times was read: 0");
}

#[test]
fn each_axis_has_its_unit() {
    let sizes = "SizeZ=\"2\" PhysicalSizeX=\"0.25\" PhysicalSizeXUnit=\"\u{b5}m\" PhysicalSizeY=\"0.5\" PhysicalSizeYUnit=\"\u{b5}m\" \
                 PhysicalSizeZ=\"1e-5\" PhysicalSizeZUnit=\"dm\"";
    let opened = read(pages(0..2, &ome(&image(sizes, "")))).unwrap();
    assert_eq!((opened.volume.grid().spacing(), opened.unit.as_deref()), (DVec3::new(0.25, 0.5, 1.0), Some("\u{b5}m")));
    let sizes =
        "SizeZ=\"2\" PhysicalSizeX=\"2\" PhysicalSizeY=\"2\" PhysicalSizeZ=\"3\" PhysicalSizeZUnit=\"reference frame\"";
    let opened = read(pages(0..2, &ome(&image(sizes, "")))).unwrap();
    assert_eq!((opened.volume.grid().spacing(), opened.unit.as_deref()), (DVec3::new(2.0, 2.0, 3.0), Some("um")));
    let note = Note::UnknownUnit { axes: vec!['z'], unit: "reference frame".to_owned() };
    assert_eq!(opened.notes, [note]);
}

#[test]
fn one_of_several_images_is_read() {
    let named = |name: &str, page: u64, n: u64| {
        let data = format!("<TiffData IFD=\"{page}\" PlaneCount=\"{n}\"/>");
        image(&format!("SizeZ=\"{n}\""), &data).replace("<Image ", &format!("<Image Name=\"{name}\" "))
    };
    let bytes = || pages(0..5, &ome(&(named("overview", 0, 2) + &named("detail", 2, 3))));
    let opened = read(bytes()).unwrap();
    assert_eq!(slices(&opened), [0, 1]);
    assert_eq!(opened.notes[0].to_string(), "one of 2 images was read: 0 (overview)");
    assert_eq!(slices(&read_with(bytes(), &BTreeMap::new(), &[(ChoiceKind::Image, "detail")]).unwrap()), [2, 3, 4]);
}

/// Slice z in a file of its own, and the document that all of them share.
fn spread(n: u64) -> BTreeMap<String, Vec<u8>> {
    let data = |z: u64| {
        format!(
            "<TiffData FirstZ=\"{z}\" IFD=\"0\" PlaneCount=\"1\"><UUID FileName=\"z{z}.ome.tif\">urn:uuid:{z}</UUID></TiffData>"
        )
    };
    let document = ome(&image(&format!("SizeZ=\"{n}\""), &(0..n).map(data).collect::<String>()));
    let one = |z: u64| {
        let text = document.replace("urn:uuid:own", &format!("urn:uuid:{z}"));
        (format!("z{z}.ome.tif"), pages([z as u8], &text))
    };
    (0..n).map(one).collect()
}

#[test]
fn planes_lie_in_several_files() {
    let mut files = spread(3);
    for z in 0..3 {
        // The opened file itself is not asked for by its name: it may have been renamed.
        let own = files.remove(&format!("z{z}.ome.tif")).unwrap();
        assert_eq!(slices(&read_with(own.clone(), &files, &[]).unwrap()), [0, 1, 2]);
        files.insert(format!("z{z}.ome.tif"), own);
    }
    let own = files["z0.ome.tif"].clone();
    files.remove("z2.ome.tif");
    let refused = read_with(own.clone(), &files, &[]).unwrap_err().to_string();
    assert!(refused.contains("data file \"z2.ome.tif\""), "{refused}");
    files.insert("z2.ome.tif".to_owned(), file(&[PageBytes::grey(3, 2, 8, vec![0; 6])]));
    let refused = read_with(own.clone(), &files, &[]).unwrap_err().to_string();
    assert_eq!(
        refused,
        "file \"z2.ome.tif\": page is \"3 x 2 samples of u8 (page 1 of 1)\"; expected 2 x 2 samples of u8, as the first page"
    );
    files.insert("z2.ome.tif".to_owned(), vec![]);
    let refused = read_with(own, &files, &[]).unwrap_err().to_string();
    assert!(refused.starts_with("file \"z2.ome.tif\": the file is empty"), "{refused}");
}

#[test]
fn files_outside_the_folder_are_refused() {
    for name in ["../z1.ome.tif", "/etc/passwd", "a\\b.tif", ".."] {
        let data = format!("<TiffData/><TiffData FirstZ=\"1\"><UUID FileName=\"{name}\">urn:uuid:1</UUID></TiffData>");
        let refused = read(pages([0], &ome(&image("SizeZ=\"2\"", &data)))).unwrap_err().to_string();
        assert!(refused.ends_with("expected the name of a file in the same folder"), "{refused}");
    }
}

#[test]
fn a_file_that_was_renamed_is_its_own() {
    let data = "<TiffData IFD=\"0\" PlaneCount=\"2\"><UUID FileName=\"before.ome.tif\"/></TiffData>";
    assert_eq!(slices(&read(pages(0..2, &ome(&image("SizeZ=\"2\"", data)))).unwrap()), [0, 1]);
}

#[test]
fn the_document_lies_in_another_file() {
    let mut files = spread(3);
    let document = "<OME UUID=\"urn:uuid:1\"><BinaryOnly MetadataFile=\"z0.ome.tif\" UUID=\"urn:uuid:0\"/></OME>";
    let own = pages([1], &document.replace("UUID=\"urn:uuid:0\"", ""));
    files.remove("z1.ome.tif");
    assert_eq!(slices(&read_with(own.clone(), &files, &[]).unwrap()), [0, 1, 2]);
    let companion = ome(&image("SizeZ=\"1\"", "<TiffData><UUID FileName=\"x.ome.tif\">urn:uuid:1</UUID></TiffData>"));
    files.insert("z0.ome.tif".to_owned(), companion.into_bytes());
    assert_eq!(slices(&read_with(own.clone(), &files, &[]).unwrap()), [1]);
    let refused = read(own).unwrap_err().to_string();
    assert!(refused.contains("data file \"z0.ome.tif\""), "{refused}");
}

#[test]
fn planes_that_no_page_has_are_noted() {
    let data = "<TiffData IFD=\"0\" PlaneCount=\"1\"/><TiffData FirstZ=\"3\" IFD=\"1\" PlaneCount=\"1\"/>";
    let opened = read(pages([5, 6], &ome(&image("SizeZ=\"4\"", data)))).unwrap();
    assert_eq!(slices(&opened), [5, 0, 0, 6]);
    assert_eq!(opened.notes, [Note::MissingPlanes { n_missing: 2, n_planes: 4 }]);
    let refused = read(pages([5, 6], &ome(&image("SizeZ=\"4\"", "<TiffData/>")))).unwrap_err().to_string();
    assert_eq!(refused, "number of pages is \"2\"; expected 3 or more, from the description");
}

#[test]
fn levels_of_a_pyramid_are_chosen() {
    let level = |n: u16, value: u8| PageBytes::grey(n, n, 8, vec![value; usize::from(n * n)]);
    let page = |z: u8| PageBytes { levels: vec![level(4, 10 + z), level(2, 20 + z)], ..level(8, z) };
    let sizes = "SizeZ=\"2\" PhysicalSizeX=\"0.5\" PhysicalSizeY=\"0.5\" PhysicalSizeZ=\"3\"";
    let bytes = || file(&[page(0).with_text(ome(&image(sizes, "<TiffData/>"))), page(1)]);
    let opened = read(bytes()).unwrap();
    assert_eq!((opened.volume.grid().dims(), &opened.notes[..]), (UVec3::new(8, 8, 2), &[][..]));
    let opened = read_with(bytes(), &BTreeMap::new(), &[(ChoiceKind::Level, "2")]).unwrap();
    assert_eq!(opened.volume.voxels(), &Voxels::U8(vec![20, 20, 20, 20, 21, 21, 21, 21]));
    assert_eq!(opened.volume.grid().spacing(), DVec3::new(2.0, 2.0, 3.0));
    // The corner of the first voxel stays.
    assert_near(centre(&opened, -0.5, -0.5, -0.5), [0.0; 3]);
}

#[test]
fn colours_of_a_channel_are_no_channels() {
    let page = |i: u8| PageBytes::colours(2, 3, 2, 2, [i, 0, 0].repeat(4));
    let document = ome(&image("SizeC=\"3\" SizeZ=\"2\"", "<Channel SamplesPerPixel=\"3\"/><TiffData/>"));
    let bytes = || file(&[page(100).with_text(&document), page(200)]);
    let opened = read(bytes()).unwrap();
    assert_eq!((slices(&opened), &opened.notes[..]), (vec![21, 43], &[Note::Luminance][..]));
    let opened = read_with(bytes(), &BTreeMap::new(), &[(ChoiceKind::Channel, "red")]).unwrap();
    assert_eq!(slices(&opened), [100, 200]);
}

#[test]
fn xml_that_is_malformed_is_refused_on_one_line() {
    let document = ome(&image("SizeZ=\"1\"", ""));
    for n in document.find("<OME").unwrap() + 4..document.len() {
        if let Err(fault) = read(pages([0], &document[..n])) {
            assert!(!fault.to_string().contains('\n'), "{fault}");
        }
    }
    let refused = read(pages([0], &ome(&image("SizeZ=\"4000000000\"", "")))).unwrap_err().to_string();
    assert_eq!(refused, "number of planes is \"4000000000\"; expected at most 16777216");
}

/// Files for fuzzing: a file with most features, planes in several files, and a document in a file of its own.
pub(crate) fn examples() -> [BTreeMap<String, Vec<u8>>; 3] {
    let inside = "<Channel Name=\"DAPI\"/><Channel Name=\"GFP\"/><TiffData FirstC=\"1\" IFD=\"0\" PlaneCount=\"2\"/><TiffData IFD=\"2\"/>";
    let sizes = "SizeC=\"2\" SizeZ=\"2\" PhysicalSizeX=\"0.5\" PhysicalSizeXUnit=\"nm\" PhysicalSizeZ=\"3\"";
    let binary_only = "<OME><BinaryOnly MetadataFile=\"b.companion.ome\" UUID=\"urn:uuid:own\"/></OME>";
    let data = "<TiffData FirstZ=\"1\" PlaneCount=\"1\"><UUID FileName=\"a.ome.tif\">urn:uuid:own</UUID></TiffData>";
    let apart = [
        ("a.ome.tif", pages(0..4, binary_only)),
        ("b.companion.ome", ome(&image(sizes, &format!("{inside}{data}"))).into_bytes()),
    ];
    [files([("", pages(0..4, &ome(&image(sizes, inside))))]), spread(3), files(apart)]
}
