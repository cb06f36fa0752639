//! The layout of a PLOT3D file, found from its length.

use std::io::{Read, SeekFrom};

use brickfield_core::glam::UVec3;

use super::header::{Sizes, read_sizes};
use super::layout::{Binary, Content, Encoding, Layout, Plot3dLayout, Precision};
use crate::files::{ByteSource, n_bytes_left};
use crate::samples::next_token;
use crate::{ByteOrder, ReadError};

/// A layout that a file could have, by its first numbers.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    pub(super) layout: Layout,
    pub(super) sizes: Sizes,
    /// What the whole file then has: bytes, or numbers of text.
    n_in_all: u128,
}

/// The layout that was found.
#[derive(Clone, Debug)]
pub(super) struct Found {
    pub(super) layout: Layout,
    pub(super) sizes: Sizes,
    /// Zeros after the last number.
    pub(super) n_spare_bytes: u64,
}

/// The length of a file as layouts count it.
#[derive(Clone, Copy, Debug)]
struct FileLength {
    n_bytes: u64,
    /// The length in numbers, if the file is text.
    n_numbers: Option<u64>,
}

impl FileLength {
    fn measure(source: &mut dyn ByteSource) -> Result<FileLength, ReadError> {
        let fault = |e| ReadError::io("the file", e);
        source.seek(SeekFrom::Start(0)).map_err(fault)?;
        let n_bytes = n_bytes_left(source)?;
        let mut head = Vec::new();
        (&mut *source).take(4096).read_to_end(&mut head).map_err(fault)?;
        let is_text = head.iter().all(|b| b.is_ascii_graphic() || b.is_ascii_whitespace());
        if !is_text {
            return Ok(FileLength { n_bytes, n_numbers: None });
        }
        source.seek(SeekFrom::Start(0)).map_err(fault)?;
        let (mut token, mut n_numbers) = (Vec::new(), 0);
        loop {
            next_token(source, &mut token).map_err(fault)?;
            if token.is_empty() {
                return Ok(FileLength { n_bytes, n_numbers: Some(n_numbers) });
            }
            n_numbers += 1;
        }
    }

    fn n_in_all(self) -> u64 {
        self.n_numbers.unwrap_or(self.n_bytes)
    }

    fn unit(self) -> &'static str {
        if self.n_numbers.is_some() { "numbers" } else { "bytes" }
    }
}

/// The contents of a grid file, and of the file that belongs to it.
pub(super) const GRIDS: [Content; 2] = [Content::Grid { has_iblank: false }, Content::Grid { has_iblank: true }];
pub(super) const VALUES: [Content; 2] = [Content::Solution, Content::Functions];

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
                let value = format!("a {} of {}", values.layout.content.name(), grids(&values.sizes));
                Err(ReadError::unsupported("PLOT3D file", value, "its grid is, with it as `solution`"))
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

/// Whether the file is PLOT3D beyond doubt: one layout of grids or values fits it exactly.
pub(crate) fn is_plot3d(source: &mut dyn ByteSource) -> Result<bool, ReadError> {
    let length = FileLength::measure(source)?;
    let all = [GRIDS, VALUES].concat();
    let candidates = candidates(source, length, &all, &Plot3dLayout::default())?;
    let is_exact = |candidate: &Candidate| candidate.n_in_all == u128::from(length.n_in_all());
    Ok(candidates.iter().any(is_exact))
}

fn find_only_values(source: &mut dyn ByteSource, length: FileLength) -> Result<Option<Found>, ReadError> {
    let candidates = candidates(source, length, &VALUES, &Plot3dLayout::default())?;
    Ok(fitting(source, length, &candidates)?.into_iter().next())
}

/// All layouts whose sizes make sense.
fn candidates(
    source: &mut dyn ByteSource,
    length: FileLength,
    contents: &[Content],
    stated: &Plot3dLayout,
) -> Result<Vec<Candidate>, ReadError> {
    let mut candidates = Vec::new();
    for encoding in encodings(length) {
        for is_multi_grid in [false, true] {
            for n_axes in [3, 2] {
                for content in contents {
                    let layout = Layout { encoding, is_multi_grid, n_axes, content: *content };
                    if !layout.agrees(stated) {
                        continue;
                    }
                    if let Some(sizes) = read_sizes(source, length.n_bytes, &layout)? {
                        let n_in_all = n_in_all(&layout, &sizes);
                        candidates.push(Candidate { layout, sizes, n_in_all });
                    }
                }
            }
        }
    }
    Ok(candidates)
}

fn encodings(length: FileLength) -> Vec<Encoding> {
    if length.n_numbers.is_some() {
        return vec![Encoding::Text];
    }
    let mut encodings = Vec::new();
    for order in [ByteOrder::Little, ByteOrder::Big] {
        for precision in [Precision::F32, Precision::F64] {
            for has_record_marks in [false, true] {
                encodings.push(Encoding::Binary(Binary { order, precision, has_record_marks }));
            }
        }
    }
    encodings
}

/// Bytes of the whole file, or numbers of text.
fn n_in_all(layout: &Layout, sizes: &Sizes) -> u128 {
    let (real, integer, marks) = match layout.encoding {
        Encoding::Text => (1, 1, 0),
        Encoding::Binary(binary) => {
            (binary.precision.n_bytes() as u128, 4, if binary.has_record_marks { 8 } else { 0 })
        }
    };
    let n_axes = u128::from(layout.n_axes);
    let of_grid = |(n, n_functions): (&UVec3, &u32)| {
        let n: u128 = n.to_array().into_iter().map(u128::from).product();
        match layout.content {
            Content::Grid { has_iblank } => {
                let iblank = if has_iblank { integer } else { 0 };
                n.saturating_mul(n_axes * real + iblank).saturating_add(marks)
            }
            Content::Solution => n.saturating_mul((n_axes + 2) * real).saturating_add(4 * real + 2 * marks),
            Content::Functions => n.saturating_mul(u128::from(*n_functions) * real).saturating_add(marks),
        }
    };
    let grids = sizes.grids.iter().zip(&sizes.n_functions).map(of_grid);
    grids.fold(sizes.n_before.into(), u128::saturating_add)
}

/// Zeros that fill the last block of a file. More of them would hide a layout of more numbers.
const MOST_SPARE_BYTES: u128 = 4096;

/// Layouts of the file's length; without any, those after which only zeros follow.
fn fitting(source: &mut dyn ByteSource, length: FileLength, candidates: &[Candidate]) -> Result<Vec<Found>, ReadError> {
    let mut fitting = Vec::new();
    for candidate in candidates.iter().filter(|c| c.n_in_all == u128::from(length.n_in_all())) {
        fitting.push(candidate.found(0));
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

impl Candidate {
    fn found(&self, n_spare_bytes: u64) -> Found {
        Found { layout: self.layout, sizes: self.sizes.clone(), n_spare_bytes }
    }

    fn described(&self, unit: &str) -> String {
        format!("{} {unit} ({}; {})", self.n_in_all, self.layout, grids(&self.sizes))
    }
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

fn grids(sizes: &Sizes) -> String {
    let first = sizes.grids[0];
    let more = if sizes.grids.len() > 1 { format!(" and {} more", sizes.grids.len() - 1) } else { String::new() };
    format!("{} x {} x {} nodes{more}", first.x, first.y, first.z)
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
