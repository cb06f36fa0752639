//! Options of sampling, and the rule that a transfer function asks for.

use brickfield_bricks::{BlockSource, FetchError, fetch_values};
use brickfield_core::{Level, TransferFunction, Volume};
use brickfield_frame::{Division, Lengths, Mode, Placement, Target, Upload};
use brickfield_optics::{NarrowPeak, QuadratureRule, changes_across, narrow_peak, narrow_peak_of};
use clap::Args;

use super::{OptionError, note, values};
use crate::{Classification, Quality, Scene, Skipping, Technique};

/// How rays are sampled.
#[derive(Args, Clone, Debug)]
pub struct SamplingOptions {
    /// exact (f32 arithmetic, held to the reference) or fast (hardware filter, early end of rays)
    #[arg(long, default_value = "exact", value_parser = values::mode)]
    pub mode: Mode,
    /// Distance between samples, in units of the least voxel spacing, as a decimal or a fraction
    #[arg(long, value_name = "VOXELS", default_value_t = 0.5, value_parser = values::step, allow_hyphen_values = true)]
    pub step: f64,
    /// Quadrature rule: left-riemann, left-exponential, midpoint, pre-integrated or gauss2; midpoint unless stated, or
    /// pre-integrated where samples would step over a peak of the transfer function (not with --classify prefiltered)
    #[arg(long, value_parser = values::rule)]
    pub rule: Option<QuadratureRule>,
    /// Surfaces between which samples lie: shells (spheres around the eye), tessellated-shells[=PIXELS] (their triangles:
    /// squares of PIXELS, 16, cut in two), viewport-planes (parallel to the picture) or object-planes (of constant x, y or z);
    /// shells unless stated, tessellated-shells with --polygons
    #[arg(long, value_name = "SURFACES", value_parser = values::placement)]
    pub placement: Option<Placement>,
    /// What is divided into segments: rays (all are as long), or bricks (a ray's way through each, at distances that double
    /// with its level); rays unless stated, bricks with --polygons
    #[arg(long, value_name = "WHAT", value_parser = values::division)]
    pub divide: Option<Division>,
    /// For which length the light through a sample is computed: true (the segment's) or nominal (the step, whatever the
    /// angle; with --rule midpoint)
    #[arg(long, value_name = "WHICH", default_value = "true", value_parser = values::lengths)]
    pub lengths: Lengths,
    /// Rasterise and blend polygons instead of casting rays, into rgba32float or rgba16float; the cpu backend casts rays to
    /// their samples
    #[arg(long, value_name = "TARGET", value_parser = values::target)]
    pub polygons: Option<Target>,
    /// final, or draft (steps of twice the length, and of flat blocks the nearest one alone): while the camera moves
    #[arg(long, value_name = "WHICH", default_value = "final", value_parser = values::quality)]
    pub quality: Quality,
    /// How samples are brought to a device: plain, or packed[=ERROR] (in groups of numbers that the device unpacks, where that is fewer
    /// bytes; with ERROR, 0, a sample may be so many stored integers off)
    #[arg(long, value_name = "HOW", default_value = "plain", value_parser = values::upload)]
    pub upload: Upload,
    /// Upload and sample transparent bricks too (to measure what leaving them out saves)
    #[arg(long)]
    pub no_skip: bool,
}

/// Voxels at full resolution, of which a default may be chosen.
#[derive(Clone, Copy)]
pub enum FinestVoxels<'a> {
    /// All of them.
    Volume(&'a Volume),
    /// Those of a few blocks, fetched when they are asked for.
    Blocks(&'a dyn BlockSource),
}

impl FinestVoxels<'_> {
    fn narrow_peak(self, transfer: &TransferFunction, step_voxels: f64) -> Result<Option<NarrowPeak>, FetchError> {
        match self {
            FinestVoxels::Volume(volume) => Ok(narrow_peak(volume, transfer, step_voxels)),
            FinestVoxels::Blocks(blocks) => {
                narrow_peak_of(transfer, step_voxels, |value| changes_of_blocks(blocks, value))
            }
        }
    }
}

/// How much neighbours differ that have a value between them, in blocks spread evenly over those that have the value.
fn changes_of_blocks(blocks: &dyn BlockSource, value: f64) -> Result<Vec<f64>, FetchError> {
    const MOST_BLOCKS: usize = 32;
    let (layout, summaries) = (blocks.layout(), blocks.summaries());
    let with_value: Vec<usize> = (0..summaries.len()).filter(|i| summaries[*i].range.contains(value)).collect();
    let mut changes = Vec::new();
    for ordinal in with_value.iter().step_by(with_value.len().div_ceil(MOST_BLOCKS).max(1)) {
        let block = layout.block(*ordinal);
        changes.extend(changes_across(&fetch_values(blocks, block, Level(0))?, layout.extent(block), value));
    }
    Ok(changes)
}

impl SamplingOptions {
    /// The scene of a volume, sampled as asked for. The default rule depends on the voxels.
    ///
    /// # Errors
    /// Options that exclude each other; voxels that cannot be fetched.
    pub fn of(
        &self,
        scene: Scene,
        voxels: FinestVoxels<'_>,
        classification: Classification,
    ) -> Result<Scene, OptionError> {
        self.check()?;
        let rule = match self.rule {
            Some(rule) => rule,
            None => self.default_rule(&scene, voxels, classification)?,
        };
        let tessellated = Placement::TessellatedShells { facet_pixels: values::FACET_PIXELS };
        // Without polygons, as by default.
        let (technique, placement, division) = match self.polygons {
            Some(target) => (Technique::Polygons(target), tessellated, Division::Brick),
            None => Default::default(),
        };
        Ok(Scene {
            step_voxels: self.step,
            rule,
            mode: self.mode,
            placement: self.placement.unwrap_or(placement),
            division: self.divide.unwrap_or(division),
            lengths: self.lengths,
            technique,
            quality: self.quality,
            upload: self.upload,
            skipping: if self.no_skip { Skipping::Off } else { Skipping::On },
            ..scene
        })
    }

    /// The midpoint rule, unless it steps over a peak of the transfer function: that is said, and pre-integration is taken where it can be.
    fn default_rule(
        &self,
        scene: &Scene,
        voxels: FinestVoxels<'_>,
        classification: Classification,
    ) -> Result<QuadratureRule, OptionError> {
        let narrow = match self.lengths {
            Lengths::True => voxels.narrow_peak(&scene.transfer, self.quality.step(self.step))?,
            // Only the midpoint rule has nominal lengths.
            Lengths::Nominal => None,
        };
        let Some(NarrowPeak { values, change }) = narrow else { return Ok(QuadratureRule::MidpointExponential) };
        let (rule, taken) = match classification {
            Classification::OfMean => (
                QuadratureRule::PreIntegrated,
                "--rule pre-integrated is taken, for the midpoint rule would show rings",
            ),
            // Spreads tell of values between the samples of a block, and pre-integration knows nothing of them.
            Classification::Prefiltered => (
                QuadratureRule::MidpointExponential,
                "where blocks are fine, the midpoint rule shows rings: take a shorter --step, or --classify mean",
            ),
        };
        note(&format!(
            "the transfer function has a peak at {:.6} to {:.6}, and from one sample to the next values change by {change:.6}: {taken}",
            values.min, values.max
        ));
        Ok(rule)
    }

    /// Refuses what is wrong for any volume: `prepare` does, too, but here the options are known by name.
    ///
    /// # Errors
    /// Options that exclude each other.
    pub fn check(&self) -> Result<(), OptionError> {
        let exclude = |first: String, second: String, reason| Err(OptionError::Exclude { first, second, reason });
        let polygons = || format!("--polygons {}", self.polygons.map_or("", Target::name));
        match (self.polygons, self.placement, self.divide, self.lengths, self.rule) {
            (Some(_), Some(Placement::Shells), ..) => exclude(
                polygons(),
                "--placement shells".to_owned(),
                "a sphere has no polygons; take tessellated-shells",
            ),
            (Some(_), _, Some(Division::Ray), ..) => {
                exclude(polygons(), "--divide rays".to_owned(), "polygons are clipped to bricks")
            }
            (.., Lengths::Nominal, Some(rule)) if rule != QuadratureRule::MidpointExponential => exclude(
                "--lengths nominal".to_owned(),
                format!("--rule {}", rule.name()),
                "the one node must be the segment's middle; take --rule midpoint",
            ),
            _ => Ok(()),
        }
    }
}
