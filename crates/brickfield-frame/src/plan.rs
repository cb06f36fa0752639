//! The frame plan: one frame as plain data.

use std::sync::Arc;

use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{Aabb, TransferFunction};
use brickfield_optics::QuadratureRule;

use crate::{Beams, BrickSet, Feature, FeatureSet, IndexGrid, Occupancy, RayFrame, SampleFormat, ValueScale};

/// Everything that a backend needs for one frame, and nothing that this frame does not need.
#[derive(Clone, Debug)]
pub struct FramePlan {
    /// Samples of the volume along x, y, z.
    pub dims: UVec3,
    /// The rays, in sample space.
    pub rays: RayFrame,
    /// The part of sample space that is integrated (the volume's box cut by the clip box); may be empty.
    pub domain: Aabb,
    /// A box in sample space around everything visible; empty if nothing is.
    pub visible: Aabb,
    /// Step, rule and mode.
    pub sampling: Sampling,
    /// Extinction per world unit and colour over data values.
    pub transfer: TransferFunction,
    /// From a position to its brick.
    pub index: IndexGrid,
    /// The samples of the bricks in the index.
    pub bricks: Arc<BrickSet>,
    /// Which macrocells of those bricks are dark; `None` where nothing inside a brick is leapt over.
    pub occupancy: Option<Arc<Occupancy>>,
    /// Where the rays of each tile may see something; `None` where each finds its own way.
    pub beams: Option<Arc<Beams>>,
    /// What the frame needs of a shader.
    pub features: FeatureSet,
}

impl FramePlan {
    /// The last sample of the volume, in sample space: positions are clamped to [0, last].
    pub fn last_sample(&self) -> DVec3 {
        (self.dims - 1).as_dvec3()
    }

    /// How f32 arithmetic counts data values.
    pub fn value_scale(&self) -> ValueScale {
        ValueScale::of(&self.transfer, self.bricks.decode())
    }

    /// Whether shaders turn what they read of a texture back into the integers that were stored: 16-bit samples where
    /// no hardware filters them. Of a fraction in [0, 1], f32 has too few digits left for what lies between two of them.
    pub fn reads_integers(&self) -> bool {
        self.bricks.format() == SampleFormat::Unorm16 && !self.features.contains(Feature::HardwareFilter)
    }

    /// Width and height of the picture, in pixels.
    pub fn size(&self) -> UVec2 {
        self.rays.size
    }
}

/// How a ray is sampled.
///
/// Segment k is [k h, (k + 1) h) from the eye for every ray (LaMar et al. 1999: spherical shells), cut to the domain; the
/// rule's nodes lie in the cut segment. A node belongs to the brick that holds it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    step_world: f64,
    rule: QuadratureRule,
    mode: Mode,
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

/// Why a sampling is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum SamplingError {
    #[error("a step of {step_world} world units; it must be finite and above 0")]
    Step { step_world: f64 },
    #[error("a transmittance floor of {floor}; it must be at least 0 and below 1")]
    TransmittanceFloor { floor: f64 },
}

impl Sampling {
    /// A sampling.
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
            _ => Ok(Sampling { step_world, rule, mode }),
        }
    }

    /// Length of a segment, in world units.
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

    /// The transmittance at which rays end; 0 if they never do.
    pub fn transmittance_floor(&self) -> f64 {
        match self.mode {
            Mode::Exact => 0.0,
            Mode::Fast { transmittance_floor } => transmittance_floor,
        }
    }
}
