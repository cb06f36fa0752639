//! One table over all formats: what is empty, cut short, of another kind, absurdly large or of an unsupported type.

use std::path::Path;

use brickfield_io::{Format, Limits, OpenOptions, detect, open};

use crate::common::options;

pub(crate) struct BadFile {
    pub(crate) name: &'static str,
    /// A file that opens.
    pub(crate) good: Vec<u8>,
    /// Replacements that make it absurdly large and of an unsupported type, and what the message then has.
    absurd: (&'static [u8], &'static [u8], &'static str),
    unsupported: (&'static [u8], &'static [u8], &'static str),
}

pub(crate) fn cases() -> Vec<BadFile> {
    #[allow(unused_mut)]
    let mut cases = vec![
        BadFile {
            name: "v.nrrd",
            good: b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4 3 2\nencoding: raw\n\n012345678901234567890123".to_vec(),
            absurd: (b"4 3 2", b"16384 16384 4096", "1099511627776 bytes; the limit is"),
            unsupported: (b"uchar", b"block", "type \"block\" is not supported"),
        },
        BadFile {
            name: "v.mha",
            good: b"NDims = 3\nDimSize = 4 3 2\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n012345678901234567890123"
                .to_vec(),
            absurd: (b"4 3 2", b"16384 16384 4096", "1099511627776 bytes; the limit is"),
            unsupported: (b"MET_UCHAR", b"MET_STRING", "ElementType \"MET_STRING\" is not supported"),
        },
        BadFile {
            name: "v.vtk",
            good: b"# vtk DataFile Version 3.0\n\nBINARY\nDATASET STRUCTURED_POINTS\nDIMENSIONS 4 3 2\nPOINT_DATA 24\n\
                    SCALARS a unsigned_char 1\nLOOKUP_TABLE t\n012345678901234567890123"
                .to_vec(),
            absurd: (b"4 3 2", b"16384 16384 4096", "1099511627776 bytes; the limit is"),
            unsupported: (b"unsigned_char", b"string", "array type \"string\" is not supported"),
        },
        BadFile {
            name: "v.vol",
            good: [&b"VOLS\n\0\0\0\x04\0\0\0\x03\0\0\0\x02"[..], &[1; 24]].concat(),
            absurd: (b"\0\0\0\x04\0\0\0\x03", b"\0\x08\0\0\0\x10\0\0", "1099511627776 bytes; the limit is"),
            unsupported: (b"VOLS\n", b"VOLS2", "version \"VOLS2"),
        },
    ];
    #[cfg(feature = "vti")]
    cases.push(BadFile {
        name: "v.vti",
        good: b"<VTKFile type=\"ImageData\"><ImageData WholeExtent=\"0 3 0 2 0 1\"><Piece><PointData>\
                <DataArray type=\"UInt8\" Name=\"a\">0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1 2 3</DataArray>\
                </PointData></Piece></ImageData></VTKFile>"
            .to_vec(),
        absurd: (b"0 3 0 2 0 1", b"1 16384 1 16384 1 4096", "1099511627776 bytes; the limit is"),
        unsupported: (b"UInt8", b"String", "array type \"String\" is not supported"),
    });
    #[cfg(feature = "nifti")]
    cases.push(BadFile {
        name: "v.nii",
        good: [crate::nifti::NiftiHeader::new(2).bytes(), vec![1; 24]].concat(),
        absurd: (b"\x03\0\x04\0\x03\0\x02\0", b"\x03\0\x00\x40\x00\x40\x00\x10", "1099511627776 bytes; the limit is"),
        unsupported: (b"\0\0\x02\0\0\0", b"\0\0\x00\x06\0\0", "datatype \"float128 (code 1536)\" is not supported"),
    });
    #[cfg(feature = "mgh")]
    cases.push(BadFile {
        name: "v.mgh",
        good: [crate::mgh::MghHeader::new(0).bytes(), vec![1; 24]].concat(),
        absurd: (b"\0\0\0\x04\0\0\0\x03", b"\0\x01\0\0\0\x80\0\0", "1099511627776 bytes; the limit is"),
        unsupported: (b"\0\0\0\x01\0\0\0\0\0\0", b"\0\0\0\x01\0\0\0\x05\0\0", "type \"5\" is not supported"),
    });
    #[cfg(feature = "dicom")]
    cases.push(BadFile {
        name: "v.dcm",
        good: crate::dicom::Slice::at(1.0).bytes(),
        absurd: (b"\x28\0\x10\0US\x02\0\x02\0", b"\x28\0\x10\0US\x02\0\xff\xff", "promised"),
        unsupported: (
            b"\x28\0\0\x01US\x02\0\x10\0",
            b"\x28\0\0\x01US\x02\0\x40\0",
            "BitsAllocated \"64\" is not supported",
        ),
    });
    cases
}

fn write(folder: &Path, name: &str, bytes: &[u8]) -> std::path::PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

fn replaced(bytes: &[u8], from: &[u8], to: &[u8]) -> Vec<u8> {
    let at = bytes.windows(from.len()).position(|w| w == from).expect("the fixture has what is to be replaced");
    [&bytes[..at], to, &bytes[at + from.len()..]].concat()
}

/// The one-line message of a refusal, which names the file.
#[track_caller]
fn refusal(path: &Path, options: &OpenOptions) -> String {
    let message = open(path, options).expect_err("a refusal").to_string();
    assert!(message.starts_with(&path.display().to_string()), "{message}");
    assert!(!message.contains('\n') && message.len() < 500, "{message}");
    message
}

#[test]
fn every_format() {
    let folder = tempfile::tempdir().unwrap();
    for case in cases() {
        let path = write(folder.path(), case.name, &case.good);
        open(&path, &options()).unwrap();
        let absurd = replaced(&case.good, case.absurd.0, case.absurd.1);
        let message = refusal(&write(folder.path(), case.name, &absurd), &OpenOptions::default());
        assert!(message.contains(case.absurd.2), "{message}");
        let unsupported = replaced(&case.good, case.unsupported.0, case.unsupported.1);
        let message = refusal(&write(folder.path(), case.name, &unsupported), &options());
        assert!(message.contains(case.unsupported.2), "{message}");
        let message = refusal(&write(folder.path(), case.name, &case.good), &Limits { max_bytes: 11 }.into());
        assert!(message.contains("the limit is 11 bytes"), "{message}");
    }
}

#[test]
fn a_file_cut_anywhere_is_refused_or_read() {
    let folder = tempfile::tempdir().unwrap();
    for case in cases() {
        for n in 0..case.good.len() {
            let path = write(folder.path(), case.name, &case.good[..n]);
            if let Err(e) = open(&path, &options()) {
                let message = e.to_string();
                assert!(message.starts_with(&path.display().to_string()) && !message.contains('\n'), "{message}");
            }
        }
    }
}

#[test]
fn an_empty_file_of_every_extension() {
    let folder = tempfile::tempdir().unwrap();
    for extension in Format::ALL.iter().flat_map(|format| format.extensions()) {
        let message = refusal(&write(folder.path(), &format!("empty.{extension}"), &[]), &options());
        assert!(message.ends_with("the file is empty (0 bytes)"), "{message}");
    }
}

#[test]
fn text_in_a_file_of_every_extension() {
    let folder = tempfile::tempdir().unwrap();
    for extension in Format::ALL.iter().flat_map(|format| format.extensions()) {
        let text = b"This is not a volume.\nIt is a letter to a friend.\n".repeat(20);
        refusal(&write(folder.path(), &format!("letter.{extension}"), &text), &options());
    }
    let message = refusal(&write(folder.path(), "letter", b"Dear friend,\n"), &options());
    assert!(message.ends_with("no known volume format; it starts with \"Dear friend,\\n\""), "{message}");
}

#[test]
fn content_goes_before_the_extension() {
    let folder = tempfile::tempdir().unwrap();
    for case in cases() {
        let right = detect(&write(folder.path(), case.name, &case.good)).unwrap();
        for wrong in ["v.tif", "v.nii.gz", "v.raw", "v"] {
            let path = write(folder.path(), wrong, &case.good);
            assert_eq!(detect(&path).unwrap(), right);
            assert_eq!(open(&path, &options()).unwrap().format, right);
        }
    }
}

#[test]
fn foreign_formats_folders_and_missing_files() {
    let folder = tempfile::tempdir().unwrap();
    let vdb = refusal(&write(folder.path(), "v.vdb", b" BDV\0\0\0\0"), &options());
    assert!(vdb.contains("format \"OpenVDB\" is not supported"), "{vdb}");
    for format in ["MGH", "OME-Zarr", "folders of TIFF or PNG slices"] {
        assert!(vdb.contains(format), "{vdb}");
    }
    let png = refusal(&write(folder.path(), "3.png", b"\x89PNG\r\n\x1a\n"), &options());
    assert!(
        png.ends_with(
            "\"a single PNG\" is not supported; a stack of slices opens as a folder: name the folder instead"
        )
    );
    let raw = refusal(&write(folder.path(), "v.raw", b"\x01\x02"), &options());
    assert!(raw.contains("open_raw"), "{raw}");
    std::fs::create_dir(folder.path().join("empty")).unwrap();
    assert!(refusal(&folder.path().join("empty"), &options()).contains("0 entries"));
    assert!(refusal(&folder.path().join("gone.nrrd"), &options()).contains("cannot read the file"));
    #[cfg(feature = "gzip")]
    {
        let packed = write(folder.path(), "v.nrrd.gz", &crate::common::gzip(&cases()[0].good));
        assert!(refusal(&packed, &options()).contains("unpack it first"));
    }
}
