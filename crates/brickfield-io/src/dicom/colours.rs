//! From stored samples to red, green and blue: planes apart, luma with chroma (PS3.3, C.7.6.3.1.2), colours by number
//! (C.7.6.3.1.5).

use brickfield_core::{Scalar, Voxels, with_voxels};

use super::elements::DataSet;
use super::image::{Colour, Image, Planes};
use super::source::Codec;
use super::tags::{self, Tag};
use crate::ReadError;
use crate::samples::with_room;

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

    fn colours(&self, stored: &Voxels) -> Result<Voxels, ReadError> {
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

/// Red, green and blue of each pixel, side by side, of a frame's stored samples.
pub(super) fn interleaved_rgb(samples: Voxels, image: &Image) -> Result<Voxels, ReadError> {
    // Codecs leave samples side by side; that of JPEG turns luma and chroma to RGB, too.
    let is_plain = image.codec == Codec::None;
    let order = match &image.colour {
        Colour::Palette(palette) => return palette.colours(&samples),
        Colour::Ybr422 if is_plain => Order::Paired,
        _ if is_plain && image.planes == Planes::Separate => Order::Separate,
        _ => Order::SideBySide,
    };
    let is_ybr = image.codec != Codec::Jpeg && matches!(image.colour, Colour::Ybr | Colour::Ybr422);
    match (order, is_ybr) {
        (Order::SideBySide, false) => Ok(samples),
        _ => with_voxels!(samples, v => rearranged(&v, image, order, is_ybr)),
    }
}

/// Where the three samples of a pixel lie.
#[derive(Clone, Copy)]
enum Order {
    SideBySide,
    Separate,
    /// Luma of two pixels, then the chroma that they share.
    Paired,
}

fn rearranged<T: Scalar>(stored: &[T], image: &Image, order: Order, is_ybr: bool) -> Result<Voxels, ReadError> {
    let (n_pixels, columns) = (image.n_pixels() as usize, image.columns as usize);
    let mut rgb = with_room::<T>(3 * n_pixels)?;
    for i in 0..n_pixels {
        let pixel = match order {
            Order::SideBySide => [3 * i, 3 * i + 1, 3 * i + 2],
            Order::Separate => [i, n_pixels + i, 2 * n_pixels + i],
            Order::Paired => {
                let (row, column) = (i / columns, i % columns);
                let pair = row * columns.next_multiple_of(2) * 2 + column / 2 * 4;
                [pair + column % 2, pair + 2, pair + 3]
            }
        };
        let pixel = pixel.map(|at| stored[at]);
        match is_ybr {
            true => rgb.extend(rgb_of_ybr(pixel.map(T::to_f64), image.bits.n_stored).map(T::from_f64)),
            false => rgb.extend(pixel),
        }
    }
    Ok(T::wrap(rgb))
}

/// Red, green and blue of luma and chroma, all of `n_bits` (ITU-R BT.601, full range).
fn rgb_of_ybr([luma, blue, red]: [f64; 3], n_bits: u32) -> [f64; 3] {
    let (max, middle) = ((1u64 << n_bits) as f64 - 1.0, (1u64 << (n_bits - 1)) as f64);
    let (blue, red) = (blue - middle, red - middle);
    let rgb = [luma + 1.402 * red, luma - 0.344_136 * blue - 0.714_136 * red, luma + 1.772 * blue];
    rgb.map(|v| v.round().clamp(0.0, max))
}
