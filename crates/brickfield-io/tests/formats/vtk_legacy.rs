use std::io::Cursor;

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{ScalarType, Voxels};
use brickfield_io::{ByteOrder, ChoiceKind, Note, Opened, ReadError, vtk_legacy};

use crate::common::*;

fn read(file: &[u8]) -> Result<Opened, ReadError> {
    vtk_legacy::read(Cursor::new(file), &options())
}

fn wanting(file: &[u8], kind: ChoiceKind, entry: &str) -> Result<Opened, ReadError> {
    let mut options = options();
    options.wanted.want(kind, entry);
    vtk_legacy::read(Cursor::new(file), &options)
}

fn type_name(scalar: ScalarType) -> &'static str {
    match scalar {
        ScalarType::U8 => "unsigned_char",
        ScalarType::I8 => "char",
        ScalarType::U16 => "unsigned_short",
        ScalarType::I16 => "short",
        ScalarType::U32 => "unsigned_int",
        ScalarType::I32 => "int",
        ScalarType::F32 => "float",
        ScalarType::F64 => "double",
    }
}

fn head(storage: &str) -> String {
    format!(
        "# vtk DataFile Version 3.0\na title\n{storage}\nDATASET STRUCTURED_POINTS\nDIMENSIONS 4 3 2\nORIGIN 1 2 3\n\
         SPACING 2 3 4\nPOINT_DATA 24\n"
    )
}

fn text_file(arrays: &str) -> Vec<u8> {
    (head("ASCII") + arrays).into_bytes()
}

/// Arrays as their header and their bytes.
fn binary_file(arrays: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let mut file = head("BINARY").into_bytes();
    for (header, data) in arrays {
        file.extend(header.as_bytes());
        file.extend(data);
        file.push(b'\n');
    }
    file
}

#[test]
fn every_type_as_text_and_binary() {
    for scalar in ScalarType::ALL {
        let header = format!("SCALARS a {}\nLOOKUP_TABLE default\n", type_name(scalar));
        let opened = read(&text_file(&(header.clone() + &text(&ramp(scalar))))).unwrap();
        assert_ramp(&opened, scalar);
        assert!(opened.notes.is_empty());
        let opened = read(&binary_file(&[(&header, bytes(&ramp(scalar), ByteOrder::Big))])).unwrap();
        assert_ramp(&opened, scalar);
    }
}

#[test]
fn origin_and_spacing_place_the_first_sample() {
    let file = text_file(&("SCALARS a float 1\nLOOKUP_TABLE default\n".to_owned() + &"1 ".repeat(24)));
    let opened = read(&file).unwrap();
    assert_eq!(opened.volume.grid().spacing(), DVec3::new(2.0, 3.0, 4.0));
    assert_near(centre(&opened, 1.0, 1.0, 1.0), [3.0, 5.0, 7.0]);
    let old = String::from_utf8(file).unwrap().replace("SPACING", "aspect_ratio").replace("Version 3.0", "Version 1.0");
    assert_near(centre(&read(old.as_bytes()).unwrap(), 1.0, 1.0, 1.0), [3.0, 5.0, 7.0]);
    let negative = old.replace("aspect_ratio 2 3 4", "SPACING 2 -3 0").into_bytes();
    let opened = read(&negative).unwrap();
    assert_near(centre(&opened, 1.0, 1.0, 1.0), [3.0, -1.0, 4.0]);
    assert_eq!(opened.notes, [Note::SpacingAssumed { axis: 'z', reason: "is 0" }]);
}

/// Scalars, vectors, colours, and a field of wide integers and bits, with what VTK writes between them.
fn many(is_binary: bool) -> Vec<u8> {
    let count: Vec<i32> = (0..72).collect();
    let numbers = |n: usize| count[..n].iter().map(i32::to_string).collect::<Vec<_>>().join(" ").into_bytes();
    let floats: Vec<u8> = count.iter().flat_map(|i| (*i as f32).to_be_bytes()).collect();
    let wide: Vec<u8> = count[..24].iter().flat_map(|i| i64::from(*i).to_be_bytes()).collect();
    let small: Vec<u8> = (0..72).collect();
    let shares = small.iter().map(|i| (f32::from(*i) / 255.0).to_string()).collect::<Vec<_>>().join(" ").into_bytes();
    let bits =
        [1, 0, 0, 0, 0, 0, 0, 1].map(|b: u8| b.to_string()).join(" ").repeat(3).replace("11", "1 1").into_bytes();
    let pick = |text: Vec<u8>, binary: Vec<u8>| if is_binary { binary } else { text };
    let arrays: Vec<(&str, Vec<u8>)> = vec![
        ("SCALARS s unsigned_char 1\nLOOKUP_TABLE t\n", pick(numbers(24), small[..24].to_vec())),
        ("METADATA\nINFORMATION 1\nNAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 0 23 \n", vec![]),
        ("LOOKUP_TABLE t 2\n", pick(b"0 0 0 1 1 1 1 1".to_vec(), vec![0, 0, 0, 255, 255, 255, 255, 255])),
        ("VECTORS v float\n", pick(numbers(72), floats)),
        ("COLOR_SCALARS c 3\n", pick(shares, small)),
        ("FIELD FieldData 2\nwide%20ones 1 24 long\n", pick(numbers(24), wide)),
        ("METADATA\nINFORMATION 0\n", vec![]),
        ("b 1 24 bit\n", pick(bits, vec![0b1000_0001; 3])),
    ];
    match is_binary {
        true => binary_file(&arrays),
        false => {
            let mut file = text_file("");
            for (header, data) in arrays {
                file.extend([header.as_bytes(), &data, b"\n"].concat());
            }
            file
        }
    }
}

#[test]
fn arrays_are_chosen_by_name() {
    for is_binary in [false, true] {
        let file = many(is_binary);
        let opened = read(&file).unwrap();
        assert_eq!(opened.volume.voxels(), &Voxels::U8((0..24).collect()));
        let choice = &opened.choices[0];
        assert_eq!((choice.kind, choice.read), (ChoiceKind::Array, 0));
        assert_eq!(choice.names, ["s", "v", "c", "wide ones", "b"]);
        let array = |name: &str| wanting(&file, ChoiceKind::Array, name).unwrap();
        assert_eq!(array("wide ones").volume.voxels(), &Voxels::U8((0..24).collect()));
        assert_eq!(array("b").volume.voxels(), &Voxels::U8([1, 0, 0, 0, 0, 0, 0, 1].repeat(3)));
        assert_eq!(array("v").volume.voxels(), &Voxels::F32((0..24).map(|i| (3 * i) as f32).collect()));
        let colours = array("c");
        assert_eq!(colours.notes, [Note::Luminance]);
        let mut options = options();
        options.wanted.want(ChoiceKind::Array, "c");
        options.wanted.want(ChoiceKind::Channel, "green");
        let green = vtk_legacy::read(Cursor::new(&file), &options).unwrap();
        assert_eq!(green.volume.voxels(), &Voxels::U8((0..24).map(|i| 3 * i + 1).collect()));
    }
}

#[test]
fn bytes_as_text_are_shares_of_255() {
    let shares = (0..24).map(|i| format!("{:.6}", f64::from(i * 11) / 255.0)).collect::<Vec<_>>().join(" ");
    let opened = read(&text_file(&format!("COLOR_SCALARS a 1\n{shares}\n"))).unwrap();
    assert_eq!(opened.volume.voxels(), &Voxels::U8((0..24).map(|i| i * 11).collect()));
    assert!(opened.notes.is_empty());
    let beyond = read(&text_file(&format!("COLOR_SCALARS a 1\n7{shares}\n"))).unwrap_err().to_string();
    assert_eq!(beyond, "sample 0 is \"17850\"; expected a number that fits u8");
}

#[test]
fn components_are_channels() {
    let numbers = (0..48).map(|i| i.to_string()).collect::<Vec<_>>().join("\n");
    let file = text_file(&format!("SCALARS a short 2\nLOOKUP_TABLE default\n{numbers}\n"));
    let opened = wanting(&file, ChoiceKind::Channel, "1").unwrap();
    assert_eq!(opened.volume.voxels(), &Voxels::I16((0..24).map(|i| 2 * i + 1).collect()));
}

#[test]
fn cell_data_lie_at_cell_centres() {
    let file = text_file("SCALARS a short 1\nLOOKUP_TABLE default\n1 2 3 4 5 6");
    let file = String::from_utf8(file).unwrap().replace("POINT_DATA 24", "CELL_DATA 6");
    let opened = read(file.as_bytes()).unwrap();
    assert_eq!(opened.volume.grid().dims(), UVec3::new(3, 2, 1));
    assert_near(centre(&opened, 0.0, 0.0, 0.0), [2.0, 3.5, 5.0]);
}

#[test]
fn files_that_lie() {
    let file = String::from_utf8(text_file("SCALARS a short 1\nLOOKUP_TABLE default\n")).unwrap() + &"1 ".repeat(24);
    let said = |from: &str, to: &str| {
        assert!(file.contains(from), "{from}");
        read(file.replace(from, to).as_bytes()).unwrap_err().to_string()
    };
    let grid = "it is a structured grid, and no volume";
    for (dataset, hint) in [
        ("UNSTRUCTURED_GRID", "STRUCTURED_POINTS is"),
        ("POLYDATA", "STRUCTURED_POINTS is"),
        ("RECTILINEAR_GRID", grid),
        ("STRUCTURED_GRID", grid),
    ] {
        assert_eq!(said("STRUCTURED_POINTS", dataset), format!("DATASET {dataset:?} is not supported; {hint}"));
    }
    assert_eq!(
        said("short 1", "string 1"),
        "array type \"string\" is not supported; 8 to 64 bit integers, 32 and 64 bit floats and bits are"
    );
    assert_eq!(
        said("POINT_DATA 24", "POINT_DATA 12"),
        "section \"1\" is not supported; SCALARS, COLOR_SCALARS, VECTORS, NORMALS, TENSORS, FIELD and the like are"
    );
    assert_eq!(
        said("DIMENSIONS 4 3 2", "DIMENSIONS 4 3 1"),
        "size of array \"a\" is \"24\"; expected 12, from the dimensions"
    );
    assert_eq!(said("DIMENSIONS 4 3 2", "DIMENSIONS 4 3"), "DIMENSIONS is \"4 3\"; expected 3 numbers");
    assert_eq!(said("DIMENSIONS 4 3 2\n", ""), "DIMENSIONS is missing");
    assert_eq!(said("POINT_DATA 24", "POINT_DATA 25"), "array \"a\" holds 24 samples; 25 are promised");
    assert_eq!(said("ASCII", "HEXADECIMAL"), "line 3 is \"HEXADECIMAL\"; expected ASCII or BINARY");
    assert_eq!(
        said("LOOKUP_TABLE default", "1 2 3"),
        "the line after SCALARS is \"1 2 3\"; expected LOOKUP_TABLE and a name"
    );
    assert!(said("DIMENSIONS 4 3 2", "DIMENSIONS 4 -3 2").contains("Extent"));
    assert!(said("DIMENSIONS 4 3 2", "DIMENSIONS 4 3 9223372036854775807").contains("dimension z"));
    let cut = binary_file(&[("SCALARS a short\nLOOKUP_TABLE default\n", vec![0; 46])]);
    assert_eq!(read(&cut).unwrap_err().to_string(), "array \"a\" holds 47 bytes; 48 are promised");
}

/// Text and binary, with several arrays.
pub(crate) fn examples() -> [Vec<u8>; 2] {
    [many(false), many(true)]
}
