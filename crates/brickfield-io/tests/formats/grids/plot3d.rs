//! PLOT3D files in every layout.

use std::io::Cursor;

use brickfield_core::glam::UVec3;
use brickfield_io::grids::plot3d::{self, Plot3dLayout, Precision};
use brickfield_io::{ByteOrder, GridNote, GridOptions, OpenedGrids, ReadError};
use proptest::prelude::*;

use super::{Example, assert_places, assert_values, nodes, options, place, value};

/// A layout, complete.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Style {
    pub(crate) order: ByteOrder,
    pub(crate) precision: Precision,
    pub(crate) has_record_marks: bool,
    pub(crate) is_multi_grid: bool,
    pub(crate) n_axes: u32,
    pub(crate) has_iblank: bool,
    pub(crate) is_text: bool,
}

pub(crate) const PLAIN: Style = Style {
    order: ByteOrder::Little,
    precision: Precision::F32,
    has_record_marks: false,
    is_multi_grid: false,
    n_axes: 3,
    has_iblank: false,
    is_text: false,
};

impl Style {
    fn all() -> Vec<Style> {
        (0..128)
            .map(|bits: u32| Style {
                order: if bits & 1 == 0 { ByteOrder::Little } else { ByteOrder::Big },
                precision: if bits & 2 == 0 { Precision::F32 } else { Precision::F64 },
                has_record_marks: bits & 4 != 0,
                is_multi_grid: bits & 8 != 0,
                n_axes: if bits & 16 == 0 { 3 } else { 2 },
                has_iblank: bits & 32 != 0,
                is_text: bits & 64 != 0,
            })
            .filter(|s| !s.is_text || (s.order == ByteOrder::Little && !s.has_record_marks))
            .collect()
    }

    fn stated(&self) -> GridOptions {
        let mut stated = Plot3dLayout::default();
        stated.order = Some(self.order);
        stated.precision = Some(self.precision);
        stated.has_record_marks = Some(self.has_record_marks);
        stated.is_multi_grid = Some(self.is_multi_grid);
        stated.n_axes = Some(self.n_axes);
        stated.has_iblank = Some(self.has_iblank);
        let mut options = options();
        options.layout = stated;
        options
    }

    fn integer(&self, out: &mut Vec<u8>, n: i32) {
        match (self.is_text, self.order) {
            (true, _) => out.extend(format!("{n}\n").bytes()),
            (_, ByteOrder::Little) => out.extend(n.to_le_bytes()),
            (_, ByteOrder::Big) => out.extend(n.to_be_bytes()),
        }
    }

    fn real(&self, out: &mut Vec<u8>, x: f64) {
        match (self.is_text, self.precision, self.order) {
            (true, ..) => out.extend(format!("{x:e}  ").replace('e', "D").bytes()),
            (_, Precision::F32, ByteOrder::Little) => out.extend((x as f32).to_le_bytes()),
            (_, Precision::F32, ByteOrder::Big) => out.extend((x as f32).to_be_bytes()),
            (_, Precision::F64, ByteOrder::Little) => out.extend(x.to_le_bytes()),
            (_, Precision::F64, ByteOrder::Big) => out.extend(x.to_be_bytes()),
        }
    }

    fn record(&self, out: &mut Vec<u8>, write: impl Fn(&mut Vec<u8>)) {
        let mut record = Vec::new();
        write(&mut record);
        let n_bytes = record.len() as i32;
        if self.has_record_marks {
            self.integer(out, n_bytes);
        }
        out.extend(record);
        if self.has_record_marks {
            self.integer(out, n_bytes);
        }
    }

    fn sizes(&self, grids: &[UVec3], n_functions: Option<i32>) -> Vec<u8> {
        let mut out = Vec::new();
        if self.is_multi_grid {
            self.record(&mut out, |out| self.integer(out, grids.len() as i32));
        }
        self.record(&mut out, |out| {
            for n in grids {
                n.to_array().iter().take(self.n_axes as usize).for_each(|n| self.integer(out, *n as i32));
                n_functions.into_iter().for_each(|n| self.integer(out, n));
            }
        });
        out
    }

    pub(crate) fn grid(&self, grids: &[UVec3]) -> Vec<u8> {
        let mut out = self.sizes(grids, None);
        for n in grids {
            self.record(&mut out, |out| {
                for axis in 0..self.n_axes as usize {
                    nodes(*n).for_each(|node| self.real(out, place(node)[axis]));
                }
                if self.has_iblank {
                    nodes(*n).for_each(|node| self.integer(out, iblank(node)));
                }
            });
        }
        out
    }

    pub(crate) fn solution(&self, grids: &[UVec3]) -> Vec<u8> {
        let mut out = self.sizes(grids, None);
        for n in grids {
            self.record(&mut out, |out| [2.5, 1.0, 2e6, 0.125].iter().for_each(|x| self.real(out, *x)));
            self.fields(&mut out, *n, self.n_axes as usize + 2);
        }
        out
    }

    fn functions(&self, grids: &[UVec3], n_functions: usize) -> Vec<u8> {
        let mut out = self.sizes(grids, Some(n_functions as i32));
        grids.iter().for_each(|n| self.fields(&mut out, *n, n_functions));
        out
    }

    fn fields(&self, out: &mut Vec<u8>, n: UVec3, n_fields: usize) {
        self.record(out, |out| {
            for field in 0..n_fields {
                nodes(n).for_each(|node| self.real(out, value(field, node).into()));
            }
        });
    }
}

/// 0 at every fifth node, else 1, or the number of a neighbour.
fn iblank(node: UVec3) -> i32 {
    match (node.x + 2 * node.y + 3 * node.z) % 5 {
        0 => 0,
        1 => -3,
        _ => 1,
    }
}

pub(crate) fn read(grid: &[u8], solution: Option<&[u8]>, options: &GridOptions) -> Result<OpenedGrids, ReadError> {
    match solution {
        Some(solution) => plot3d::read(Cursor::new(grid), Some(&mut Cursor::new(solution)), options),
        None => plot3d::read(Cursor::new(grid), None, options),
    }
}

pub(crate) const GRIDS: [UVec3; 2] = [UVec3::new(4, 3, 2), UVec3::new(2, 5, 3)];

pub(crate) fn examples() -> Vec<Example> {
    let read: fn(&[u8]) -> _ = |bytes| read(bytes, None, &options());
    let read_solution: fn(&[u8]) -> _ = |bytes| super::plot3d::read(&PLAIN.grid(&GRIDS[..1]), Some(bytes), &options());
    let big = Style { order: ByteOrder::Big, has_record_marks: true, has_iblank: true, ..PLAIN };
    let multi = Style { is_multi_grid: true, precision: Precision::F64, ..big };
    let text = Style { is_text: true, ..PLAIN };
    vec![
        Example { name: "plain.xyz", bytes: PLAIN.grid(&GRIDS[..1]), read },
        Example { name: "records.xyz", bytes: big.grid(&GRIDS[..1]), read },
        Example { name: "multi.xyz", bytes: multi.grid(&GRIDS), read },
        Example { name: "text.xyz", bytes: text.grid(&GRIDS[..1]), read },
        Example { name: "plain.q", bytes: PLAIN.solution(&GRIDS[..1]), read: read_solution },
        Example { name: "plain.f", bytes: PLAIN.functions(&GRIDS[..1], 2), read: read_solution },
    ]
}

/// Plane grids have one layer, and z = 0.
fn plane(grids: &[UVec3], n_axes: u32) -> Vec<UVec3> {
    grids.iter().map(|n| if n_axes == 2 { n.with_z(1) } else { *n }).collect()
}

#[track_caller]
fn assert_grids(opened: &OpenedGrids, style: Style, grids: &[UVec3]) {
    assert_eq!(opened.grids.len(), grids.len());
    for (grid, n) in opened.grids.iter().zip(grids) {
        match style.n_axes {
            3 => assert_places(grid, *n),
            _ => nodes(*n).for_each(|node| assert_eq!(grid.position(node), place(node).with_z(0.0))),
        }
        let holes: Vec<bool> = nodes(*n).map(|node| style.has_iblank && iblank(node) == 0).collect();
        assert_eq!(grid.holes().map(<[bool]>::to_vec), holes.contains(&true).then_some(holes));
    }
}

#[track_caller]
fn assert_solution(opened: &OpenedGrids, n_axes: u32) {
    let names: &[&str] = match n_axes {
        3 => &["density", "momentum x", "momentum y", "momentum z", "stagnation energy"],
        _ => &["density", "momentum x", "momentum y", "stagnation energy"],
    };
    for grid in &opened.grids {
        assert_eq!(grid.fields().len(), names.len());
        names.iter().enumerate().for_each(|(field, name)| assert_values(grid, field, name));
    }
    // The same for all grids.
    let note = GridNote::FlowConditions { grid: 0, mach: 2.5, alpha: 1.0, reynolds: 2e6, time: 0.125 };
    assert_eq!(opened.notes[0], note);
    assert!(!opened.notes[1..].iter().any(|note| matches!(note, GridNote::FlowConditions { .. })));
}

#[test]
fn every_layout_is_found_from_the_length() {
    for style in Style::all() {
        let grids = plane(if style.is_multi_grid { &GRIDS } else { &GRIDS[..1] }, style.n_axes);
        let opened = read(&style.grid(&grids), Some(&style.solution(&grids)), &options()).unwrap();
        assert_grids(&opened, style, &grids);
        assert_solution(&opened, style.n_axes);
        let opened = read(&style.grid(&grids), Some(&style.functions(&grids, 3)), &options()).unwrap();
        for grid in &opened.grids {
            (0..3).for_each(|i| assert_values(grid, i, &format!("function {}", i + 1)));
        }
    }
}

fn any_grids() -> impl Strategy<Value = Vec<UVec3>> {
    prop::collection::vec((1..6u32, 1..6u32, 1..6u32).prop_map(UVec3::from), 1..4)
}

proptest! {
    /// Small files may fit several layouts: then that is said, and a stated layout settles it.
    #[test]
    fn any_grids_come_back(grids in any_grids(), style in prop::sample::select(Style::all())) {
        let grids = plane(if style.is_multi_grid { &grids } else { &grids[..1] }, style.n_axes);
        let (grid, solution) = (style.grid(&grids), style.solution(&grids));
        let opened = read(&grid, Some(&solution), &style.stated());
        let found = read(&grid, Some(&solution), &options());
        match opened {
            Ok(opened) => {
                assert_grids(&opened, style, &grids);
                assert_solution(&opened, style.n_axes);
                if let Err(fault) = found {
                    prop_assert!(fault.to_string().contains("state the `layout`"), "{fault}");
                }
            }
            // All may be alike but for what is no part of the layout: solution or functions.
            Err(fault) => prop_assert!(fault.to_string().contains("state the `layout`"), "{fault}"),
        }
    }
}

#[test]
fn several_layouts_are_named_and_one_can_be_stated() {
    // 1 x 3 x 4 nodes of f32, or one plane grid of 3 x 4 nodes with IBLANK.
    let n = [UVec3::new(1, 3, 4)];
    let grid = PLAIN.grid(&n);
    let said = read(&grid, None, &options()).unwrap_err().to_string();
    assert_eq!(
        said,
        "length of the PLOT3D file is \"156 bytes\"; expected of one layout; it fits 2: state the `layout`: little-endian \
         f32, single 3-D with 1 x 3 x 4 nodes; little-endian f32, multi 2-D with IBLANK with 3 x 4 x 1 nodes"
    );
    let mut three_d = options();
    three_d.layout.n_axes = Some(3);
    assert_grids(&read(&grid, None, &three_d).unwrap(), PLAIN, &n);
}

#[test]
fn a_solution_may_have_another_precision_and_spare_zeros() {
    let wide = Style { precision: Precision::F64, order: ByteOrder::Big, ..PLAIN };
    let solution = [wide.solution(&GRIDS[..1]), vec![0; 484]].concat();
    let opened = read(&PLAIN.grid(&GRIDS[..1]), Some(&solution), &options()).unwrap();
    assert_solution(&opened, 3);
    let note = GridNote::SpareBytes { what: "the solution".to_owned(), n_bytes: 484 };
    assert_eq!(opened.notes.last(), Some(&note));
    assert_eq!(note.to_string(), "484 bytes of zeros follow the last number of the solution");
}

#[test]
fn numbers_that_are_not_finite_are_holes_of_solutions_and_faults_of_grids() {
    let mut solution = PLAIN.solution(&GRIDS[..1]);
    let first_density = 12 + 16;
    solution[first_density..first_density + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    let opened = read(&PLAIN.grid(&GRIDS[..1]), Some(&solution), &options()).unwrap();
    assert_eq!(opened.grids[0].holes().unwrap().iter().filter(|hole| **hole).count(), 1);
    let mut grid = PLAIN.grid(&GRIDS[..1]);
    grid[12..16].copy_from_slice(&f32::INFINITY.to_le_bytes());
    let said = read(&grid, None, &options()).unwrap_err().to_string();
    assert_eq!(said, "node (0, 0, 0) lies at [inf, 0, 10]; it must be finite");
}
