//! How a ray is sampled.

use brickfield_optics::QuadratureRule;

/// How a ray is sampled: how long its segments are, which rule integrates them, and whether shortcuts are allowed.
///
/// Segment k lies between surfaces k and k + 1 of the rays' [`Placement`](crate::Placement), cut to the divided span
/// ([`Division`]); the rule's nodes lie in the cut segment, which has its true length. [`Lengths::Nominal`] is the exception.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    step_world: f64,
    rule: QuadratureRule,
    mode: Mode,
    division: Division,
    lengths: Lengths,
}

/// The span that is divided into segments.
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
    /// A segment counts as a whole if its middle lies in the divided span, and else not at all. One-node rules only.
    Nominal,
}

/// Exact or fast; never mixed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mode {
    /// All eight texels (two gathers) and f32 arithmetic per sample, no early termination.
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

impl Sampling {
    /// A sampling of whole rays, with true lengths.
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
                let (division, lengths) = (Division::Ray, Lengths::True);
                Ok(Sampling { step_world, rule, mode, division, lengths })
            }
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

    /// The span that is divided into segments.
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
        assert!(good.weighted(Lengths::Nominal).is_ok());
        let gauss = Sampling::new(1.0, QuadratureRule::Gauss2, Mode::Exact).unwrap();
        assert!(error(gauss.weighted(Lengths::Nominal)).contains("gauss2"));
    }
}
