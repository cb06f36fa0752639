//! The sizes of grids, at the start of a PLOT3D file, read as each layout has them.

use std::io::{Read, SeekFrom};

use brickfield_core::glam::UVec3;

use super::layout::{Content, Encoding, Layout};
use crate::files::ByteSource;
use crate::samples::next_token;
use crate::{ByteOrder, ReadError};

/// The sizes of all grids, as a layout reads them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Sizes {
    pub(super) grids: Vec<UVec3>,
    /// Functions of each grid; 0 unless the file has functions.
    pub(super) n_functions: Vec<u32>,
    /// What precedes the first number: bytes, or numbers of text.
    pub(super) n_before: u64,
}

/// The sizes, if they make sense in this layout: marks agree, all counts are above 0, and the file could list as many.
pub(super) fn read_sizes(
    source: &mut dyn ByteSource,
    n_file_bytes: u64,
    layout: &Layout,
) -> Result<Option<Sizes>, ReadError> {
    source.seek(SeekFrom::Start(0)).map_err(|e| ReadError::io("the sizes of the grids", e))?;
    let mut integers = Integers { source, encoding: layout.encoding, n_read: 0 };
    let n_grids = match layout.is_multi_grid {
        true => match integers.record(1)? {
            Some(count) => count[0],
            None => return Ok(None),
        },
        false => 1,
    };
    let per_grid = layout.n_axes as usize + usize::from(layout.content == Content::Functions);
    let n_integers = u64::from(n_grids) * per_grid as u64;
    // Text has at least a digit and a space for each.
    if n_integers > n_file_bytes / 2 {
        return Ok(None);
    }
    let Some(counts) = integers.record(n_integers as usize)? else { return Ok(None) };
    let n_before = integers.n_read;
    let (grids, n_functions) = sizes_of(&counts, per_grid, layout);
    Ok(Some(Sizes { grids, n_functions, n_before }))
}

fn sizes_of(integers: &[u32], per_grid: usize, layout: &Layout) -> (Vec<UVec3>, Vec<u32>) {
    let of_grids = || integers.chunks_exact(per_grid);
    let grids = of_grids().map(|n| UVec3::new(n[0], n[1], if layout.n_axes == 3 { n[2] } else { 1 })).collect();
    let n_functions = match layout.content {
        Content::Functions => of_grids().map(|n| n[per_grid - 1]).collect(),
        _ => vec![0; integers.len() / per_grid],
    };
    (grids, n_functions)
}

/// The integers at the start of a file.
struct Integers<'a> {
    source: &'a mut dyn ByteSource,
    encoding: Encoding,
    /// Bytes, or numbers of text.
    n_read: u64,
}

impl Integers<'_> {
    /// `n` integers of at least 1 in a record of their own; nothing where there are none.
    fn record(&mut self, n: usize) -> Result<Option<Vec<u32>>, ReadError> {
        let has_marks = matches!(self.encoding, Encoding::Binary(binary) if binary.has_record_marks);
        let Some(mut integers) = self.several(n + if has_marks { 2 } else { 0 })? else { return Ok(None) };
        if has_marks {
            let marks = [integers.remove(0), integers.pop().unwrap_or_default()];
            if marks.iter().any(|mark| u64::from(*mark) != 4 * n as u64) {
                return Ok(None);
            }
        }
        Ok(Some(integers))
    }

    fn several(&mut self, n: usize) -> Result<Option<Vec<u32>>, ReadError> {
        let mut integers = Vec::new();
        for _ in 0..n {
            match self.next()? {
                Some(integer) if (1..=i32::MAX as u32).contains(&integer) => integers.push(integer),
                _ => return Ok(None),
            }
        }
        Ok(Some(integers))
    }

    fn next(&mut self) -> Result<Option<u32>, ReadError> {
        let fault = |e| ReadError::io("the sizes of the grids", e);
        match self.encoding {
            Encoding::Text => {
                let mut token = Vec::new();
                next_token(self.source, &mut token).map_err(fault)?;
                self.n_read += 1;
                Ok(str::from_utf8(&token).ok().and_then(|text| text.parse().ok()))
            }
            Encoding::Binary(binary) => {
                let mut bytes = Vec::new();
                (&mut *self.source).take(4).read_to_end(&mut bytes).map_err(fault)?;
                self.n_read += 4;
                let Ok(bytes) = <[u8; 4]>::try_from(bytes) else { return Ok(None) };
                Ok(Some(match binary.order {
                    ByteOrder::Little => u32::from_le_bytes(bytes),
                    ByteOrder::Big => u32::from_be_bytes(bytes),
                }))
            }
        }
    }
}
