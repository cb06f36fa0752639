//! Samples of slots as groups of numbers that a device unpacks.

use brickfield_core::glam::UVec3;
use brickfield_haar::{BrickHeader, EncodeOptions, Kernel, Loss, PackedBrick, Sample, Storages, decode, encode};
use bytemuck::{Pod, Zeroable};

use crate::SampleFormat;

/// How the samples of slots are brought to a device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Upload {
    /// As they are.
    #[default]
    Plain,
    /// Packed (`brickfield-haar`: storage *packed*, the smaller of both Haar kernels), and unpacked by the device. Slots that would not
    /// be smaller are brought as they are, and so are floats.
    Packed {
        /// By how much a sample may differ from its own value, in stored integers; 0 for not at all. Every backend draws the samples
        /// that are unpacked.
        max_error: u16,
    },
}

/// The samples of a slot, packed.
///
/// ```text
/// words   first group of each section | runs | groups
/// run     word of its first group, then 16 widths of a byte each: 5 words for 16 groups
/// group   64 numbers of one width w in 2 w words; the last group of a section is filled up with zeros
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct PackedSamples {
    uniform: PackedUniform,
    words: Box<[u32]>,
}

/// A packed slot as shaders read it, one of an array.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PackedUniform {
    /// Samples along x, y, z.
    pub extent: [u32; 3],
    /// Levels above level 0.
    pub n_levels: u32,
    /// The place of its first coefficient.
    pub first_coefficient: u32,
    /// The place of its first word of texels.
    pub first_texel: u32,
    /// Words from a row of texels to the next one.
    pub row_words: u32,
    /// The number by which values are multiplied.
    pub step: i32,
    /// The place of its first word.
    pub first_word: u32,
    /// The kernel: 0 Haar, 1 Haar predicted; 2 if all samples have one value.
    pub kernel: u32,
    /// That value.
    pub value: i32,
    /// Unused.
    pub padding: u32,
}

/// A task of a device that unpacks, as shaders read it.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct DecodingUniforms {
    /// 0: numbers become coefficients, 1: one axis of one level is transformed back, 2: values become texels.
    pub task: u32,
    /// The level.
    pub level: u32,
    /// The axis.
    pub axis: u32,
    /// Bits of a sample.
    pub sample_bits: u32,
}

/// Groups whose places follow from the place of the first.
const N_IN_RUN: usize = 16;
/// Most samples of a slot that is packed: 64 MiB of coefficients.
const MOST_SAMPLES: usize = 1 << 24;
/// The kernels that devices undo, in the order of their numbers in shaders.
const KERNELS: [Kernel; 2] = [Kernel::Haar, Kernel::HaarPredicted];
/// In place of a kernel: all samples have one value.
const ONE_VALUE: u32 = KERNELS.len() as u32;

impl PackedSamples {
    /// Packs samples of a format, x fastest; also the samples that come back, if they are not the same. `None` if they would have no
    /// fewer bytes packed, and for floats.
    pub(crate) fn of(
        extent: UVec3,
        format: SampleFormat,
        samples: &[u8],
        max_error: u16,
    ) -> Option<(PackedSamples, Option<Vec<u8>>)> {
        if samples.len() > MOST_SAMPLES * format.n_bytes() {
            return None;
        }
        let (packed, restored) = match format {
            SampleFormat::Unorm8 => pack(extent, samples, max_error)?,
            SampleFormat::Unorm16 => {
                let samples: Vec<u16> = samples.as_chunks().0.iter().map(|bytes| u16::from_le_bytes(*bytes)).collect();
                let (packed, restored) = pack(extent, &samples, max_error)?;
                (packed, restored.map(|samples| samples.into_iter().flat_map(u16::to_le_bytes).collect()))
            }
            SampleFormat::Float32 | SampleFormat::Unorm8x4 => return None,
        };
        (packed.n_bytes() < samples.len()).then_some((packed, restored))
    }

    /// Samples along x, y, z of the texture.
    pub fn extent(&self) -> UVec3 {
        UVec3::from(self.uniform.extent)
    }

    /// The levels above level 0 that are transformed back.
    pub fn n_levels(&self) -> u8 {
        self.uniform.n_levels as u8
    }

    /// The groups, and where they are.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// The slot as shaders read it, if its words begin at `first_word`, its coefficients at `first_coefficient`, and its texels at word
    /// `first_texel`, in rows of `row_words` words.
    pub fn uniform(&self, first_word: u32, first_coefficient: u32, first_texel: u32, row_words: u32) -> PackedUniform {
        PackedUniform { first_word, first_coefficient, first_texel, row_words, ..self.uniform }
    }

    /// Bytes that a device is brought.
    pub fn n_bytes(&self) -> usize {
        size_of::<PackedUniform>() + size_of_val(self.words())
    }

    fn of_brick(brick: &PackedBrick<'_>) -> Option<PackedSamples> {
        let header = brick.header();
        let kernel = KERNELS.iter().position(|kernel| *kernel == header.kernel())? as u32;
        let (mut first_groups, mut widths, mut groups, mut firsts) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for section in brick.sections() {
            first_groups.push(widths.len() as u32);
            let mut rest = section.groups;
            for (i, &width) in section.widths.iter().enumerate() {
                let n_numbers = 64.min(section.n_numbers - 64 * i);
                let (own, behind) = rest.split_at((usize::from(width) * n_numbers).div_ceil(8));
                firsts.push(groups.len() as u32);
                groups.extend(own.chunks(4).map(word));
                groups.resize(firsts[firsts.len() - 1] as usize + 2 * usize::from(width), 0);
                rest = behind;
            }
            widths.extend_from_slice(section.widths);
        }
        let n_before = (first_groups.len() + 5 * widths.len().div_ceil(N_IN_RUN)) as u32;
        let mut words = first_groups;
        for (widths, firsts) in widths.chunks(N_IN_RUN).zip(firsts.chunks(N_IN_RUN)) {
            words.push(n_before + firsts[0]);
            let mut of_run = [0; N_IN_RUN];
            of_run[..widths.len()].copy_from_slice(widths);
            words.extend(of_run.chunks(4).map(word));
        }
        words.append(&mut groups);
        let step = header.step() as i32;
        let n_levels = header.n_levels().into();
        let uniform = PackedUniform { n_levels, step, kernel, ..unplaced(header.extent()) };
        Some(PackedSamples { uniform, words: words.into() })
    }
}

fn unplaced(extent: UVec3) -> PackedUniform {
    PackedUniform { extent: extent.to_array(), ..PackedUniform::zeroed() }
}

/// At most four bytes, the first the lowest.
fn word(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |word, byte| word << 8 | u32::from(*byte))
}

fn pack<T: Sample>(extent: UVec3, samples: &[T], max_error: u16) -> Option<(PackedSamples, Option<Vec<T>>)> {
    let options = EncodeOptions {
        kernels: KERNELS.to_vec(),
        storages: Storages::Packed,
        loss: if max_error == 0 { Loss::None } else { Loss::MaxError(max_error.into()) },
        ..EncodeOptions::default()
    };
    // Samples that do not fill their extent are not packed; slots refuse them.
    let brick = encode(extent, samples, &options).ok()?;
    let header = BrickHeader::read(&brick).ok()?;
    let packed = match header.one_value() {
        Some(value) => PackedSamples {
            uniform: PackedUniform { step: 1, kernel: ONE_VALUE, value: value as i32, ..unplaced(extent) },
            words: Box::new([]),
        },
        None => PackedSamples::of_brick(&PackedBrick::read(&brick).ok()?)?,
    };
    let restored = if header.max_error() == 0 { None } else { Some(decode(&brick).ok()?.samples) };
    Some((packed, restored))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use brickfield_core::BrickSide;

    use super::*;
    use crate::{Chunk, Decode, Places, Slots, SlotsError};

    const LOSSLESS: Upload = Upload::Packed { max_error: 0 };

    fn chunk(extent: UVec3, format: SampleFormat, upload: Upload, sample: impl Fn(u32) -> u8) -> Chunk {
        let n = extent.element_product() * format.n_bytes() as u32;
        Chunk::of_samples(extent, format, (0..n).map(sample).collect(), upload)
    }

    #[test]
    fn samples_are_packed_where_that_is_fewer_bytes() {
        let (side, noise) = (UVec3::splat(16), |i: u32| (i.wrapping_mul(2_654_435_761) >> 24) as u8);
        let unorm8 = |sample: fn(u32) -> u8| chunk(side, SampleFormat::Unorm8, LOSSLESS, sample);
        let ramp = unorm8(|i| (i % 16 + i / 256) as u8);
        let packed = ramp.packed().unwrap();
        assert!(packed.n_bytes() < 4096 / 2 && packed.n_levels() == 2 && packed.extent() == side);
        assert_eq!(unorm8(|_| 7).packed().unwrap().n_bytes(), 48);
        assert!(chunk(side, SampleFormat::Unorm8, LOSSLESS, noise).packed().is_none());
        assert!(chunk(side, SampleFormat::Float32, LOSSLESS, |_| 0).packed().is_none());
        assert!(chunk(side, SampleFormat::Unorm8, Upload::Plain, |_| 7).packed().is_none());
        let renewed = ramp.renewed();
        assert!(renewed.id() != ramp.id() && renewed.packed() == ramp.packed() && renewed == ramp);
    }

    #[test]
    fn lossy_samples_are_those_that_come_back() {
        let noise = |i: u32| 100 + (i.wrapping_mul(2_654_435_761) >> 27) as u8;
        let [own, lossy] = [Upload::Plain, Upload::Packed { max_error: 3 }]
            .map(|u| chunk(UVec3::new(9, 8, 7), SampleFormat::Unorm8, u, noise));
        let worst = own.bytes().iter().zip(lossy.bytes()).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(worst == Some(3) && lossy.packed().is_some(), "{worst:?}");
    }

    #[test]
    fn packed_samples_of_another_extent_are_refused() {
        let extent = UVec3::new(32, 16, 8);
        let chunk = Arc::new(chunk(extent, SampleFormat::Unorm8, LOSSLESS, |_| 7));
        let decode = Decode { scale: 1.0, offset: 0.0 };
        let slots = Slots::new(SampleFormat::Unorm8, decode, Places::Even(BrickSide::S16), vec![None, Some(chunk)]);
        let expected = SlotsError::Packed { slot: 1, packed: extent, extent: UVec3::splat(16) };
        assert_eq!(slots.map(|slots| slots.n_slots()), Err(expected));
    }
}
