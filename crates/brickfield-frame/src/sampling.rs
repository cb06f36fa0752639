//! How a ray is sampled.

use brickfield_optics::QuadratureRule;

/// How a ray is sampled: where its segments end, which rule integrates them, and whether shortcuts are allowed.
///
/// Segment k lies between surfaces k and k + 1 of the [`Placement`], cut to what is divided ([`Division`]); the rule's nodes
/// lie in the cut segment, which has its true length. [`Lengths::Nominal`] is the exception.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    step_world: f64,
    rule: QuadratureRule,
    mode: Mode,
    placement: Placement,
    division: Division,
    lengths: Lengths,
}

/// The surfaces between which segments lie: the proxy geometries of LaMar, Hamann and Joy 1999, section 4.2.
///
/// Along each ray they are evenly spaced; how far apart, in steps, is [`PlanRay::stretch`](crate::PlanRay::stretch).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Placement {
    /// Spheres around the eye, a step apart on every ray. For parallel rays: planes.
    #[default]
    Shells,
    /// Those spheres as triangles: the picture's squares of so many pixels a side, cut along their falling diagonals, with
    /// their corners on the sphere.
    #[allow(missing_docs)]
    TessellatedShells { facet_pixels: u32 },
    /// Planes parallel to the picture, a step apart: a ray at angle a to the view direction has 1 / cos a steps between two.
    ViewportPlanes,
    /// Planes of constant x, y or z of the grid, a step apart in the world. Each ray takes the stack that it meets at the
    /// steepest angle.
    ObjectPlanes,
}

/// What is divided into segments.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Division {
    /// A ray's way through the domain: all its segments are as long, whichever bricks they cross.
    #[default]
    Ray,
    /// A ray's way through each brick: segments end at the brick's faces, and are 2^level steps long in between.
    Brick,
}

/// For which length the light through a sample is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Lengths {
    /// The true length of each segment: LaMar's opacity correction for any distance between samples.
    #[default]
    True,
    /// The step (2^level steps for [`Division::Brick`]), whatever the ray's angle: LaMar's own form, to show what it costs.
    /// A segment counts as a whole if its middle lies in what is divided, and else not at all. One-node rules only.
    Nominal,
}

/// Exact or fast; never mixed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mode {
    /// Eight loads and f32 arithmetic per sample, no early termination.
    Exact,
    /// Hardware filtering; a ray ends when its transmittance falls below `transmittance_floor` (0: never), which is the
    /// most that any channel can lose.
    #[allow(missing_docs)]
    Fast { transmittance_floor: f64 },
}

/// Why a sampling is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum SamplingError {
    #[error("a step of {step_world} world units; it must be finite and above 0")]
    Step { step_world: f64 },
    #[error("a transmittance floor of {floor}; it must be at least 0 and below 1")]
    TransmittanceFloor { floor: f64 },
    #[error("facets of {facet_pixels} pixels; a side must be 1 to {most}")]
    FacetPixels { facet_pixels: u32, most: u32 },
    #[error(
        "nominal lengths with the rule {}: they are for the rule {}, whose one node is a segment's middle", rule.name(), QuadratureRule::MidpointExponential.name()
    )]
    NominalRule { rule: QuadratureRule },
}

impl Mode {
    /// The fast mode that the front door chooses: rays end at a transmittance of 1/1024, a quarter of an 8-bit step.
    pub const FAST: Mode = Mode::Fast { transmittance_floor: 1.0 / 1024.0 };

    /// `exact` or `fast`.
    pub const fn name(self) -> &'static str {
        match self {
            Mode::Exact => "exact",
            Mode::Fast { .. } => "fast",
        }
    }
}

impl Placement {
    /// Most pixels along a facet's side.
    pub const MOST_FACET_PIXELS: u32 = 1 << 15;

    /// The name in shader conditions (`@if(name)`), options and reports.
    pub const fn name(self) -> &'static str {
        match self {
            Placement::Shells => "shells",
            Placement::TessellatedShells { .. } => "tessellated-shells",
            Placement::ViewportPlanes => "viewport-planes",
            Placement::ObjectPlanes => "object-planes",
        }
    }
}

impl Sampling {
    /// A sampling of whole rays by shells, with true lengths.
    ///
    /// # Errors
    /// A step that is not finite and positive, a transmittance floor outside [0, 1).
    pub fn new(step_world: f64, rule: QuadratureRule, mode: Mode) -> Result<Sampling, SamplingError> {
        if !(step_world.is_finite() && step_world > 0.0) {
            return Err(SamplingError::Step { step_world });
        }
        match mode {
            Mode::Fast { transmittance_floor: floor } if !(0.0..1.0).contains(&floor) => {
                Err(SamplingError::TransmittanceFloor { floor })
            }
            _ => {
                let (placement, division, lengths) = (Placement::Shells, Division::Ray, Lengths::True);
                Ok(Sampling { step_world, rule, mode, placement, division, lengths })
            }
        }
    }

    /// The sampling with other surfaces.
    ///
    /// # Errors
    /// Facets without pixels, or of more than [`Placement::MOST_FACET_PIXELS`].
    pub fn placed(self, placement: Placement) -> Result<Sampling, SamplingError> {
        let most = Placement::MOST_FACET_PIXELS;
        match placement {
            Placement::TessellatedShells { facet_pixels } if !(1..=most).contains(&facet_pixels) => {
                Err(SamplingError::FacetPixels { facet_pixels, most })
            }
            _ => Ok(Sampling { placement, ..self }),
        }
    }

    /// The sampling with something else divided.
    #[must_use]
    pub fn divided(self, division: Division) -> Sampling {
        Sampling { division, ..self }
    }

    /// The sampling with other lengths.
    ///
    /// # Errors
    /// Nominal lengths with a rule whose one node is not the segment's middle.
    pub fn weighted(self, lengths: Lengths) -> Result<Sampling, SamplingError> {
        match (lengths, self.rule) {
            (Lengths::True, _) | (_, QuadratureRule::MidpointExponential) => Ok(Sampling { lengths, ..self }),
            (Lengths::Nominal, rule) => Err(SamplingError::NominalRule { rule }),
        }
    }

    /// Nominal length of a segment, in world units.
    pub fn step_world(&self) -> f64 {
        self.step_world
    }

    /// How a segment is integrated.
    pub fn rule(&self) -> QuadratureRule {
        self.rule
    }

    /// Exact or fast.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// The surfaces between segments.
    pub fn placement(&self) -> Placement {
        self.placement
    }

    /// What is divided into segments.
    pub fn division(&self) -> Division {
        self.division
    }

    /// For which length the light through a sample is computed.
    pub fn lengths(&self) -> Lengths {
        self.lengths
    }

    /// The transmittance at which rays end; 0 if they never do.
    pub fn transmittance_floor(&self) -> f64 {
        match self.mode {
            Mode::Exact => 0.0,
            Mode::Fast { transmittance_floor } => transmittance_floor,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bad_samplings_are_named() {
        let midpoint = QuadratureRule::MidpointExponential;
        let error = |s: Result<Sampling, SamplingError>| s.unwrap_err().to_string();
        assert!(error(Sampling::new(0.0, midpoint, Mode::Exact)).contains("step of 0"));
        assert!(error(Sampling::new(1.0, midpoint, Mode::Fast { transmittance_floor: 1.0 })).contains("floor of 1"));
        let good = Sampling::new(1.0, midpoint, Mode::Exact).unwrap();
        assert!(error(good.placed(Placement::TessellatedShells { facet_pixels: 0 })).contains("facets of 0 pixels"));
        assert!(good.weighted(Lengths::Nominal).is_ok());
        let gauss = Sampling::new(1.0, QuadratureRule::Gauss2, Mode::Exact).unwrap();
        assert!(error(gauss.weighted(Lengths::Nominal)).contains("gauss2"));
    }
}
