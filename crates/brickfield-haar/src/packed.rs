//! Boxes of coefficients as groups of 64 numbers of one width, so that any of them is found by its place: for devices that decode
//! each coefficient on its own.
//!
//! A section is one byte for each group, its width w, and then the groups: 64 numbers of w bits, which are 8 w bytes. The last group
//! may be shorter, and ends with a whole byte. Numbers are coefficients in zigzag order (0, -1, 1, -2, ...), band by band, row by row.

use brickfield_core::Level;
use brickfield_core::glam::UVec3;

use crate::bits::{BitReader, BitWriter, low_bits};
use crate::coded::BrokenSection;
use crate::encode::LowBand;
use crate::extent::BandBox;
use crate::sample::Coefficient;
use crate::transform::Bands;

/// Numbers of a group, but for the last one.
pub(crate) const N_IN_GROUP: usize = 64;
/// The widest number. Coefficients of u32 have at most 40 bits.
const GREATEST_WIDTH: u8 = 56;

/// The bytes of all sections of a brick, coarsest first.
pub(crate) fn encode<C: Coefficient>(bands: &Bands<C>, low_band: LowBand) -> Vec<Vec<u8>> {
    boxes_of(bands, low_band).map(|(array, all, boxes)| encode_section(&numbers(array, all, &boxes))).collect()
}

/// The number of bytes that [`encode`] will make.
pub(crate) fn n_bytes<C: Coefficient>(bands: &Bands<C>, low_band: LowBand) -> usize {
    boxes_of(bands, low_band).map(|(array, all, boxes)| n_section_bytes(array, all, &boxes)).sum()
}

fn n_section_bytes<C: Coefficient>(array: &[C], all: UVec3, boxes: &[BandBox]) -> usize {
    let mut n_bytes = 0;
    let (mut union, mut n_in_group) = (0, 0);
    for band in boxes {
        for (z, y) in rows(band) {
            let mut row = &array[band.row(all, y, z)..][..band.n.x as usize];
            while !row.is_empty() {
                let (own, rest) = row.split_at(row.len().min(N_IN_GROUP - n_in_group));
                union = own.iter().fold(union, |union, c| union | zigzag(c.to_i64()));
                n_in_group += own.len();
                if n_in_group == N_IN_GROUP {
                    n_bytes += 1 + n_group_bytes(n_bits(union), n_in_group);
                    (union, n_in_group) = (0, 0);
                }
                row = rest;
            }
        }
    }
    if n_in_group == 0 { n_bytes } else { n_bytes + 1 + n_group_bytes(n_bits(union), n_in_group) }
}

/// The bytes of a group of `n` numbers of a width, without the byte of its width.
pub(crate) fn n_group_bytes(width: u32, n: usize) -> usize {
    (width as usize * n).div_ceil(8)
}

/// The bits of a number, from its highest one on.
fn n_bits(number: u64) -> u32 {
    u64::BITS - number.leading_zeros()
}

/// For each section its array, the array's extent and the boxes in it; no box for a low band elsewhere.
fn boxes_of<C: Coefficient>(bands: &Bands<C>, low_band: LowBand) -> impl Iterator<Item = (&[C], UVec3, Vec<BandBox>)> {
    let n = bands.extent(Level(bands.n_levels()));
    let details = |level: u8| {
        let n = bands.extent(Level(level));
        (bands.details(Level(level)), n, BandBox::details(n).collect())
    };
    let boxes = if low_band == LowBand::Stored { vec![BandBox::whole(n)] } else { Vec::new() };
    let low = (bands.low(), n, boxes);
    std::iter::once(low).chain((0..bands.n_levels()).rev().map(details))
}

/// The coefficients of the boxes in zigzag order.
fn numbers<C: Coefficient>(array: &[C], all: UVec3, boxes: &[BandBox]) -> Vec<u64> {
    let mut numbers = Vec::with_capacity(array.len());
    for band in boxes {
        for (z, y) in rows(band) {
            let row = &array[band.row(all, y, z)..][..band.n.x as usize];
            numbers.extend(row.iter().map(|c| zigzag(c.to_i64())));
        }
    }
    numbers
}

fn rows(band: &BandBox) -> impl Iterator<Item = (usize, usize)> + use<> {
    let [_, ny, nz] = band.n.to_array().map(|n| n as usize);
    (0..nz).flat_map(move |z| (0..ny).map(move |y| (z, y)))
}

fn width(group: &[u64]) -> u8 {
    n_bits(group.iter().fold(0, |all, n| all | n)) as u8
}

fn encode_section(numbers: &[u64]) -> Vec<u8> {
    let groups = numbers.chunks(N_IN_GROUP);
    let mut bytes: Vec<u8> = groups.clone().map(width).collect();
    for group in groups {
        let mut writer = BitWriter::default();
        let width = u32::from(width(group));
        for &number in group {
            writer.push(low_bits(number, width.min(32)), width.min(32));
            writer.push(number >> width.min(32), width.saturating_sub(32));
        }
        bytes.extend(writer.into_bytes());
    }
    bytes
}

/// Decodes the section with the low band.
pub(crate) fn decode_low<C: Coefficient>(bands: &mut Bands<C>, bytes: &[u8]) -> Result<(), BrokenSection> {
    let n = bands.extent(Level(bands.n_levels()));
    decode_section(bands.low_mut(), n, &[BandBox::whole(n)], bytes)
}

/// Decodes the section with the details of a level.
pub(crate) fn decode_details<C: Coefficient>(
    bands: &mut Bands<C>,
    level: Level,
    bytes: &[u8],
) -> Result<(), BrokenSection> {
    let n = bands.extent(level);
    decode_section(bands.details_mut(level), n, &BandBox::details(n).collect::<Vec<_>>(), bytes)
}

fn decode_section<C: Coefficient>(
    array: &mut [C],
    all: UVec3,
    boxes: &[BandBox],
    bytes: &[u8],
) -> Result<(), BrokenSection> {
    let n = boxes.iter().map(|band| band.n.element_product() as usize).sum();
    let coefficients: Vec<C> = decode_numbers(bytes, n)?;
    let mut rest = &coefficients[..];
    for band in boxes {
        for (z, y) in rows(band) {
            let (row, behind) = rest.split_at(band.n.x as usize);
            array[band.row(all, y, z)..][..row.len()].copy_from_slice(row);
            rest = behind;
        }
    }
    Ok(())
}

fn decode_numbers<C: Coefficient>(bytes: &[u8], n: usize) -> Result<Vec<C>, BrokenSection> {
    let (widths, mut groups) = bytes.split_at_checked(n.div_ceil(N_IN_GROUP)).ok_or(BrokenSection)?;
    let mut coefficients = vec![C::default(); n];
    for (group, &width) in coefficients.chunks_mut(N_IN_GROUP).zip(widths) {
        if width > GREATEST_WIDTH {
            return Err(BrokenSection);
        }
        let n_bytes = n_group_bytes(u32::from(width), group.len());
        let (own, behind) = groups.split_at_checked(n_bytes).ok_or(BrokenSection)?;
        decode_group(own, u32::from(width), group);
        groups = behind;
    }
    if groups.is_empty() { Ok(coefficients) } else { Err(BrokenSection) }
}

fn decode_group<C: Coefficient>(bytes: &[u8], width: u32, group: &mut [C]) {
    if width == 0 {
        return;
    }
    let mut reader = BitReader::new(bytes);
    let n_at_once = (56 / width).min(8);
    for some in group.chunks_mut(n_at_once as usize) {
        let mut window = reader.window();
        for value in some {
            *value = C::wrap_from(unzigzag(low_bits(window, width)));
            window >>= width;
        }
        reader.skip(n_at_once * width);
    }
}

/// 0, -1, 1, -2, ... as 0, 1, 2, 3, ...
pub(crate) fn zigzag(value: i64) -> u64 {
    (value << 1 ^ value >> 63) as u64
}

/// Undoes [`zigzag`].
#[inline(always)]
pub(crate) fn unzigzag(number: u64) -> i64 {
    (number >> 1) as i64 ^ -((number & 1) as i64)
}
