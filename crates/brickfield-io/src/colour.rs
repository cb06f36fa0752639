//! Volumes in colour: one channel of them, or their luminance.

use brickfield_core::Scalar;
#[cfg(any(feature = "dicom", feature = "tiff", feature = "png", test))]
use brickfield_core::{Voxels, with_voxels};

use crate::choice::Entries;
use crate::opened::FileFacts;
use crate::{ChoiceKind, Note, ReadError};

/// Interleaved colours of a voxel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Colours {
    Rgb,
    Rgba,
}

/// The part of a colour that is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ColourPart {
    /// 0 red, 1 green, 2 blue, 3 alpha.
    Channel(usize),
    Luminance,
}

/// The weights of red, green and blue in the luminance Y' (ITU-R BT.709, 2015, item 3.2). Their sum is 1: grey stays itself.
const WEIGHTS: [f64; 3] = [0.2126, 0.7152, 0.0722];

impl Colours {
    /// Colours of so many channels.
    pub(crate) fn of_channels(n_channels: u64) -> Option<Colours> {
        match n_channels {
            3 => Some(Colours::Rgb),
            4 => Some(Colours::Rgba),
            _ => None,
        }
    }

    pub(crate) fn n_channels(self) -> usize {
        match self {
            Colours::Rgb => 3,
            Colours::Rgba => 4,
        }
    }

    /// The part that is wanted, else the luminance with a note. It is listed after the channels.
    pub(crate) fn choose(self, found: &mut FileFacts) -> Result<ColourPart, ReadError> {
        let n_channels = self.n_channels();
        let mut names: Vec<String> =
            ["red", "green", "blue", "alpha"][..n_channels].iter().map(|n| (*n).to_owned()).collect();
        names.push("luminance".to_owned());
        let entry = found.choices.choose(ChoiceKind::Channel, Entries::Named(names), n_channels as u64)?.entry;
        match entry as usize {
            channel if channel < n_channels => Ok(ColourPart::Channel(channel)),
            _ => {
                found.notes.push(Note::Luminance);
                Ok(ColourPart::Luminance)
            }
        }
    }

    #[cfg(any(feature = "dicom", feature = "tiff", feature = "png", test))]
    /// One value for each voxel, in place: integers of the luminance are rounded.
    #[cfg(any(feature = "dicom", feature = "tiff", feature = "png", test))]
    pub(crate) fn reduce(self, interleaved: Voxels, part: ColourPart) -> Voxels {
        with_voxels!(interleaved, v => reduced(v, self.n_channels(), part))
    }
}

#[cfg(any(feature = "dicom", feature = "tiff", feature = "png", test))]
fn reduced<T: Scalar>(mut values: Vec<T>, n_channels: usize, part: ColourPart) -> Voxels {
    let n_voxels = values.len() / n_channels;
    for i in 0..n_voxels {
        let voxel = &values[i * n_channels..];
        values[i] = match part {
            ColourPart::Channel(channel) => voxel[channel],
            ColourPart::Luminance => luminance([voxel[0], voxel[1], voxel[2]]),
        };
    }
    values.truncate(n_voxels);
    values.shrink_to_fit();
    T::wrap(values)
}

/// The luminance; of integers it is rounded.
pub(crate) fn luminance<T: Scalar>([red, green, blue]: [T; 3]) -> T {
    if red == green && green == blue {
        return red;
    }
    let sum: f64 = WEIGHTS.iter().zip([red, green, blue]).map(|(weight, v)| weight * v.to_f64()).sum();
    T::from_f64(sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_voxel_keeps_one_value() {
        let rgba = || Voxels::from(vec![10u8, 20, 30, 255, 7, 7, 7, 0]);
        assert_eq!(Colours::Rgba.reduce(rgba(), ColourPart::Channel(1)), Voxels::from(vec![20u8, 7]));
        // 2.126 + 14.304 + 2.166 = 18.596.
        assert_eq!(Colours::Rgba.reduce(rgba(), ColourPart::Luminance), Voxels::from(vec![19u8, 7]));
        let rgb = Voxels::from(vec![0.1f32, 0.1, 0.1]);
        assert_eq!(Colours::Rgb.reduce(rgb, ColourPart::Luminance), Voxels::from(vec![0.1f32]));
    }
}
