//! One table over all readers: cut short, absurdly large, and what is wrong in it.

use super::{Example, examples};
use crate::grids::plot3d::{GRIDS, PLAIN};
use crate::grids::usgs_dem::UTM;

/// The message of a refusal.
#[track_caller]
fn refusal(example: &Example, bytes: &[u8]) -> String {
    let said = (example.read)(bytes).expect_err(example.name).to_string();
    assert!(!said.contains(['\n', '\r']) && !said.contains("panicked"), "{said}");
    said
}

fn example(name: &str) -> Example {
    examples().into_iter().find(|example| example.name == name).expect(name)
}

fn replaced(bytes: &[u8], from: &[u8], to: &[u8]) -> Vec<u8> {
    let at = bytes.windows(from.len()).position(|w| w == from).expect("the fixture has what is to be replaced");
    [&bytes[..at], to, &bytes[at + from.len()..]].concat()
}

/// The example, what is replaced in it by what, and the message.
type Row = (&'static str, &'static [u8], &'static [u8], &'static str);

#[track_caller]
fn check(rows: &[Row]) {
    let said = rows.iter().map(|(name, from, to, _)| {
        let example = example(name);
        refusal(&example, &replaced(&example.bytes, from, to))
    });
    let wrong: Vec<_> = said.zip(rows.iter().map(|row| row.3)).filter(|(said, expected)| said != expected).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn plot3d() {
    check(&[
        (
            "plain.xyz",
            b"\x04\0\0\0\x03\0\0\0",
            b"\xff\xff\xff\x7f\xff\xff\xff\x7f",
            "length of the grid file is \"300 bytes\"; expected 36893488113059364880 bytes (little-endian f32, single 2-D; 2147483647 x 2147483647 x 1 nodes) or 55340232169589047316 bytes (little-endian f32, single 2-D with IBLANK; 2147483647 x 2147483647 x 1 nodes)",
        ),
        (
            "plain.xyz",
            b"\x04\0\0\0\x03",
            b"\0\0\0\0\x03",
            "length of the grid file is \"300 bytes\"; expected a PLOT3D file: it begins with the sizes of its grids, each at least 1",
        ),
        (
            "text.xyz",
            b"4\n3\n2\n",
            b"4\n3\n3\n",
            "length of the grid file is \"75 numbers\"; expected 111 numbers (text, single 3-D; 4 x 3 x 3 nodes) or 38 numbers (text, single 2-D with IBLANK; 4 x 3 x 1 nodes)",
        ),
        ("text.xyz", b"1D", b"1x", "number 2 of grid 1 is \"1x0\"; expected a number"),
        (
            "plain.q",
            b"\x04\0\0\0\x03\0\0\0",
            b"\x03\0\0\0\x04\0\0\0",
            "size of the solution is \"3 x 4 x 2 nodes\"; expected 4 x 3 x 2 nodes, as the grid file has",
        ),
    ]);
    let records = example("records.xyz");
    let mut wrong = records.bytes.clone();
    let last = wrong.len() - 1;
    wrong[last] ^= 1;
    assert_eq!(refusal(&records, &wrong), "record mark of grid 1 is \"385\"; expected 384 bytes");
    let plain = example("plain.xyz");
    assert_eq!(
        refusal(&plain, &plain.bytes[..299]),
        "length of the grid file is \"299 bytes\"; expected 300 bytes (little-endian f32, single 3-D; 4 x 3 x 2 nodes) or 248 bytes (little-endian f64, single 2-D with IBLANK; 4 x 3 x 1 nodes)"
    );
    let limited = |n: u64| {
        let (grid, solution) = (PLAIN.grid(&GRIDS[..1]), PLAIN.solution(&GRIDS[..1]));
        let limits = brickfield_io::Limits { max_bytes: n };
        super::plot3d::read(&grid, Some(&solution), &limits.into())
    };
    assert_eq!(
        limited(24 * 45 - 1).unwrap_err().to_string(),
        "a grid of 4 x 3 x 2 nodes would take 1080 bytes; the limit is 1079 bytes"
    );
    assert!(limited(24 * 45).is_ok());
}

#[test]
fn usgs_dem() {
    let long = 1024 + 1024 + 3 * 1024;
    let dem = example("v.dem");
    assert_eq!(dem.bytes.len(), long + 1024);
    let cut = |n: usize| refusal(&dem, &dem.bytes[..n]);
    assert_eq!(cut(863), "the file ends at byte 863, within the record of type A, which goes on to byte 864");
    assert_eq!(cut(1024), "number of profiles is \"3\"; expected 1 to 1, the file's records of 1024 bytes");
    assert_eq!(cut(3072), "the file ends at byte 3072, within profile 2 of 3, which goes on to byte 4600");
    let field = |from: usize, to: &str| {
        let mut bytes = dem.bytes.clone();
        bytes[from..from + to.len()].copy_from_slice(to.as_bytes());
        refusal(&dem, &bytes)
    };
    let b = 1024;
    let cases = [
        (150, "     2", "pattern \"2\" is not supported; 1, regular profiles, is"),
        (
            156,
            "     0",
            "reference system \"0 in unit 2\" is not supported; 0 (geographic) in 3 (seconds of arc), others in 1 (feet) and 2 (metres) are",
        ),
        (534, "     7", "unit of elevations is \"7\"; expected 1 (feet) or 2 (metres)"),
        (534, "  feet", "unit of elevations of record A is \"feet\"; expected an integer"),
        (816, "         0.0", "resolution of x is \"0\"; expected above 0"),
        (828, "            ", "resolution of y is \"blank\"; expected above 0"),
        (852, "     4", "rows of profiles \"4\" is not supported; 1 is"),
        (858, "999999", "number of profiles is \"999999\"; expected 1 to 6, the file's records of 1024 bytes"),
        (858, "     0", "number of profiles is \"0\"; expected 1 to 6, the file's records of 1024 bytes"),
        (858, "    -3", "number of profiles is \"-3\"; expected 1 to 6, the file's records of 1024 bytes"),
        (b + 12, "999999", "the file ends at byte 6144, within profile 1 of 3, which goes on to byte 6024690"),
        (b + 12, "     0", "number of samples of profile 1 of 3 is \"0\"; expected at least 1"),
        (b + 18, "     2", "columns of a profile \"2\" is not supported; 1 is"),
        (b + 24, "      0.557800000000D+06", "easting of profile 2 is \"557850\"; expected 557830"),
        (b + 48, "           0.511e+9999  ", "northing of profile 1 of 3 is \"blank or infinite\"; expected a number"),
        (b + 144, "   1.5", "a sample of profile 1 is \"1.5\"; expected an integer"),
        (b + 144, "      ", "sample 1 of profile 1 is \"\"; expected a number"),
    ];
    let said = cases.iter().map(|(at, to, _)| field(*at, to));
    let wrong: Vec<_> = said.zip(cases.iter().map(|case| case.2)).filter(|(said, expected)| said != expected).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
    // A profile far in the north: the rows between would be memory without data.
    let far = UTM.file(&[(0, vec![1]), (1_000_000, vec![2])]);
    assert_eq!(
        refusal(&dem, &far),
        "grid around all profiles is \"2 profiles of 1000001 rows\"; expected at most 3072 nodes, the file's bytes"
    );
}

#[test]
fn vtk_legacy() {
    check(&[
        ("text.vtk", b"4 3 2", b"5 3 2", "size of array \"X_COORDINATES\" is \"4\"; expected 5, from the dimensions"),
        ("text.vtk", b"4 3 2", b"4 0 2", "nodes along j is \"0\"; expected 1 to 4294967295"),
        ("text.vtk", b"Y_COORDINATES", b"X_COORDINATES", "Y_COORDINATES is missing"),
        (
            "text.vtk",
            b"X_COORDINATES 4",
            b"X_COORDINATES 9999999999",
            "array \"X_COORDINATES\" holds 153 samples; 9999999999 are promised",
        ),
        (
            "text.vtk",
            b"POINT_DATA 24",
            b"POINT_DATA 23",
            "section \"99.5\" is not supported; SCALARS, COLOR_SCALARS, VECTORS, NORMALS, TENSORS, FIELD and the like are",
        ),
        (
            "text.vtk",
            b"p double 1",
            b"p double 0",
            "section \"100\" is not supported; SCALARS, COLOR_SCALARS, VECTORS, NORMALS, TENSORS, FIELD and the like are",
        ),
        (
            "text.vtk",
            b"RECTILINEAR_GRID",
            b"POLYDATA",
            "DATASET \"POLYDATA\" is not supported; RECTILINEAR_GRID and STRUCTURED_GRID are",
        ),
        ("text.vtk", b"RECTILINEAR_GRID", b"STRUCTURED_GRID", "POINTS is missing"),
        ("text.vtk", b"0 1 2.5", b"0 1 nan", "node (2, 0, 0) lies at [NaN, -1, 10]; it must be finite"),
        (
            "binary.vtk",
            b"4 3 2",
            b"16384 16384 4096",
            "a grid of 16384 x 16384 x 4096 nodes would take 102254581383168 bytes; the limit is 1048576 bytes",
        ),
        (
            "binary.vtk",
            b"POINTS 24",
            b"POINTS 1000000000",
            "array \"POINTS\" holds 1493 bytes; 24000000000 are promised",
        ),
    ]);
}

#[cfg(feature = "vti")]
#[test]
fn vtk_xml() {
    check(&[
        (
            "text.vts",
            b"Piece Extent=\"0 3",
            b"Piece Extent=\"0 4",
            "DataArray \"Points\" holds 72 samples; 90 are promised",
        ),
        (
            "text.vts",
            b"Piece Extent=\"0 3 0 2 0 1",
            b"Piece Extent=\"0 9999 0 9999 0 9999",
            "a grid of 10000 x 10000 x 10000 nodes would take 93000000000000 bytes; the limit is 1048576 bytes",
        ),
        (
            "text.vts",
            b"Name=\"Points\" NumberOfComponents=\"3\"",
            b"Name=\"Points\" NumberOfComponents=\"2\"",
            "components of array \"Points\" is \"2\"; expected 3, of positions",
        ),
        (
            "text.vts",
            b"Name=\"u\" NumberOfComponents=\"3\"",
            b"Name=\"u\" NumberOfComponents=\"0\"",
            "components of array \"u\" is \"0\"; expected at least 1",
        ),
        (
            "text.vts",
            b"Name=\"u\" NumberOfComponents=\"3\"",
            b"Name=\"u\" NumberOfComponents=\"18446744073709551615\"",
            "a grid of 4 x 3 x 2 nodes would take 5312662293228350866488 bytes; the limit is 1048576 bytes",
        ),
        (
            "text.vts",
            b"Float64\" Name=\"p\"",
            b"String\" Name=\"p\"",
            "array type \"String\" is not supported; 8 to 64 bit integers, 32 and 64 bit floats and bits are",
        ),
        (
            "inline.vtr",
            b"Name=\"y\" NumberOfComponents=\"1\"",
            b"Name=\"y\" NumberOfComponents=\"2\"",
            "components of array \"y\" is \"2\"; expected 1, of positions",
        ),
    ]);
}

/// Cut anywhere, a file is refused in one line or read; every example but text ends with its last number.
#[test]
fn a_file_cut_anywhere_is_refused_or_read() {
    for example in examples() {
        for n in 0..example.bytes.len() {
            if let Err(fault) = (example.read)(&example.bytes[..n]) {
                let said = fault.to_string();
                assert!(!said.contains(['\n', '\r']) && said.len() < 500, "{}: {said}", example.name);
            }
        }
    }
}
