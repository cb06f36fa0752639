//! Colours by number (PS3.3, C.7.6.3.1.5).

use brickfield_core::{Scalar, Voxels, with_voxels};

use super::elements::DataSet;
use super::tags::{self, Tag};
use crate::ReadError;
use crate::numbers::with_room;

/// The colour of each stored value.
#[derive(Debug)]
pub(super) struct Palette {
    /// The stored value of the first entry; lower ones have its colour, too.
    first: i64,
    entries: Vec<[u16; 3]>,
    pub(super) n_bits: u32,
}

impl Palette {
    /// Nothing if a table is missing, too short, or written in segments.
    pub(super) fn new(elements: &DataSet) -> Option<Palette> {
        let [n_entries, first, n_bits] = shape(elements, tags::RED_PALETTE_SHAPE)?;
        let columns = [tags::RED_PALETTE, tags::GREEN_PALETTE, tags::BLUE_PALETTE]
            .map(|tag| column(elements.bytes(tag).unwrap_or_default(), n_entries as usize, n_bits));
        let [red, green, blue] = columns;
        let (red, green, blue) = (red?, green?, blue?);
        let entries = red.into_iter().zip(green).zip(blue).map(|((r, g), b)| [r, g, b]).collect();
        Some(Palette { first, entries, n_bits: n_bits as u32 })
    }

    fn colour(&self, stored: f64) -> [u16; 3] {
        let last = self.entries.len() as i64 - 1;
        self.entries[(stored as i64 - self.first).clamp(0, last) as usize]
    }

    /// Red, green and blue of each value, side by side.
    pub(super) fn colours(&self, stored: &Voxels) -> Result<Voxels, ReadError> {
        let mut rgb = with_room::<u16>(3 * stored.len())?;
        with_voxels!(stored, v => rgb.extend(v.iter().flat_map(|value| self.colour(value.to_f64()))));
        Ok(match self.n_bits {
            8 => Voxels::from(rgb.into_iter().map(|v| v as u8).collect::<Vec<u8>>()),
            _ => Voxels::from(rgb),
        })
    }
}

/// Entries (0 stands for 65536), the first stored value, bits of an entry.
fn shape(elements: &DataSet, tag: Tag) -> Option<[i64; 3]> {
    let [n_entries, first, n_bits] = elements.numbers(tag)?.map(|n: f64| n as i64);
    let n_entries = if n_entries == 0 { 65536 } else { n_entries };
    matches!(n_bits, 8 | 16).then_some([n_entries, first, n_bits])
}

/// The entries of one colour: words, or bytes where eight bits are packed two to a word.
fn column(bytes: &[u8], n_entries: usize, n_bits: i64) -> Option<Vec<u16>> {
    let words = bytes.as_chunks::<2>().0.iter().map(|b| u16::from_le_bytes(*b));
    let column: Vec<u16> = match n_bits {
        8 if bytes.len() < 2 * n_entries => bytes.iter().take(n_entries).map(|b| u16::from(*b)).collect(),
        _ => words.take(n_entries).collect(),
    };
    (column.len() == n_entries && n_entries > 0).then_some(column)
}
