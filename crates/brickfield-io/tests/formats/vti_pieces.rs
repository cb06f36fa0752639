//! VTK images of several pieces, in one file or in several.

use std::collections::BTreeMap;
use std::io::Cursor;

use brickfield_core::{ScalarType, Voxels};
use brickfield_io::{NoFiles, Opened, ReadError, open, vti};

use crate::common::*;

/// The values of [`ramp`] in a box of points or cells, as text: first and last along x, y, z.
fn numbers(extent: [usize; 6]) -> String {
    let [x0, x1, y0, y1, z0, z1] = extent;
    let Voxels::U8(ramp) = ramp(ScalarType::U8) else { unreachable!() };
    let mut out = String::new();
    for z in z0..=z1 {
        for y in y0..=y1 {
            for x in x0..=x1 {
                out += &format!("{} ", ramp[(z * 3 + y) * 4 + x]);
            }
        }
    }
    out
}

fn piece(extent: [usize; 6]) -> String {
    format!(
        "<Piece Extent=\"{}\"><PointData Scalars=\"a\"><DataArray type=\"UInt8\" Name=\"a\" format=\"ascii\">{}</DataArray></PointData></Piece>",
        extent.map(|e| e.to_string()).join(" "),
        numbers(extent)
    )
}

fn image(pieces: &str) -> String {
    format!(
        "<VTKFile type=\"ImageData\"><ImageData WholeExtent=\"0 3 0 2 0 1\" Spacing=\"1 2 3\">{pieces}</ImageData></VTKFile>"
    )
}

fn read(pieces: &[[usize; 6]]) -> Result<Opened, ReadError> {
    let pieces: String = pieces.iter().map(|extent| piece(*extent)).collect();
    vti::read(Cursor::new(image(&pieces)), &NoFiles, &options())
}

#[test]
fn pieces_that_share_points_or_overlap() {
    let halves = [[0, 2, 0, 2, 0, 1], [2, 3, 0, 2, 0, 1]];
    assert_ramp(&read(&halves).unwrap(), ScalarType::U8);
    assert_ramp(&read(&[[0, 3, 0, 2, 0, 0], [0, 3, 0, 1, 0, 1], [0, 3, 1, 2, 1, 1]]).unwrap(), ScalarType::U8);
    assert_ramp(&read(&[[0, 3, 0, 2, 0, 1]; 3]).unwrap(), ScalarType::U8);
}

#[test]
fn pieces_of_cells() {
    let cells = |extent: [usize; 6], values: &str| {
        piece(extent).replace("PointData", "CellData").replace(&numbers(extent), values)
    };
    let cells = cells([0, 2, 0, 2, 0, 1], "1 2 4 5") + &cells([2, 3, 0, 2, 0, 1], "3 6");
    let opened = vti::read(Cursor::new(image(&cells)), &NoFiles, &options()).unwrap();
    assert_eq!(opened.volume.voxels(), &Voxels::U8(vec![1, 2, 3, 4, 5, 6]));
}

#[test]
fn holes_and_pieces_outside_are_errors() {
    let said = |pieces: &[[usize; 6]]| read(pieces).unwrap_err().to_string();
    let hole = said(&[[0, 1, 0, 2, 0, 1], [3, 3, 0, 2, 0, 1]]);
    assert_eq!(hole, "all pieces together holds 18 samples; 24 are promised");
    assert_eq!(said(&[[0, 2, 0, 2, 0, 1]]), "all pieces together holds 18 samples; 24 are promised");
    let file = image(&piece([0, 3, 0, 2, 0, 1]).replace("Extent=\"0 3", "Extent=\"1 4"));
    let outside = vti::read(Cursor::new(file), &NoFiles, &options()).unwrap_err().to_string();
    assert_eq!(outside, "Extent of piece 1 is \"1 4 0 2 0 1\"; expected within the WholeExtent 0 3 0 2 0 1");
    let other = piece([2, 3, 0, 2, 0, 1]).replace("Name=\"a\"", "Name=\"b\"");
    let file = image(&(piece([0, 2, 0, 2, 0, 1]) + &other));
    let lacking = vti::read(Cursor::new(file), &NoFiles, &options()).unwrap_err().to_string();
    assert_eq!(lacking, "arrays of piece 2 is \"b\"; expected one named \"a\"");
    let other = piece([2, 3, 0, 2, 0, 1]).replace("UInt8", "Int16");
    let file = image(&(piece([0, 2, 0, 2, 0, 1]) + &other));
    let unlike = vti::read(Cursor::new(file), &NoFiles, &options()).unwrap_err().to_string();
    assert_eq!(unlike, "components of array \"a\" in piece 2 is \"1 of Int16\"; expected 1 of UInt8");
}

type Files = BTreeMap<String, Vec<u8>>;

/// A .pvti of two files, one of them in a folder beside it.
pub(crate) fn parallel() -> Files {
    let master = "<VTKFile type=\"PImageData\"><PImageData WholeExtent=\"0 3 0 2 0 1\" GhostLevel=\"0\" Spacing=\"1 2 3\">\
                  <PPointData Scalars=\"a\"><PDataArray type=\"UInt8\" Name=\"a\"/></PPointData>\
                  <Piece Extent=\"0 2 0 2 0 1\" Source=\"v/0.vti\"/><Piece Extent=\"2 3 0 2 0 1\" Source=\"1.vti\"/>\
                  </PImageData></VTKFile>";
    files([
        ("v.pvti", master.as_bytes().to_vec()),
        ("v/0.vti", image(&piece([0, 2, 0, 2, 0, 1])).into_bytes()),
        ("1.vti", image(&piece([2, 3, 0, 2, 0, 1])).into_bytes()),
    ])
}

fn read_parallel(entries: &Files) -> Result<Opened, ReadError> {
    vti::read(Cursor::new(&entries["v.pvti"]), entries, &options())
}

#[test]
fn pieces_in_files_beside() {
    let entries = parallel();
    assert_ramp(&read_parallel(&entries).unwrap(), ScalarType::U8);
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("v")).unwrap();
    for (name, bytes) in &entries {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    assert_ramp(&open(&folder.path().join("v.pvti"), &options()).unwrap(), ScalarType::U8);
}

#[test]
fn pieces_in_files_that_are_missing_damaged_or_elsewhere() {
    let said = |change: &dyn Fn(&mut Files)| {
        let mut entries = parallel();
        change(&mut entries);
        read_parallel(&entries).unwrap_err().to_string()
    };
    let missing = said(&|entries| drop(entries.remove("1.vti")));
    assert!(missing.starts_with("cannot read data file \"1.vti\": "), "{missing}");
    let cut = said(&|entries| entries.get_mut("v/0.vti").unwrap().truncate(100));
    assert_eq!(cut, "data file \"v/0.vti\": the file of 100 bytes ends within the XML document");
    let nested = said(&|entries| drop(entries.insert("1.vti".to_owned(), entries["v.pvti"].clone())));
    assert!(nested.contains("data file \"1.vti\": VTKFile type \"PImageData\" is not supported"), "{nested}");
    for outside in ["../1.vti", "/1.vti", "v/../1.vti", "c:1.vti", ""] {
        let master =
            String::from_utf8(parallel()["v.pvti"].clone()).unwrap().replace("\"1.vti", &format!("\"{outside}"));
        let said = said(&|entries| drop(entries.insert("v.pvti".to_owned(), master.clone().into_bytes())));
        assert_eq!(said, format!("Source of a piece is {outside:?}; expected a path within the folder"));
    }
}
