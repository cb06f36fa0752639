//! Rectilinear and structured grids of legacy VTK, and the fixture that XML shares.

use std::io::Cursor;

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{GridPoints, StructuredGrid};
use brickfield_io::grids::vtk_legacy;
use brickfield_io::{GridNote, OpenedGrids, ReadError};

use super::{Example, assert_places, assert_values, nodes, options, place, value};

pub(crate) const N: UVec3 = UVec3::new(4, 3, 2);
pub(crate) const AXES: [&[f64]; 3] = [&[0.0, 1.0, 2.5, 7.0], &[-1.0, 0.5, 3.0], &[10.0, 20.0]];

/// Numbers of the fixture: positions, a field of one component, and one of three.
pub(crate) fn positions() -> Vec<f64> {
    nodes(N).flat_map(|node| place(node).to_array()).collect()
}

pub(crate) fn tuples(n_components: usize) -> Vec<f64> {
    nodes(N).flat_map(|node| (0..n_components).map(move |c| f64::from(value(c, node)))).collect()
}

/// Every third node has the mark.
pub(crate) fn marks(mark: u8) -> Vec<u8> {
    (0..24).map(|i| if i % 3 == 0 { mark | 1 } else { 1 }).collect()
}

#[track_caller]
pub(crate) fn assert_fixture(grid: &StructuredGrid) {
    assert_values(grid, 0, "p");
    ["u x", "u y", "u z"].iter().enumerate().for_each(|(i, name)| {
        let found = &grid.fields()[i + 1];
        let expected: Vec<f32> = nodes(N).map(|node| value(i, node)).collect();
        assert_eq!((found.name.as_str(), &found.values), (*name, &expected));
    });
    let holes: Vec<bool> = (0..24).map(|i| i % 3 == 0).collect();
    assert_eq!(grid.holes(), Some(&holes[..]));
}

#[track_caller]
pub(crate) fn assert_axes(grid: &StructuredGrid) {
    assert_eq!(*grid.points(), GridPoints::Rectilinear(AXES.map(<[f64]>::to_vec)));
}

/// Numbers of legacy files, as text or big-endian.
struct Legacy {
    out: Vec<u8>,
    is_binary: bool,
}

impl Legacy {
    fn new(is_binary: bool, dataset: &str) -> Legacy {
        let storage = if is_binary { "BINARY" } else { "ASCII" };
        let head = format!("# vtk DataFile Version 3.0\ntitle\n{storage}\nDATASET {dataset}\nDIMENSIONS 4 3 2\n");
        Legacy { out: head.into_bytes(), is_binary }
    }

    fn line(mut self, line: &str) -> Legacy {
        self.out.extend(format!("{line}\n").bytes());
        self
    }

    fn doubles(mut self, numbers: &[f64]) -> Legacy {
        match self.is_binary {
            true => numbers.iter().for_each(|x| self.out.extend(x.to_be_bytes())),
            false => numbers.iter().for_each(|x| self.out.extend(format!("{x} ").bytes())),
        }
        self.line("")
    }

    fn bytes(mut self, numbers: &[u8]) -> Legacy {
        match self.is_binary {
            true => self.out.extend(numbers),
            false => numbers.iter().for_each(|x| self.out.extend(format!("{x} ").bytes())),
        }
        self.line("")
    }

    fn point_data(self) -> Vec<u8> {
        self.line("POINT_DATA 24")
            .line("SCALARS p double 1\nLOOKUP_TABLE default")
            .doubles(&tuples(1))
            .line("VECTORS u double")
            .doubles(&tuples(3))
            .line("FIELD FieldData 1\nvtkGhostType 1 24 unsigned_char")
            .bytes(&marks(2))
            .out
    }
}

fn legacy_rectilinear(is_binary: bool) -> Vec<u8> {
    let mut file = Legacy::new(is_binary, "RECTILINEAR_GRID");
    for (name, axis) in ["X", "Y", "Z"].iter().zip(AXES) {
        file = file.line(&format!("{name}_COORDINATES {} double", axis.len())).doubles(axis);
    }
    file.point_data()
}

fn legacy_structured(is_binary: bool) -> Vec<u8> {
    Legacy::new(is_binary, "STRUCTURED_GRID").line("POINTS 24 double").doubles(&positions()).point_data()
}

pub(crate) fn read_legacy(bytes: &[u8]) -> Result<OpenedGrids, ReadError> {
    vtk_legacy::read(Cursor::new(bytes), &options())
}

pub(crate) fn examples() -> Vec<Example> {
    vec![
        Example { name: "text.vtk", bytes: legacy_rectilinear(false), read: read_legacy },
        Example { name: "binary.vtk", bytes: legacy_structured(true), read: read_legacy },
    ]
}

#[test]
fn legacy_grids_as_text_and_binary() {
    for is_binary in [false, true] {
        let opened = read_legacy(&legacy_rectilinear(is_binary)).unwrap();
        assert_axes(&opened.grids[0]);
        assert_fixture(&opened.grids[0]);
        let opened = read_legacy(&legacy_structured(is_binary)).unwrap();
        assert_places(&opened.grids[0], N);
        assert_fixture(&opened.grids[0]);
        assert!(opened.notes.is_empty());
    }
}

#[test]
fn blanking_makes_holes_and_cells_are_left_out() {
    let points = |file: Legacy| file.line("POINTS 24 double").doubles(&positions());
    let marks: Vec<u8> = (0..24).map(|i| u8::from(i != 5)).collect();
    let file = Legacy::new(false, "STRUCTURED_GRID").line("BLANKING 24 unsigned_char").bytes(&marks);
    let file = points(file).line("CELL_DATA 6\nSCALARS c unsigned_char\nLOOKUP_TABLE t").bytes(&[7; 6]);
    let said = read_legacy(&file.out).unwrap_err().to_string();
    assert_eq!(
        said,
        "arrays of cells only, \"c\" is not supported; those of points are: bring cell data to points first (ParaView: \
         Cell Data to Point Data)"
    );
    let both = file.line("POINT_DATA 24\nSCALARS p double\nLOOKUP_TABLE t").doubles(&tuples(1)).out;
    let opened = read_legacy(&both).unwrap();
    assert_eq!(opened.notes, [GridNote::CellDataLeftOut { names: vec!["c".to_owned()] }]);
    assert_values(&opened.grids[0], 0, "p");
    let holes = opened.grids[0].holes().unwrap();
    assert!(holes[5] && holes.iter().filter(|hole| **hole).count() == 1);
}

#[test]
fn colours_and_tensors_are_fields_by_number() {
    let file = Legacy::new(false, "RECTILINEAR_GRID")
        .line("X_COORDINATES 4 float")
        .doubles(AXES[0])
        .line("Y_COORDINATES 3 float")
        .doubles(AXES[1])
        .line("Z_COORDINATES 2 float")
        .doubles(AXES[2])
        .line("POINT_DATA 24\nTENSORS t double")
        .doubles(&tuples(9))
        .line("COLOR_SCALARS c 4")
        .doubles(&[0.2; 96])
        .out;
    let opened = read_legacy(&file).unwrap();
    let names: Vec<_> = opened.grids[0].fields().iter().map(|field| field.name.as_str()).collect();
    assert_eq!(names, ["t 0", "t 1", "t 2", "t 3", "t 4", "t 5", "t 6", "t 7", "t 8", "c 0", "c 1", "c 2", "c 3"]);
    assert_eq!(opened.grids[0].fields()[12].values, [51.0; 24]);
    assert_eq!(opened.grids[0].position(UVec3::new(2, 0, 1)), DVec3::new(2.5, -1.0, 20.0));
}
