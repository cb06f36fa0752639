//! Small plans, built by hand.

use std::sync::Arc;

use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{Aabb, BrickSide, Camera, Grid, Knot, Level, Projection, TransferFunction};
use brickfield_frame::{
    DarkRegions, Decode, Division, Drawing, FeatureSet, Field, FramePlan, IndexEntry, IndexGrid, IndexLattice, Join,
    Mode, Placement, PlanParts, QuadratureRule, RayFrame, Reach, SampleFormat, Sampling, Sequence, Slices, Slots,
    SpoiltPlan, Steps, Target,
};

const N: u32 = 16;
const DIMS: UVec3 = UVec3::new(2 * N - 1, N, N);

/// Two bricks side by side along x: 31 x 16 x 16 samples whose value is their z. A third brick is nowhere: with it the
/// atlas has a place that no brick fills.
pub(crate) fn ramp(format: SampleFormat) -> Slots {
    filled(format, |_, p| p.z)
}

/// The same with values that vary along all axes and from brick to brick, all of them 0 to 15.
pub(crate) fn bumps(format: SampleFormat) -> Slots {
    filled(format, |slot, p| {
        let x = p.x + slot * (N - 1);
        (x * 7 + p.y * 5 + p.z * 3 + x * p.y / 4) % N
    })
}

fn filled(format: SampleFormat, value: impl Fn(u32, UVec3) -> u32) -> Slots {
    let (decode, per_value) = match format {
        SampleFormat::Unorm8 => (Decode { scale: 255.0 / 16.0, offset: 0.0 }, 16),
        SampleFormat::Unorm16 => (Decode { scale: 65535.0 / 4096.0, offset: 0.0 }, 4096),
        SampleFormat::Float32 => (Decode { scale: 1.0, offset: 0.0 }, 1),
        SampleFormat::Unorm8x4 => unreachable!("values are single numbers"),
    };
    let mut bytes = Vec::new();
    for i in 0..3 * N.pow(3) {
        let (slot, i) = (i / N.pow(3), i % N.pow(3));
        let stored = value(slot, UVec3::new(i % N, i / N % N, i / (N * N))) * per_value;
        match format {
            SampleFormat::Float32 => bytes.extend((stored as f32).to_le_bytes()),
            _ => bytes.extend(&stored.to_le_bytes()[..format.n_bytes()]),
        }
    }
    Slots::even(BrickSide::S16, format, decode, &bytes).unwrap()
}

/// Extinction 0 at value 0, rising by `slope` per unit of value up to 16.
pub(crate) fn rising(slope: f64) -> TransferFunction {
    let knot = |value: f64| Knot { value, extinction: value * slope, color: [1.0, 0.5, 0.25] };
    TransferFunction::new(vec![knot(0.0), knot(16.0)]).unwrap()
}

/// A picture of the two bricks along z: all rays cross 16 voxels of 1 world unit.
pub(crate) fn plan(slots: Slots, transfer: TransferFunction, rule: QuadratureRule, mode: Mode) -> FramePlan {
    let sampling = Sampling::new(0.5, rule, mode).unwrap();
    let entry = |slot: u32| (UVec3::new(slot, 0, 0), IndexEntry::Resident { slot, reach: Reach(0) });
    let parts = PlanParts {
        field: field([0, 1].map(entry), slots),
        rays: rays(&Steps::shells(sampling.step_world())),
        domain: domain(),
        sampling,
        transfer,
        lighting: None,
        dark: DarkRegions::default(),
        drawing: Drawing::Rays,
        sequence: Sequence::Whole,
    };
    FramePlan::new(parts).unwrap()
}

fn field(entries: impl IntoIterator<Item = (UVec3, IndexEntry)>, slots: Slots) -> Field {
    let lattice = IndexLattice { cell_samples: N - 1, origin: 0.0 };
    let index = IndexGrid::new(UVec3::new(2, 1, 1), lattice, entries);
    Field::new(DIMS, Arc::new(index), Arc::new(slots), Join::Shared).unwrap()
}

/// What a plan was built from, with rays.
fn parts(plan: &FramePlan) -> PlanParts {
    PlanParts {
        field: plan.field().clone(),
        rays: *plan.rays(),
        domain: *plan.domain(),
        sampling: *plan.sampling(),
        transfer: plan.transfer().clone(),
        lighting: None,
        dark: DarkRegions::default(),
        drawing: Drawing::Rays,
        sequence: Sequence::Whole,
    }
}

/// The same through the rasteriser.
pub(crate) fn polygons(plan: &FramePlan, placement: Placement, target: Target) -> FramePlan {
    let sampling = plan.sampling().divided(Division::Brick);
    let rays = rays(&Steps::of(&sampling, placement, Level(0)).unwrap());
    let beside_each_other = vec![UVec3::ZERO, UVec3::X];
    let drawing = Drawing::Polygons { back_to_front: beside_each_other, target, slices: Slices::Together };
    FramePlan::new(PlanParts { rays, sampling, drawing, ..parts(plan) }).unwrap()
}

fn rays(steps: &Steps) -> RayFrame {
    let grid = Grid::axis_aligned(DIMS, DVec3::ONE).unwrap();
    let target = grid.world_box().center();
    let projection = Projection::Orthographic { height: 12.0 };
    let camera = Camera::look_at(target - DVec3::Z * 20.5, target, -DVec3::Y, projection).unwrap();
    RayFrame::new(&camera, &grid, UVec2::new(20, 12), &domain(), steps)
}

fn domain() -> Aabb {
    Aabb { min: DVec3::splat(-0.5), max: DIMS.as_dvec3() - 0.5 }
}

/// The same with nothing in it.
pub(crate) fn nothing(plan: &FramePlan) -> FramePlan {
    let slots = plan.field().slots();
    let empty = Slots::even(BrickSide::S16, slots.format(), slots.decode(), &[]).unwrap();
    FramePlan::new(PlanParts { field: field([], empty), ..parts(plan) }).unwrap()
}

/// The same in another size, with pixels as large.
pub(crate) fn of_size(plan: &FramePlan, size: UVec2) -> FramePlan {
    FramePlan::new(PlanParts { rays: RayFrame { size, ..*plan.rays() }, ..parts(plan) }).unwrap()
}

/// The same with a box of what is visible that may be larger than it is.
pub(crate) fn with_visible(plan: &FramePlan, visible: Aabb) -> FramePlan {
    let mut spoilt = SpoiltPlan::of(plan);
    spoilt.visible = visible;
    spoilt.into_plan()
}

/// The same with other features.
pub(crate) fn with_features(plan: &FramePlan, features: FeatureSet) -> FramePlan {
    let mut spoilt = SpoiltPlan::of(plan);
    spoilt.features = features;
    spoilt.into_plan()
}
