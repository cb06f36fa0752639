use std::collections::BTreeMap;

use brickfield_core::glam::DVec3;
use brickfield_core::{ScalarType, Voxels};
use brickfield_io::{ChoiceKind, Note, Opened, ReadError, WorldFrame, dicom, open};

use crate::common::options;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Syntax {
    Explicit,
    Implicit,
    BigEndian,
    Rle,
}

/// One slice of 3 columns and 2 rows.
#[derive(Clone)]
pub(crate) struct Slice {
    pub(crate) syntax: Syntax,
    pub(crate) series: &'static str,
    pub(crate) position: [f64; 3],
    pub(crate) orientation: &'static str,
    /// Bits allocated, bits stored, signed.
    pub(crate) bits: (u16, u16, u16),
    pub(crate) rescale: Option<(&'static str, &'static str)>,
    pub(crate) pixels: Vec<i32>,
}

impl Slice {
    pub(crate) fn at(z: f64) -> Slice {
        Slice {
            syntax: Syntax::Explicit,
            series: "1.2.3",
            position: [10.0, 20.0, z],
            orientation: "1\\0\\0\\0\\1\\0",
            bits: (16, 16, 0),
            rescale: None,
            pixels: vec![z as i32; 6],
        }
    }

    pub(crate) fn bytes(&self) -> Vec<u8> {
        let uid = match self.syntax {
            Syntax::Explicit => "1.2.840.10008.1.2.1",
            Syntax::Implicit => "1.2.840.10008.1.2",
            Syntax::BigEndian => "1.2.840.10008.1.2.2",
            Syntax::Rle => "1.2.840.10008.1.2.5",
        };
        let mut meta = Vec::new();
        element(&mut meta, Syntax::Explicit, (2, 2), b"UI", b"1.2.840.10008.5.1.4.1.1.2\0");
        element(&mut meta, Syntax::Explicit, (2, 3), b"UI", b"1.2.3.4\0");
        element(&mut meta, Syntax::Explicit, (2, 0x10), b"UI", &even(uid, 0));
        let mut out = [vec![0; 128], b"DICM".to_vec()].concat();
        element(&mut out, Syntax::Explicit, (2, 0), b"UL", &(meta.len() as u32).to_le_bytes());
        out.extend(meta);
        self.data_set(&mut out);
        out
    }

    fn data_set(&self, out: &mut Vec<u8>) {
        let mut text = |tag, vr, value: &str| element(out, self.syntax, tag, vr, &even(value, b' '));
        let [x, y, z] = self.position;
        text((8, 0x16), b"UI", "1.2.840.10008.5.1.4.1.1.2");
        text((0x18, 0x50), b"DS", "2.5");
        text((0x20, 0xe), b"UI", self.series);
        text((0x20, 0x13), b"IS", "1");
        text((0x20, 0x32), b"DS", &format!("{x}\\{y}\\{z}"));
        text((0x20, 0x37), b"DS", self.orientation);
        let mut short = |tag, value: u16| {
            let bytes = if self.syntax == Syntax::BigEndian { value.to_be_bytes() } else { value.to_le_bytes() };
            element(out, self.syntax, tag, b"US", &bytes);
        };
        let (allocated, stored, signed) = self.bits;
        short((0x28, 2), 1);
        element(out, self.syntax, (0x28, 4), b"CS", b"MONOCHROME2 ");
        let mut short = |tag, value: u16| {
            let bytes = if self.syntax == Syntax::BigEndian { value.to_be_bytes() } else { value.to_le_bytes() };
            element(out, self.syntax, tag, b"US", &bytes);
        };
        short((0x28, 0x10), 2);
        short((0x28, 0x11), 3);
        element(out, self.syntax, (0x28, 0x30), b"DS", b"0.5\\0.25");
        let mut short = |tag, value: u16| {
            let bytes = if self.syntax == Syntax::BigEndian { value.to_be_bytes() } else { value.to_le_bytes() };
            element(out, self.syntax, tag, b"US", &bytes);
        };
        short((0x28, 0x100), allocated);
        short((0x28, 0x101), stored);
        short((0x28, 0x102), stored - 1);
        short((0x28, 0x103), signed);
        if let Some((slope, intercept)) = self.rescale {
            element(out, self.syntax, (0x28, 0x1052), b"DS", &even(intercept, b' '));
            element(out, self.syntax, (0x28, 0x1053), b"DS", &even(slope, b' '));
        }
        self.pixel_data(out, allocated);
    }

    fn pixel_data(&self, out: &mut Vec<u8>, allocated: u16) {
        let n_bytes = usize::from(allocated / 8);
        let word = |v: &i32| match self.syntax {
            Syntax::BigEndian => v.to_be_bytes()[4 - n_bytes..].to_vec(),
            _ => v.to_le_bytes()[..n_bytes].to_vec(),
        };
        let bytes: Vec<u8> = self.pixels.iter().flat_map(word).collect();
        if self.syntax != Syntax::Rle {
            return element(out, self.syntax, (0x7fe0, 0x10), b"OW", &bytes);
        }
        out.extend([0xe0, 0x7f, 0x10, 0, b'O', b'B', 0, 0, 255, 255, 255, 255]);
        out.extend([0xfe, 0xff, 0, 0xe0, 0, 0, 0, 0]);
        let fragment = rle(&bytes, n_bytes);
        out.extend([0xfe, 0xff, 0, 0xe0]);
        out.extend((fragment.len() as u32).to_le_bytes());
        out.extend(fragment);
        out.extend([0xfe, 0xff, 0xdd, 0xe0, 0, 0, 0, 0]);
    }
}

/// One segment per byte of a sample, the high byte first, each as one literal run.
fn rle(bytes: &[u8], sample_bytes: usize) -> Vec<u8> {
    let n = bytes.len() / sample_bytes;
    let segment_bytes = (n + 2) & !1;
    let mut header = vec![sample_bytes as u32];
    header.extend((0..sample_bytes).map(|i| (64 + i * segment_bytes) as u32));
    header.resize(16, 0);
    let mut out: Vec<u8> = header.iter().flat_map(|w| w.to_le_bytes()).collect();
    for i in (0..sample_bytes).rev() {
        let start = out.len();
        out.push(n as u8 - 1);
        out.extend(bytes.iter().skip(i).step_by(sample_bytes));
        out.resize(start + segment_bytes, 0);
    }
    out
}

pub(crate) fn even(text: &str, pad: u8) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    if bytes.len() % 2 == 1 {
        bytes.push(pad);
    }
    bytes
}

pub(crate) fn element(out: &mut Vec<u8>, syntax: Syntax, (group, number): (u16, u16), vr: &[u8; 2], value: &[u8]) {
    let is_big = syntax == Syntax::BigEndian;
    let short = |v: u16| if is_big { v.to_be_bytes() } else { v.to_le_bytes() };
    let long = |v: u32| if is_big { v.to_be_bytes() } else { v.to_le_bytes() };
    out.extend(short(group));
    out.extend(short(number));
    match (syntax, vr) {
        (Syntax::Implicit, _) => out.extend(long(value.len() as u32)),
        (_, b"OW" | b"OB" | b"SQ") => {
            out.extend([vr[0], vr[1], 0, 0]);
            out.extend(long(value.len() as u32));
        }
        _ => {
            out.extend(vr);
            out.extend(short(value.len() as u16));
        }
    }
    out.extend(value);
}

pub(crate) fn read(slices: &[Slice]) -> Result<Opened, ReadError> {
    let files: BTreeMap<String, Vec<u8>> =
        slices.iter().enumerate().map(|(i, s)| (format!("{i:02}.dcm"), s.bytes())).collect();
    let names: Vec<String> = files.keys().cloned().collect();
    dicom::read(&names, &files, &options())
}

fn voxels(opened: &Opened) -> Vec<f64> {
    (0..opened.volume.voxels().len()).map(|i| opened.volume.value(i)).collect()
}

#[test]
fn slices_are_sorted_along_their_normal() {
    let opened = read(&[Slice::at(8.0), Slice::at(2.0), Slice::at(5.0)]).unwrap();
    assert_eq!(opened.volume.grid().dims().to_array(), [3, 2, 3]);
    assert_eq!(opened.volume.grid().spacing(), DVec3::new(0.25, 0.5, 3.0));
    assert_eq!(voxels(&opened), [[2.0; 6], [5.0; 6], [8.0; 6]].concat());
    assert_eq!((opened.frame, &opened.notes[..]), (WorldFrame::Lps, &[][..]));
    crate::common::assert_near(crate::common::centre(&opened, 1.0, 1.0, 1.0), [10.25, 20.5, 5.0]);
}

#[test]
fn every_transfer_syntax_and_type() {
    let pixels = vec![0, 1, 100, 7, 8, 99];
    for syntax in [Syntax::Explicit, Syntax::Implicit, Syntax::BigEndian, Syntax::Rle] {
        let types =
            [(8, 0, ScalarType::U8), (8, 1, ScalarType::I8), (16, 0, ScalarType::U16), (16, 1, ScalarType::I16)];
        for (allocated, signed, scalar) in types {
            if syntax == Syntax::BigEndian && allocated == 8 {
                continue;
            }
            let slice =
                Slice { syntax, bits: (allocated, allocated, signed), pixels: pixels.clone(), ..Slice::at(0.0) };
            let opened = read(&[slice]).unwrap();
            assert_eq!(opened.volume.scalar_type(), scalar);
            assert_eq!(voxels(&opened), [0.0, 1.0, 100.0, 7.0, 8.0, 99.0], "{scalar}");
            assert_eq!(opened.volume.grid().spacing().z, 2.5);
        }
    }
}

#[test]
fn bits_beyond_the_stored_ones_are_no_part_of_the_value() {
    let slice =
        |signed| Slice { bits: (16, 12, signed), pixels: vec![0xf001, 0x0fff, 0x0800, 0x07ff, 0, 1], ..Slice::at(0.0) };
    assert_eq!(voxels(&read(&[slice(0)]).unwrap()), [1.0, 4095.0, 2048.0, 2047.0, 0.0, 1.0]);
    assert_eq!(voxels(&read(&[slice(1)]).unwrap()), [1.0, -1.0, -2048.0, 2047.0, 0.0, 1.0]);
}

#[test]
fn rescales_keep_integers() {
    let with = |rescale, pixels: [i32; 6]| {
        let slice = Slice { rescale: Some(rescale), pixels: pixels.to_vec(), ..Slice::at(0.0) };
        read(&[slice]).unwrap().volume
    };
    let pixels = [0, 1, 2, 3, 4, 4095];
    assert_eq!(with(("1", "-1024"), pixels).voxels(), &Voxels::I16(vec![-1024, -1023, -1022, -1021, -1020, 3071]));
    assert_eq!(with(("1.0", "5"), pixels).scalar_type(), ScalarType::U16);
    assert_eq!(with(("10", "-1"), [0, 1, 2, 3, 4, 65535]).voxels().at(5), 655_349.0);
    assert_eq!(with(("10", "-1"), [0, 1, 2, 3, 4, 65535]).scalar_type(), ScalarType::I32);
    assert_eq!(with(("0.5", "0"), pixels).scalar_type(), ScalarType::U16);
    assert_eq!(with(("0.5", "0"), pixels).value(5), 2047.5);
}

#[test]
fn rescales_may_differ_from_slice_to_slice() {
    let [mut a, mut b] = [Slice::at(1.0), Slice::at(2.0)];
    (a.rescale, b.rescale) = (Some(("2", "0")), Some(("3", "1")));
    assert_eq!(voxels(&read(&[a, b]).unwrap()), [[2.0; 6], [7.0; 6]].concat());
}

#[test]
fn uneven_spacing_is_told_with_all_positions() {
    let opened = read(&[Slice::at(0.0), Slice::at(1.0), Slice::at(2.0), Slice::at(5.0)]).unwrap();
    assert_eq!(opened.volume.grid().spacing().z, 1.0);
    let positions = vec![0.0, 1.0, 2.0, 5.0];
    let expected = Note::UnevenSpacing { positions, min_step: 1.0, median_step: 1.0, max_step: 3.0, max_shift: 2.0 };
    assert_eq!(opened.notes, [expected]);
}

#[test]
fn a_damaged_slice_is_not_left_out() {
    for (n_cut, part) in [(5, "length of element (7fe0,0010)"), (18, "ends within the element after")] {
        let [first, mut cut, last] = [0.0, 1.0, 2.0].map(|z| Slice::at(z).bytes());
        cut.truncate(cut.len() - n_cut);
        let names = ["a", "b", "c"].map(str::to_owned);
        let files = crate::common::files([("a", first), ("b", cut), ("c", last)]);
        let fault = dicom::read(&names, &files, &options()).unwrap_err().to_string();
        assert!(fault.contains("slice \"b\"") && fault.contains(part), "{fault}");
    }
}

#[test]
fn gantry_tilt_shears_the_grid() {
    let slices = [0.0, 1.0, 2.0].map(|z| Slice { position: [10.0, 20.0 + z, z], ..Slice::at(z) });
    let opened = read(&slices).unwrap();
    assert!(matches!(opened.notes[..], [Note::GantryTilt { degrees }] if (degrees - 45.0).abs() < 1e-9));
    crate::common::assert_near(crate::common::centre(&opened, 0.0, 0.0, 2.0), [10.0, 22.0, 2.0]);
}

#[test]
fn duplicates_other_series_and_other_files_are_told() {
    let mut other = Slice::at(9.0);
    other.series = "9.9";
    let opened = read(&[Slice::at(0.0), Slice::at(1.0), Slice::at(1.0), other]).unwrap();
    assert_eq!(opened.volume.grid().dims().z, 2);
    let series = Note::OneOfSeveral { kind: ChoiceKind::Series, read: "0 (1.2.3)".to_owned(), n_entries: 2 };
    assert_eq!(opened.notes, [series, Note::DuplicateSlices { n_slices: 1 }]);
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.dcm"), Slice::at(0.0).bytes()).unwrap();
    std::fs::write(folder.path().join("read me.txt"), "no slice").unwrap();
    let opened = open(folder.path(), &options()).unwrap();
    assert!(matches!(&opened.notes[..], [Note::FilesSkipped { n_files: 1, first, .. }] if first == "read me.txt"));
}

#[test]
fn lengths_beyond_the_file_are_refused_before_they_are_allocated() {
    let whole = Slice::at(0.0).bytes();
    let read = |bytes: Vec<u8>| dicom::read(&["a".to_owned()], &crate::common::files([("a", bytes)]), &options());
    for n in [0, 100, 131, 140, 200, 300, whole.len() - 1] {
        let fault = read(whole[..n].to_vec()).unwrap_err().to_string();
        assert!(!fault.contains('\n'), "{fault}");
    }
    let nested = [
        whole[..whole.len() - 24].to_vec(),
        b"\x08\0\x40\x11SQ\0\0\xff\xff\xff\xff\xfe\xff\0\xe0\xff\xff\xff\xff".repeat(100_000),
    ];
    let fault = read(nested.concat()).unwrap_err().to_string();
    assert_eq!(fault, "slice \"a\": nesting of sequences is \"33\"; expected at most 32");
    // Found by fuzzing: to the parser, an unknown representation has a length of 32 bits.
    let at = whole.windows(4).position(|w| w == b"\x20\0\x32\0").unwrap() + 4;
    let mut unknown = whole.clone();
    unknown[at..at + 2].copy_from_slice(b"D\xa8");
    let fault = read(unknown).unwrap_err().to_string();
    assert!(fault.starts_with("slice \"a\": length of element (0020,0032) is \"844902449\""), "{fault}");
    // Found by fuzzing: of a length that is no whole number of values, the parser takes the rest for elements.
    let at = whole.windows(6).position(|w| w == b"\x28\0\x10\0US").unwrap() + 6;
    let mut odd = whole.clone();
    odd[at..at + 2].copy_from_slice(&3u16.to_le_bytes());
    let fault = read(odd).unwrap_err().to_string();
    assert_eq!(fault, "slice \"a\": length of element (0028,0010) is \"3\"; expected a multiple of 2");
    // The meta group ends where its elements do, whatever its length says.
    for length in [0u32, 10_000] {
        let mut wrong = whole.clone();
        wrong[140..144].copy_from_slice(&length.to_le_bytes());
        assert_eq!(read(wrong).unwrap().volume.voxels(), &Voxels::U16(vec![0; 6]));
    }
    // Found by fuzzing: the parser goes on after the pixel data where tags are lower.
    let junk = [whole.clone(), [0; 24].to_vec(), b"\x02\0\x02\0UN\0\0\x02\0\x55\x49".to_vec()].concat();
    assert_eq!(read(junk).unwrap().volume.voxels(), &Voxels::U16(vec![0; 6]));
    let mut huge = whole.clone();
    let at = whole.len() - 12 - 4;
    huge[at..at + 4].copy_from_slice(&0xffff_fff0u32.to_le_bytes());
    let fault = read(huge).unwrap_err().to_string();
    assert_eq!(
        fault,
        "slice \"a\": length of element (7fe0,0010) is \"4294967280\"; expected at most the 12 bytes left"
    );
}

#[test]
fn uneven_slices_become_even_on_a_tilted_grid_too() {
    let slices = [0.0, 1.0, 2.0, 5.0].map(|z| Slice { position: [10.0, 20.0 + z, z], ..Slice::at(z) });
    let opened = read(&slices).unwrap();
    let even = opened.clone().evenly_spaced(&options().limits);
    let [before, after] = [&opened, &even].map(|o| o.volume.grid());
    assert_eq!((before.dims().z, after.dims().z), (4, 6));
    // The last slice lies where the file has it; on the median's grid it did not.
    crate::common::assert_near(crate::common::centre(&even, 0.0, 0.0, 5.0), [10.0, 25.0, 5.0]);
    assert_eq!(after.dims().truncate(), before.dims().truncate());
    let n = (after.dims().x * after.dims().y) as usize;
    let voxel = |o: &brickfield_io::Opened, slice: usize| o.volume.voxels().at(slice * n);
    assert_eq!([voxel(&even, 1), voxel(&even, 5)], [voxel(&opened, 1), voxel(&opened, 3)]);
    let mixed = (voxel(&opened, 2) * 2.0 + voxel(&opened, 3)) / 3.0;
    assert!((voxel(&even, 3) - mixed).abs() <= 0.5 + 1e-9);
}

#[test]
fn padding_behind_a_file_is_no_damage() {
    let files = [0.0, 1.0].map(|z| Slice::at(z).bytes());
    // A document without pixels, padded to a multiple of 8 bytes.
    let mut document = Slice::at(2.0).bytes();
    let pixels = document.windows(4).rposition(|w| w == [0xe0, 0x7f, 0x10, 0]).unwrap();
    document.truncate(pixels);
    document.extend([0; 3]);
    let names = ["a", "b", "c"].map(str::to_owned);
    let [first, second] = files;
    let files = crate::common::files([("a", first), ("b", second), ("c", document)]);
    let fault = dicom::read(&names, &files, &options()).map(|o| o.volume.grid().dims().z);
    // It has the size of a slice: that it has no pixels is told by its name.
    assert!(fault.unwrap_err().to_string().contains("slice \"c\""));
}
