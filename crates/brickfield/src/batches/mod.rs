//! Frames of trimmed bricks that are larger than the device's memory: batches in the order of visibility.

mod cache;

use std::collections::BTreeSet;
use std::sync::mpsc::sync_channel;

use brickfield_core::glam::{UVec2, UVec3};
use brickfield_core::{Aabb, BrickId, BrickLayout, Level, TransferFunction};
use brickfield_frame::{
    Backend, Division, Drawing, Frame, FramePlan, Lighting, PlanParts, RayFrame, RenderError, Sampling, Sequence,
    Slices, Target,
};
use brickfield_lod::back_to_front;

pub use cache::{CacheCounts, CacheError, CacheOptions, Eviction, TrimCache};

use crate::course::{Course, voxels_in_step};
use crate::prepare::check_polygons;
use crate::trimmed::{check_bricks, drawn_bricks, index_of, reach_of};
use crate::{PrepareTrimmedError, Scene, Technique, TrimmedVolume, Trimming};
use cache::Held;

/// Bricks that are drawn together.
#[derive(Debug, Default)]
struct Batch {
    /// In the order of drawing.
    drawn: Vec<BrickId>,
    /// Neighbours whose values are read.
    lent: Vec<BrickId>,
    pages: BTreeSet<usize>,
}

/// The plans of one frame, batch by batch: for [`Backend::render_batches`] or [`render_ahead`]. Each brings the pages that it needs to the
/// cache as it is asked for.
pub struct TrimBatches<'a> {
    source: &'a TrimmedVolume,
    cache: &'a mut TrimCache,
    batches: Vec<Batch>,
    next: usize,
    /// By page, the batches that need it.
    uses: Vec<Vec<usize>>,
    rays: RayFrame,
    domain: Aabb,
    visible: Aabb,
    sampling: Sampling,
    transfer: TransferFunction,
    lighting: Option<Lighting>,
    target: Option<Target>,
}

impl TrimBatches<'_> {
    /// How many there are.
    pub fn n_batches(&self) -> usize {
        self.batches.len()
    }

    /// Width and height of the picture.
    pub fn size(&self) -> UVec2 {
        self.rays.size
    }
}

impl Iterator for TrimBatches<'_> {
    type Item = FramePlan;

    fn next(&mut self) -> Option<FramePlan> {
        let batch = self.batches.get(self.next)?;
        let (this, n) = (self.next, self.batches.len());
        self.next += 1;
        let eviction = self.cache.options.eviction;
        let held = self.cache.held.as_mut().expect("a frame of these bricks");
        let distance = |page: usize, last_use: u64| match eviction {
            Eviction::LeastRecentlyUsed => u64::MAX - last_use,
            Eviction::FarthestUse => {
                let uses = &self.uses[page];
                let next = uses.iter().find(|batch| **batch > this).copied();
                // The next frame begins with the first batch.
                next.or(uses.first().map(|first| first + n)).unwrap_or(usize::MAX) as u64
            }
        };
        let admitted = held.admit(self.source, &batch.pages, distance);
        let counts = &mut self.cache.counts;
        counts.n_hits += admitted.n_there;
        counts.n_misses += admitted.n_brought;
        counts.n_bytes += admitted.n_bytes;
        let (field, dark) = held.field(self.source.layout(), &batch.drawn, &batch.lent);
        let parts = PlanParts::new(field, self.rays, self.domain, self.sampling, self.transfer.clone());
        let drawing = match self.target {
            None => Drawing::Rays,
            Some(target) => {
                let back_to_front = batch.drawn.iter().map(|id| id.coords).collect();
                Drawing::Polygons { back_to_front, target, slices: Slices::Together }
            }
        };
        let sequence = if n > 1 { Sequence::Batch { visible: self.visible } } else { Sequence::Whole };
        let plan = FramePlan::new(PlanParts { lighting: self.lighting, dark, drawing, sequence, ..parts });
        Some(plan.expect("a batch of a frame that was checked"))
    }
}

/// Renders a frame in batches, the next of which is prepared on another thread while one is drawn.
///
/// # Errors
/// As [`Backend::render_batches`].
pub fn render_ahead(
    backend: &mut dyn Backend,
    size: UVec2,
    mut batches: impl Iterator<Item = FramePlan> + Send,
) -> Result<Frame, RenderError> {
    std::thread::scope(|scope| {
        let (ahead, plans) = sync_channel(1);
        // It ends where nobody takes its plans any more.
        scope.spawn(move || batches.all(|plan| ahead.send(plan).is_ok()));
        backend.render_batches(size, &mut plans.into_iter())
    })
}

/// The batches of a frame of trimmed bricks ([`prepare_trimmed`](crate::prepare_trimmed())), each of which fits the cache. The picture is
/// that of one batch.
///
/// # Errors
/// As [`prepare_trimmed`](crate::prepare_trimmed()); a cache that does not hold one brick with the neighbours that are read beside it.
pub fn prepare_trimmed_batches<'a>(
    source: &'a TrimmedVolume,
    scene: &Scene,
    trimming: Trimming,
    cache: &'a mut TrimCache,
) -> Result<TrimBatches<'a>, PrepareTrimmedError> {
    let trimming = trimming.unless_off(scene.skipping);
    check_bricks(source, scene)?;
    let (layout, grid) = (*source.layout(), source.volume().grid());
    let Course { domain, sampling, rays } = Course::new(grid, scene, Level(0))?;
    let halo = halo_of(source, scene);
    let options = cache.options;
    let held = cache.hold(source, scene, trimming, reach_of(grid, scene))?;
    let drawn = drawn_bricks(trimming, &held.grown, &domain);
    let mut order: Vec<BrickId> =
        back_to_front(&layout, grid, &scene.camera, &drawn).into_iter().map(|i| drawn[i]).collect();
    let target = match scene.technique {
        Technique::RayCasting => {
            order.reverse();
            None
        }
        Technique::Polygons(target) => {
            check_polygons(&layout, grid, &rays, sampling.step_world(), drawn.len())?;
            Some(target)
        }
    };
    let batches = batches_of(held, &layout, &order, halo).map_err(|needed| CacheError::TooSmall {
        n_bytes: options.n_bytes,
        n_places: held.pages.len(),
        page_bytes: held.paged.n_page_texels() * held.coding.format.n_bytes() as u64,
        needed,
    })?;
    let mut uses = vec![Vec::new(); held.places.len()];
    for (i, batch) in batches.iter().enumerate() {
        batch.pages.iter().for_each(|page| uses[*page].push(i));
    }
    let n_pages = uses.iter().filter(|uses| !uses.is_empty()).count();
    let n_places = held.pages.len();
    cache.counts = CacheCounts { n_batches: batches.len(), n_places, n_pages, ..CacheCounts::default() };
    // As the plan of one batch has it.
    let visible = index_of(&layout, &drawn, None)
        .resident_box(layout.dims())
        .unwrap_or(Aabb { min: domain.min, max: domain.min });
    let lighting = scene.light.map(|light| Lighting::new(light, grid));
    let transfer = scene.transfer.clone();
    Ok(TrimBatches {
        source,
        cache,
        batches,
        next: 0,
        uses,
        rays,
        domain,
        visible,
        sampling,
        transfer,
        lighting,
        target,
    })
}

/// How many bricks beside a drawn one are read: by gradients, and by segments whose second node lies there.
fn halo_of(source: &TrimmedVolume, scene: &Scene) -> u32 {
    let of_segments = match scene.division {
        Division::Ray if scene.rule.nodes().len() > 1 => voxels_in_step(source.volume().grid(), scene),
        _ => 0,
    };
    let n_voxels = u32::from(scene.light.is_some()) + of_segments;
    n_voxels.div_ceil(source.layout().side().n_cells())
}

/// Bricks in the order of drawing: all at once if the cache has pages for them, else as many as half of it has, so that pages stay in
/// the other half. Or how many pages one brick needs, if the cache has fewer.
fn batches_of(held: &Held, layout: &BrickLayout, order: &[BrickId], halo: u32) -> Result<Vec<Batch>, usize> {
    let n_bricks = layout.n_bricks(Level(0));
    let beside = |id: BrickId| {
        let (low, high) = (id.coords.saturating_sub(UVec3::splat(halo)), (id.coords + halo + 1).min(n_bricks));
        let rows = (low.z..high.z).flat_map(move |z| (low.y..high.y).map(move |y| (y, z)));
        rows.flat_map(move |(y, z)| (low.x..high.x).map(move |x| BrickId { coords: UVec3::new(x, y, z), ..id }))
    };
    let page = |id: &BrickId| held.paged.bricks()[layout.ordinal(*id)].map(|brick| brick.page);
    let needed: Vec<BTreeSet<usize>> =
        order.iter().map(|id| beside(*id).filter_map(|id| page(&id)).collect()).collect();
    let n_places = held.pages.len();
    if let Some(too_many) = needed.iter().map(BTreeSet::len).find(|n| *n > n_places) {
        return Err(too_many);
    }
    let all: BTreeSet<usize> = needed.iter().flatten().copied().collect();
    let most = if all.len() <= n_places { n_places } else { n_places / 2 };
    let (mut batches, mut batch) = (Vec::new(), Batch::default());
    for (id, of_brick) in order.iter().zip(needed) {
        if !batch.drawn.is_empty() && batch.pages.union(&of_brick).count() > most {
            batches.push(std::mem::take(&mut batch));
        }
        batch.pages.extend(of_brick);
        batch.drawn.push(*id);
    }
    if !batch.drawn.is_empty() {
        batches.push(batch);
    }
    let ids: Vec<BrickId> = layout.bricks(Level(0)).collect();
    for batch in &mut batches {
        let drawn: BTreeSet<usize> = batch.drawn.iter().map(|id| layout.ordinal(*id)).collect();
        let read: BTreeSet<usize> =
            batch.drawn.iter().flat_map(|id| beside(*id)).map(|id| layout.ordinal(id)).collect();
        let lent = read.difference(&drawn).map(|ordinal| ids[*ordinal]);
        batch.lent = lent.filter(|id| page(id).is_some()).collect();
    }
    Ok(batches)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use brickfield_core::glam::DVec3;
    use brickfield_core::{BrickSide, Camera, Grid, Knot, Volume};
    use brickfield_frame::{Placement, QuadratureRule};
    use brickfield_optics::{Light, LightSource, LightTerms};
    use proptest::prelude::*;

    use super::*;
    use crate::{BackendKind, TrimResidency, Validation, open_backend, prepare_trimmed};

    /// Noise of two values, rarely the greater one.
    fn source(dims: UVec3, seed: u32) -> TrimmedVolume {
        let grid = Grid::axis_aligned(dims, DVec3::ONE).unwrap();
        let noise = |i: u32| (i ^ seed).wrapping_mul(2_654_435_761).rotate_left(15).wrapping_mul(2_246_822_519) >> 16;
        let voxel = |i: u32| if noise(i) % 53 == 0 { 200u8 } else { (noise(i) % 40) as u8 };
        let voxels: Vec<u8> = (0..grid.n_voxels() as u32).map(voxel).collect();
        TrimmedVolume::new(Arc::new(Volume::new(grid, voxels).unwrap()), BrickSide::S16)
    }

    /// Values from a threshold on are seen.
    fn scene(source: &TrimmedVolume, threshold: f64) -> Scene {
        let grid = source.volume().grid();
        let camera = Camera::framing(&grid.world_box(), DVec3::new(1.0, 2.0, 3.0), DVec3::Z).unwrap();
        let knot = |value: f64, extinction: f64| Knot { value, extinction, color: [0.2, 0.5, 1.0] };
        let transfer = TransferFunction::new(vec![knot(threshold, 0.0), knot(threshold + 30.0, 0.02)]).unwrap();
        Scene { step_voxels: 1.3, ..Scene::new(camera, UVec2::new(24, 20), transfer) }
    }

    fn cache(n_bytes: u64) -> TrimCache {
        TrimCache::new(CacheOptions { page_side: Some(16), ..CacheOptions::of_bytes(n_bytes) })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn batches_show_the_picture_of_one(
            n in prop::array::uniform3(17u32..60), seed: u32, threshold in 5.0..190.0f64, rule in 0..5usize, is_lit: bool,
            divides_bricks: bool, n_pages in 27..40u64, trimming in 0..Trimming::NAMES.len(),
        ) {
            let source = source(UVec3::from(n), seed);
            let light = Light::new(LightSource::Head, LightTerms::default(), 20.0).unwrap();
            let scene = Scene {
                rule: QuadratureRule::ALL[rule % QuadratureRule::ALL.len()],
                light: is_lit.then_some(light),
                division: if divides_bricks { Division::Brick } else { Division::Ray },
                ..scene(&source, threshold)
            };
            let trimming = Trimming::of_name(Trimming::NAMES[trimming], BrickSide::S16).unwrap();
            let mut backend = open_backend(BackendKind::Cpu, None, Validation::Off).unwrap();
            let mut residency = TrimResidency::default();
            let whole = prepare_trimmed(&source, &scene, trimming, &mut residency).unwrap();
            let whole = backend.render(&whole).unwrap().image;
            let mut cache = cache(n_pages * 4096 * if matches!(trimming, Trimming::Merged(_)) { 4 } else { 1 });
            for _ in 0..2 {
                let batches = prepare_trimmed_batches(&source, &scene, trimming, &mut cache).unwrap();
                let found = render_ahead(backend.as_mut(), batches.size(), batches).unwrap().image;
                prop_assert_eq!(&found, &whole, "{:?} in {:?}", trimming, cache.counts());
            }
        }
    }

    #[test]
    fn pages_stay_in_the_cache_and_leave_it_when_others_need_their_place() {
        let source = source(UVec3::new(76, 61, 46), 1);
        let scene = scene(&source, 150.0);
        let mut backend = open_backend(BackendKind::Cpu, None, Validation::Off).unwrap();
        let mut frame = |cache: &mut TrimCache| {
            let mut batches = prepare_trimmed_batches(&source, &scene, Trimming::Visible, cache).unwrap();
            backend.render_batches(batches.size(), &mut batches).unwrap();
            cache.counts()
        };
        // 5 x 4 x 3 bricks, each a page.
        let mut all = cache(60 * 4096);
        let (first, second) = (frame(&mut all), frame(&mut all));
        assert_eq!((first.n_batches, first.n_pages, first.n_hits, first.n_misses), (1, 60, 0, 60));
        assert_eq!((second.n_hits, second.n_misses, second.n_bytes), (60, 0, 0));
        let mut of = |eviction| {
            let options = CacheOptions { page_side: Some(16), eviction, ..CacheOptions::of_bytes(30 * 4096) };
            let mut half = TrimCache::new(options);
            [frame(&mut half), frame(&mut half)]
        };
        let [first, second] = of(Eviction::LeastRecentlyUsed);
        assert_eq!((first.n_batches, first.n_misses, second.n_misses), (4, 60, 60));
        // The pages that are needed soonest stay.
        let [first, second] = of(Eviction::FarthestUse);
        assert_eq!((first.n_misses, second.n_misses, second.n_hits), (60, 30, 30));
    }

    #[test]
    fn a_cache_that_is_too_small_is_named() {
        let source = source(UVec3::new(76, 61, 46), 1);
        let scene = Scene { rule: QuadratureRule::Gauss2, ..scene(&source, 150.0) };
        let error = prepare_trimmed_batches(&source, &scene, Trimming::Visible, &mut cache(9 * 4096)).err().unwrap();
        let expected = "drawing trimmed bricks in batches: a cache of 36864 bytes has 9 pages of 4096 bytes; a brick needs 12 at once";
        assert_eq!(error.to_string(), expected);
    }

    #[test]
    fn polygons_are_blended_batch_by_batch() {
        let source = source(UVec3::new(76, 61, 46), 1);
        let scene = Scene {
            technique: Technique::Polygons(Target::Float32),
            placement: Placement::ViewportPlanes,
            division: Division::Brick,
            ..scene(&source, 150.0)
        };
        let mut backend = open_backend(BackendKind::Cpu, None, Validation::Off).unwrap();
        let plan = prepare_trimmed(&source, &scene, Trimming::Packed, &mut TrimResidency::default()).unwrap();
        let whole = backend.render(&plan).unwrap().image;
        let mut cache = cache(10 * 4096);
        let batches = prepare_trimmed_batches(&source, &scene, Trimming::Packed, &mut cache).unwrap();
        assert!(batches.n_batches() > 3);
        let found = render_ahead(backend.as_mut(), batches.size(), batches).unwrap().image;
        let pairs = found.pixels().iter().flatten().zip(whole.pixels().iter().flatten());
        assert!(pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max) < 1e-6);
    }
}
