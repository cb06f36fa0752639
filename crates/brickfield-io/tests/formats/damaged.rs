//! Tables over all formats of what the messages about damaged files say, to the letter.

use brickfield_io::{ChoiceKind, Note, open};

use crate::common::options;

/// What the message says after the path.
#[track_caller]
fn refusal(name: &str, bytes: &[u8]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    let message = open(&path, &options()).expect_err("a refusal").to_string();
    let said = message.strip_prefix(&format!("{}: ", path.display())).expect("the path comes first");
    assert!(!said.contains(['\n', '\r']), "{said}");
    said.to_owned()
}

#[cfg(any(feature = "gzip", feature = "tiff", feature = "dicom"))]
#[track_caller]
fn check(cases: &[(&str, Vec<u8>, &str)]) {
    for (name, bytes, expected) in cases {
        assert_eq!(refusal(name, bytes), *expected, "{name}");
    }
}

/// What text in a file of each extension is called.
const TEXT: &[(&str, &str)] = &[
    ("v.nrrd", "not NRRD: the first line is \"hello world\", expected NRRD0001 to NRRD0005"),
    ("v.mha", "not MetaImage: the first line is \"hello world\", expected a key such as ObjectType or NDims, and ="),
    #[cfg(feature = "nifti")]
    ("v.nii", "not NIfTI: the start of the file is \"hello world\\n\", expected 348 or 540, the length of its header"),
    #[cfg(feature = "nifti")]
    (
        "v.nii.gz",
        "not NIfTI: the start of the file is \"hello world\\n\", expected 348 or 540, the length of its header",
    ),
    #[cfg(feature = "nifti")]
    ("v.hdr", "not NIfTI: the start of the file is \"hello world\\n\", expected 348 or 540, the length of its header"),
    #[cfg(feature = "mgh")]
    ("v.mgz", "not MGH: the start of the file is \"hello world\\n\", expected 1, the version, in four bytes"),
    #[cfg(feature = "vti")]
    (
        "v.vti",
        "not VTK XML ImageData: the start of the file is \"hello world\\n\", expected XML with the root element VTKFile",
    ),
    ("v.vtk", "not legacy VTK: the start of the file is \"hello world\", expected # vtk DataFile Version"),
    ("v.vol", "not VOL: the start of the file is \"hello world\\n\", expected VOLS, VOLB, VOLC or #VOLC"),
    #[cfg(feature = "tiff")]
    ("v.tif", "not TIFF: the start of the file is \"hello world\\n\", expected II or MM, then 42 or 43"),
    #[cfg(feature = "dicom")]
    ("v.dcm", "not DICOM: the start of the file is \"hello world\\n\", expected 128 bytes of any kind, then DICM"),
];

#[test]
fn text_is_quoted() {
    for (name, expected) in TEXT {
        assert_eq!(refusal(name, b"hello world\n"), *expected);
        let long = refusal(name, &b"hello world\n".repeat(1000));
        assert!(long.starts_with(&expected[..expected.find("world").unwrap()]) && long.len() < 160, "{long}");
        refusal(name, b"h");
    }
}

#[test]
fn one_is_not_many() {
    assert_eq!(
        refusal("v.nrrd", b"NRRD0004\ntype: uchar\ndimension: 1\nsizes: 2\nencoding: raw\n\n1"),
        "the data after the header holds 1 byte; 2 are promised"
    );
    assert_eq!(
        refusal("v.nrrd", b"NRRD0004\ntype: uchar\ndimension: 1\nsizes: 1\nencoding: raw\n\n"),
        "the data after the header holds 0 bytes; 1 is promised"
    );
    assert_eq!(
        refusal("v.nrrd", b"NRRD0004\ntype: uchar\ndimension: 1\nsizes: 1 1\nencoding: raw\n\n"),
        "sizes is \"1 1\"; expected 1 number, one per axis"
    );
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("letter"), "Dear friend").unwrap();
    let message = open(folder.path(), &options()).unwrap_err().to_string();
    assert!(message.ends_with("among the 1 entry of this folder"), "{message}");
    let skipped = |n_files| Note::FilesSkipped { n_files, first: "a".to_owned(), reason: "why".to_owned() };
    let series = Note::OneOfSeveral { kind: ChoiceKind::Series, read: "0 (1.2)".to_owned(), n_entries: 2 };
    let notes = [
        (skipped(1), "1 file is no slice of this volume and was skipped, \"a\": why"),
        (skipped(2), "2 files are no slices of this volume and were skipped, first \"a\": why"),
        (series, "one of 2 series was read: 0 (1.2)"),
        (Note::DuplicateSlices { n_slices: 1 }, "1 slice lies where another does and was left out"),
        (Note::DuplicateSlices { n_slices: 2 }, "2 slices lie where another does and were left out"),
        (Note::PagesSkipped { n_pages: 1 }, "1 page of reduced resolution was skipped"),
        (Note::PagesSkipped { n_pages: 2 }, "2 pages of reduced resolution were skipped"),
    ];
    for (note, expected) in notes {
        assert_eq!(note.to_string(), expected);
    }
}

#[cfg(feature = "gzip")]
mod packed {
    use super::*;
    use crate::common::{gzip_unpressed, zlib_unpressed};

    const DATA: &[u8; 24] = b"abcdefghijklmnopqrstuvwx";

    /// A header, and `n` bytes of what follows it.
    fn cut(header: &[u8], packed: &[u8], n: usize) -> Vec<u8> {
        [header, &packed[..n]].concat()
    }

    fn with_last_flipped(mut bytes: Vec<u8>, from_end: usize) -> Vec<u8> {
        let at = bytes.len() - from_end;
        bytes[at] ^= 0xff;
        bytes
    }

    #[test]
    fn nrrd_and_meta_image() {
        let nrrd = b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4 3 2\nencoding: gzip\n\n";
        let skipping = b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4 3 1\nencoding: gzip\nbyte skip: 12\n\n";
        let meta =
            b"NDims = 3\nDimSize = 4 3 2\nElementType = MET_UCHAR\nCompressedData = True\nElementDataFile = LOCAL\n";
        let (gz, z) = (gzip_unpressed(DATA), zlib_unpressed(DATA));
        let cut_off = "the data after the header holds 10 bytes, then its compressed data are cut off; 24 are promised";
        let at_end = "the data after the header holds the 24 bytes promised, but its compressed data are cut off at the end, where the checksum is";
        let checksum = "the data after the header holds the 24 bytes promised, but its compressed data are corrupt at the end, where the checksum is";
        check(&[
            ("v.nrrd", cut(nrrd, &gz, 10 + 5 + 10), cut_off),
            ("v.nrrd", cut(nrrd, &gz, 10 + 5 + 24 + 1), at_end),
            ("v.nrrd", [nrrd, &with_last_flipped(gz.clone(), 8)[..]].concat(), checksum),
            (
                "v.nrrd",
                cut(skipping, &gz, 10 + 5 + 7),
                "what is to be skipped of the data after the header holds 7 bytes, then its compressed data are cut off; 12 are promised",
            ),
            ("v.mha", cut(meta, &z, 2 + 5 + 10), cut_off),
            ("v.mha", cut(meta, &z, 2 + 5 + 24 + 3), at_end),
        ]);
    }

    /// How much comes before a fault is up to the decoder's buffers, and zeros are a bad block.
    #[test]
    fn a_corrupt_stream_says_after_how_much() {
        let header =
            b"NDims = 2\nDimSize = 500 500\nElementType = MET_UCHAR\nCompressedData = True\nElementDataFile = LOCAL\n";
        let mut packed = vec![0x78, 1];
        for _ in 0..4 {
            packed.extend([0, 0x50, 0xc3, 0xaf, 0x3c]);
            packed.extend([7; 50_000]);
        }
        let said = refusal("v.mha", &[&header[..], &packed, &[0; 60_000]].concat());
        let n_bytes = said.strip_prefix("the data after the header holds ");
        let n_bytes =
            n_bytes.and_then(|s| s.strip_suffix(" bytes, then its compressed data are corrupt; 250000 are promised"));
        let n_bytes: usize = n_bytes.and_then(|n| n.parse().ok()).expect(&said);
        assert!((100_000..=200_000).contains(&n_bytes), "{said}");
    }

    #[cfg(feature = "nifti")]
    #[test]
    fn nifti() {
        let file = gzip_unpressed(&[crate::nifti::NiftiHeader::new(2).bytes(), DATA.to_vec()].concat());
        let at_end = "the image holds the 24 bytes promised, but its compressed data are cut off at the end, where the checksum is";
        let cases = [
            (10 + 5 + 352 + 10, "the image holds 10 bytes, then its compressed data are cut off; 24 are promised"),
            (10 + 5 + 352 + 24, at_end),
            (
                10 + 5 + 350,
                "what is to be skipped of the image holds 350 bytes, then its compressed data are cut off; 352 are promised",
            ),
            (10 + 5 + 1, "the header holds 1 byte, then its compressed data are cut off; 348 are promised"),
        ];
        check(&cases.map(|(n, expected)| ("v.nii.gz", file[..n].to_vec(), expected)));
    }

    #[cfg(feature = "mgh")]
    #[test]
    fn mgh() {
        let header = crate::mgh::MghHeader::new(0).bytes();
        let file = gzip_unpressed(&[&header[..], DATA].concat());
        let start = 10 + 5;
        let cases = [
            (start + 284 + 10, "the image holds 10 bytes, then its compressed data are cut off; 24 are promised"),
            (start + 7, "the header holds 7 bytes, then its compressed data are cut off; 284 are promised"),
        ];
        check(&cases.map(|(n, expected)| ("v.mgz", file[..n].to_vec(), expected)));
        let plain = [&header[..], DATA].concat();
        check(&[
            ("v.mgh", plain[..300].to_vec(), "the image holds 16 bytes; 24 are promised"),
            ("v.mgh", plain[..283].to_vec(), "the header holds 283 bytes; 284 are promised"),
        ]);
    }

    /// Appended raw data in zlib blocks of 10 bytes.
    #[cfg(feature = "vti")]
    fn vti(blocks: &[Vec<u8>]) -> Vec<u8> {
        let head = "<VTKFile type=\"ImageData\" compressor=\"vtkZLibDataCompressor\"><ImageData WholeExtent=\"0 3 0 2 0 1\">\
                    <Piece><PointData><DataArray type=\"UInt8\" Name=\"a\" format=\"appended\"/></PointData></Piece>\
                    </ImageData><AppendedData encoding=\"raw\">_";
        let words = [3, 10, 4].into_iter().chain(blocks.iter().map(|b| b.len() as u32));
        let words: Vec<u8> = words.flat_map(u32::to_le_bytes).collect();
        [head.as_bytes(), &words, &blocks.concat(), b"</AppendedData></VTKFile>"].concat()
    }

    #[cfg(feature = "vti")]
    #[test]
    fn vti_blocks() {
        let blocks: Vec<Vec<u8>> = DATA.chunks(10).map(zlib_unpressed).collect();
        let file = vti(&blocks);
        let start = file.windows(2).position(|w| w == blocks[0][..2].to_vec()).unwrap();
        let broken = |i: usize, block: Vec<u8>| {
            let mut blocks = blocks.clone();
            blocks[i] = block;
            vti(&blocks)
        };
        let flipped = |i: usize| with_last_flipped(blocks[i].clone(), 6);
        check(&[
            (
                "v.vti",
                file[..start + blocks[0].len() + 2 + 5 + 3].to_vec(),
                "DataArray \"a\" holds 13 bytes, then its compressed data are cut off; 24 are promised",
            ),
            (
                "v.vti",
                file[..start - 2].to_vec(),
                "a word of the header of DataArray \"a\" holds 2 bytes; 4 are promised",
            ),
            (
                "v.vti",
                broken(1, flipped(1)),
                "DataArray \"a\" holds 10 bytes, then its compressed data are corrupt; 24 are promised",
            ),
            (
                "v.vti",
                broken(2, flipped(2)),
                "DataArray \"a\" holds 20 bytes, then its compressed data are corrupt; 24 are promised",
            ),
            (
                "v.vti",
                broken(1, zlib_unpressed(&DATA[..8])),
                "DataArray \"a\" holds 18 bytes, then a block ends after 8 of its 10 bytes; 24 are promised",
            ),
        ]);
    }
}

#[cfg(feature = "vti")]
#[test]
fn vti_text_and_document() {
    let file = |format: &str, numbers: &str| {
        format!(
            "<VTKFile type=\"ImageData\"><ImageData WholeExtent=\"0 3 0 2 0 1\"><Piece><PointData>\
             <DataArray type=\"UInt8\" Name=\"a\" format=\"{format}\">{numbers}</DataArray>\
             </PointData></Piece></ImageData></VTKFile>"
        )
    };
    // The length 24 and then 24 bytes of 0.
    let good = "GAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA==";
    let up_to = |text: &str, end: &str| text.split(end).next().unwrap().as_bytes().to_vec();
    check(&[
        (
            "v.vti",
            file("binary", &good.replace("AAAA==", "A!AA==")).into_bytes(),
            "DataArray \"a\" holds 20 bytes, then its base64 text has the symbol \"!\"; 24 are promised",
        ),
        ("v.vti", up_to(&file("ascii", "1 2 3"), "2 3"), "DataArray \"a\" holds 2 bytes; 47 are promised"),
        ("v.vti", up_to(&file("ascii", ""), "<Piece"), "the file of 63 bytes ends within the XML document"),
        ("v.vti", b"<VTKFile type='ImageData'/>".to_vec(), "the element Piece is missing"),
        ("v.vti", b"<VTKFile ty".to_vec(), "the file of 11 bytes ends within the XML document"),
    ]);
}

/// Two pages of 2 x 1 samples of 16 bits, the directories first: each has 8 tags and is 102 bytes long.
#[cfg(feature = "tiff")]
fn stack() -> Vec<u8> {
    let directories = [8u32, 8 + 102];
    let samples = 8 + 2 * 102;
    let mut out = b"MM\0\x2a\0\0\0\x08".to_vec();
    for (i, next) in [directories[1], 0].into_iter().enumerate() {
        let start = samples + 4 * i as u16;
        let tags: [(u16, u16); 8] =
            [(256, 2), (257, 1), (258, 16), (259, 1), (262, 1), (273, start), (277, 1), (279, 4)];
        out.extend(crate::tiff::directory(&tags, next));
    }
    out.extend([1, 2, 3, 4, 5, 6, 7, 8]);
    out
}

#[cfg(feature = "tiff")]
#[test]
fn tiff_pages() {
    let file = stack();
    assert_eq!(file.len(), 220);
    let cases = [
        (219, "the file ends at byte 219, within page 2 of 2, which goes on to byte 220"),
        (213, "the file ends at byte 213, within page 1 of 2, which goes on to byte 216"),
        (150, "the file of 150 bytes ends within the tags of page 2"),
        (110, "the file ends at byte 110, before the tags of page 2 at byte 110"),
        (50, "the file of 50 bytes ends within the tags of page 1"),
        (8, "the file ends at byte 8, before the tags of page 1 at byte 8"),
        (7, "the file of 7 bytes ends within the TIFF header"),
    ];
    check(&cases.map(|(n, expected)| ("v.tif", file[..n].to_vec(), expected)));
}

#[cfg(feature = "dicom")]
#[test]
fn dicom_elements() {
    let file = crate::dicom::Slice::at(1.0).bytes();
    let n = file.len();
    let within = |n| format!("slice \"v.dcm\": the file of {n} bytes ends within the element after (0028,0103)");
    check(&[
        (
            "v.dcm",
            file[..n - 3].to_vec(),
            "slice \"v.dcm\": length of element (7fe0,0010) is \"12\"; expected at most the 9 bytes left",
        ),
        (
            "v.dcm",
            file[..n - 11].to_vec(),
            "slice \"v.dcm\": length of element (7fe0,0010) is \"12\"; expected at most the 1 byte left",
        ),
        ("v.dcm", file[..n - 12 - 5].to_vec(), &within(n - 12 - 5)),
    ]);
}

/// Every cut, and every byte replaced by others: what is read or refused must not panic.
mod changed {
    use std::io::Cursor;

    use brickfield_io::{Opened, ReadError, vtk_legacy};

    use crate::common::options;

    const OTHERS: [u8; 4] = [0, b'9', b'<', 0xff];

    fn check(file: &[u8], read: &dyn Fn(&[u8]) -> Result<Opened, ReadError>) {
        let mut changed = file.to_vec();
        for i in 0..file.len() {
            check_one(read(&file[..i]));
            for other in OTHERS {
                changed[i] = other;
                check_one(read(&changed));
            }
            changed[i] = file[i];
        }
    }

    fn check_one(outcome: Result<Opened, ReadError>) {
        if let Err(fault) = outcome {
            let said = fault.to_string();
            assert!(!said.contains(['\n', '\r']) && !said.contains("panicked"), "{said}");
        }
    }

    #[test]
    fn legacy_vtk() {
        for file in crate::vtk_legacy::examples() {
            check(&file, &|bytes| vtk_legacy::read(Cursor::new(bytes), &options()));
        }
    }

    #[cfg(any(feature = "vti", feature = "ome-zarr"))]
    type Entries = std::collections::BTreeMap<String, Vec<u8>>;

    #[cfg(any(feature = "vti", feature = "ome-zarr"))]
    fn check_entries(entries: &Entries, read: &dyn Fn(&Entries) -> Result<Opened, ReadError>) {
        for (name, bytes) in entries {
            check(bytes, &|changed| {
                let mut entries = entries.clone();
                entries.insert(name.clone(), changed.to_vec());
                read(&entries)
            });
        }
    }

    #[cfg(feature = "vti")]
    #[test]
    fn vti_pieces() {
        check_entries(&crate::vti_pieces::parallel(), &|entries| {
            brickfield_io::vti::read(Cursor::new(&entries["v.pvti"]), entries, &options())
        });
        for (_, file) in crate::vti::examples() {
            check(&file, &|bytes| brickfield_io::vti::read(Cursor::new(bytes), &brickfield_io::NoFiles, &options()));
        }
    }

    #[cfg(feature = "ome-zarr")]
    #[test]
    fn zarr() {
        for entries in crate::zarr_arrays::examples() {
            check_entries(&entries, &|entries| brickfield_io::ome_zarr::read_entries(entries, &options()));
        }
    }
}
