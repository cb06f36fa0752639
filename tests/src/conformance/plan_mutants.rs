//! Plans with one thing wrong, to see that the cases notice. Backends replay them like any other.

use std::sync::Arc;

use brickfield::frame::{
    BlockPlaces, Chunk, Chunked, Decode, Feature, FramePlan, IndexEntry, IndexGrid, KeptBoxes, Mode, Places,
    ProxyCorner, ProxyGeometry, Reach, SampleFormat, Sampling, Slots, SpoiltPlan,
};
use brickfield_core::glam::{DVec3, UVec3, Vec3Swizzles};
use brickfield_core::{Aabb, Companion, Knot, Level, TransferFunction};
use brickfield_optics::{Light, LightSource, LightTerms, QuadratureRule};

use super::surface_normals::{NormalRule, Values};

/// One thing wrong with a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum PlanMutant {
    /// Rays start half a voxel off along x.
    AnchorHalfVoxel,
    /// Rays pass the pixels' corners, not their centres.
    PixelCorner,
    /// The picture is upside down.
    RowsFlipped,
    /// The step is 5 % too large.
    StepScaled,
    /// Segments begin half a step late.
    PhaseHalfStep,
    /// Directions are not normalised.
    NotNormalised,
    /// The rays are parallel.
    Parallel,
    /// The segment's value is taken at its near end.
    LeftRule,
    /// The domain ends at the outer sample centres.
    DomainAtSamples,
    /// The last segment of every ray is dropped.
    LastSegmentDropped,
    /// The visible box misses a slice of the volume's visible part.
    VisibleTooSmall,
    /// A brick in the middle is marked empty.
    BrickTransparent,
    /// Two bricks are swapped in the index.
    IndexSwapped,
    /// A brick is taken for one of the next coarser level (or a coarser one for the finest).
    WrongLevel,
    /// The samples of every brick are shifted by one along x.
    BricksShifted,
    /// The last layer of every brick repeats the one before: the border is not shared.
    BorderNotShared,
    /// x and y are swapped inside every brick.
    BricksTransposed,
    /// The bytes of samples are swapped.
    BytesSwapped,
    /// The top bit of integers is turned.
    SignTurned,
    /// Values are read 1 % of the transfer function's range too high.
    DecodeOffset,
    /// Values are scaled by 256/255.
    DecodeScale,
    /// The volume ends a sample early.
    LastSampleCut,
    /// The knots of the transfer function are moved up, the lowest by 5 % of its range, the last not at all.
    KnotMoved,
    /// Extinction is 2 % too high.
    ExtinctionScaled,
    /// Red and blue are swapped.
    RedBlueSwapped,
    /// Rays end at a transmittance of 1/4.
    EndsEarly,
    /// The volume behind the eye is seen.
    BehindTheEye,
    /// The clip box is ignored.
    ClipIgnored,
    /// Empty blocks show a brick of the greatest value.
    GhostBricks,
    /// Polygons are drawn front to back.
    PolygonsReversed,
    /// Every 31st triangle is missing.
    PolygonsMissing,
    /// The faces through which rays leave bricks are not drawn.
    ExitsMissing,
    /// Of three stacks of planes, the stack across z is missing.
    StackMissing,
    /// Of flat blocks only what lies among their own samples is drawn, not what lies between blocks.
    BetweenMissing,
    /// The picture of all earlier batches is forgotten when the last batch begins.
    BatchesForgotten,
    /// The boxes of trimmed bricks begin a sample late along x.
    KeptTooSmall,
    /// Surfaces begin at a gradient a fifth higher.
    FlatBelowScaled,
    /// Diffuse light is 5 % too dim.
    DiffuseDimmed,
    /// A light that is elsewhere than the eye has x and y swapped.
    LightTurned,
    /// Normals of surface voxels point from the outside to them.
    SurfaceTurned,
    /// Voxels that are none of a surface have a normal along x.
    SurfaceEverywhere,
    /// Of the neighbours of a voxel only the six that share a face are asked for a normal.
    SurfaceOfSix,
    /// All outside neighbours of a voxel count alike.
    SurfaceUnweighted,
}

impl PlanMutant {
    /// All plan mutants.
    pub const ALL: [PlanMutant; 43] = [
        PlanMutant::AnchorHalfVoxel,
        PlanMutant::PixelCorner,
        PlanMutant::RowsFlipped,
        PlanMutant::StepScaled,
        PlanMutant::PhaseHalfStep,
        PlanMutant::NotNormalised,
        PlanMutant::Parallel,
        PlanMutant::LeftRule,
        PlanMutant::DomainAtSamples,
        PlanMutant::LastSegmentDropped,
        PlanMutant::VisibleTooSmall,
        PlanMutant::BrickTransparent,
        PlanMutant::IndexSwapped,
        PlanMutant::WrongLevel,
        PlanMutant::BricksShifted,
        PlanMutant::BorderNotShared,
        PlanMutant::BricksTransposed,
        PlanMutant::BytesSwapped,
        PlanMutant::SignTurned,
        PlanMutant::DecodeOffset,
        PlanMutant::DecodeScale,
        PlanMutant::LastSampleCut,
        PlanMutant::KnotMoved,
        PlanMutant::ExtinctionScaled,
        PlanMutant::RedBlueSwapped,
        PlanMutant::EndsEarly,
        PlanMutant::BehindTheEye,
        PlanMutant::ClipIgnored,
        PlanMutant::GhostBricks,
        PlanMutant::PolygonsReversed,
        PlanMutant::PolygonsMissing,
        PlanMutant::ExitsMissing,
        PlanMutant::StackMissing,
        PlanMutant::BetweenMissing,
        PlanMutant::BatchesForgotten,
        PlanMutant::KeptTooSmall,
        PlanMutant::FlatBelowScaled,
        PlanMutant::DiffuseDimmed,
        PlanMutant::LightTurned,
        PlanMutant::SurfaceTurned,
        PlanMutant::SurfaceEverywhere,
        PlanMutant::SurfaceOfSix,
        PlanMutant::SurfaceUnweighted,
    ];

    /// The mutant's name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            PlanMutant::AnchorHalfVoxel => "plan/anchor-half-voxel",
            PlanMutant::PixelCorner => "plan/pixel-corner",
            PlanMutant::RowsFlipped => "plan/rows-flipped",
            PlanMutant::StepScaled => "plan/step-scaled",
            PlanMutant::PhaseHalfStep => "plan/phase-half-step",
            PlanMutant::NotNormalised => "plan/not-normalised",
            PlanMutant::Parallel => "plan/parallel",
            PlanMutant::LeftRule => "plan/left-rule",
            PlanMutant::DomainAtSamples => "plan/domain-at-samples",
            PlanMutant::LastSegmentDropped => "plan/last-segment-dropped",
            PlanMutant::VisibleTooSmall => "plan/visible-too-small",
            PlanMutant::BrickTransparent => "plan/brick-transparent",
            PlanMutant::IndexSwapped => "plan/index-swapped",
            PlanMutant::WrongLevel => "plan/wrong-level",
            PlanMutant::BricksShifted => "plan/bricks-shifted",
            PlanMutant::BorderNotShared => "plan/border-not-shared",
            PlanMutant::BricksTransposed => "plan/bricks-transposed",
            PlanMutant::BytesSwapped => "plan/bytes-swapped",
            PlanMutant::SignTurned => "plan/sign-turned",
            PlanMutant::DecodeOffset => "plan/decode-offset",
            PlanMutant::DecodeScale => "plan/decode-scale",
            PlanMutant::LastSampleCut => "plan/last-sample-cut",
            PlanMutant::KnotMoved => "plan/knot-moved",
            PlanMutant::ExtinctionScaled => "plan/extinction-scaled",
            PlanMutant::RedBlueSwapped => "plan/red-blue-swapped",
            PlanMutant::EndsEarly => "plan/ends-early",
            PlanMutant::BehindTheEye => "plan/behind-the-eye",
            PlanMutant::ClipIgnored => "plan/clip-ignored",
            PlanMutant::GhostBricks => "plan/ghost-bricks",
            PlanMutant::PolygonsReversed => "plan/polygons-reversed",
            PlanMutant::PolygonsMissing => "plan/polygons-missing",
            PlanMutant::ExitsMissing => "plan/exits-missing",
            PlanMutant::StackMissing => "plan/stack-missing",
            PlanMutant::BetweenMissing => "plan/between-missing",
            PlanMutant::BatchesForgotten => "plan/batches-forgotten",
            PlanMutant::KeptTooSmall => "plan/kept-too-small",
            PlanMutant::FlatBelowScaled => "plan/flat-below-scaled",
            PlanMutant::DiffuseDimmed => "plan/diffuse-dimmed",
            PlanMutant::LightTurned => "plan/light-turned",
            PlanMutant::SurfaceTurned => "plan/surface-turned",
            PlanMutant::SurfaceEverywhere => "plan/surface-everywhere",
            PlanMutant::SurfaceOfSix => "plan/surface-of-six",
            PlanMutant::SurfaceUnweighted => "plan/surface-unweighted",
        }
    }

    /// Whether it is in the polygons, which only backends with a rasteriser draw.
    pub fn is_of_polygons(self) -> bool {
        use PlanMutant::{
            BatchesForgotten, BetweenMissing, ExitsMissing, PolygonsMissing, PolygonsReversed, StackMissing,
        };
        matches!(
            self,
            PolygonsReversed | PolygonsMissing | ExitsMissing | StackMissing | BetweenMissing | BatchesForgotten
        )
    }

    /// The plan with this thing wrong.
    pub fn apply(self, honest: &FramePlan) -> FramePlan {
        let mut plan = SpoiltPlan::of(honest);
        self.spoil(&mut plan);
        plan.into_plan()
    }

    fn spoil(self, plan: &mut SpoiltPlan) {
        match self {
            PlanMutant::AnchorHalfVoxel => plan.rays.anchor[0].x += 0.5,
            PlanMutant::PixelCorner => shift_half_pixel(plan),
            PlanMutant::RowsFlipped => flip_rows(plan),
            PlanMutant::StepScaled => resample(plan, |s| (s.step_world() * 1.05, s.rule(), s.mode())),
            PlanMutant::PhaseHalfStep => plan.rays.anchor_past_start += 0.5 * plan.sampling.step_world(),
            PlanMutant::NotNormalised => plan.rays.pixel = 0.0,
            PlanMutant::Parallel => make_parallel(plan),
            PlanMutant::LeftRule => {
                resample(plan, |s| (s.step_world(), QuadratureRule::LeftExponential, s.mode()));
            }
            PlanMutant::DomainAtSamples => end_domain_at_samples(plan),
            PlanMutant::LastSegmentDropped => drop_last_segment(plan),
            PlanMutant::VisibleTooSmall => shrink_visible(plan),
            PlanMutant::BrickTransparent => hide_central_brick(plan),
            PlanMutant::IndexSwapped => swap_slots(plan),
            PlanMutant::WrongLevel => confuse_levels(plan),
            PlanMutant::BricksShifted => move_samples(plan, |p, n| p.with_x((p.x + 1).min(n - 1))),
            PlanMutant::BorderNotShared => move_samples(plan, |p, n| p.min(UVec3::splat(n - 2))),
            PlanMutant::BricksTransposed => move_samples(plan, |p, _| UVec3::new(p.y, p.x, p.z)),
            PlanMutant::BytesSwapped => edit_bytes(plan, |sample| sample.reverse()),
            PlanMutant::SignTurned => edit_bytes(plan, |sample| sample[sample.len() - 1] ^= 0x80),
            PlanMutant::DecodeOffset => redecode(plan, |d, range| Decode { offset: d.offset + 0.01 * range, ..d }),
            PlanMutant::DecodeScale => redecode(plan, |d, _| Decode { scale: d.scale * 256.0 / 255.0, ..d }),
            PlanMutant::LastSampleCut => plan.dims = (plan.dims - 1).max(UVec3::ONE),
            PlanMutant::KnotMoved => move_knot(plan),
            PlanMutant::ExtinctionScaled => edit_knots(plan, |k| k.extinction *= 1.02),
            PlanMutant::RedBlueSwapped => edit_knots(plan, |k| k.color.swap(0, 2)),
            PlanMutant::EndsEarly => {
                resample(plan, |s| (s.step_world(), s.rule(), Mode::Fast { transmittance_floor: 0.25 }));
                plan.features = plan.features.with(Feature::EarlyTermination);
            }
            PlanMutant::BehindTheEye => see_behind(plan),
            PlanMutant::ClipIgnored => {
                plan.domain = whole(plan);
                plan.visible = plan.domain;
            }
            PlanMutant::GhostBricks => show_ghosts(plan),
            PlanMutant::PolygonsReversed => edit_triangles(plan, |_, triangles| triangles.reverse()),
            PlanMutant::PolygonsMissing => edit_triangles(plan, |_, triangles| {
                triangles.iter_mut().step_by(31).for_each(|t| *t = [0; 3]);
            }),
            PlanMutant::ExitsMissing => drop_triangles(plan, |corner| corner.surface == ProxyCorner::EXIT),
            PlanMutant::StackMissing => drop_triangles(plan, |corner| corner.owner / 2 == 2),
            PlanMutant::BetweenMissing => drop_triangles(plan, |corner| corner.brick % 2 == 1),
            PlanMutant::BatchesForgotten => forget_batches(plan),
            PlanMutant::KeptTooSmall => {
                let late = |b: &Aabb| Aabb { min: b.min + DVec3::X, ..*b };
                let boxes = |kept: Arc<KeptBoxes>| Arc::new(KeptBoxes::new(kept.boxes().iter().map(late).collect()));
                plan.kept = plan.kept.take().map(boxes);
            }
            PlanMutant::FlatBelowScaled => {
                relight(plan, |light| (light.source(), light.terms(), 1.2 * light.flat_below()))
            }
            PlanMutant::DiffuseDimmed => relight(plan, |light| {
                let terms = LightTerms { diffuse: 0.95 * light.terms().diffuse, ..light.terms() };
                (light.source(), terms, light.flat_below())
            }),
            PlanMutant::LightTurned => relight(plan, |light| {
                let source = match light.source() {
                    LightSource::Head => LightSource::Head,
                    LightSource::Direction(d) => LightSource::Direction(d.yxz()),
                    LightSource::Place(p) => LightSource::Place(p.yxz()),
                };
                (source, light.terms(), light.flat_below())
            }),
            PlanMutant::SurfaceTurned => edit_normals(plan, |_, [x, y, z, length]| [254 - x, 254 - y, 254 - z, length]),
            PlanMutant::SurfaceEverywhere => {
                edit_normals(plan, |_, code| if code[3] == 0 { [254, 127, 127, 255] } else { code });
            }
            PlanMutant::SurfaceOfSix => recompute_normals(plan, NormalRule::OfSix),
            PlanMutant::SurfaceUnweighted => recompute_normals(plan, NormalRule::Unweighted),
        }
    }
}

fn relight(plan: &mut SpoiltPlan, change: impl Fn(&Light) -> (LightSource, LightTerms, f64)) {
    let Some(lighting) = &mut plan.lighting else { return };
    let (source, terms, flat_below) = change(&lighting.light);
    let light = Light::new(source, terms, flat_below).expect("a mutant's light is one");
    lighting.light = light.on_sides(lighting.light.sides()).on_normals(lighting.light.normals());
}

/// Other normals of surface voxels: of each sample, by its block and its place in it.
fn edit_normals(plan: &mut SpoiltPlan, edit: impl Fn((u32, usize), [u8; 4]) -> [u8; 4]) {
    let Some(normals) = plan.companions[Companion::SurfaceNormal as usize].take() else { return };
    let edited = |slot: u32, bytes: &[u8]| -> Vec<u8> {
        let codes = bytes.as_chunks().0.iter().enumerate();
        codes.flat_map(|(i, code)| edit((slot, i), *code)).collect()
    };
    let slots = 0..normals.n_slots();
    let chunk = |slot: u32| Some(Arc::new(Chunk::new(edited(slot, normals.samples(slot)?.bytes()))));
    let one = |slot: u32| match normals.samples(slot) {
        Some(_) => 0,
        None => {
            u32::from_le_bytes(edit((slot, 0), (normals.one_sample(slot).unwrap_or_default() as u32).to_le_bytes()))
        }
    };
    let (chunks, ones) = (slots.clone().map(chunk).collect(), slots.map(one).collect());
    let edited = plan.slots.companions(normals.format(), normals.decode(), chunks, ones);
    plan.companions[Companion::SurfaceNormal as usize] = Some(Arc::new(edited.expect("as many as before")));
}

/// Normals by another rule, of a plan all of whose blocks are at level 0; of other plans they stay.
fn recompute_normals(plan: &mut SpoiltPlan, rule: NormalRule) {
    let (Places::Blocks(places), Some(lighting)) = (plan.slots.places().clone(), plan.lighting) else { return };
    if places.rows().iter().any(|row| row.level != Level(0)) {
        return;
    }
    let mut values = vec![0.0; plan.dims.element_product() as usize];
    for slot in 0..plan.slots.n_slots() {
        let Some(chunk) = plan.slots.samples(slot) else { continue };
        for i in 0..chunk.bytes().len() / plan.slots.format().n_bytes() {
            values[voxel_of(&places, slot, i)] = plan.slots.decode().value(plan.slots.format().read(chunk.bytes(), i));
        }
    }
    let transfer = plan.transfer.clone();
    let codes = Values { values, dims: plan.dims, spacing: lighting.spacing(), transfer: &transfer }.codes(rule);
    edit_normals(plan, |(slot, i), _| codes[voxel_of(&places, slot, i)]);
}

/// The number of a voxel, x fastest, by its block and its place in it.
fn voxel_of(places: &BlockPlaces, slot: u32, i: usize) -> usize {
    let layout = places.layout();
    let block = layout.block(slot as usize);
    let (first, n, i) = (layout.first_voxel(block), layout.extent(block), i as u32);
    let p = first + UVec3::new(i % n.x, i / n.x % n.y, i / (n.x * n.y));
    (p.x + layout.dims().x * (p.y + layout.dims().y * p.z)) as usize
}

fn edit_triangles(plan: &mut SpoiltPlan, edit: impl Fn(&[ProxyCorner], &mut [[u32; 3]])) {
    let Some(proxy) = &mut plan.proxy else { return };
    let mut spoilt = ProxyGeometry::clone(proxy);
    let corners = spoilt.corners().to_vec();
    edit(&corners, spoilt.indices_mut().as_chunks_mut().0);
    *proxy = Arc::new(spoilt);
}

fn drop_triangles(plan: &mut SpoiltPlan, is_dropped: impl Fn(&ProxyCorner) -> bool) {
    edit_triangles(plan, |corners, triangles| {
        let dropped = triangles.iter_mut().filter(|t| is_dropped(&corners[t[0] as usize]));
        dropped.for_each(|t| *t = [0; 3]);
    });
}

fn forget_batches(plan: &mut SpoiltPlan) {
    let last = plan.proxy.as_ref().and_then(|proxy| proxy.batches().last().map(|batch| batch.start as usize / 3));
    edit_triangles(plan, |_, triangles| triangles[..last.unwrap_or(0)].fill([0; 3]));
}

fn shift_half_pixel(plan: &mut SpoiltPlan) {
    for v in [&mut plan.rays.anchor, &mut plan.rays.direction] {
        v[0] += 0.5 * (v[1] + v[2]);
    }
}

fn flip_rows(plan: &mut SpoiltPlan) {
    plan.rays.anchor[2] *= -1.0;
    plan.rays.direction[2] *= -1.0;
}

fn make_parallel(plan: &mut SpoiltPlan) {
    plan.rays.direction[1] = DVec3::ZERO;
    plan.rays.direction[2] = DVec3::ZERO;
    plan.rays.pixel = 0.0;
}

/// Lets rays begin a volume's length before the eye.
fn see_behind(plan: &mut SpoiltPlan) {
    let step = plan.sampling.step_world();
    let length = plan.dims.as_dvec3().length() / plan.rays.direction[0].length();
    let back = (2.0 * length / step).ceil() * step;
    plan.rays.start += back;
}

fn whole(plan: &SpoiltPlan) -> Aabb {
    Aabb { min: DVec3::splat(-0.5), max: plan.dims.as_dvec3() - 0.5 }
}

/// One brick whose samples all have the greatest stored value, everywhere.
fn show_ghosts(plan: &mut SpoiltPlan) {
    let sample: &[u8] = match plan.slots.format() {
        SampleFormat::Unorm8 | SampleFormat::Unorm8x4 | SampleFormat::Unorm16 => &[0xff],
        SampleFormat::Float32 => &[0, 0, 0x80, 0x3f],
    };
    let bytes: Vec<u8> = sample.iter().copied().cycle().take(plan.slots.chunk_bytes()).collect();
    refill(plan, vec![Some(bytes)], plan.slots.decode());
    let entry = IndexEntry::Resident { slot: 0, reach: Reach(0) };
    edit_words(plan, |words| words.fill(entry.pack()));
    plan.visible = plan.domain;
}

/// Other samples in the slots.
fn refill(plan: &mut SpoiltPlan, bytes: Vec<Option<Vec<u8>>>, decode: Decode) {
    let samples = bytes.into_iter().map(|bytes| Some(Arc::new(Chunk::new(bytes?)))).collect();
    let slots = Slots::new(plan.slots.format(), decode, plan.slots.places().clone(), samples);
    plan.slots = Arc::new(slots.expect("samples of the same size"));
}

/// Changed samples in the slots.
fn edit_samples(plan: &mut SpoiltPlan, edit: impl Fn(&[u8]) -> Vec<u8>) {
    let all = plan.slots.all_samples().iter();
    let edited = all.map(|samples| samples.as_ref().map(|chunk| edit(chunk.bytes()))).collect();
    refill(plan, edited, plan.slots.decode());
}

fn edit_words(plan: &mut SpoiltPlan, edit: impl FnOnce(&mut [u32])) {
    let mut words = plan.index.words().to_vec();
    edit(&mut words);
    plan.index = Arc::new(IndexGrid::from_words(plan.index.dims(), plan.index.lattice(), words));
}

fn resample(plan: &mut SpoiltPlan, change: impl Fn(&Sampling) -> (f64, QuadratureRule, Mode)) {
    let (step, rule, mode) = change(&plan.sampling);
    let old = plan.sampling;
    let new = Sampling::new(step, rule, mode).expect("a mutant's sampling is a sampling");
    let new = new.divided(old.division());
    plan.sampling = new.weighted(old.lengths()).unwrap_or(new);
}

fn end_domain_at_samples(plan: &mut SpoiltPlan) {
    let last = plan.field().last_sample();
    cut_domain(plan, Aabb { min: DVec3::ZERO, max: last });
}

/// Ends the domain one step of the central ray before its far end.
fn drop_last_segment(plan: &mut SpoiltPlan) {
    let way = plan.rays.direction[0] * plan.sampling.step_world();
    let Aabb { min, max } = plan.domain;
    let back = way.clamp(-0.5 * (max - min), 0.5 * (max - min));
    cut_domain(plan, Aabb { min: min - back.min(DVec3::ZERO), max: max - back.max(DVec3::ZERO) });
}

fn cut_domain(plan: &mut SpoiltPlan, to: Aabb) {
    plan.domain = plan.domain.intersection(&to);
    plan.visible = plan.visible.intersection(&to);
}

fn shrink_visible(plan: &mut SpoiltPlan) {
    let extent = plan.visible.extent();
    plan.visible.min += extent * 0.3;
    plan.visible.max -= extent * 0.3;
}

fn hide_central_brick(plan: &mut SpoiltPlan) {
    let centre = plan.index.dims() / 2;
    let reach = plan.index.at(centre).reach();
    let (low, high) = reach.block(centre);
    let dims = plan.index.dims();
    let in_block = |cell: UVec3| cell.cmpge(low).all() && cell.cmplt(high).all();
    edit_words(plan, |words| {
        let cells = (0..).map(|i| UVec3::new(i % dims.x, i / dims.x % dims.y, i / dims.x / dims.y));
        let hidden = words.iter_mut().zip(cells).filter(|(_, cell)| in_block(*cell));
        hidden.for_each(|(word, _)| *word = IndexEntry::Empty { reach }.pack());
    });
    plan.features = plan.features.with(Feature::SkipEmpty);
}

/// Gives each of the two central bricks the other's slot.
fn swap_slots(plan: &mut SpoiltPlan) {
    edit_words(plan, |words| {
        let slot = |w: u32| IndexEntry::unpack(w).slot();
        let middle = words.len() / 2;
        let mut near: Vec<u32> =
            words[middle..].iter().chain(words[..middle].iter().rev()).filter_map(|w| slot(*w)).collect();
        near.dedup();
        let (Some(&a), Some(&b)) = (near.first(), near.iter().find(|s| Some(*s) != near.first())) else { return };
        for word in words {
            if let IndexEntry::Resident { slot, reach } = IndexEntry::unpack(*word) {
                let other = if slot == a {
                    b
                } else if slot == b {
                    a
                } else {
                    slot
                };
                *word = IndexEntry::Resident { slot: other, reach }.pack();
            }
        }
    });
}

fn confuse_levels(plan: &mut SpoiltPlan) {
    edit_words(plan, |words| {
        for word in words {
            if let IndexEntry::Resident { slot, reach } = IndexEntry::unpack(*word) {
                let reach = if reach == Reach(0) { Reach(1) } else { Reach(0) };
                *word = IndexEntry::Resident { slot, reach }.pack();
            }
        }
    });
    plan.features = plan.features.with(Feature::MultiLevel);
}

/// Every brick with the sample at `from(p, n)` at p.
fn move_samples(plan: &mut SpoiltPlan, from: impl Fn(UVec3, u32) -> UVec3) {
    let n = plan.slots.brick_side().expect("cases have bricks of one size").n_samples();
    let size = plan.slots.format().n_bytes();
    let at = |p: UVec3| size * (p.x + n * (p.y + n * p.z)) as usize;
    edit_samples(plan, |brick| {
        let mut moved = brick.to_vec();
        for i in 0..n * n * n {
            let p = UVec3::new(i % n, i / n % n, i / (n * n));
            moved[at(p)..][..size].copy_from_slice(&brick[at(from(p, n))..][..size]);
        }
        moved
    });
}

fn edit_bytes(plan: &mut SpoiltPlan, edit: impl Fn(&mut [u8])) {
    let size = plan.slots.format().n_bytes();
    edit_samples(plan, |brick| {
        let mut edited = brick.to_vec();
        edited.chunks_exact_mut(size).for_each(&edit);
        edited
    });
}

fn redecode(plan: &mut SpoiltPlan, change: impl Fn(Decode, f64) -> Decode) {
    let decode = change(plan.slots.decode(), transfer_range(plan));
    let slots = &plan.slots;
    let same = Slots::new(slots.format(), decode, slots.places().clone(), slots.all_samples().to_vec());
    plan.slots = Arc::new(same.expect("the same samples"));
}

fn transfer_range(plan: &SpoiltPlan) -> f64 {
    let knots = plan.transfer.knots();
    knots[knots.len() - 1].value - knots[0].value
}

fn edit_knots(plan: &mut SpoiltPlan, edit: impl FnMut(&mut Knot)) {
    let mut knots = plan.transfer.knots().to_vec();
    knots.iter_mut().for_each(edit);
    plan.transfer = TransferFunction::new(knots).expect("a mutant's transfer function is one");
}

/// Moves all knots but the last up, the lower ones by more; jumps stay jumps, and the order stays.
fn move_knot(plan: &mut SpoiltPlan) {
    let knots = plan.transfer.knots();
    let last = knots[knots.len() - 1].value;
    edit_knots(plan, |k| {
        k.value += 0.05 * (last - k.value);
    });
}
