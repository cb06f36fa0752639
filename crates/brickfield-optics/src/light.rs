//! Light on the surfaces that a field's gradient shows.
//!
//! The model is that of Phong 1975 with the half vector of Blinn 1977, softened where there is hardly a gradient:
//!
//! ```text
//! normal    n = -g / |g|                             towards lower values
//! strength  s = |g| / sqrt(|g|^2 + flat_below^2)     0 in a homogeneous medium, towards 1 on a surface
//! factor        (1 - s) + s (ambient + diffuse max(n . l, 0))
//! highlight     s specular max(n . h, 0)^shininess   h halfway between l, towards the light, and the eye
//! colour'       colour * factor + highlight
//! ```
//!
//! Light is white, colours are linear. All of it is continuous in the gradient: a medium without surfaces looks as without light.

use brickfield_core::glam::DVec3;
use brickfield_core::{Companion, Optics};

/// A light: where it comes from, and how surfaces throw it back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    source: LightSource,
    terms: LightTerms,
    flat_below: f64,
    sides: LitSides,
    normals: Normals,
}

/// Where light comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum LightSource {
    /// The eye: a headlight. With parallel rays it comes along them.
    #[default]
    Head,
    /// Far away: the direction towards the light, in the world, of any length above 0.
    Direction(DVec3),
    /// A place in the world.
    Place(DVec3),
}

/// How much of the light a surface throws back, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightTerms {
    /// The part of the colour that shows from everywhere.
    pub ambient: f64,
    /// The part of the colour that shows where the surface faces the light (Lambert).
    pub diffuse: f64,
    /// The brightness of highlights.
    pub specular: f64,
    /// The exponent of highlights: the greater, the smaller they are. 1 to [`Light::MAX_SHININESS`].
    pub shininess: u32,
}

impl Default for LightTerms {
    /// A dull surface: ambient 0.2, diffuse 0.8, specular 0.2, shininess 32.
    fn default() -> LightTerms {
        LightTerms { ambient: 0.2, diffuse: 0.8, specular: 0.2, shininess: 32 }
    }
}

/// The side of a surface that light falls on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum LitSides {
    /// The side of lower values.
    #[default]
    Lower,
    /// Both.
    Both,
}

/// Where normals come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Normals {
    /// Differences of the field's values.
    #[default]
    Central,
    /// Gradients that were computed before, and lie beside the samples.
    Stored,
    /// Normals of surface voxels, which lie beside the samples: of voxels that the transfer function shows, beside transparent ones
    /// ([`Companion::SurfaceNormal`]). All else is as without light.
    Surface,
}

/// The gradient of a surface voxel with [`Normals::Surface`], in units of [`Light::flat_below`]: the strength there is 0.9999, whatever the
/// values are.
pub const SURFACE_STEEPNESS: f64 = 64.0;

impl Normals {
    /// The name in options and messages.
    pub const fn name(self) -> &'static str {
        match self {
            Normals::Central => "central",
            Normals::Stored => "stored",
            Normals::Surface => "surface",
        }
    }

    /// The companions of samples that they are read from; `None` of differences of values.
    pub const fn companion(self) -> Option<Companion> {
        match self {
            Normals::Central => None,
            Normals::Stored => Some(Companion::Gradient),
            Normals::Surface => Some(Companion::SurfaceNormal),
        }
    }
}

/// Numbers that make no light.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum LightError {
    #[error("a light from direction {direction}; it must be finite and longer than 0")]
    Direction { direction: DVec3 },
    #[error("a light at {place}; its place must be finite")]
    Place { place: DVec3 },
    #[error("{term} light of {value}; it must be 0 to {most}")]
    Term { term: &'static str, value: f64, most: f64 },
    #[error("a shininess of {shininess}; it must be 1 to {most}")]
    Shininess { shininess: u32, most: u32 },
    #[error("no surface below a gradient of {flat_below} data values per world unit; it must be finite and above 0")]
    FlatBelow { flat_below: f64 },
}

/// What light makes of a colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shade {
    /// Of the colour.
    pub factor: f64,
    /// Added to each channel of the colour.
    pub highlight: f64,
}

impl Light {
    /// The greatest of each term.
    pub const MAX_TERM: f64 = 16.0;
    /// The greatest shininess.
    pub const MAX_SHININESS: u32 = 255;

    /// A light on surfaces' side of lower values.
    ///
    /// `flat_below` is a gradient, in data values per world unit: far below it there is no surface, far above it there is
    /// nothing else ([`flat_below`] has a default).
    ///
    /// # Errors
    /// A direction or a place that is not finite, a direction of length 0, terms out of their range.
    pub fn new(source: LightSource, terms: LightTerms, flat_below: f64) -> Result<Light, LightError> {
        let source = match source {
            LightSource::Head => source,
            LightSource::Direction(direction) => LightSource::Direction(unit(direction)?),
            LightSource::Place(place) if place.is_finite() => source,
            LightSource::Place(place) => return Err(LightError::Place { place }),
        };
        let most = Light::MAX_TERM;
        for (term, value) in [("ambient", terms.ambient), ("diffuse", terms.diffuse), ("specular", terms.specular)] {
            if !(0.0..=most).contains(&value) {
                return Err(LightError::Term { term, value, most });
            }
        }
        if !(1..=Light::MAX_SHININESS).contains(&terms.shininess) {
            return Err(LightError::Shininess { shininess: terms.shininess, most: Light::MAX_SHININESS });
        }
        if !(flat_below.is_finite() && flat_below > 0.0) {
            return Err(LightError::FlatBelow { flat_below });
        }
        Ok(Light { source, terms, flat_below, sides: LitSides::Lower, normals: Normals::Central })
    }

    /// The light on other sides of surfaces.
    #[must_use]
    pub fn on_sides(self, sides: LitSides) -> Light {
        Light { sides, ..self }
    }

    /// The light on surfaces whose normals come from elsewhere.
    #[must_use]
    pub fn on_normals(self, normals: Normals) -> Light {
        Light { normals, ..self }
    }

    /// Where it comes from; a direction has length 1.
    pub fn source(&self) -> LightSource {
        self.source
    }

    /// How surfaces throw it back.
    pub fn terms(&self) -> LightTerms {
        self.terms
    }

    /// The gradient, in data values per world unit, around which surfaces begin.
    pub fn flat_below(&self) -> f64 {
        self.flat_below
    }

    /// The sides of surfaces that it falls on.
    pub fn sides(&self) -> LitSides {
        self.sides
    }

    /// Where surfaces' normals come from.
    pub fn normals(&self) -> Normals {
        self.normals
    }

    /// The shade where the field has a gradient, in data values per world unit; the light and the eye are in these directions of
    /// length 1. A light right behind, seen from the eye, has no highlight.
    pub fn shade(&self, gradient: DVec3, to_light: DVec3, to_eye: DVec3) -> Shade {
        let LightTerms { ambient, diffuse, specular, shininess } = self.terms;
        let steepness = gradient / self.flat_below;
        let length = steepness.length();
        let strength = length / length.hypot(1.0);
        let normal = -gradient.normalize_or_zero();
        let halfway = (to_light + to_eye).normalize_or_zero();
        let power = self.facing(normal.dot(halfway)).powi(shininess as i32);
        Shade {
            factor: (1.0 - strength) + strength * (ambient + diffuse * self.facing(normal.dot(to_light))),
            highlight: strength * specular * power,
        }
    }

    /// How much of a cosine counts.
    fn facing(&self, cosine: f64) -> f64 {
        match self.sides {
            LitSides::Lower => cosine.max(0.0),
            LitSides::Both => cosine.abs(),
        }
    }

    /// The greatest factor and the greatest highlight of any shade.
    pub fn brightest(&self) -> Shade {
        let LightTerms { ambient, diffuse, specular, .. } = self.terms;
        Shade { factor: (ambient + diffuse).max(1.0), highlight: specular }
    }
}

impl Shade {
    /// As without light.
    pub const NONE: Shade = Shade { factor: 1.0, highlight: 0.0 };

    /// The optics in this shade.
    pub fn on(self, optics: Optics) -> Optics {
        Optics { color: optics.color.map(|c| c * self.factor + self.highlight), ..optics }
    }

    /// Halfway between two shades.
    #[must_use]
    pub fn mean(self, other: Shade) -> Shade {
        Shade { factor: 0.5 * (self.factor + other.factor), highlight: 0.5 * (self.highlight + other.highlight) }
    }
}

/// The gradient below which a volume has no surfaces, unless somebody knows better: a 64th of the range of its values in a step of
/// its least spacing. Noise is mostly below, the rim of an object above.
pub fn flat_below(range: brickfield_core::ValueRange, least_spacing: f64) -> f64 {
    let gradient = (range.max - range.min) / (64.0 * least_spacing);
    // Values that are all equal have no gradient.
    if gradient.is_finite() && gradient > 0.0 { gradient } else { 1.0 }
}

fn unit(direction: DVec3) -> Result<DVec3, LightError> {
    direction.try_normalize().ok_or(LightError::Direction { direction })
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: LightTerms = LightTerms { ambient: 0.1, diffuse: 0.7, specular: 0.4, shininess: 20 };

    fn head() -> Light {
        Light::new(LightSource::Head, PLAIN, 2.0).unwrap()
    }

    #[test]
    fn a_steep_surface_is_lamberts_and_a_flat_medium_is_as_without_light() {
        let (eye, slant) = (DVec3::Z, DVec3::new(0.6, 0.0, 0.8));
        let steep = head().shade(slant * -1e9, eye, eye);
        assert!(
            (steep.factor - (0.1 + 0.7 * 0.8)).abs() < 1e-9 && (steep.highlight - 0.4 * 0.8f64.powi(20)).abs() < 1e-9
        );
        assert_eq!(head().shade(DVec3::ZERO, eye, eye), Shade::NONE);
        let half = head().shade(eye * -2.0, eye, eye);
        let strength = 0.5f64.sqrt();
        assert!((half.factor - (1.0 - strength + strength * 0.8)).abs() < 1e-12);
        assert!((half.highlight - 0.4 * strength).abs() < 1e-12);
    }

    #[test]
    fn the_side_of_higher_values_is_lit_if_both_are() {
        let away = head().shade(DVec3::Z * 1e9, DVec3::Z, DVec3::Z);
        assert!((away.factor - 0.1).abs() < 1e-8 && away.highlight == 0.0);
        let both = head().on_sides(LitSides::Both).shade(DVec3::Z * 1e9, DVec3::Z, DVec3::Z);
        assert!((both.factor - 0.8).abs() < 1e-8 && (both.highlight - 0.4).abs() < 1e-8);
        let behind = head().shade(DVec3::X * -1e9, DVec3::NEG_Z, DVec3::Z);
        assert!((behind.factor - 0.1).abs() < 1e-8 && behind.highlight == 0.0);
    }

    #[test]
    fn no_shade_is_brighter_than_the_brightest() {
        let most = head().brightest();
        for i in 0..1000u32 {
            let at = |k: u32| f64::from(i.wrapping_mul(k) % 1009) / 504.5 - 1.0;
            let g = DVec3::new(at(7), at(31), at(101)) * 10f64.powi(i as i32 % 7 - 3);
            let l = DVec3::new(at(13), at(57), at(211)).normalize_or(DVec3::X);
            let shade = head().on_sides(LitSides::Both).shade(g, l, DVec3::Z);
            assert!(shade.factor <= most.factor + 1e-12 && (0.0..=most.highlight + 1e-12).contains(&shade.highlight));
        }
    }

    #[test]
    fn numbers_that_make_no_light_are_named() {
        let error = |source, terms, flat| Light::new(source, terms, flat).unwrap_err().to_string();
        assert!(error(LightSource::Direction(DVec3::ZERO), PLAIN, 1.0).contains("longer than 0"));
        assert!(error(LightSource::Place(DVec3::NAN), PLAIN, 1.0).contains("must be finite"));
        assert!(error(LightSource::Head, LightTerms { diffuse: -1.0, ..PLAIN }, 1.0).contains("diffuse light of -1"));
        assert!(error(LightSource::Head, LightTerms { specular: f64::NAN, ..PLAIN }, 1.0).contains("specular light"));
        assert!(error(LightSource::Head, LightTerms { shininess: 256, ..PLAIN }, 1.0).contains("1 to 255"));
        assert!(error(LightSource::Head, PLAIN, 0.0).contains("above 0"));
    }
}
