//! The frame plan: one frame as plain data.

use std::sync::Arc;

use brickfield_core::glam::{UVec2, UVec3};
use brickfield_core::{Aabb, Companion, TransferFunction};
use brickfield_optics::{LightSource, Normals, QuadratureRule, SURFACE_STEEPNESS};

use crate::{
    Beams, DarkRegions, Division, Feature, FeatureSet, Field, KeptBoxes, Lighting, Mode, Occupancy, Placement,
    ProxyGeometry, RayFrame, SampleFormat, Sampling, Slices, Slots, Target, TextureLayout, ValueScale,
};

/// Everything that a backend needs for one frame, and nothing that this frame does not need.
///
/// Built whole by [`new`](Self::new), which derives the visible box, beams, polygons and features from the parts; nothing
/// changes afterwards.
#[derive(Clone, Debug)]
pub struct FramePlan {
    pub(crate) field: Field,
    pub(crate) rays: RayFrame,
    pub(crate) domain: Aabb,
    pub(crate) visible: Aabb,
    pub(crate) sampling: Sampling,
    pub(crate) transfer: TransferFunction,
    pub(crate) lighting: Option<Lighting>,
    pub(crate) occupancy: Option<Arc<Occupancy>>,
    pub(crate) kept: Option<Arc<KeptBoxes>>,
    pub(crate) beams: Option<Arc<Beams>>,
    pub(crate) proxy: Option<Arc<ProxyGeometry>>,
    pub(crate) sequence: Sequence,
    pub(crate) features: FeatureSet,
}

/// The parts of a plan, from which all else follows. [`new`](Self::new) fills in the parts that a frame may do without.
#[derive(Clone, Debug)]
pub struct PlanParts {
    /// A value for every position.
    pub field: Field,
    /// The rays, in sample space.
    pub rays: RayFrame,
    /// The part of sample space that is integrated (the volume's box cut by the clip box); may be empty.
    pub domain: Aabb,
    /// Step, rule and mode.
    pub sampling: Sampling,
    /// Extinction per world unit and colour over data values.
    pub transfer: TransferFunction,
    /// The light on surfaces; by default none.
    pub lighting: Option<Lighting>,
    /// The regions that rays leave out; by default none.
    pub dark: DarkRegions,
    /// How backends that can do both make the picture.
    pub drawing: Drawing,
    /// Whether the plan is a whole frame or one batch of it; by default a whole one.
    pub sequence: Sequence,
}

/// Whether a plan is a whole frame, or one of several batches of a frame ([`Backend::render_batches`](crate::Backend::render_batches)).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Sequence {
    /// A whole frame: rays begin with nothing seen.
    #[default]
    Whole,
    /// A batch: rays go on with what they have seen in earlier ones, polygons are blended over those of earlier ones.
    Batch {
        /// A box in sample space around everything visible in any batch: rays that are divided brick by brick enter their first brick
        /// there, in each batch at the same point.
        visible: Aabb,
    },
}

impl PlanParts {
    /// Parts for rays that look at everything.
    pub fn new(
        field: Field,
        rays: RayFrame,
        domain: Aabb,
        sampling: Sampling,
        transfer: TransferFunction,
    ) -> PlanParts {
        let (lighting, dark, drawing, sequence) = (None, DarkRegions::default(), Drawing::Rays, Sequence::Whole);
        PlanParts { field, rays, domain, sampling, transfer, lighting, dark, drawing, sequence }
    }
}

/// How backends that can do both make a picture.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Drawing {
    /// Rays are cast, front to back.
    #[default]
    Rays,
    /// Polygons are rasterised and blended, back to front; backends without a rasteriser cast rays to the same samples.
    Polygons {
        /// An index cell of each resident block, the farthest block first.
        back_to_front: Vec<UVec3>,
        /// The pixel format that they are blended into.
        target: Target,
        /// The order of a polygon's fragments.
        slices: Slices,
    },
}

/// Parts that do not make a plan.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum PlanError {
    #[error("a domain from {} to {} in a volume from {} to {}, in sample space", domain.min, domain.max, volume.min, volume.max)]
    Domain { domain: Aabb, volume: Aabb },
    #[error("dark regions of another field: rays would pass over samples that are seen")]
    OtherField,
    #[error(
        "light on {} normals, of samples without {companion}: take normals of central differences, or flat blocks", normals.name()
    )]
    NoNormals { normals: Normals, companion: Companion },
    #[error("polygons of spherical shells: a sphere has none; take tessellated shells")]
    RoundPolygons,
    #[error("polygons of whole rays: they are clipped to bricks; divide bricks")]
    PolygonsOfRays,
    #[error(
        "spreads of samples with the rule {}: it looks at the values between its nodes; take another rule", QuadratureRule::PreIntegrated.name()
    )]
    PreIntegratedSpreads,
    #[error("spreads of samples without the ranges of their blocks: the values that they stand for have no ends")]
    SpreadsWithoutRanges,
    #[error("a block to be drawn at index cell {cell}, which is not resident in an index of {dims}")]
    NotResident { cell: UVec3, dims: UVec3 },
}

impl FramePlan {
    /// The plan of some parts.
    ///
    /// # Errors
    /// A domain outside of the volume; dark regions of another field; spreads with a rule that looks at values between nodes, or without
    /// ranges; normals that lie beside samples, of samples without them; polygons of surfaces that have none, or of blocks that
    /// are not resident.
    pub fn new(parts: PlanParts) -> Result<FramePlan, PlanError> {
        check(&parts)?;
        let PlanParts { field, rays, domain, sampling, transfer, lighting, dark, drawing, sequence } = parts;
        let visible = match sequence {
            Sequence::Batch { visible } if sampling.division() == Division::Brick => visible.intersection(&domain),
            _ => visible_box(&field, &domain),
        };
        let mut plan = FramePlan {
            field,
            rays,
            domain,
            visible,
            sampling,
            transfer,
            lighting,
            occupancy: dark.occupancy().cloned(),
            kept: dark.kept().cloned(),
            beams: None,
            proxy: None,
            sequence,
            features: FeatureSet::default(),
        };
        match drawing {
            Drawing::Rays => plan.beams = dark.overview().and_then(|o| Beams::of(&plan, o)).map(Arc::new),
            Drawing::Polygons { back_to_front, target, slices } => {
                // The interior of bricks is not looked at before it is drawn.
                plan.occupancy = None;
                plan.proxy = Some(Arc::new(ProxyGeometry::of(&plan, &back_to_front, target, slices)));
            }
        }
        plan.features = plan.needs();
        Ok(plan)
    }

    /// The plan with its polygons drawn in batches of at most `n_triangles` (at least 1): the picture is the same.
    #[must_use]
    pub fn in_batches_of(mut self, n_triangles: u32) -> FramePlan {
        self.proxy = self.proxy.map(|proxy| Arc::new(Arc::unwrap_or_clone(proxy).in_batches_of(n_triangles)));
        self
    }

    /// The features that the rest of the plan needs.
    fn needs(&self) -> FeatureSet {
        let fast = matches!(self.sampling.mode(), Mode::Fast { .. });
        let needed = [
            (Feature::HardwareFilter, fast),
            (Feature::EarlyTermination, self.sampling.transmittance_floor() > 0.0),
            (Feature::SkipEmpty, self.field.index().has_empty()),
            (Feature::SkipDark, self.occupancy.is_some() || (self.kept.is_some() && self.proxy.is_none())),
            (Feature::Lent, self.proxy.is_none() && self.has_lent()),
            (Feature::SkipBesideBeams, self.beams.is_some()),
            (Feature::MultiLevel, self.field.has_coarse()),
            (Feature::ShortBlocks, self.field.has_short_blocks()),
            // A value is looked up, and its gradient.
            (Feature::TransferLookup, self.transfer.knots().len() > 1 || self.lighting.is_some()),
            (Feature::Prefiltered, self.spreads().is_some()),
            (Feature::Light, self.lighting.is_some()),
            (Feature::StoredGradients, self.gradients().is_some()),
            (Feature::LightBesideEye, self.lighting.is_some_and(|l| l.light.source() != LightSource::Head)),
        ];
        needed.into_iter().filter_map(|(feature, is_needed)| is_needed.then_some(feature)).collect()
    }

    /// A value for every position.
    #[inline]
    pub fn field(&self) -> &Field {
        &self.field
    }

    /// The rays, in sample space.
    #[inline]
    pub fn rays(&self) -> &RayFrame {
        &self.rays
    }

    /// The part of sample space that is integrated; may be empty.
    #[inline]
    pub fn domain(&self) -> &Aabb {
        &self.domain
    }

    /// A box in sample space around everything visible; empty if nothing is.
    #[inline]
    pub fn visible(&self) -> &Aabb {
        &self.visible
    }

    /// Step, rule and mode.
    #[inline]
    pub fn sampling(&self) -> &Sampling {
        &self.sampling
    }

    /// Extinction per world unit and colour over data values.
    #[inline]
    pub fn transfer(&self) -> &TransferFunction {
        &self.transfer
    }

    /// The light on surfaces; `None` where the medium only emits.
    #[inline]
    pub fn lighting(&self) -> Option<&Lighting> {
        self.lighting.as_ref()
    }

    /// The gradients of the samples, or the normals of surface voxels in their form; `None` where none are asked for.
    pub fn gradients(&self) -> Option<&Arc<Slots>> {
        self.field.companions(self.lighting?.light.normals().companion()?)
    }

    /// The length that [`gradients`](Self::gradients) of length 1 stand for, in data values per world unit; 0 without any.
    pub fn greatest_gradient(&self) -> f64 {
        let (Some(gradients), Some(lighting)) = (self.gradients(), self.lighting) else { return 0.0 };
        match lighting.light.normals() {
            Normals::Central | Normals::Stored => gradients.decode().scale,
            Normals::Surface => SURFACE_STEEPNESS * lighting.light.flat_below(),
        }
    }

    /// Which macrocells of bricks are dark; `None` where nothing inside a brick is leapt over.
    #[inline]
    pub fn occupancy(&self) -> Option<&Arc<Occupancy>> {
        self.occupancy.as_ref()
    }

    /// The boxes beside which trimmed bricks are dark; `None` where none are known.
    #[inline]
    pub fn kept(&self) -> Option<&Arc<KeptBoxes>> {
        self.kept.as_ref()
    }

    /// Where the rays of each tile may see something; `None` where each finds its own way.
    #[inline]
    pub fn beams(&self) -> Option<&Arc<Beams>> {
        self.beams.as_ref()
    }

    /// The polygons on which the samples are rasterised; `None` where rays are cast.
    #[inline]
    pub fn proxy(&self) -> Option<&Arc<ProxyGeometry>> {
        self.proxy.as_ref()
    }

    /// Whether the plan is one of several batches of a frame.
    #[inline]
    pub fn is_batch(&self) -> bool {
        matches!(self.sequence, Sequence::Batch { .. })
    }

    /// Whether any block is lent.
    #[inline]
    pub fn has_lent(&self) -> bool {
        self.kept.as_ref().is_some_and(|kept| kept.has_lent())
    }

    /// Whether the segments that begin in the block of an index cell are another batch's.
    #[inline]
    pub fn is_lent(&self, cell: UVec3) -> bool {
        let slot = self.field.index().at(cell).slot();
        self.kept.as_ref().zip(slot).is_some_and(|(kept, slot)| kept.is_lent(slot))
    }

    /// The features that the frame needs of a shader.
    #[inline]
    pub fn features(&self) -> FeatureSet {
        self.features
    }

    /// The part of the domain that belongs to the block of an index cell, relative to the frame's centre.
    pub fn block_box(&self, cell: UVec3) -> Aabb {
        let b = self.field.block_box(cell).intersection(&self.domain);
        Aabb { min: b.min - self.rays.center, max: b.max - self.rays.center }
    }

    /// The part of [`block_box`](Self::block_box) in which segments that see something end: of trimmed bricks the kept box, and as far
    /// beside it as a segment of length `reach` (in world units) reaches.
    pub(crate) fn seen_box(&self, cell: UVec3, reach: f64) -> Aabb {
        let b = self.block_box(cell);
        let slot = self.field.index().at(cell).slot();
        let Some((kept, slot)) = self.kept.as_ref().zip(slot) else { return b };
        let kept = kept.boxes()[slot as usize];
        let beside = reach * self.rays.voxels_per_unit;
        let center = self.rays.center;
        b.intersection(&Aabb { min: kept.min - beside - center, max: kept.max + beside - center })
    }

    /// The spreads of the samples, by which nodes are classified: of a field that has spreads, if not all of them are 0 and the transfer
    /// function tells values apart.
    pub fn spreads(&self) -> Option<&Arc<Slots>> {
        let is_needed = self.transfer.knots().len() > 1 && self.field.has_coarse();
        self.field.companions(Companion::Spread).filter(|_| is_needed)
    }

    /// How f32 arithmetic counts data values.
    pub fn value_scale(&self) -> ValueScale {
        ValueScale::of(&self.transfer, self.field.slots().decode())
    }

    /// How a device holds the samples: a volume for the texture unit's filter, else layers.
    pub fn texture_layout(&self) -> TextureLayout {
        match self.features.contains(Feature::HardwareFilter) {
            true => TextureLayout::Volume,
            false => TextureLayout::Layers,
        }
    }

    /// Whether shaders turn texture reads back into the integers that were stored: 16-bit samples where
    /// no hardware filters them. f32 has too few digits for the values between two neighbouring samples, as fractions of 1.
    pub fn reads_integers(&self) -> bool {
        self.field.slots().format() == SampleFormat::Unorm16 && !self.features.contains(Feature::HardwareFilter)
    }

    /// Whether there is nothing to render: no pixel, or nothing visible.
    pub fn shows_nothing(&self) -> bool {
        self.visible.is_empty() || self.domain.is_empty() || self.size().min_element() == 0
    }

    /// Width and height of the picture, in pixels.
    #[inline]
    pub fn size(&self) -> UVec2 {
        self.rays.size
    }
}

fn check(parts: &PlanParts) -> Result<(), PlanError> {
    let (field, volume) = (&parts.field, parts.field.volume_box());
    let Aabb { min, max } = parts.domain;
    // NaN fails too; an empty domain may lie anywhere.
    let is_inside = min.cmpge(volume.min).all() && max.cmple(volume.max).all();
    let is_nothing = parts.domain.is_empty() && min.is_finite() && max.is_finite();
    if !(is_inside || is_nothing) {
        return Err(PlanError::Domain { domain: parts.domain, volume });
    }
    if !parts.dark.is_of(field) {
        return Err(PlanError::OtherField);
    }
    if field.companions(Companion::Spread).is_some() {
        check_prefiltered(field, parts.sampling.rule())?;
    }
    let normals = parts.lighting.map_or(Normals::Central, |lighting| lighting.light.normals());
    match normals.companion() {
        Some(companion) if field.companions(companion).is_none() => {
            return Err(PlanError::NoNormals { normals, companion });
        }
        _ => {}
    }
    let Drawing::Polygons { back_to_front, .. } = &parts.drawing else { return Ok(()) };
    if parts.rays.placement == Placement::Shells {
        return Err(PlanError::RoundPolygons);
    }
    if parts.sampling.division() == Division::Ray {
        return Err(PlanError::PolygonsOfRays);
    }
    let dims = field.index().dims();
    let is_resident = |cell: &UVec3| cell.cmplt(dims).all() && field.index().at(*cell).slot().is_some();
    match back_to_front.iter().find(|cell| !is_resident(cell)) {
        Some(cell) => Err(PlanError::NotResident { cell: *cell, dims }),
        None => Ok(()),
    }
}

/// Whether nodes can be classified by spreads.
fn check_prefiltered(field: &Field, rule: QuadratureRule) -> Result<(), PlanError> {
    match field.ranges() {
        _ if rule == QuadratureRule::PreIntegrated => Err(PlanError::PreIntegratedSpreads),
        None => Err(PlanError::SpreadsWithoutRanges),
        Some(_) => Ok(()),
    }
}

/// The box around all resident blocks, as far as the domain reaches.
pub(crate) fn visible_box(field: &Field, domain: &Aabb) -> Aabb {
    let empty = Aabb { min: domain.min, max: domain.min };
    let resident = field.index().resident_box(field.dims());
    let visible = resident.map_or(empty, |b| b.intersection(domain));
    if visible.is_empty() { empty } else { visible }
}
