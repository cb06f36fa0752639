//! Units of length by name, for readers and writers, and axes whose lengths have different ones.
//!
//! The names of OME-XML (UnitsLength of 2016-06), of OME-Zarr (UDUNITS-2), and those that ImageJ users write.

use brickfield_core::glam::DVec3;

use crate::Note;
use crate::placement::AXES;

/// The lengths along x, y and z in one unit.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CommonUnit {
    /// The name of the unit, as the file writes it.
    pub(crate) name: Option<String>,
    /// What a length along each axis has to be multiplied by.
    pub(crate) factors: DVec3,
}

/// The unit of x, or of the first axis whose unit is known, with the factors of the other axes. An axis without a unit has
/// the common one. A unit that is no known unit of length gets a note, and its lengths are kept as they are.
pub(crate) fn common_unit(units: [Option<&str>; 3], notes: &mut Vec<Note>) -> CommonUnit {
    let known = units.map(|unit| unit.and_then(Length::of_unit));
    let common = known.iter().position(Option::is_some);
    let reference = common.and_then(|i| known[i]);
    let factor = |length: Option<Length>| match (length, reference) {
        (Some(length), Some(reference)) => length.in_units_of(reference),
        _ => 1.0,
    };
    note_unknown(units.map(|unit| unit.filter(|u| Length::of_unit(u).is_none())), notes);
    let name = common.and_then(|i| units[i]).or_else(|| units.into_iter().flatten().next());
    CommonUnit { name: name.map(str::to_owned), factors: DVec3::from(known.map(factor)) }
}

/// The one of `names` that names the same length: what a format calls a unit.
pub(crate) fn unit_among<'n>(unit: &str, names: &[&'n str]) -> Option<&'n str> {
    let length = Length::of_unit(unit)?;
    names.iter().copied().find(|name| Length::of_unit(name) == Some(length))
}

/// One note for each unknown unit.
fn note_unknown(unknown: [Option<&str>; 3], notes: &mut Vec<Note>) {
    for (i, unit) in unknown.iter().enumerate() {
        let Some(unit) = unit else { continue };
        if unknown[..i].contains(&Some(unit)) {
            continue;
        }
        let axes =
            AXES.into_iter().zip(unknown).filter(|(_, other)| *other == Some(unit)).map(|(axis, _)| axis).collect();
        notes.push(Note::UnknownUnit { axes, unit: (*unit).to_owned() });
    }
}

/// A length of `mantissa` x 10^`exponent` metres: powers of ten stay exact.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Length {
    mantissa: f64,
    exponent: i32,
}

impl Length {
    /// The length of a unit: symbols by their letters' case, names in any.
    fn of_unit(name: &str) -> Option<Length> {
        let name = name.trim();
        by_symbol(name).or_else(|| by_name(&name.to_lowercase()))
    }

    fn in_units_of(self, unit: Length) -> f64 {
        let ratio = self.mantissa / unit.mantissa;
        match self.exponent - unit.exponent {
            n @ 0.. => ratio * 10f64.powi(n),
            n => ratio / 10f64.powi(-n),
        }
    }
}

const fn metres(mantissa: f64, exponent: i32) -> Option<Length> {
    Some(Length { mantissa, exponent })
}

/// Symbol, name and power of ten of the prefixes (BIPM 2019, table 7; those since 2022 measure no volume).
const PREFIXES: &[(&str, &str, i32)] = &[
    ("Y", "yotta", 24),
    ("Z", "zetta", 21),
    ("E", "exa", 18),
    ("P", "peta", 15),
    ("T", "tera", 12),
    ("G", "giga", 9),
    ("M", "mega", 6),
    ("k", "kilo", 3),
    ("h", "hecto", 2),
    ("da", "deca", 1),
    ("", "", 0),
    ("d", "deci", -1),
    ("c", "centi", -2),
    ("m", "milli", -3),
    // The micro sign, the Greek letter, and u for either.
    ("\u{b5}", "micro", -6),
    ("\u{3bc}", "micro", -6),
    ("u", "micro", -6),
    ("n", "nano", -9),
    ("p", "pico", -12),
    ("f", "femto", -15),
    ("a", "atto", -18),
    ("z", "zepto", -21),
    ("y", "yocto", -24),
];

fn by_symbol(symbol: &str) -> Option<Length> {
    match symbol {
        // The Angstrom sign, and the letter.
        "\u{212b}" | "\u{c5}" => metres(1.0, -10),
        "in" | "\"" => metres(2.54, -2),
        "thou" | "mil" => metres(2.54, -5),
        "li" => metres(2.54 / 12.0, -2),
        "pt" => metres(2.54 / 72.0, -2),
        "ft" | "'" => metres(3.048, -1),
        "yd" => metres(9.144, -1),
        "mi" => metres(1.609_344, 3),
        "ua" | "au" => metres(1.495_978_707, 11),
        "ly" => metres(9.460_730_472_580_8, 15),
        "pc" => metres(3.085_677_581_491_367, 16),
        _ => {
            let prefix = symbol.strip_suffix('m')?;
            PREFIXES.iter().find(|(p, ..)| *p == prefix).and_then(|(.., exponent)| metres(1.0, *exponent))
        }
    }
}

/// A name in lower case, in singular or plural.
fn by_name(name: &str) -> Option<Length> {
    match name {
        "inch" | "inches" => return metres(2.54, -2),
        "foot" | "feet" => return metres(3.048, -1),
        "angstrom" | "angstroms" | "\u{e5}ngstr\u{f6}m" => return metres(1.0, -10),
        _ => {}
    }
    let singular = name.strip_suffix('s').unwrap_or(name);
    match singular {
        "micron" => return metres(1.0, -6),
        "yard" => return metres(9.144, -1),
        "mile" => return metres(1.609_344, 3),
        "parsec" => return metres(3.085_677_581_491_367, 16),
        _ => {}
    }
    let prefix = singular.strip_suffix("meter").or_else(|| singular.strip_suffix("metre"))?;
    PREFIXES.iter().find(|(_, p, _)| *p == prefix).and_then(|(.., exponent)| metres(1.0, *exponent))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn in_metres(unit: &str) -> Option<f64> {
        Some(Length::of_unit(unit)?.in_units_of(Length { mantissa: 1.0, exponent: 0 }))
    }

    #[test]
    fn units_are_known_by_symbol_and_by_name() {
        let same: &[(f64, &[&str])] = &[
            (1e-6, &["\u{b5}m", "\u{3bc}m", "um", "micron", "microns", "micrometer", "Micrometre"]),
            (1e-10, &["\u{c5}", "\u{212b}", "angstrom"]),
            (1e-3, &["mm", "millimeter", " mm "]),
            (1e6, &["Mm", "megameter"]),
            (0.1, &["dm", "decimeter"]),
            (10.0, &["dam"]),
            (1.0, &["m", "meter", "metres"]),
            (0.0254, &["in", "inch", "inches", "\""]),
            (0.3048, &["ft", "foot"]),
            (1e-12, &["pm", "picometer"]),
        ];
        for (length, names) in same {
            for name in *names {
                assert_eq!(in_metres(name), Some(*length), "{name}");
            }
        }
        for name in ["pixel", "reference frame", "", "MM", "second", "ms", "voxels", "meterm"] {
            assert_eq!(in_metres(name), None, "{name}");
        }
    }

    #[test]
    fn a_unit_is_found_by_any_of_its_names() {
        let names = ["m", "mm", "um"];
        for unit in ["\u{b5}m", "\u{3bc}m", "micron", "Micrometer", "um"] {
            assert_eq!(unit_among(unit, &names), Some("um"), "{unit}");
        }
        assert_eq!((unit_among("nm", &names), unit_among("pixel", &names)), (None, None));
    }

    #[test]
    fn lengths_are_brought_to_the_unit_of_x() {
        let mut notes = vec![];
        let common = common_unit([Some("um"), None, Some("dm")], &mut notes);
        assert_eq!(common, CommonUnit { name: Some("um".to_owned()), factors: DVec3::new(1.0, 1.0, 1e5) });
        let common = common_unit([Some("micron"), Some("\u{b5}m"), Some("nm")], &mut notes);
        assert_eq!(common.factors, DVec3::new(1.0, 1.0, 1e-3));
        assert_eq!(common_unit([None; 3], &mut notes), CommonUnit { name: None, factors: DVec3::ONE });
        assert!(notes.is_empty());
    }

    #[test]
    fn a_unit_that_is_not_known_is_noted_once() {
        let mut notes = vec![];
        let common = common_unit([Some("pixel"), Some("pixel"), Some("mm")], &mut notes);
        assert_eq!(common, CommonUnit { name: Some("mm".to_owned()), factors: DVec3::ONE });
        let common = common_unit([Some("pixel"), Some("pixel"), Some("pixel")], &mut notes);
        assert_eq!(common.name.as_deref(), Some("pixel"));
        let said: Vec<_> = notes.iter().map(ToString::to_string).collect();
        assert_eq!(
            said,
            [
                "the unit \"pixel\" of lengths along x and y is not known; they are used as they are",
                "the unit \"pixel\" of lengths along x, y and z is not known; they are used as they are",
            ]
        );
    }
}
