//! The layout of a PLOT3D file, found from its length.

use std::io::SeekFrom;

use super::candidates::{Candidate, FileLength, MARK_BYTES, candidates, grids, has_marks, records};
use super::header::Sizes;
use super::layout::{Content, Layout, Plot3dLayout};
use super::numbers::Numbers;
use crate::ReadError;
use crate::files::ByteSource;

/// The layout that was found.
#[derive(Clone, Debug)]
pub(super) struct Found {
    pub(super) layout: Layout,
    pub(super) sizes: Sizes,
    /// Zeros after the last number.
    pub(super) n_spare_bytes: u64,
}

/// The contents of a grid file, and of the file that belongs to it.
const GRIDS: [Content; 2] = [Content::Grid { has_iblank: false }, Content::Grid { has_iblank: true }];
const VALUES: [Content; 2] = [Content::Solution, Content::Functions];

/// The one layout of a grid that fits the file.
///
/// # Errors
/// If none or several fit: their sizes are named.
pub(super) fn find_grid(source: &mut dyn ByteSource, stated: &Plot3dLayout) -> Result<Found, ReadError> {
    let length = FileLength::measure(source)?;
    let candidates = candidates(source, length, &GRIDS, stated)?;
    let fitting = fitting(source, length, &candidates)?;
    match <[Found; 1]>::try_from(fitting) {
        Ok([found]) => Ok(found),
        Err(several) if several.is_empty() => match find_only_values(source, length)? {
            Some(values) => {
                let value = format!("{} of {}", values.layout.content.name(), grids(&values.sizes));
                Err(ReadError::unsupported(
                    "PLOT3D file",
                    value,
                    "it is the solution of a grid: open that, with this file as its solution",
                ))
            }
            None => Err(none_fits("length of the grid file", length, &candidates)),
        },
        Err(several) => Err(several_fit(length, &several)),
    }
}

/// The one layout of a solution or functions for these grids; of several, the one that is most like the grid's.
///
/// # Errors
/// If none or several fit: their sizes are named.
pub(super) fn find_values(
    source: &mut dyn ByteSource,
    grids: &Found,
    stated: &Plot3dLayout,
) -> Result<Found, ReadError> {
    let length = FileLength::measure(source)?;
    let mut candidates = candidates(source, length, &VALUES, stated)?;
    let is_alike = |candidate: &Candidate| candidate.sizes.grids == grids.sizes.grids;
    if !candidates.is_empty() && !candidates.iter().any(is_alike) {
        return Err(other_sizes(&candidates, grids));
    }
    candidates.retain(is_alike);
    let mut fitting = fitting(source, length, &candidates)?;
    if fitting.len() > 1 {
        fitting.retain(|found| {
            let Layout { encoding, is_multi_grid, n_axes, .. } = found.layout;
            let grid = grids.layout;
            (encoding, is_multi_grid, n_axes) == (grid.encoding, grid.is_multi_grid, grid.n_axes)
        });
    }
    match <[Found; 1]>::try_from(fitting) {
        Ok([found]) => Ok(found),
        Err(several) if several.is_empty() => Err(none_fits("length of the solution file", length, &candidates)),
        Err(several) => Err(several_fit(length, &several)),
    }
}

/// Whether a layout of grids or of a solution fits the file exactly. Functions would not tell: three sizes and their product of
/// numbers are any raw file with a small header.
pub(crate) fn is_plot3d(source: &mut dyn ByteSource) -> Result<bool, ReadError> {
    let length = FileLength::measure(source)?;
    let contents = [GRIDS[0], GRIDS[1], Content::Solution];
    let candidates = candidates(source, length, &contents, &Plot3dLayout::default())?;
    Ok(candidates.iter().any(|candidate| candidate.n_in_all == u128::from(length.n_in_all())))
}

fn find_only_values(source: &mut dyn ByteSource, length: FileLength) -> Result<Option<Found>, ReadError> {
    let candidates = candidates(source, length, &VALUES, &Plot3dLayout::default())?;
    Ok(fitting(source, length, &candidates)?.into_iter().next())
}

/// Zeros that fill the last block of a file. More of them would hide a layout of more numbers.
const MOST_SPARE_BYTES: u128 = 4096;

/// Layouts of the file's length; without any, those after which only zeros follow.
fn fitting(source: &mut dyn ByteSource, length: FileLength, candidates: &[Candidate]) -> Result<Vec<Found>, ReadError> {
    let mut fitting = Vec::new();
    for candidate in candidates.iter().filter(|c| c.n_in_all == u128::from(length.n_in_all())) {
        fitting.push(candidate.found(0));
    }
    if fitting.len() > 1 {
        prefer_records(source, &mut fitting)?;
    }
    if !fitting.is_empty() || length.n_numbers.is_some() {
        return Ok(fitting);
    }
    for candidate in candidates {
        let n_spare_bytes = u128::from(length.n_bytes).checked_sub(candidate.n_in_all).unwrap_or(u128::MAX);
        if n_spare_bytes < MOST_SPARE_BYTES && ends_with_zeros(source, candidate.n_in_all as u64)? {
            fitting.push(candidate.found(n_spare_bytes as u64));
        }
    }
    Ok(fitting)
}

/// Leaves the one layout in records whose marks are all right, if there is one: that is no accident.
fn prefer_records(source: &mut dyn ByteSource, fitting: &mut Vec<Found>) -> Result<(), ReadError> {
    let mut marked = Vec::new();
    for found in &*fitting {
        if has_marks(&found.layout) && marks_agree(source, found)? {
            marked.push(found.clone());
        }
    }
    if marked.len() == 1 {
        *fitting = marked;
    }
    Ok(())
}

/// Whether each record has its length before and after it. The layout fits the file.
fn marks_agree(source: &mut dyn ByteSource, found: &Found) -> Result<bool, ReadError> {
    let mut position = found.sizes.n_before;
    for n_bytes in records(&found.layout, &found.sizes) {
        let n_bytes = n_bytes as u64;
        for start in [position, position + 4 + n_bytes] {
            source.seek(SeekFrom::Start(start)).map_err(|e| ReadError::io("a record mark", e))?;
            let mut numbers = Numbers { source, encoding: found.layout.encoding };
            if numbers.mark(n_bytes, "a record").is_err() {
                return Ok(false);
            }
        }
        position += n_bytes + 2 * MARK_BYTES as u64;
    }
    Ok(true)
}

fn ends_with_zeros(source: &mut dyn ByteSource, start: u64) -> Result<bool, ReadError> {
    let fault = |e| ReadError::io("the end of the file", e);
    source.seek(SeekFrom::Start(start)).map_err(fault)?;
    loop {
        let bytes = source.fill_buf().map_err(fault)?;
        let n = bytes.len();
        if n == 0 {
            return Ok(true);
        }
        if bytes.iter().any(|b| *b != 0) {
            return Ok(false);
        }
        source.consume(n);
    }
}

/// Candidates in a message: more do not fit one line.
const MOST_SHOWN: usize = 2;

fn none_fits(field: &str, length: FileLength, candidates: &[Candidate]) -> ReadError {
    let value = format!("{} {}", length.n_in_all(), length.unit());
    if candidates.is_empty() {
        return ReadError::field(field, value, "a PLOT3D file: it begins with the sizes of its grids, each at least 1");
    }
    let mut nearest: Vec<_> = candidates.iter().collect();
    nearest.sort_by_key(|candidate| candidate.n_in_all.abs_diff(length.n_in_all().into()));
    let shown: Vec<_> = nearest.iter().take(MOST_SHOWN).map(|candidate| candidate.described(length.unit())).collect();
    ReadError::field(field, value, shown.join(" or "))
}

fn several_fit(length: FileLength, several: &[Found]) -> ReadError {
    let shown: Vec<_> =
        several.iter().take(MOST_SHOWN).map(|found| format!("{} with {}", found.layout, grids(&found.sizes))).collect();
    let value = format!("{} {}", length.n_in_all(), length.unit());
    let expected = format!("of one layout; it fits {}: state the `layout`: {}", several.len(), shown.join("; "));
    ReadError::field("length of the PLOT3D file", value, expected)
}

fn other_sizes(candidates: &[Candidate], of_grid: &Found) -> ReadError {
    let of_layout = |candidate: &&Candidate| {
        (candidate.layout.encoding, candidate.layout.n_axes) == (of_grid.layout.encoding, of_grid.layout.n_axes)
    };
    let nearest = candidates.iter().find(of_layout).unwrap_or(&candidates[0]);
    let expected = format!("{}, as the grid file has", grids(&of_grid.sizes));
    ReadError::field("size of the solution", grids(&nearest.sizes), expected)
}
