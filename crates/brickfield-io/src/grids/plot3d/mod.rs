//! PLOT3D: grids, and solutions (q) or functions (f) at their nodes (Walatka, Buning, Pierce, Elson 1990, "PLOT3D User's
//! Manual", NASA TM 101067, chapter 8).
//!
//! ```text
//! [number of grids]                      files of several grids
//! ni nj [nk] ...                         of each grid; functions have their number after them
//! x x x ... y y y ... z z z ... [iblank] grid
//! mach alpha reynolds time               solution
//! density ... momentum x ... momentum y ... momentum z ... stagnation energy ...
//! ```
//!
//! Integers have 32 bits, reals 32 or 64, in either byte order, with or without the marks of Fortran records (32 bits, before
//! and after each record); or all is text. A file does not say which: its length does, for all layouts are tried, and one
//! has to fit. Zeros may follow. Not: the format "planes", records of more than 2 GiB, repeat counts in text.

mod candidates;
mod fit;
mod header;
mod layout;
mod numbers;

use std::io::{BufRead, Seek, SeekFrom};

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{GridPoints, NodeField, StructuredGrid};

use super::check_nodes;
use crate::files::ByteSource;
use crate::numbers::with_room;
use crate::{GridFormat, GridNote, GridOptions, OpenedGrids, ReadError};
pub(crate) use fit::is_plot3d;
use fit::{Found, find_grid, find_values};
use layout::{Content, Encoding, Layout};
pub use layout::{Plot3dLayout, Precision};
use numbers::Numbers;
pub(crate) use numbers::real;

/// Reads grids, and the file of a solution or of functions that belongs to them. `options.solution` is not looked at.
///
/// Positions are the file's, z of plane grids is 0. Nodes with IBLANK = 0 are holes. A solution has the fields "density",
/// "momentum x", "momentum y", "momentum z" (not of plane grids) and "stagnation energy", as PLOT3D scales them, and its
/// flow conditions are notes; functions are "function 1" and so on.
///
/// # Errors
/// No layout fits, or several do; other sizes of the solution; marks of records that disagree; positions that are not
/// finite; grids beyond the limits.
pub fn read(
    mut grid: impl BufRead + Seek,
    solution: Option<&mut dyn ByteSource>,
    options: &GridOptions,
) -> Result<OpenedGrids, ReadError> {
    read_from(&mut grid, solution, options).map_err(|(_, fault)| fault)
}

/// The file in which something is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FileOf {
    Grid,
    Solution,
}

/// [`read`] of a grid with its solution, and which of both is at fault.
pub(crate) fn read_both(
    mut grid: impl BufRead + Seek,
    solution: &mut dyn ByteSource,
    options: &GridOptions,
) -> Result<OpenedGrids, (FileOf, ReadError)> {
    read_from(&mut grid, Some(solution), options)
}

fn read_from(
    source: &mut dyn ByteSource,
    solution: Option<&mut dyn ByteSource>,
    options: &GridOptions,
) -> Result<OpenedGrids, (FileOf, ReadError)> {
    let of_grid = |fault| (FileOf::Grid, fault);
    let of_solution = |fault| (FileOf::Solution, fault);
    let found = find_grid(source, &options.layout).map_err(of_grid)?;
    let values = match solution {
        None => None,
        Some(source) => Some((find_values(source, &found, &options.layout).map_err(of_solution)?, source)),
    };
    let n_fields = values.as_ref().map_or(0, |(found, _)| n_fields(found));
    check_nodes(&found.sizes.grids, NODE_BYTES + 4 * u128::from(n_fields), 0, &options.limits).map_err(of_grid)?;
    let mut opened = OpenedGrids::new(read_grids(source, &found).map_err(of_grid)?, GridFormat::Plot3d);
    note_spare("the grid", &found, &mut opened.notes);
    if let Some((found, source)) = values {
        add_values(source, &found, &mut opened).map_err(of_solution)?;
        note_spare("the solution", &found, &mut opened.notes);
    }
    Ok(opened)
}

/// A position, and whether it is a hole.
const NODE_BYTES: u128 = size_of::<DVec3>() as u128 + 1;

/// The most fields of a grid.
fn n_fields(found: &Found) -> u32 {
    match found.layout.content {
        Content::Functions => found.sizes.n_functions.iter().copied().max().unwrap_or(0),
        _ => found.layout.n_axes + 2,
    }
}

fn note_spare(what: &str, found: &Found, notes: &mut Vec<GridNote>) {
    if found.n_spare_bytes > 0 {
        notes.push(GridNote::SpareBytes { what: what.to_owned(), n_bytes: found.n_spare_bytes });
    }
}

/// Numbers from the first one after the sizes on.
fn numbers<'a>(source: &'a mut dyn ByteSource, found: &Found) -> Result<Numbers<'a>, ReadError> {
    let encoding = found.layout.encoding;
    let fault = |e| ReadError::io("the file", e);
    if let Encoding::Binary(_) = encoding {
        source.seek(SeekFrom::Start(found.sizes.n_before)).map_err(fault)?;
        return Ok(Numbers { source, encoding });
    }
    source.seek(SeekFrom::Start(0)).map_err(fault)?;
    let mut numbers = Numbers { source, encoding };
    numbers.integers(found.sizes.n_before as usize, "the sizes of the grids", &mut |_, _| ())?;
    Ok(numbers)
}

fn read_grids(source: &mut dyn ByteSource, found: &Found) -> Result<Vec<StructuredGrid>, ReadError> {
    let mut numbers = numbers(source, found)?;
    let sizes = found.sizes.grids.iter().enumerate();
    sizes.map(|(i, n_nodes)| read_grid(&mut numbers, *n_nodes, &found.layout, i)).collect()
}

fn read_grid(
    numbers: &mut Numbers,
    n_nodes: UVec3,
    layout: &Layout,
    number: usize,
) -> Result<StructuredGrid, ReadError> {
    let (n, what) = (n_in(n_nodes), format!("grid {}", number + 1));
    let has_iblank = layout.content == Content::Grid { has_iblank: true };
    let n_axes = layout.n_axes as usize;
    let n_record_bytes = numbers.n_bytes((n * n_axes) as u64, if has_iblank { n as u64 } else { 0 });
    numbers.mark(n_record_bytes, &what)?;
    let mut positions = with_room(n)?;
    positions.resize(n, DVec3::ZERO);
    (0..n_axes).try_for_each(|axis| numbers.reals(n, &what, &mut |i, v| positions[i][axis] = v))?;
    let mut holes = with_room(if has_iblank { n } else { 0 })?;
    if has_iblank {
        numbers.integers(n, &format!("IBLANK of {what}"), &mut |_, iblank| holes.push(iblank == 0))?;
    }
    numbers.mark(n_record_bytes, &what)?;
    let grid = StructuredGrid::new(n_nodes, GridPoints::Curvilinear(positions))?;
    Ok(if has_iblank { grid.with_holes(&holes)? } else { grid })
}

fn n_in(n_nodes: UVec3) -> usize {
    n_nodes.to_array().into_iter().map(|n| n as usize).product()
}

/// Adds the fields of a solution or of functions to the grids.
fn add_values(source: &mut dyn ByteSource, found: &Found, opened: &mut OpenedGrids) -> Result<(), ReadError> {
    let (mut numbers, mut conditions) = (numbers(source, found)?, None);
    for (i, grid) in std::mem::take(&mut opened.grids).into_iter().enumerate() {
        let what = format!("solution of grid {}", i + 1);
        if found.layout.content == Content::Solution {
            let now = flow_conditions(&mut numbers, &what)?;
            if conditions != Some(now) {
                let [mach, alpha, reynolds, time] = now;
                opened.notes.push(GridNote::FlowConditions { grid: i, mach, alpha, reynolds, time });
                conditions = Some(now);
            }
        }
        let names = field_names(&found.layout, found.sizes.n_functions[i]);
        opened.grids.push(add_fields(&mut numbers, grid, names, &what)?);
    }
    Ok(())
}

/// Mach number, angle of attack, Reynolds number, and time.
fn flow_conditions(numbers: &mut Numbers, what: &str) -> Result<[f64; 4], ReadError> {
    let n_record_bytes = numbers.n_bytes(4, 0);
    let mut conditions = [0.0; 4];
    numbers.mark(n_record_bytes, what)?;
    numbers.reals(4, what, &mut |i, v| conditions[i] = v)?;
    numbers.mark(n_record_bytes, what)?;
    Ok(conditions)
}

fn field_names(layout: &Layout, n_functions: u32) -> Vec<String> {
    let names: &[&str] = match (layout.content, layout.n_axes) {
        (Content::Functions, _) => return (1..=n_functions).map(|i| format!("function {i}")).collect(),
        (_, 2) => &["density", "momentum x", "momentum y", "stagnation energy"],
        _ => &["density", "momentum x", "momentum y", "momentum z", "stagnation energy"],
    };
    names.iter().map(|name| (*name).to_owned()).collect()
}

fn add_fields(
    numbers: &mut Numbers,
    mut grid: StructuredGrid,
    names: Vec<String>,
    what: &str,
) -> Result<StructuredGrid, ReadError> {
    let n = n_in(grid.n_nodes());
    let n_record_bytes = numbers.n_bytes((n * names.len()) as u64, 0);
    numbers.mark(n_record_bytes, what)?;
    for name in names {
        let mut values = with_room(n)?;
        numbers.reals(n, what, &mut |_, v| values.push(v as f32))?;
        grid = grid.with_field(NodeField { name, unit: None, values })?;
    }
    numbers.mark(n_record_bytes, what)?;
    Ok(grid)
}
