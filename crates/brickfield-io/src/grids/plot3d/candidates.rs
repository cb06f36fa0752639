//! The layouts that a PLOT3D file could have by its first numbers, and the length that each gives it.

use std::io::{Read, SeekFrom};

use super::fit::Found;
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
    pub(super) n_in_all: u128,
}

/// The length of a file as layouts count it.
#[derive(Clone, Copy, Debug)]
pub(super) struct FileLength {
    pub(super) n_bytes: u64,
    /// The length in numbers, if the file is text.
    pub(super) n_numbers: Option<u64>,
}

impl FileLength {
    pub(super) fn measure(source: &mut dyn ByteSource) -> Result<FileLength, ReadError> {
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

    pub(super) fn n_in_all(self) -> u64 {
        self.n_numbers.unwrap_or(self.n_bytes)
    }

    pub(super) fn unit(self) -> &'static str {
        if self.n_numbers.is_some() { "numbers" } else { "bytes" }
    }
}

impl Candidate {
    pub(super) fn found(&self, n_spare_bytes: u64) -> Found {
        Found { layout: self.layout, sizes: self.sizes.clone(), n_spare_bytes }
    }

    pub(super) fn described(&self, unit: &str) -> String {
        format!("{} {unit} ({}; {})", self.n_in_all, self.layout, grids(&self.sizes))
    }
}

/// All layouts whose sizes make sense.
pub(super) fn candidates(
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
    let marks = if has_marks(layout) { 2 * MARK_BYTES } else { 0 };
    let lengths = records(layout, sizes).map(|n| n.saturating_add(marks));
    lengths.fold(sizes.n_before.into(), u128::saturating_add)
}

pub(super) const MARK_BYTES: u128 = 4;

pub(super) fn has_marks(layout: &Layout) -> bool {
    matches!(layout.encoding, Encoding::Binary(binary) if binary.has_record_marks)
}

/// Bytes of each record after the sizes, or numbers of text.
pub(super) fn records(layout: &Layout, sizes: &Sizes) -> impl Iterator<Item = u128> {
    let (real, integer) = match layout.encoding {
        Encoding::Text => (1, 1),
        Encoding::Binary(binary) => (binary.precision.n_bytes() as u128, 4),
    };
    let (n_axes, content) = (u128::from(layout.n_axes), layout.content);
    sizes.grids.iter().zip(&sizes.n_functions).flat_map(move |(n, n_functions)| {
        let n: u128 = n.to_array().into_iter().map(u128::from).product();
        let (conditions, node) = match content {
            Content::Grid { has_iblank: true } => (None, n_axes * real + integer),
            Content::Grid { has_iblank: false } => (None, n_axes * real),
            Content::Solution => (Some(4 * real), (n_axes + 2) * real),
            Content::Functions => (None, u128::from(*n_functions) * real),
        };
        conditions.into_iter().chain([n.saturating_mul(node)])
    })
}

pub(super) fn grids(sizes: &Sizes) -> String {
    let first = sizes.grids[0];
    let more = if sizes.grids.len() > 1 { format!(" and {} more", sizes.grids.len() - 1) } else { String::new() };
    format!("{} x {} x {} nodes{more}", first.x, first.y, first.z)
}
