//! The bytes of a brick to samples.

use brickfield_core::glam::UVec3;
use brickfield_core::{Level, ScalarType};

use crate::coded::{self, BrokenSection};
use crate::encode::LowBand;
use crate::extent::{ExtentError, n_samples};
use crate::header::{Body, BrickHeader, FORMAT_VERSION, N_CHECKSUM_BYTES, Storage, matches_checksum};
use crate::kernel::Kernel;
use crate::packed;
use crate::quantise::Quantiser;
use crate::sample::Sample;
use crate::transform::Bands;

/// Samples of a brick, of which x varies fastest.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct Decoded<T> {
    pub extent: UVec3,
    pub samples: Vec<T>,
}

/// Why bytes are not a brick.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum DecodeError {
    #[error("the bytes do not begin with BH: they are not a brick of this format")]
    NotABrick,
    #[error("a brick of format version {version}; this program reads version {FORMAT_VERSION}")]
    Version { version: u8 },
    #[error("the brick ends after {given} bytes; {needed} are needed")]
    Truncated { needed: usize, given: usize },
    #[error("the brick has {extra} bytes behind its end")]
    TooLong { extra: usize },
    #[error("the checksum of {part} does not match: the brick is damaged")]
    Checksum { part: &'static str },
    #[error("{field} is outside of its bounds: the brick is damaged")]
    Field { field: &'static str },
    #[error(transparent)]
    Extent(#[from] ExtentError),
    #[error("the brick's samples are {found}, not {wanted}")]
    Type { found: ScalarType, wanted: ScalarType },
    #[error("the brick's storage is {found:?}; only one of {wanted:?} has groups")]
    Storage { found: Storage, wanted: Storage },
    #[error("section {section} makes no coefficients: the brick is damaged")]
    Section { section: usize },
    #[error("level {level} of a brick; it has levels 0 to {coarsest}")]
    Level { level: u8, coarsest: u8 },
    #[error("the low band of the brick is stored elsewhere, and is not given")]
    LowBandElsewhere,
    #[error("the low band of the brick has {expected} samples, but {given} are given")]
    LowBand { expected: usize, given: usize },
    #[error("a decoded sample is outside of the range of {scalar}: the brick is damaged")]
    Range { scalar: ScalarType },
}

/// Decodes all samples.
///
/// Memory is allocated for the samples that the header states, at most [`MAX_SAMPLES`](crate::MAX_SAMPLES), and for their
/// coefficients: [`BrickHeader::read`] says how many before.
///
/// # Errors
/// If the bytes are no brick, are damaged, or have samples of another type.
pub fn decode<T: Sample>(brick: &[u8]) -> Result<Decoded<T>, DecodeError> {
    level_of(&whole_brick(brick)?, brick, Level(0), None)
}

/// Decodes all samples of a brick with [`LowBand::Elsewhere`], given the samples of level 1, x fastest: means rounded to the nearest. A
/// brick that needs none, such as one of one value, leaves it out of account.
///
/// # Errors
/// As for [`decode`], and if the low band has another number of samples.
pub fn decode_with_low<T: Sample>(brick: &[u8], low: &[T]) -> Result<Decoded<T>, DecodeError> {
    level_of(&whole_brick(brick)?, brick, Level(0), Some(low))
}

/// The header of a brick that ends with its last section, of which no byte may be missing.
pub(crate) fn whole_brick(brick: &[u8]) -> Result<BrickHeader, DecodeError> {
    let header = BrickHeader::read(brick)?;
    let needed = header.n_bytes_of_level(Level(0));
    match brick.len().checked_sub(needed) {
        None => Err(DecodeError::Truncated { needed, given: brick.len() }),
        Some(extra) if extra > 0 => Err(DecodeError::TooLong { extra }),
        _ => Ok(header),
    }
}

/// Decodes the samples of a level: ceil(extent / 2^level) of them. Bytes behind [`BrickHeader::n_bytes_of_level`] are not read, and may
/// be absent.
///
/// With the kernels [`Kernel::AVERAGING`], a level's samples are the floors of averages of pairs of the level below, along x, then y,
/// then z. With the 5/3 kernel they are its low band, in the range of the type. A brick without bands (the median kernel, raw, one value) has every level of this kind, but needs all its bytes.
///
/// # Errors
/// As for [`decode`], and if the brick does not have the level.
pub fn decode_level<T: Sample>(brick: &[u8], level: Level) -> Result<Decoded<T>, DecodeError> {
    level_of(&BrickHeader::read(brick)?, brick, level, None)
}

fn level_of<T: Sample>(
    header: &BrickHeader,
    brick: &[u8],
    level: Level,
    low: Option<&[T]>,
) -> Result<Decoded<T>, DecodeError> {
    if header.scalar != T::TYPE {
        return Err(DecodeError::Type { found: header.scalar, wanted: T::TYPE });
    }
    if level.0 > header.coarsest_level() {
        return Err(DecodeError::Level { level: level.0, coarsest: header.coarsest_level() });
    }
    let extent = level.dims_of(header.extent);
    let n_bytes = header.n_bytes_of_level(level);
    if brick.len() < n_bytes {
        return Err(DecodeError::Truncated { needed: n_bytes, given: brick.len() });
    }
    let samples = match header.body {
        Body::Value(value) => vec![in_range::<T>(value)?; n_samples(extent)?],
        Body::Raw => raw_level(header, sections(header, brick, level)?[0], level),
        Body::Packed | Body::Coded(_) => band_level(header, &sections(header, brick, level)?, level, low)?,
    };
    Ok(Decoded { extent, samples })
}

fn in_range<T: Sample>(value: i64) -> Result<T, DecodeError> {
    let sample = T::saturate(value);
    if sample.to_i64() == value { Ok(sample) } else { Err(DecodeError::Range { scalar: T::TYPE }) }
}

/// The sections that a level needs, without their checksums, which match.
pub(crate) fn sections<'a>(header: &BrickHeader, brick: &'a [u8], level: Level) -> Result<Vec<&'a [u8]>, DecodeError> {
    let mut rest = &brick[header.n_bytes..header.n_bytes_of_level(level)];
    let mut sections = Vec::new();
    for &n in &header.n_section_bytes[..header.n_sections_of_level(level)] {
        let (section, behind) = rest.split_at(n);
        let (checksum, behind) = behind.split_at(N_CHECKSUM_BYTES);
        if !matches_checksum(section, checksum) {
            return Err(DecodeError::Checksum { part: "a section" });
        }
        sections.push(section);
        rest = behind;
    }
    Ok(sections)
}

fn raw_level<T: Sample>(header: &BrickHeader, section: &[u8], level: Level) -> Vec<T> {
    let value = |bytes: &[u8]| {
        let unsigned = bytes.iter().rev().fold(0u32, |value, &byte| value << 8 | u32::from(byte));
        let unused = 32 - 8 * bytes.len() as u32;
        let is_signed = matches!(header.scalar, ScalarType::I8 | ScalarType::I16 | ScalarType::I32);
        if is_signed { i64::from((unsigned << unused) as i32 >> unused) } else { i64::from(unsigned) }
    };
    let samples: Vec<T> = section.chunks_exact(T::TYPE.n_bytes()).map(|bytes| T::saturate(value(bytes))).collect();
    if level == Level(0) {
        return samples;
    }
    let averages = averages(header.extent, samples.iter().map(|s| s.widen()).collect(), level);
    averages.into_iter().map(|average| T::saturate(crate::Coefficient::to_i64(average))).collect()
}

/// Averages of averages, as the Haar kernels make them.
fn averages<C: crate::Coefficient>(extent: UVec3, values: Vec<C>, level: Level) -> Vec<C> {
    let bands = Bands::of(Kernel::Haar, extent, values, level.0);
    bands.into_level(level)
}

fn band_level<T: Sample>(
    header: &BrickHeader,
    sections: &[&[u8]],
    level: Level,
    low: Option<&[T]>,
) -> Result<Vec<T>, DecodeError> {
    let mut bands = Bands::zero(header.kernel, header.extent, header.n_levels, level);
    let is_elsewhere = header.low_band() == LowBand::Elsewhere;
    if is_elsewhere {
        fill_low(&mut bands, low.ok_or(DecodeError::LowBandElsewhere)?)?;
    }
    for (i, section) in sections.iter().enumerate().skip(usize::from(is_elsewhere)) {
        let of_level = header.n_levels.checked_sub(i as u8);
        decode_section(&mut bands, header.body, of_level, section).map_err(|_| DecodeError::Section { section: i })?;
    }
    let values = match header.has_bands() {
        true if is_elsewhere => bands.without_means().into_level(level),
        true => bands.into_level(level),
        false => averages(header.extent, bands.into_level(Level(0)), level),
    };
    restore(header, values, level)
}

fn fill_low<T: Sample>(bands: &mut Bands<T::Coefficient>, low: &[T]) -> Result<(), DecodeError> {
    let own = bands.low_mut();
    if own.len() != low.len() {
        return Err(DecodeError::LowBand { expected: own.len(), given: low.len() });
    }
    own.iter_mut().zip(low).for_each(|(own, sample)| *own = sample.widen());
    Ok(())
}

/// Section 0 has the low band, section i > 0 the details of level n_levels - i.
fn decode_section<C: crate::Coefficient>(
    bands: &mut Bands<C>,
    body: Body,
    level: Option<u8>,
    section: &[u8],
) -> Result<(), BrokenSection> {
    let level = level.map(Level).ok_or(BrokenSection)?;
    let is_low = level.0 == bands.n_levels();
    match (body, is_low) {
        (Body::Coded(model), true) => coded::decode_low(bands, section, &model),
        (Body::Coded(model), false) => coded::decode_details(bands, level, section, &model),
        (_, true) => packed::decode_low(bands, section),
        (_, false) => packed::decode_details(bands, level, section),
    }
}

/// Values to samples: exactly in the type's range if nothing was lost, otherwise the nearest sample. The 5/3 kernel's low band goes
/// beyond the range where samples jump between its ends.
fn restore<T: Sample>(header: &BrickHeader, values: Vec<T::Coefficient>, level: Level) -> Result<Vec<T>, DecodeError> {
    let is_lossless = header.max_error == 0 && header.step == 1;
    if is_lossless && (level == Level(0) || header.kernel != Kernel::LeGall53) {
        // All are looked at, so that the loop has no exit.
        let are_held = values.iter().fold(true, |all, &value| all & T::holds(value));
        return match are_held {
            true => Ok(values.iter().map(|&value| T::truncate(value)).collect()),
            false => Err(DecodeError::Range { scalar: T::TYPE }),
        };
    }
    let quantiser = Quantiser::with_step(header.step);
    Ok(values.into_iter().map(|value| quantiser.restore_nearest(value)).collect())
}
