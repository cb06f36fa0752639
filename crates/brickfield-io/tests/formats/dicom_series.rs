//! Which files make a series, and where its slices lie.

use brickfield_core::ScalarType;
use brickfield_core::glam::DVec3;
use brickfield_io::{ChoiceKind, Format, Note, WorldFrame, detect, open};

use crate::common::{assert_near, centre, options};
use crate::dicom::{Slice, Syntax, read};
use crate::dicom_file::{EXPLICIT, Elements, GREY_16, meta, read_all, read_one, values};

fn slices() -> [Slice; 3] {
    [2.0, 4.0, 6.0].map(Slice::at)
}

const IN_ORDER: [[f64; 6]; 3] = [[2.0; 6], [4.0; 6], [6.0; 6]];

/// A slice of two voxels.
fn slice(number: u16) -> Elements {
    Elements::default()
        .series("1.2.3")
        .text((0x20, 0x13), b"IS", &number.to_string())
        .placed([0.0, 0.0, f64::from(number)])
        .shape(GREY_16, 1)
}

#[test]
fn pixel_data_of_an_icon_are_not_those_of_the_slice() {
    let icon = Elements::default().shape(GREY_16, 1).words(&[1, 2]);
    let empty = Elements::default().shape(GREY_16, 1).words(&[]);
    for icon in [icon, empty] {
        for closed in [true, false] {
            let before = Elements::default().series("1.2.3");
            let with_icon = match closed {
                true => before.items((0x88, 0x200), std::slice::from_ref(&icon)),
                false => before.open_item((0x88, 0x200), icon.clone()),
            };
            let file = with_icon.shape(GREY_16, 1).words(&[7, 9]).file(EXPLICIT);
            assert_eq!(values(&read_one(file).unwrap()), [7.0, 9.0]);
        }
    }
}

#[test]
fn a_sequence_of_unknown_representation_has_implicit_elements() {
    let mut inner = Elements::new(Syntax::Implicit).text((9, 0x1001), b"LO", "private").bytes;
    inner.extend([0xfe, 0xff, 0x0d, 0xe0, 0, 0, 0, 0, 0xfe, 0xff, 0xdd, 0xe0, 0, 0, 0, 0]);
    let mut before = Elements::default().series("1.2.3");
    before.bytes.extend(b"\x29\0\x10\x10UN\0\0\xff\xff\xff\xff\xfe\xff\0\xe0\xff\xff\xff\xff");
    before.bytes.extend(inner);
    let file = before.shape(GREY_16, 1).words(&[7, 9]).file(EXPLICIT);
    // Tags need not ascend, so the sequence may stand here.
    assert_eq!(values(&read_one(file).unwrap()), [7.0, 9.0]);
}

#[test]
fn sub_folders_are_descended_and_an_index_is_no_slice() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("DICOM/ST0/SE0");
    std::fs::create_dir_all(&inner).unwrap();
    for (i, slice) in slices().iter().enumerate() {
        std::fs::write(inner.join(format!("IM{i}")), slice.bytes()).unwrap();
    }
    let directory = Elements::default().items((4, 0x1220), &[Elements::default().series("1.2.3")]);
    let index = folder.path().join("DICOMDIR");
    for with_index in [false, true] {
        if with_index {
            std::fs::write(&index, directory.file(EXPLICIT)).unwrap();
        }
        assert_eq!(detect(folder.path()).unwrap(), Format::Dicom);
        let opened = open(folder.path(), &options()).unwrap();
        assert_eq!((values(&opened), &opened.notes[..]), (IN_ORDER.concat(), &[][..]));
    }
    // The index itself stands for what it lists.
    assert_eq!(values(&open(&index, &options()).unwrap()), IN_ORDER.concat());
}

#[test]
fn folders_are_not_descended_without_end() {
    let folder = tempfile::tempdir().unwrap();
    let deep = folder.path().join("1/2/3/4/5/6/7/8/9/10/11");
    std::fs::create_dir_all(&deep).unwrap();
    std::fs::write(deep.join("a.dcm"), Slice::at(0.0).bytes()).unwrap();
    let fault = open(folder.path(), &options()).unwrap_err().to_string();
    assert!(fault.contains("no DICOM slices"), "{fault}");
}

#[test]
fn a_damaged_file_of_another_series_is_a_note() {
    let cut = |series: &'static str| {
        let mut bytes = Slice { series, ..Slice::at(8.0) }.bytes();
        bytes.truncate(bytes.len() - 5);
        bytes
    };
    let with = |file: Vec<u8>| {
        let mut files: Vec<Vec<u8>> = slices().iter().map(Slice::bytes).collect();
        files.push(file);
        read_all(files, &[])
    };
    let opened = with(cut("9.9")).unwrap();
    assert_eq!(values(&opened), IN_ORDER.concat());
    assert!(matches!(&opened.notes[..], [Note::FilesSkipped { n_files: 1, first, reason }]
        if first == "03" && reason.contains("length of element (7fe0,0010)")));
    // Of the same series, or of one that the rest of the file does not tell, it is missed.
    let unknown = [meta(EXPLICIT), Slice::at(8.0).bytes()[200..206].to_vec()].concat();
    for file in [cut("1.2.3"), unknown] {
        let fault = with(file).unwrap_err().to_string();
        assert!(fault.starts_with("slice \"03\""), "{fault}");
    }
}

#[test]
fn a_slice_of_the_series_that_cannot_be_decoded_is_missed() {
    let mut files = vec![slice(1).words(&[1, 2]).file(EXPLICIT)];
    files.push(slice(2).words(&[1, 2]).file("1.2.840.10008.1.2.4.100"));
    let fault = read_all(files, &[]).unwrap_err().to_string();
    assert!(fault.contains("slice \"01\": transfer syntax \"1.2.840.10008.1.2.4.100\" is not supported"), "{fault}");
}

#[test]
fn orientations_that_differ_by_rounding_are_one() {
    let orientations =
        ["0.12349994\\0.9923\\0\\-0.9923\\0.12349994\\0", "0.12350006\\0.9923\\0\\-0.9923\\0.12350006\\0"];
    let mut slices = slices();
    slices.iter_mut().zip(orientations.iter().cycle()).for_each(|(slice, o)| slice.orientation = o);
    let opened = read(&slices).unwrap();
    assert_eq!((values(&opened), opened.choices.len()), (IN_ORDER.concat(), 0));
}

#[test]
fn big_endian_samples_are_swapped_by_their_size() {
    let pixels = vec![1, -2, 70_000, -70_000, 0, 1 << 30];
    for (allocated, expected) in
        [(32, [1.0, -2.0, 70_000.0, -70_000.0, 0.0, f64::from(1 << 30)]), (8, [1.0, -2.0, 112.0, -112.0, 0.0, 0.0])]
    {
        let slice = Slice { syntax: Syntax::BigEndian, bits: (allocated, allocated, 1), ..Slice::at(0.0) };
        let mut slice = Slice { pixels: pixels.clone(), ..slice };
        if allocated == 8 {
            // Bytes of 8-bit samples are stored as words.
            slice.pixels = [1, 0, 3, 2, 5, 4].map(|i| pixels[i]).to_vec();
        }
        assert_eq!(values(&read(&[slice]).unwrap()), expected);
    }
}

#[test]
fn a_stated_step_serves_where_positions_are_missing() {
    let with = |spacing: &str, thickness: &str| {
        let file = |number: u16| {
            let text = |elements: Elements, tag, vr, value: &str| match value {
                "" => elements,
                value => elements.text(tag, vr, value),
            };
            let elements = text(Elements::default().series("1.2.3"), (0x18, 0x50), b"DS", thickness);
            let elements = text(elements, (0x18, 0x88), b"DS", spacing).text((0x20, 0x13), b"IS", &number.to_string());
            elements.shape(GREY_16, 1).words(&[number, number]).file(EXPLICIT)
        };
        read_all(vec![file(2), file(1), file(3)], &[]).unwrap()
    };
    let cases = [
        ("-2", "5", 2.0, "SpacingBetweenSlices"),
        ("0", "5", 5.0, "SliceThickness"),
        ("2.5", "", 2.5, "SpacingBetweenSlices"),
    ];
    for (spacing, thickness, step, from) in cases {
        let opened = with(spacing, thickness);
        assert_eq!((opened.volume.grid().spacing().z, opened.frame), (step, WorldFrame::Plain));
        assert_eq!(values(&opened), [1.0, 1.0, 2.0, 2.0, 3.0, 3.0]);
        assert!(opened.notes.contains(&Note::StepStated { from, step }), "{:?}", opened.notes);
    }
    assert!(with("0", "").notes.contains(&Note::SpacingAssumed { axis: 'z', reason: "is not stated" }));
}

#[test]
fn slice_locations_serve_where_positions_are_missing() {
    let file = |location: u16, number: u16| {
        let elements = Elements::default().series("1.2.3").text((0x20, 0x13), b"IS", &number.to_string());
        let elements = elements.text((0x20, 0x1041), b"DS", &location.to_string());
        elements.shape(GREY_16, 1).words(&[location, location]).file(EXPLICIT)
    };
    let opened = read_all(vec![file(9, 1), file(5, 2), file(7, 3)], &[]).unwrap();
    assert_eq!(values(&opened), [5.0, 5.0, 7.0, 7.0, 9.0, 9.0]);
    assert_eq!(opened.volume.grid().spacing(), DVec3::new(1.0, 1.0, 2.0));
    assert!(opened.notes.contains(&Note::StepStated { from: "SliceLocation", step: 2.0 }));
}

#[test]
fn signed_and_unsigned_slices_are_one_series() {
    let [mut a, mut b] = [Slice::at(1.0), Slice::at(2.0)];
    (a.bits, a.pixels) = ((16, 16, 1), vec![-5; 6]);
    (b.bits, b.pixels) = ((16, 12, 0), vec![4000; 6]);
    let opened = read(&[a.clone(), b.clone()]).unwrap();
    assert_eq!(opened.volume.scalar_type(), ScalarType::I16);
    assert_eq!(values(&opened), [[-5.0; 6], [4000.0; 6]].concat());
    assert_eq!(opened.notes, [Note::Converted { from: "several types", to: ScalarType::I16 }]);
    (b.bits, b.pixels) = ((16, 16, 0), vec![65_535; 6]);
    let opened = read(&[a, b]).unwrap();
    assert_eq!((opened.volume.scalar_type(), values(&opened)[6]), (ScalarType::I32, 65_535.0));
}

#[test]
fn files_need_neither_preamble_nor_meta_group() {
    for syntax in [Syntax::Explicit, Syntax::Implicit, Syntax::BigEndian] {
        let elements = Elements::new(syntax).series("1.2.3").placed([1.0, 2.0, 3.0]).shape(GREY_16, 1);
        let pixels: &[u8] = if syntax == Syntax::BigEndian { &[0, 7, 1, 0] } else { &[7, 0, 0, 1] };
        let bare = elements.bytes((0x7fe0, 0x10), b"OW", pixels).bytes;
        let opened = read_one(bare.clone()).unwrap();
        assert_eq!(values(&opened), [7.0, 256.0]);
        assert_near(centre(&opened, 0.0, 0.0, 0.0), [1.0, 2.0, 3.0]);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("IM0001");
        std::fs::write(&path, bare).unwrap();
        assert_eq!(detect(&path).unwrap(), Format::Dicom);
    }
    let whole = slice(1).words(&[7, 9]).file(EXPLICIT);
    assert_eq!(values(&read_one(whole[132..].to_vec()).unwrap()), [7.0, 9.0]);
    for other in [
        &b"\x08\0\x05\0\0\0\0\0\x08\0\x06\0\0\0\0\0\x08\0\x07\0\0\0\0\0"[..],
        b"\x08\0\x05\0CS\x04\0ISO_",
        &[8, 0, 0, 0],
    ] {
        assert_eq!(Format::from_magic(other), None);
    }
}

#[test]
fn deflated_data_sets_are_unpacked_within_the_limit() {
    use std::io::Write;
    let deflated = |elements: &Elements| {
        let mut packed = flate2::write::DeflateEncoder::new(Vec::new(), flate2::Compression::default());
        packed.write_all(&elements.bytes).unwrap();
        [meta("1.2.840.10008.1.2.1.99"), packed.finish().unwrap()].concat()
    };
    let file = deflated(&slice(3).words(&[7, 9]));
    assert_eq!(values(&read_one(file.clone()).unwrap()), [7.0, 9.0]);
    let fault = read_one(file[..file.len() - 20].to_vec()).unwrap_err().to_string();
    assert!(fault.starts_with("slice \"00\""), "{fault}");
    // 40 MiB of zeros behind a header that promises four bytes.
    let bomb = deflated(&slice(3).bytes((0x7fe0, 0x10), b"OW", &vec![0; 40 << 20]));
    let fault = read_one(bomb).unwrap_err().to_string();
    assert!(fault.contains("the deflated data set would take") && fault.contains("the limit is 1048576"), "{fault}");
}

#[test]
fn copies_of_a_file_are_left_out() {
    let file = |number: u16| {
        let elements = Elements::default().series("1.2.3").text((8, 0x18), b"UI", &format!("1.{number}"));
        let elements = elements.placed([0.0, 0.0, f64::from(number)]).shape(GREY_16, 1);
        elements.words(&[number, number]).file(EXPLICIT)
    };
    let opened = read_all(vec![file(1), file(2), file(1), file(2)], &[]).unwrap();
    assert_eq!(values(&opened), [1.0, 1.0, 2.0, 2.0]);
    assert_eq!(opened.notes, [Note::DuplicateSlices { n_slices: 2 }]);
}

#[test]
fn a_series_is_found_by_its_uid() {
    let file = |series: &str, z: f64, value: u16| {
        let elements = Elements::default().series(series).thick().placed([0.0, 0.0, z]).shape(GREY_16, 1);
        elements.words(&[value, value]).file(EXPLICIT)
    };
    let files = || vec![file("1.2", 0.0, 5), file("1.2", 1.0, 6), file("1.3", 0.0, 8)];
    let opened = read_all(files(), &[(ChoiceKind::Series, "1.3")]).unwrap();
    assert_eq!(
        (values(&opened), opened.choices[0].names.clone()),
        (vec![8.0, 8.0], vec!["1.2".to_owned(), "1.3".to_owned()])
    );
    assert!(opened.notes.is_empty());
    let fault = read_all(files(), &[(ChoiceKind::Series, "1.4")]).unwrap_err().to_string();
    assert_eq!(fault, r#"series is "1.4"; expected 0 to 1, or one of "1.2", "1.3""#);
}
