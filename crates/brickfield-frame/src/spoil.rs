//! Plans taken apart, to be spoilt on purpose: for harnesses that must see a wrong plan noticed.

use std::sync::Arc;

use brickfield_core::glam::UVec3;
use brickfield_core::{Aabb, Companion, TransferFunction};

use crate::{
    Beams, BlockRanges, Feature, FeatureSet, Field, FramePlan, IndexGrid, Join, KeptBoxes, Lighting, Occupancy,
    Overview, ProxyGeometry, RayFrame, Sampling, Sequence, Slots,
};

/// A plan taken apart. It is put together again without validation: the plan may be wrong in any way.
#[derive(Clone, Debug)]
#[allow(missing_docs)]
pub struct SpoiltPlan {
    pub dims: UVec3,
    pub index: Arc<IndexGrid>,
    pub slots: Arc<Slots>,
    pub join: Join,
    pub companions: [Option<Arc<Slots>>; Companion::ALL.len()],
    pub ranges: Option<Arc<BlockRanges>>,
    pub rays: RayFrame,
    pub domain: Aabb,
    pub visible: Aabb,
    pub sampling: Sampling,
    pub transfer: TransferFunction,
    pub lighting: Option<Lighting>,
    pub occupancy: Option<Arc<Occupancy>>,
    pub kept: Option<Arc<KeptBoxes>>,
    pub proxy: Option<Arc<ProxyGeometry>>,
    pub features: FeatureSet,
    sequence: Sequence,
    has_beams: bool,
}

impl SpoiltPlan {
    /// The parts of a plan.
    pub fn of(plan: &FramePlan) -> SpoiltPlan {
        let FramePlan {
            field,
            rays,
            domain,
            visible,
            sampling,
            transfer,
            lighting,
            occupancy,
            kept,
            beams,
            proxy,
            sequence,
            features,
        } = plan.clone();
        SpoiltPlan {
            dims: field.dims(),
            index: field.index().clone(),
            slots: field.slots().clone(),
            join: field.join(),
            companions: Companion::ALL.map(|companion| field.companions(companion).cloned()),
            ranges: field.ranges().cloned(),
            rays,
            domain,
            visible,
            sampling,
            transfer,
            lighting,
            occupancy,
            kept,
            proxy,
            features,
            sequence,
            has_beams: beams.is_some(),
        }
    }

    /// The field as it is now.
    pub fn field(&self) -> Field {
        let beside = (self.companions.clone(), self.ranges.clone());
        Field::unchecked(self.dims, self.index.clone(), self.slots.clone(), self.join, beside)
    }

    /// The plan as it is now. Beams are traced anew: an error shall be seen, not hidden by beams that know better.
    pub fn into_plan(self) -> FramePlan {
        let field = self.field();
        let SpoiltPlan {
            rays,
            domain,
            visible,
            sampling,
            transfer,
            lighting,
            occupancy,
            kept,
            proxy,
            features,
            sequence,
            ..
        } = self;
        let features = features.without(Feature::SkipBesideBeams);
        let mut plan = FramePlan {
            field,
            rays,
            domain,
            visible,
            sampling,
            transfer,
            lighting,
            occupancy,
            kept,
            beams: None,
            proxy,
            sequence,
            features,
        };
        if let (true, Some(side)) = (self.has_beams, plan.field.slots().brick_side()) {
            let overview = Overview::of(side, plan.field.index(), plan.occupancy.as_deref());
            plan.beams = overview.and_then(|overview| Beams::of(&plan, &overview)).map(Arc::new);
        }
        if plan.beams.is_some() {
            plan.features = plan.features.with(Feature::SkipBesideBeams);
        }
        plan
    }
}
