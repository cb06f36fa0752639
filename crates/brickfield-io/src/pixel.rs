//! The samples of a pixel, and the one value of it that a volume has.

use std::fmt;
use std::ops::Range;

use brickfield_core::{Scalar, ScalarType, Voxels, with_voxels};

use crate::choice::Entries;
use crate::colour::{ColourPart, Colours};
use crate::limits::{CheckedShape, Limits};
use crate::opened::FileFacts;
use crate::samples::{allocate, append_binary};
use crate::stored_type::StoredType;
use crate::stored_voxel::StoredVoxel;
#[cfg(feature = "png")]
use crate::stored_voxel::keep_components;
use crate::{ByteOrder, ChoiceKind, Note, ReadError};

/// What the samples of a pixel are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pixel {
    Grey,
    Colours(Colours),
    /// The number of a colour in a palette.
    Palette,
    Named(&'static [&'static str]),
    #[cfg(feature = "tiff")]
    Unnamed(u16),
}

/// The properties that are alike in all slices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PictureShape {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) depth: u32,
    /// The type of the samples.
    pub(crate) stored: StoredType,
    pub(crate) pixel: Pixel,
}

/// The part of a pixel that is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PixelPart {
    Sample(usize),
    /// Of red, green and blue.
    Luminance,
    /// Of the palette's colour.
    Palette(ColourPart),
}

/// The colours of a palette.
pub(crate) type Palette = [[u8; 3]];

/// Samples of the pixels that [`PixelPart::kept`] names, pixel by pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KeptSamples<'a> {
    pub(crate) bytes: &'a [u8],
    pub(crate) order: ByteOrder,
    pub(crate) stored: StoredType,
    pub(crate) n_pixels: usize,
    pub(crate) palette: &'a Palette,
}

impl Pixel {
    pub(crate) fn n_samples(self) -> usize {
        match self {
            Pixel::Grey | Pixel::Palette => 1,
            Pixel::Colours(colours) => colours.n_channels(),
            Pixel::Named(names) => names.len(),
            #[cfg(feature = "tiff")]
            Pixel::Unnamed(n) => n.into(),
        }
    }

    /// The part that is wanted, else the luminance or the first sample with a note.
    pub(crate) fn choose(self, found: &mut FileFacts) -> Result<PixelPart, ReadError> {
        let entries = match self {
            Pixel::Grey => return Ok(PixelPart::Sample(0)),
            Pixel::Palette => return choose_of_palette(found),
            Pixel::Colours(colours) => {
                return Ok(match colours.choose(found)? {
                    ColourPart::Channel(channel) => PixelPart::Sample(channel),
                    ColourPart::Luminance => PixelPart::Luminance,
                });
            }
            Pixel::Named(names) => Entries::Named(names.iter().map(|name| (*name).to_owned()).collect()),
            #[cfg(feature = "tiff")]
            Pixel::Unnamed(n) => Entries::Numbered(n.into()),
        };
        Ok(PixelPart::Sample(found.choose(ChoiceKind::Channel, entries)? as usize))
    }

    #[cfg(feature = "tiff")]
    /// The part that is read where the channels of a file are something else.
    pub(crate) fn default_part(self, notes: &mut Vec<Note>) -> PixelPart {
        let part = match self {
            Pixel::Colours(_) => PixelPart::Luminance,
            Pixel::Palette => PixelPart::Palette(ColourPart::Luminance),
            Pixel::Grey => return PixelPart::Sample(0),
            Pixel::Named(_) | Pixel::Unnamed(_) => {
                let axis = "samples of a pixel".to_owned();
                notes.push(Note::FirstOfAxis { axis, n_entries: self.n_samples() as u64 });
                return PixelPart::Sample(0);
            }
        };
        notes.push(Note::Luminance);
        part
    }
}

/// A colour of the palette, or its number: of labels, the number is the value.
fn choose_of_palette(found: &mut FileFacts) -> Result<PixelPart, ReadError> {
    let names = ["red", "green", "blue", "luminance", "index"].map(str::to_owned).to_vec();
    Ok(match found.choices.choose(ChoiceKind::Channel, Entries::Named(names), 3)?.entry {
        channel @ 0..3 => PixelPart::Palette(ColourPart::Channel(channel as usize)),
        3 => {
            found.notes.push(Note::Luminance);
            PixelPart::Palette(ColourPart::Luminance)
        }
        _ => PixelPart::Sample(0),
    })
}

impl fmt::Display for Pixel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Pixel::Grey => f.write_str("grey"),
            Pixel::Colours(Colours::Rgb) => f.write_str("RGB"),
            Pixel::Colours(Colours::Rgba) => f.write_str("RGBA"),
            Pixel::Palette => f.write_str("with a palette"),
            Pixel::Named(names) => write!(f, "({} a pixel)", names.join(", ")),
            #[cfg(feature = "tiff")]
            Pixel::Unnamed(n) => write!(f, "({n} a pixel)"),
        }
    }
}

impl fmt::Display for PictureShape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} x {}", self.width, self.height)?;
        if self.depth > 1 {
            write!(f, " x {}", self.depth)?;
        }
        write!(f, " samples of {}", self.stored)?;
        if self.pixel == Pixel::Grey { Ok(()) } else { write!(f, " {}", self.pixel) }
    }
}

impl PictureShape {
    pub(crate) fn n_pixels(&self) -> u128 {
        u128::from(self.width) * u128::from(self.height) * u128::from(self.depth)
    }

    /// Bytes of all its samples.
    pub(crate) fn n_bytes(&self) -> u128 {
        self.n_pixels() * self.pixel.n_samples() as u128 * self.stored.n_bytes() as u128
    }
}

impl PixelPart {
    /// The type of its values, from that of the samples.
    pub(crate) fn stored(self, stored: StoredType) -> StoredType {
        match self {
            PixelPart::Palette(_) => ScalarType::U8.into(),
            PixelPart::Sample(_) | PixelPart::Luminance => stored,
        }
    }

    /// The samples of a pixel that it needs.
    pub(crate) fn kept(self) -> Range<usize> {
        match self {
            PixelPart::Sample(i) => i..i + 1,
            PixelPart::Luminance => 0..3,
            PixelPart::Palette(_) => 0..1,
        }
    }

    /// Appends one value for each pixel; `what` names them in errors.
    pub(crate) fn append(
        self,
        voxels: &mut Voxels,
        samples: KeptSamples,
        limits: &Limits,
        what: &str,
    ) -> Result<(), ReadError> {
        let KeptSamples { mut bytes, order, stored, n_pixels, palette } = samples;
        match self {
            PixelPart::Sample(_) => append_binary(voxels, &mut bytes, n_pixels, stored, order, what),
            PixelPart::Luminance => {
                let rgb = StoredVoxel { stored, n_components: 3, part: ColourPart::Luminance };
                append_binary(voxels, &mut bytes, n_pixels, rgb, order, what)
            }
            PixelPart::Palette(part) => {
                let mut numbers = allocate(&CheckedShape::claim([n_pixels as u64, 1, 1], stored, limits)?)?;
                append_binary(&mut numbers, &mut bytes, n_pixels, stored, order, what)?;
                look_up(voxels, numbers, &values_of(palette, part), what)
            }
        }
    }
}

/// The samples of each pixel that are kept.
#[cfg(feature = "png")]
pub(crate) fn keep_samples(mut bytes: Vec<u8>, n_samples: usize, sample_bytes: usize, kept: Range<usize>) -> Vec<u8> {
    let n_kept = keep_components(&mut bytes, n_samples, sample_bytes, kept);
    bytes.truncate(n_kept);
    bytes
}

fn values_of(palette: &Palette, part: ColourPart) -> Vec<u8> {
    match Colours::Rgb.reduce(Voxels::from(palette.concat()), part) {
        Voxels::U8(values) => values,
        _ => Vec::new(),
    }
}

fn look_up(voxels: &mut Voxels, numbers: Voxels, values: &[u8], what: &str) -> Result<(), ReadError> {
    let Voxels::U8(out) = voxels else { return Ok(()) };
    with_voxels!(numbers, numbers => {
        for number in numbers {
            let value = values.get(number.to_f64() as usize).copied();
            out.push(value.ok_or_else(|| {
                ReadError::field(format!("colour number of {what}"), number, format!("below {}, as the palette has", values.len()))
            })?);
        }
    });
    Ok(())
}
