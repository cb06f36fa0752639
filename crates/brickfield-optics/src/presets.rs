//! Named transfer functions: for Hounsfield units, and relative to a volume's range and size.

use brickfield_core::{Knot, TransferError, TransferFunction, ValueRange, Volume};

use crate::automatic::diagonal_world;
use crate::srgb::linear_of_hex;

/// A transfer function with a name.
///
/// The `Ct...` presets are for Hounsfield units (air -1000, water 0) and a world in millimetres: they ignore range and
/// size. The others are stretched over a range of values, and their extinction is so many optical depths over a length.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Preset {
    /// Bone from 150 HU, ivory; everything softer is transparent.
    CtBone,
    /// Muscle and organs as a red veil, contrast-filled vessels and bone through it; fat is transparent.
    CtSoftTissue,
    /// Lung, airway walls and vessels; a hint of bone.
    CtLung,
    /// The skin as a surface.
    CtSkin,
    /// Magnetic resonance, whose values have no unit: the dark tenth is transparent, the bright half dense.
    MrDefault,
    /// White, extinction proportional to the value: the picture of a density.
    Ramp,
    /// From black to white, extinction proportional to the value, but for the darkest twentieth, which is transparent.
    Gray,
    /// From black to white, extinction proportional to the value: the linear mapping of Saladi, Pinnamaneni and Meyer 2003.
    Linear,
    /// From black to white, extinction an exponential of the value, e^5 times as much at the end as at the start, less what it is there: the exponential
    /// mapping of the same paper.
    Exponential,
    /// From black to white, transparent below the middle of the range and dense above: the threshold mapping of the same paper.
    Threshold,
    /// Viridis: perceptually uniform, from blue to yellow (Smith and van der Walt 2015, CC0).
    Viridis,
    /// Inferno: perceptually uniform, from black through red to light yellow (same source).
    Inferno,
    /// Magma: perceptually uniform, from black through purple to light yellow (same source).
    Magma,
    /// Plasma: perceptually uniform, from blue through red to yellow (same source).
    Plasma,
    /// Cool to warm: diverging from blue through grey, where it is transparent, to red (Moreland 2009).
    CoolWarm,
}

impl Preset {
    /// All presets, presets for Hounsfield units first.
    pub const ALL: [Preset; 15] = [
        Preset::CtBone,
        Preset::CtSoftTissue,
        Preset::CtLung,
        Preset::CtSkin,
        Preset::MrDefault,
        Preset::Ramp,
        Preset::Gray,
        Preset::Linear,
        Preset::Exponential,
        Preset::Threshold,
        Preset::Viridis,
        Preset::Inferno,
        Preset::Magma,
        Preset::Plasma,
        Preset::CoolWarm,
    ];

    /// The preset's name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Preset::CtBone => "ct-bone",
            Preset::CtSoftTissue => "ct-soft-tissue",
            Preset::CtLung => "ct-lung",
            Preset::CtSkin => "ct-skin",
            Preset::MrDefault => "mr-default",
            Preset::Ramp => "ramp",
            Preset::Gray => "gray",
            Preset::Linear => "linear",
            Preset::Exponential => "exponential",
            Preset::Threshold => "threshold",
            Preset::Viridis => "viridis",
            Preset::Inferno => "inferno",
            Preset::Magma => "magma",
            Preset::Plasma => "plasma",
            Preset::CoolWarm => "cool-warm",
        }
    }

    /// The preset of that [`name`](Self::name).
    pub fn from_name(name: &str) -> Option<Preset> {
        Preset::ALL.into_iter().find(|p| p.name() == name)
    }

    /// The scale of the preset's values.
    pub const fn scale(self) -> PresetScale {
        match self {
            Preset::CtBone | Preset::CtSoftTissue | Preset::CtLung | Preset::CtSkin => PresetScale::Hounsfield,
            _ => PresetScale::Relative,
        }
    }

    /// The transfer function for values in `range`, in a world in which the volume is `length_world` long.
    ///
    /// # Errors
    /// A relative preset on a range or length that is not finite, or on a length that is 0.
    pub fn transfer(self, range: ValueRange, length_world: f64) -> Result<TransferFunction, TransferError> {
        let (start, span, per_depth) = match self.scale() {
            PresetScale::Hounsfield => (0.0, 1.0, 1.0),
            PresetScale::Relative => (range.min, range.max - range.min, 1.0 / length_world),
        };
        let knot = |&(at, extinction, color): &PresetKnot| Knot {
            value: start + at * span,
            extinction: extinction * per_depth,
            color: linear_of_hex(color),
        };
        let mut knots: Vec<Knot> = self.points().iter().map(knot).collect();
        if span == 0.0 {
            knots.drain(..knots.len() - 1);
        }
        TransferFunction::new(knots)
    }

    /// The transfer function for a volume: [`transfer`](Self::transfer) over its range and diagonal.
    ///
    /// # Errors
    /// A relative preset on a volume whose range or size overflows.
    pub fn for_volume(self, volume: &Volume) -> Result<TransferFunction, TransferError> {
        self.transfer(volume.range(), diagonal_world(volume.grid()))
    }

    fn points(self) -> &'static [PresetKnot] {
        match self {
            Preset::CtBone => &CT_BONE,
            Preset::CtSoftTissue => &CT_SOFT_TISSUE,
            Preset::CtLung => &CT_LUNG,
            Preset::CtSkin => &CT_SKIN,
            Preset::MrDefault => &MR_DEFAULT,
            Preset::Ramp => &RAMP,
            Preset::Gray => &GRAY,
            Preset::Linear => &LINEAR,
            Preset::Exponential => &EXPONENTIAL,
            Preset::Threshold => &THRESHOLD,
            Preset::Viridis => &VIRIDIS,
            Preset::Inferno => &INFERNO,
            Preset::Magma => &MAGMA,
            Preset::Plasma => &PLASMA,
            Preset::CoolWarm => &COOL_WARM,
        }
    }
}

/// The scale of the values of a [`Preset`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PresetScale {
    /// Hounsfield units; extinction per millimetre.
    Hounsfield,
    /// From 0 to 1 over a range of values; extinction per length of the volume.
    Relative,
}

/// Value, extinction and sRGB colour; units as in [`PresetScale`].
type PresetKnot = (f64, f64, u32);

/// Optical depth of the brightest value over the volume's diagonal.
const FULL: f64 = 60.0;

/// [`FULL`] (e^(5 v) - 1) / (e^5 - 1) at the knots.
const EXPONENTIAL: [PresetKnot; 17] = [
    (0.0, 0.000000, 0x000000),
    (0.0625, 0.149310, 0x101010),
    (0.125, 0.353393, 0x202020),
    (0.1875, 0.632341, 0x303030),
    (0.25, 1.013618, 0x404040),
    (0.3125, 1.534761, 0x505050),
    (0.375, 2.247080, 0x606060),
    (0.4375, 3.220704, 0x707070),
    (0.5, 4.551491, 0x808080),
    (0.5625, 6.370460, 0x8f8f8f),
    (0.625, 8.856697, 0x9f9f9f),
    (0.6875, 12.254980, 0xafafaf),
    (0.75, 16.899881, 0xbfbfbf),
    (0.8125, 23.248709, 0xcfcfcf),
    (0.875, 31.926528, 0xdfdfdf),
    (0.9375, 43.787700, 0xefefef),
    (1.0, 60.000000, 0xffffff),
];
const THRESHOLD: [PresetKnot; 4] =
    [(0.0, 0.0, 0x000000), (0.5, 0.0, 0x808080), (0.5, FULL, 0x808080), (1.0, FULL, 0xffffff)];
const CT_BONE: [PresetKnot; 5] = [
    (150.0, 0.0, 0x5a1e14),
    (280.0, 0.03, 0xa8603c),
    (600.0, 0.35, 0xe8cfa0),
    (1200.0, 1.0, 0xfff8ea),
    (3000.0, 1.5, 0xffffff),
];
const CT_SOFT_TISSUE: [PresetKnot; 6] = [
    (-10.0, 0.0, 0x4a1010),
    (30.0, 0.012, 0x9a3a28),
    (80.0, 0.03, 0xc05038),
    (160.0, 0.15, 0xe88860),
    (300.0, 0.35, 0xf4d8b0),
    (1200.0, 0.6, 0xfffaf0),
];
const CT_LUNG: [PresetKnot; 7] = [
    (-970.0, 0.0, 0x102848),
    (-880.0, 0.003, 0x3c78a8),
    (-700.0, 0.012, 0x78b0d8),
    (-450.0, 0.12, 0xf0b090),
    (-200.0, 0.0, 0xe07860),
    (250.0, 0.0, 0xd8c8a8),
    (900.0, 0.04, 0xfff8ea),
];
const CT_SKIN: [PresetKnot; 4] =
    [(-450.0, 0.0, 0x502818), (-250.0, 0.15, 0xb07858), (0.0, 0.8, 0xe8b898), (300.0, 1.5, 0xf8e0cc)];
const MR_DEFAULT: [PresetKnot; 5] =
    [(0.1, 0.0, 0x301c18), (0.25, 1.5, 0x80483c), (0.5, 12.0, 0xc88c70), (0.75, 40.0, 0xf0d8c0), (1.0, 80.0, 0xffffff)];
const RAMP: [PresetKnot; 2] = [(0.05, 0.0, 0xffffff), (1.0, 20.0, 0xffffff)];
const LINEAR: [PresetKnot; 2] = [(0.0, 0.0, 0x000000), (1.0, FULL, 0xffffff)];
const GRAY: [PresetKnot; 2] = [(0.05, 0.0, 0x000000), (1.0, FULL, 0xffffff)];

/// Nine equidistant colours of a map, the first transparent, extinction rising with the square of the value: rare, high
/// values show through common, low ones.
const fn rising(colors: [u32; 9]) -> [PresetKnot; 9] {
    let mut points = [(0.0, 0.0, 0); 9];
    let mut i = 0;
    while i < 9 {
        let x = i as f64 / 8.0;
        points[i] = (if i == 0 { 0.02 } else { x }, FULL * x * x, colors[i]);
        i += 1;
    }
    points
}

const VIRIDIS: [PresetKnot; 9] =
    rising([0x440154, 0x472d7b, 0x3b528b, 0x2c728e, 0x21918c, 0x27ad81, 0x5cc863, 0xaadc32, 0xfde725]);
const INFERNO: [PresetKnot; 9] =
    rising([0x000004, 0x210c4a, 0x57106e, 0x8a226a, 0xbc3754, 0xe35933, 0xf98c0a, 0xf9c932, 0xfcffa4]);
const MAGMA: [PresetKnot; 9] =
    rising([0x000004, 0x1d1147, 0x51127c, 0x832681, 0xb73779, 0xe55064, 0xfb8761, 0xfec287, 0xfcfdbf]);
const PLASMA: [PresetKnot; 9] =
    rising([0x0d0887, 0x4c02a1, 0x7e03a8, 0xaa2395, 0xcc4778, 0xe56b5d, 0xf89441, 0xfdc328, 0xf0f921]);
const COOL_WARM: [PresetKnot; 4] =
    [(0.0, FULL, 0x3b4cc0), (0.48, 0.0, 0xdddddd), (0.52, 0.0, 0xdddddd), (1.0, FULL, 0xb40426)];

#[cfg(test)]
mod tests {
    use super::*;

    const RANGE: ValueRange = ValueRange { min: -20.0, max: 80.0 };

    #[test]
    fn names_are_unique_and_found() {
        for preset in Preset::ALL {
            assert_eq!(Preset::from_name(preset.name()), Some(preset));
        }
        assert_eq!(Preset::from_name("bone"), None);
    }

    #[test]
    fn every_preset_has_something_transparent_and_something_dense() {
        for preset in Preset::ALL {
            let tf = preset.transfer(RANGE, 100.0).unwrap();
            let least = tf.knots().iter().map(|k| k.extinction).fold(f64::INFINITY, f64::min);
            assert_eq!(least, 0.0, "{}", preset.name());
            assert!(tf.max_extinction(ValueRange { min: -5e3, max: 5e3 }) > 0.1, "{}", preset.name());
        }
    }

    #[test]
    fn air_is_transparent_in_hounsfield_presets() {
        for preset in Preset::ALL.into_iter().filter(|p| p.scale() == PresetScale::Hounsfield) {
            let tf = preset.transfer(RANGE, f64::NAN).unwrap();
            assert!(tf.is_transparent(ValueRange { min: -5000.0, max: -970.0 }), "{}", preset.name());
        }
    }

    #[test]
    fn relative_presets_follow_range_and_length() {
        let tf = Preset::Ramp.transfer(RANGE, 10.0).unwrap();
        assert_eq!((tf.at(80.0).extinction, tf.at(-15.0).extinction), (2.0, 0.0));
        assert!(Preset::Ramp.transfer(RANGE, 0.0).is_err());
        assert!(Preset::Gray.transfer(ValueRange { min: f64::MIN, max: f64::MAX }, 1.0).is_err());
    }

    #[test]
    fn the_mappings_of_saladi_pinnamaneni_and_meyer_have_their_names() {
        let unit = ValueRange { min: 0.0, max: 1.0 };
        let [linear, exponential, threshold] = ["linear", "exponential", "threshold"]
            .map(|name| Preset::from_name(name).unwrap().transfer(unit, 1.0).unwrap());
        for knot in exponential.knots() {
            let expected = FULL * ((5.0 * knot.value).exp() - 1.0) / (5f64.exp() - 1.0);
            assert!((knot.extinction - expected).abs() < 1e-6, "{knot:?} {expected}");
            assert!((linear.at(knot.value).extinction - FULL * knot.value).abs() < 1e-9);
        }
        assert_eq!((threshold.at(0.499).extinction, threshold.at(0.5).extinction), (0.0, FULL));
    }

    #[test]
    fn a_constant_range_gets_the_brightest_knot() {
        let tf = Preset::Viridis.transfer(ValueRange { min: 5.0, max: 5.0 }, 1.0).unwrap();
        assert_eq!((tf.knots().len(), tf.at(5.0).extinction), (1, FULL));
    }
}
