//! Samples to the bytes of a brick.

use brickfield_core::Level;
use brickfield_core::glam::UVec3;

use crate::coded::Symbols;
use crate::extent::{ExtentError, MAX_LEVELS, n_samples};
use crate::header::{Body, BrickHeader, Storage};
use crate::kernel::Kernel;
use crate::packed;
use crate::quantise::{Quantiser, max_difference};
use crate::sample::Sample;
use crate::transform::Bands;

/// How a brick is encoded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EncodeOptions {
    /// The kernels that are tried; the one with the fewest bytes is used.
    pub kernels: Vec<Kernel>,
    /// The storages that may be used.
    pub storages: Storages,
    /// Levels above level 0 that are stored apart, or `None` for as many as leave at most 4 samples along each axis; 1 with
    /// [`LowBand::Elsewhere`].
    pub n_levels: Option<u8>,
    /// What may be lost.
    pub loss: Loss,
    /// Whether the low band is a part of the brick.
    pub low_band: LowBand,
}

/// Where the low band is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LowBand {
    /// In the brick.
    Stored,
    /// Not in the brick: level 1 is stored elsewhere, and [`decode_with_low`](crate::decode_with_low) is given it. Its samples are those of
    /// an ordinary pyramid: the mean of each 2 x 2 x 2 samples, fewer at the upper ends, rounded to the nearest, halves up.
    Elsewhere,
}

/// The storages that may be used. Whatever is chosen, a brick of one value is [`Storage::OneValue`], and one that would be longer than
/// its samples is [`Storage::Raw`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Storages {
    /// [`Storage::Coded`]; but [`Storage::Packed`] where it is at most 1/32 longer, because it is decoded faster.
    Smallest,
    /// [`Storage::Packed`], which can be decoded coefficient by coefficient.
    Packed,
}

/// What may be lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Loss {
    /// Nothing: decoded samples equal the encoded ones.
    None,
    /// At most this difference between a decoded and an encoded sample of level 0; at most 2^31 - 1.
    MaxError(u32),
    /// Details with a magnitude below this are set to 0, as in Saladi et al. 2003. The difference has no bound of its own; the header
    /// says how large it became ([`BrickHeader::max_error`]).
    Threshold(u32),
}

impl Default for EncodeOptions {
    /// The kernels that make one pyramid, the smallest storage, lossless.
    fn default() -> EncodeOptions {
        EncodeOptions {
            kernels: Kernel::AVERAGING.to_vec(),
            storages: Storages::Smallest,
            n_levels: None,
            loss: Loss::None,
            low_band: LowBand::Stored,
        }
    }
}

/// Why a brick cannot be encoded.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum EncodeError {
    #[error(transparent)]
    Extent(#[from] ExtentError),
    #[error("a brick of {extent} has {expected} samples, but {given} are given")]
    Samples { extent: UVec3, expected: usize, given: usize },
    #[error("{given} levels of a brick; at most {MAX_LEVELS} can be stored")]
    Levels { given: u8 },
    #[error("the list of kernels is empty; at least one must be tried")]
    NoKernel,
    #[error("a greatest error of {given}; at most {most} can be asked for", most = i32::MAX)]
    MaxError { given: u32 },
    #[error("the kernel median has no details that a threshold of {threshold} could set to 0")]
    NoDetails { threshold: u32 },
    #[error(
        "the low band of the kernel {kernel} cannot be stored elsewhere; only those of haar and haar-predicted can"
    )]
    NoLowBand { kernel: Kernel },
    #[error("{given} levels above a brick whose level 1 is stored elsewhere; it must be 1")]
    LevelsBelowMeans { given: u8 },
    #[error("a low band can be stored elsewhere only if nothing is lost, but {loss:?} is asked for")]
    LossyLowBand { loss: Loss },
}

/// Encodes a brick of samples, of which x varies fastest.
///
/// # Errors
/// If the number of samples is not the extent's, or an option is outside of its bounds.
pub fn encode<T: Sample>(extent: UVec3, samples: &[T], options: &EncodeOptions) -> Result<Vec<u8>, EncodeError> {
    let expected = n_samples(extent)?;
    if samples.len() != expected {
        return Err(EncodeError::Samples { extent, expected, given: samples.len() });
    }
    let n_levels = check(options, extent)?;
    let quantiser = Quantiser::of(options.loss);
    if let Some(value) = quantiser.one_value(samples) {
        return Ok(of_one_value(extent, samples, value));
    }
    let best = best_candidate(extent, &quantiser.quantise(samples), n_levels, options);
    let brick = of_bands(samples, best, quantiser, options);
    let is_longer_than_samples = brick.len() > samples.len() * T::TYPE.n_bytes();
    Ok(if is_longer_than_samples { of_raw(extent, samples) } else { brick })
}

/// Holds options to their bounds; the number of levels.
fn check(options: &EncodeOptions, extent: UVec3) -> Result<u8, EncodeError> {
    if options.kernels.is_empty() {
        return Err(EncodeError::NoKernel);
    }
    match options.loss {
        Loss::MaxError(given) if given > i32::MAX as u32 => return Err(EncodeError::MaxError { given }),
        Loss::Threshold(threshold) if options.kernels.iter().any(|k| !k.has_bands()) => {
            return Err(EncodeError::NoDetails { threshold });
        }
        _ => {}
    }
    let n_levels = n_levels(options, extent)?;
    if options.low_band == LowBand::Elsewhere {
        check_low_band(options, n_levels)?;
    }
    Ok(n_levels)
}

/// Whether the low band is samples of the next level.
fn check_low_band(options: &EncodeOptions, n_levels: u8) -> Result<(), EncodeError> {
    let is_other = |kernel: &&Kernel| !matches!(kernel, Kernel::Haar | Kernel::HaarPredicted);
    match options.kernels.iter().find(is_other) {
        Some(&kernel) => Err(EncodeError::NoLowBand { kernel }),
        None if n_levels != 1 => Err(EncodeError::LevelsBelowMeans { given: n_levels }),
        None if options.loss != Loss::None => Err(EncodeError::LossyLowBand { loss: options.loss }),
        None => Ok(()),
    }
}

fn n_levels(options: &EncodeOptions, extent: UVec3) -> Result<u8, EncodeError> {
    match options.n_levels {
        Some(given) if given > MAX_LEVELS => Err(EncodeError::Levels { given }),
        Some(n_levels) => Ok(n_levels),
        None if options.low_band == LowBand::Elsewhere => Ok(1),
        None => Ok((0..MAX_LEVELS).find(|&l| Level(l).dims_of(extent).max_element() <= 4).unwrap_or(MAX_LEVELS)),
    }
}

/// A way to encode a brick, and about how many bytes it needs.
struct Candidate<C> {
    bands: Bands<C>,
    form: Form<C>,
    n_bytes: usize,
}

enum Form<C> {
    Packed,
    Coded(Symbols<C>),
}

fn best_candidate<C: crate::Coefficient>(
    extent: UVec3,
    values: &[C],
    n_levels: u8,
    options: &EncodeOptions,
) -> Candidate<C> {
    let of_kernel = |&kernel: &Kernel| {
        let n_levels = if kernel.has_bands() { n_levels } else { 0 };
        let mut bands = match options.low_band {
            LowBand::Stored => Bands::of(kernel, extent, values.to_vec(), n_levels),
            LowBand::Elsewhere => Bands::below_means(kernel, extent, values.to_vec()),
        };
        if let Loss::Threshold(bound) = options.loss {
            bands.threshold(u64::from(bound));
        }
        let packed = packed::n_bytes(&bands, options.low_band);
        if options.storages == Storages::Packed {
            return Candidate { bands, form: Form::Packed, n_bytes: packed };
        }
        let symbols = Symbols::of(&bands, options.low_band);
        let coded = symbols.estimated_bytes();
        match packed <= coded + coded / 32 {
            true => Candidate { bands, form: Form::Packed, n_bytes: packed },
            false => Candidate { bands, form: Form::Coded(symbols), n_bytes: coded },
        }
    };
    options.kernels.iter().map(of_kernel).min_by_key(|candidate| candidate.n_bytes).expect("a kernel at least")
}

fn header<T: Sample>(extent: UVec3, storage: Storage, body: Body) -> BrickHeader {
    BrickHeader {
        scalar: T::TYPE,
        extent,
        kernel: Kernel::Haar,
        n_levels: 0,
        storage,
        step: 1,
        max_error: 0,
        body,
        n_section_bytes: Vec::new(),
        n_bytes: 0,
    }
}

fn of_one_value<T: Sample>(extent: UVec3, samples: &[T], value: T) -> Vec<u8> {
    let max_error = max_difference(samples, std::iter::repeat(value));
    BrickHeader { max_error, ..header::<T>(extent, Storage::OneValue, Body::Value(value.to_i64())) }.to_bytes()
}

fn of_raw<T: Sample>(extent: UVec3, samples: &[T]) -> Vec<u8> {
    let mut bytes = header::<T>(extent, Storage::Raw, Body::Raw).to_bytes();
    let n_bytes = T::TYPE.n_bytes();
    push_section(
        &mut bytes,
        &samples.iter().flat_map(|s| s.to_i64().to_le_bytes().into_iter().take(n_bytes)).collect::<Vec<u8>>(),
    );
    bytes
}

fn of_bands<T: Sample>(
    samples: &[T],
    best: Candidate<T::Coefficient>,
    quantiser: Quantiser,
    &EncodeOptions { loss, low_band, .. }: &EncodeOptions,
) -> Vec<u8> {
    let (body, sections) = match &best.form {
        Form::Packed => (Body::Packed, packed::encode(&best.bands, low_band)),
        Form::Coded(symbols) => {
            let (model, sections) = symbols.encode();
            (Body::Coded(model), sections)
        }
    };
    let storage = if body == Body::Packed { Storage::Packed } else { Storage::Coded };
    let bands = best.bands;
    let mut header = BrickHeader {
        kernel: bands.kernel(),
        n_levels: bands.n_levels(),
        step: quantiser.step(),
        n_section_bytes: sections.iter().map(Vec::len).collect(),
        ..header::<T>(bands.extent(Level(0)), storage, body)
    };
    if loss != Loss::None {
        let decoded = bands.into_level(Level(0));
        header.max_error = max_difference(samples, decoded.into_iter().map(|c| quantiser.restore_nearest(c)));
    }
    let mut bytes = header.to_bytes();
    sections.iter().for_each(|section| push_section(&mut bytes, section));
    bytes
}

fn push_section(bytes: &mut Vec<u8>, section: &[u8]) {
    bytes.extend_from_slice(section);
    bytes.extend(crc32c::crc32c(section).to_le_bytes());
}
