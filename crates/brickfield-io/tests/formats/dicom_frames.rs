//! Several frames in a file, and several values at a position.

use brickfield_core::ScalarType;
use brickfield_core::glam::DVec3;
use brickfield_io::{ChoiceKind, Note};

use crate::common::{assert_near, centre};
use crate::dicom_file::{EXPLICIT, Elements, GREY_16, Shape, read_all, read_one, values};

fn plane(z: f64) -> Elements {
    let position = Elements::default().text((0x20, 0x32), b"DS", &format!("0\\0\\{z}"));
    Elements::default().items((0x20, 0x9113), &[position])
}

fn rescaled(elements: Elements, slope: &str, intercept: &str) -> Elements {
    let item = Elements::default().text((0x28, 0x1052), b"DS", intercept).text((0x28, 0x1053), b"DS", slope);
    elements.items((0x28, 0x9145), &[item])
}

/// Orientation, spacing and rescale of all frames.
fn shared() -> Elements {
    let orientation = Elements::default().text((0x20, 0x37), b"DS", "1\\0\\0\\0\\1\\0");
    let measures = Elements::default().text((0x18, 0x50), b"DS", "9").text((0x28, 0x30), b"DS", "0.5\\0.25");
    rescaled(Elements::default().items((0x20, 0x9116), &[orientation]).items((0x28, 0x9110), &[measures]), "2", "-1")
}

fn enhanced(frames: &[Elements]) -> Elements {
    Elements::default()
        .series("1.2.3")
        .shape(GREY_16, frames.len())
        .items((0x5200, 0x9229), &[shared()])
        .items((0x5200, 0x9230), frames)
}

/// Two voxels for each frame: 10, 10, 20, 20, ...
fn counted(n_frames: u16) -> Vec<u16> {
    (1..=n_frames).flat_map(|i| [10 * i, 10 * i]).collect()
}

#[test]
fn frames_have_their_own_position_and_rescale() {
    let frames = [plane(4.0), rescaled(plane(0.0), "3", "0"), plane(2.0)];
    let opened = read_one(enhanced(&frames).words(&counted(3)).file(EXPLICIT)).unwrap();
    assert_eq!(values(&opened), [60.0, 60.0, 59.0, 59.0, 19.0, 19.0]);
    assert_eq!(opened.volume.grid().spacing(), DVec3::new(0.25, 0.5, 2.0));
    assert_near(centre(&opened, 0.0, 0.0, 2.0), [0.0, 0.0, 4.0]);
    assert!(opened.notes.is_empty(), "{:?}", opened.notes);
}

#[test]
fn frames_at_the_same_positions_are_times() {
    let at = |z: f64, position: u32, time: u32| {
        let values: Vec<u8> = [position, time].iter().flat_map(|v| v.to_le_bytes()).collect();
        let content = Elements::default().bytes((0x20, 0x9157), b"UL", &values);
        Elements::default().items((0x20, 0x9111), &[content]).and(plane(z))
    };
    let pointer = |element: u16| {
        let tag: Vec<u8> = [0x20u16, element].iter().flat_map(|v| v.to_le_bytes()).collect();
        Elements::default().bytes((0x20, 0x9165), b"AT", &tag)
    };
    let frames = [at(0.0, 1, 2), at(0.0, 1, 1), at(1.0, 2, 1), at(1.0, 2, 2)];
    let with_dimensions = |elements: Elements| {
        let dimensions = Elements::default().items((0x20, 0x9222), &[pointer(0x9057), pointer(0x9128)]);
        dimensions.and(elements)
    };
    let file = with_dimensions(enhanced(&frames)).words(&counted(4)).file(EXPLICIT);
    let opened = read_one(file.clone()).unwrap();
    assert_eq!(values(&opened), [39.0, 39.0, 59.0, 59.0]);
    assert_eq!(opened.notes, [Note::OneOfSeveral { kind: ChoiceKind::Time, read: "0".to_owned(), n_entries: 2 }]);
    let second = read_all(vec![file], &[(ChoiceKind::Time, "1")]).unwrap();
    assert_eq!(values(&second), [19.0, 19.0, 79.0, 79.0]);
    // Without dimensions the order of the frames tells the times apart.
    let opened = read_one(enhanced(&frames.map(|f| f.clone())).words(&counted(4)).file(EXPLICIT)).unwrap();
    assert_eq!(values(&opened), [19.0, 19.0, 59.0, 59.0]);
}

#[test]
fn files_at_the_same_positions_are_times() {
    let file = |z: f64, number: u16| {
        let elements = Elements::default().series("1.2.3").text((0x20, 0x13), b"IS", &number.to_string());
        elements.placed([0.0, 0.0, z]).shape(GREY_16, 1).words(&[number, number]).file(EXPLICIT)
    };
    let files = || vec![file(1.0, 4), file(0.0, 1), file(0.0, 3), file(1.0, 2)];
    assert_eq!(values(&read_all(files(), &[]).unwrap()), [1.0, 1.0, 2.0, 2.0]);
    assert_eq!(values(&read_all(files(), &[(ChoiceKind::Time, "1")]).unwrap()), [3.0, 3.0, 4.0, 4.0]);
}

#[test]
fn segments_are_arrays_of_bits() {
    let at = |z: f64, segment: u16| {
        let item = Elements::default().shorts((0x62, 0xb), &[segment]);
        plane(z).items((0x62, 0xa), &[item])
    };
    let bits = Shape { columns: 3, n_bits: 1, ..GREY_16 };
    let frames = [at(0.0, 1), at(1.0, 1), at(1.0, 2)];
    let elements = Elements::default().series("1.2.3").shape(bits, 3);
    let orientation = Elements::default().text((0x20, 0x37), b"DS", "1\\0\\0\\0\\1\\0");
    let shared = Elements::default().items((0x20, 0x9116), &[orientation]);
    let elements = elements.items((0x5200, 0x9229), &[shared]).items((0x5200, 0x9230), &frames);
    // Frames follow each other without padding: 101 110 011, the first bit the lowest.
    let file = elements.bytes((0x7fe0, 0x10), b"OB", &[0b1001_1101, 0b1]).file(EXPLICIT);
    let opened = read_one(file.clone()).unwrap();
    assert_eq!(values(&opened), [1.0, 0.0, 1.0, 1.0, 1.0, 0.0]);
    assert_eq!(opened.choices[0].names, ["1", "2"]);
    let second = read_all(vec![file], &[(ChoiceKind::Array, "2")]).unwrap();
    assert_eq!((values(&second), second.volume.scalar_type()), (vec![0.0, 1.0, 1.0], ScalarType::U8));
    assert_near(centre(&second, 0.0, 0.0, 0.0), [0.0, 0.0, 1.0]);
}

#[test]
fn a_dose_grid_has_offsets_and_a_factor() {
    let file = |offsets: &str, orientation: &str| {
        let elements = Elements::default().series("1.2.3").text((0x20, 0x32), b"DS", "0\\0\\5");
        let elements = elements.text((0x20, 0x37), b"DS", orientation).shape(GREY_16, 3);
        let elements = elements.text((0x3004, 0xc), b"DS", offsets).text((0x3004, 0xe), b"DS", "0.5");
        elements.words(&[1, 1, 2, 2, 3, 3]).file(EXPLICIT)
    };
    let opened = read_one(file("0\\3\\6", "1\\0\\0\\0\\1\\0")).unwrap();
    assert_eq!(values(&opened), [0.5, 0.5, 1.0, 1.0, 1.5, 1.5]);
    assert_near(centre(&opened, 0.0, 0.0, 2.0), [0.0, 0.0, 11.0]);
    // Offsets that do not begin with 0 are positions along the patient's z, here against the normal.
    let opened = read_one(file("5\\8\\11", "1\\0\\0\\0\\-1\\0")).unwrap();
    assert_eq!(values(&opened)[..2], [1.5, 1.5]);
    assert_near(centre(&opened, 0.0, 0.0, 0.0), [0.0, 0.0, 11.0]);
    assert_near(centre(&opened, 0.0, 0.0, 2.0), [0.0, 0.0, 5.0]);
}

#[test]
fn frames_without_positions_follow_at_the_stated_step() {
    let elements = Elements::default().series("1.2.3").text((0x18, 0x88), b"DS", "2.5");
    let file = elements.placed([0.0, 0.0, 1.0]).shape(GREY_16, 3).words(&counted(3)).file(EXPLICIT);
    let opened = read_one(file).unwrap();
    assert_near(centre(&opened, 0.0, 0.0, 2.0), [0.0, 0.0, 6.0]);
    assert_eq!(opened.notes, [Note::StepStated { from: "SpacingBetweenSlices", step: 2.5 }]);
    let file = Elements::default().series("1.2.3").placed([0.0; 3]).shape(GREY_16, 2).words(&counted(2)).file(EXPLICIT);
    let opened = read_one(file).unwrap();
    assert!(opened.notes.contains(&Note::SpacingAssumed { axis: 'z', reason: "is not stated" }));
}

#[test]
fn more_frames_than_the_file_holds_are_refused() {
    let file = Elements::default().series("1.2.3").shape(GREY_16, 1_000_000).words(&[1, 2]).file(EXPLICIT);
    let fault = read_one(file).unwrap_err().to_string();
    assert_eq!(fault, "slice \"00\": PixelData holds 4 bytes; 4000000 are promised");
    let file = Elements::default().series("1.2.3").shape(GREY_16, 90_000_000).words(&[1, 2]).file(EXPLICIT);
    let fault = read_one(file).unwrap_err().to_string();
    assert_eq!(fault, "slice \"00\": NumberOfFrames is \"90000000\"; expected 1 to 1048576");
}

/// A Siemens CSA header of version 2.
fn csa(normal: [&str; 3], n_slices: &str) -> Vec<u8> {
    let tag = |name: &str, values: &[&str]| {
        let mut out = name.as_bytes().to_vec();
        out.resize(64, 0);
        out.extend(1u32.to_le_bytes());
        out.extend(b"FD\0\0");
        out.extend([0u32, values.len() as u32, 77].iter().flat_map(|v| v.to_le_bytes()));
        for value in values {
            let length = value.len() as u32;
            out.extend([length, length, 77, length].iter().flat_map(|v| v.to_le_bytes()));
            out.extend(value.as_bytes());
            out.resize(out.len().next_multiple_of(4), 0);
        }
        out
    };
    let head = [&b"SV10\x04\x03\x02\x01"[..], &3u32.to_le_bytes(), &77u32.to_le_bytes()].concat();
    let tags =
        [tag("Unused", &["7", ""]), tag("NumberOfImagesInMosaic", &[n_slices]), tag("SliceNormalVector", &normal)];
    [head, tags.concat()].concat()
}

fn mosaic(header: Option<Vec<u8>>) -> Vec<u8> {
    let shape = Shape { columns: 4, rows: 2, ..GREY_16 };
    let mut elements = Elements::default().text((8, 8), b"CS", "ORIGINAL\\PRIMARY\\M\\MOSAIC").series("1.2.3");
    elements = elements.text((0x18, 0x88), b"DS", "3").placed([0.0; 3]).shape(shape, 1);
    if let Some(header) = header {
        elements = elements.bytes((0x29, 0x1010), b"OB", &header);
    }
    elements.words(&[1, 1, 2, 2, 3, 3, 0, 0]).file(EXPLICIT)
}

#[test]
fn the_tiles_of_a_mosaic_are_slices() {
    let opened = read_one(mosaic(Some(csa(["0", "0", "1"], "3")))).unwrap();
    assert_eq!(opened.volume.grid().dims().to_array(), [2, 1, 3]);
    assert_eq!(values(&opened), [1.0, 1.0, 2.0, 2.0, 3.0, 3.0]);
    // The stated position is that of a slice of 4 x 2 around the same centre: 1 column and half a row further.
    assert_near(centre(&opened, 0.0, 0.0, 0.0), [1.0, 0.5, 0.0]);
    assert_near(centre(&opened, 0.0, 0.0, 2.0), [1.0, 0.5, 6.0]);
    let opened = read_one(mosaic(Some(csa(["0", "0", "-1"], "3")))).unwrap();
    assert_eq!(values(&opened), [3.0, 3.0, 2.0, 2.0, 1.0, 1.0]);
    assert_near(centre(&opened, 0.0, 0.0, 0.0), [1.0, 0.5, -6.0]);
}

#[test]
fn a_mosaic_that_does_not_say_how_it_is_laid_out_is_refused_by_name() {
    let fault = read_one(mosaic(None)).unwrap_err().to_string();
    assert!(fault.contains("NumberOfImagesInMosaic of a Siemens mosaic is missing"), "{fault}");
    let fault = read_one(mosaic(Some(csa(["0", "0", "1"], "7")))).unwrap_err().to_string();
    assert!(fault.contains("NumberOfImagesInMosaic is \"7 in 4 x 2\"; expected tiles of one size"), "{fault}");
    let fault = read_one(mosaic(Some(b"SV10\x04\0".to_vec()))).unwrap_err().to_string();
    assert!(fault.contains("NumberOfImagesInMosaic of a Siemens mosaic is missing"), "{fault}");
    let cut = csa(["0", "0", "1"], "3");
    let fault = read_one(mosaic(Some(cut[..cut.len() - 30].to_vec()))).unwrap_err().to_string();
    assert!(fault.contains("SliceNormalVector of a Siemens mosaic is missing"), "{fault}");
}
