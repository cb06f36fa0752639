//! A packed brick as a device takes it: groups of numbers, not yet decoded.

use brickfield_core::Level;

use crate::decode::{DecodeError, sections, whole_brick};
use crate::encode::LowBand;
use crate::extent::BandBox;
use crate::header::{BrickHeader, Storage};
use crate::packed::{N_IN_GROUP, n_group_bytes};

/// The groups of a brick of [`Storage::Packed`], for decoders that find each coefficient by its place. Checksums, lengths and widths
/// are held to their bounds: every number that the extent asks for is there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PackedBrick<'a> {
    header: BrickHeader,
    sections: Vec<PackedSection<'a>>,
}

/// A section of a packed brick: groups of 64 numbers, the last of which may be shorter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PackedSection<'a> {
    /// The bits of a number, for each group: at most those of a coefficient, 16 for samples of 8 bits, 32 for samples of 16, and
    /// 56 for samples of 32.
    pub widths: &'a [u8],
    /// The groups; each begins with a whole byte. Numbers are coefficients in zigzag order: 0, -1, 1, -2, ...
    pub groups: &'a [u8],
    /// Coefficients of the section.
    pub n_numbers: usize,
}

impl<'a> PackedBrick<'a> {
    /// Opens a whole brick.
    ///
    /// # Errors
    /// If the bytes are no brick or are damaged; if the brick is stored another way, or its low band is stored elsewhere.
    pub fn read(brick: &'a [u8]) -> Result<PackedBrick<'a>, DecodeError> {
        let header = whole_brick(brick)?;
        if header.storage() != Storage::Packed {
            return Err(DecodeError::Storage { found: header.storage(), wanted: Storage::Packed });
        }
        if header.low_band() == LowBand::Elsewhere {
            return Err(DecodeError::LowBandElsewhere);
        }
        let greatest_width = (16 * header.scalar().n_bytes()).min(56) as u8;
        let opened = (0..).zip(sections(&header, brick, Level(0))?).map(|(i, bytes)| {
            open(bytes, n_coefficients(&header, i), greatest_width).ok_or(DecodeError::Section { section: i })
        });
        let sections = opened.collect::<Result<_, DecodeError>>()?;
        Ok(PackedBrick { header, sections })
    }

    /// What the brick says about itself.
    pub fn header(&self) -> &BrickHeader {
        &self.header
    }

    /// The sections, coarsest first: the low band, then the details of each level down to level 0.
    pub fn sections(&self) -> &[PackedSection<'a>] {
        &self.sections
    }
}

/// Coefficients of section `i`: of the low band, or of the details of level `n_levels - i`.
fn n_coefficients(header: &BrickHeader, i: usize) -> usize {
    let level = |l: u8| Level(l).dims_of(header.extent());
    let n_levels = header.n_levels();
    match i {
        0 => level(n_levels).element_product() as usize,
        _ => BandBox::details(level(n_levels - i as u8)).map(|band| band.n.element_product() as usize).sum(),
    }
}

fn open(bytes: &[u8], n_numbers: usize, greatest_width: u8) -> Option<PackedSection<'_>> {
    let (widths, groups) = bytes.split_at_checked(n_numbers.div_ceil(N_IN_GROUP))?;
    let of_group =
        |(i, width): (usize, &u8)| n_group_bytes(u32::from(*width), N_IN_GROUP.min(n_numbers - i * N_IN_GROUP));
    let n_bytes: usize = widths.iter().enumerate().map(of_group).sum();
    let is_held = widths.iter().all(|width| *width <= greatest_width) && groups.len() == n_bytes;
    is_held.then_some(PackedSection { widths, groups, n_numbers })
}
