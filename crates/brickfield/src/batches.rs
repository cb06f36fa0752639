//! Frames of trimmed bricks that are larger than the device's memory: a texture cache of pages, and batches in the order of visibility.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::mpsc::sync_channel;

use brickfield_bricks::SourceId;
use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{Aabb, BrickId, BrickLayout, Level, Place, TransferFunction};
use brickfield_frame::{
    Backend, Chunk, DarkRegions, Division, Drawing, Field, Frame, FramePlan, IndexEntry, IndexGrid, IndexLattice, Join,
    KeptBoxes, Lighting, Places, PlanParts, RayFrame, Reach, RenderError, Sampling, Sequence, Slices, Slots, Target,
};
use brickfield_lod::back_to_front;
use brickfield_trim::{DarkValues, Interpolation, PagedBricks, TexelAccount, TrimmedBricks, merge_bricks, trim_bricks};
use rayon::prelude::*;

use crate::block_residency::MAX_TEXELS;
use crate::course::{Course, to_sample_space, voxels_in_step};
use crate::encode::Coding;
use crate::prepare::{check_polygons, check_size, check_values};
use crate::trimmed::{gather, kept_boxes, reach_of};
use crate::{PrepareError, PrepareTrimmedError, Scene, Technique, TrimmedVolume, Trimming};

/// The texture cache of a [`TrimCache`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CacheOptions {
    /// Bytes that its texels may take.
    pub n_bytes: u64,
    /// Texels along a page's side; unless stated up to four bricks, so that the cache has 64 pages or more, but no less than the
    /// bricks ask for.
    pub page_side: Option<u32>,
    /// Which page leaves the cache for another one.
    pub eviction: Eviction,
}

impl CacheOptions {
    /// A cache of so many bytes.
    pub fn of_bytes(n_bytes: u64) -> CacheOptions {
        CacheOptions { n_bytes, page_side: None, eviction: Eviction::default() }
    }
}

/// Which page leaves a full cache.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Eviction {
    /// The one whose last use is longest ago (the paper's). Frames that go through the same pages in the same order find none of them.
    LeastRecentlyUsed,
    /// The one that is used last of all: batches know what the later ones ask for, and the next frame is taken to be like this one.
    #[default]
    FarthestUse,
}

impl Eviction {
    /// All of them.
    pub const ALL: [Eviction; 2] = [Eviction::LeastRecentlyUsed, Eviction::FarthestUse];

    /// The name in options and reports.
    pub const fn name(self) -> &'static str {
        match self {
            Eviction::LeastRecentlyUsed => "least-recently-used",
            Eviction::FarthestUse => "farthest-use",
        }
    }
}

/// What a frame asked of the cache.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CacheCounts {
    /// Batches of the frame.
    pub n_batches: usize,
    /// Pages that the cache has room for.
    pub n_places: usize,
    /// Pages that the frame's bricks lie in.
    pub n_pages: usize,
    /// How often a batch found a page in the cache.
    pub n_hits: usize,
    /// How often a page was brought.
    pub n_misses: usize,
    /// Bytes of the samples that were brought.
    pub n_bytes: u64,
}

/// Why a cache cannot hold a frame's bricks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum CacheError {
    #[error("a cache of {n_bytes} bytes has {n_places} pages of {page_bytes} bytes; a brick needs {needed} at once")]
    TooSmall { n_bytes: u64, n_places: usize, page_bytes: u64, needed: usize },
}

/// The samples of trimmed bricks in a texture of limited size, from frame to frame.
#[derive(Debug)]
pub struct TrimCache {
    options: CacheOptions,
    held: Option<Held>,
    counts: CacheCounts,
}

#[derive(Debug)]
struct Held {
    source: SourceId,
    trimming: Trimming,
    reach: u32,
    dark: DarkValues,
    /// What may be seen of each brick; what is read of it.
    boxes: Vec<Aabb>,
    grown: TrimmedBricks,
    paged: PagedBricks,
    coding: Coding,
    /// Pages along the texture's axes.
    grid: UVec3,
    /// For each place of the cache its page, and the batch that used it last; for each page its place.
    pages: Vec<Option<usize>>,
    used: Vec<u64>,
    places: Vec<Option<usize>>,
    n_batches: u64,
    /// By brick.
    chunks: Vec<Option<Arc<Chunk>>>,
    slots: Option<Arc<Slots>>,
    kept: Option<Arc<KeptBoxes>>,
    index: Option<Arc<IndexGrid>>,
}

impl TrimCache {
    /// An empty cache.
    pub fn new(options: CacheOptions) -> TrimCache {
        TrimCache { options, held: None, counts: CacheCounts::default() }
    }

    /// What the last frame asked of it.
    pub fn counts(&self) -> CacheCounts {
        self.counts
    }

    /// Texels of all pages, in the cache or not, and those of them that hold a sample.
    pub fn account(&self) -> TexelAccount {
        self.held.as_ref().map(|held| held.paged.account()).unwrap_or_default()
    }

    /// Bytes of the cache's texels.
    pub fn n_texture_bytes(&self) -> u64 {
        let of =
            |held: &Held| held.pages.len() as u64 * held.paged.n_page_texels() * held.coding.format.n_bytes() as u64;
        self.held.as_ref().map(of).unwrap_or_default()
    }

    fn hold(
        &mut self,
        source: &TrimmedVolume,
        scene: &Scene,
        trimming: Trimming,
        reach: u32,
    ) -> Result<&mut Held, PrepareTrimmedError> {
        let dark = DarkValues::of(&scene.transfer);
        let is_kept = |held: &Held| {
            (held.source, held.trimming, held.reach) == (source.id(), trimming, reach) && held.dark == dark
        };
        if !self.held.as_ref().is_some_and(is_kept) {
            self.held = Some(Held::new(source, trimming, reach, dark, self.options)?);
        }
        Ok(self.held.as_mut().expect("bricks of before, or new ones"))
    }
}

/// The index cells of bricks of level 0.
fn lattice(layout: &BrickLayout) -> IndexLattice {
    IndexLattice { cell_samples: layout.side().n_cells(), origin: 0.0 }
}

/// Most texels along a side of a page of so many bytes.
fn page_side(layout: &BrickLayout, trimming: Trimming, options: &CacheOptions, sample_bytes: u64) -> UVec3 {
    let side = layout.side().n_samples();
    let least = match trimming {
        Trimming::Merged(options) => options.cache,
        _ => UVec3::splat(side),
    };
    let n_pages = |n: u32| options.n_bytes / (u64::from(n).pow(3) * sample_bytes);
    let wide = [4 * side, 2 * side].into_iter().find(|n| n_pages(*n) >= 64);
    least.max(UVec3::splat(options.page_side.or(wide).unwrap_or(side))).min(UVec3::splat(MAX_TEXELS))
}

/// Room for `needed` pages in a box, or for as many as there may be.
fn grid_for(needed: u64, most: u64, page: UVec3) -> UVec3 {
    let grids = (needed..=most.min(2 * needed)).map(|n| grid_of(n, page));
    let fits = |grid: &UVec3| grid.as_u64vec3().element_product() >= needed;
    grids.into_iter().find(fits).unwrap_or_else(|| grid_of(most, page))
}

/// The most pages of a size, in a box, that there are among `n`.
fn grid_of(n: u64, page: UVec3) -> UVec3 {
    let most = (UVec3::splat(MAX_TEXELS) / page).as_u64vec3();
    let along_x = (1..=n.min(most.x)).map(|x| {
        let y = (n / x).min(most.y);
        let z = (n / (x * y).max(1)).min(most.z);
        UVec3::new(x as u32, y as u32, z as u32)
    });
    along_x
        .max_by_key(|grid| (grid.as_u64vec3().element_product(), std::cmp::Reverse(grid.max_element())))
        .unwrap_or_default()
}

impl Held {
    fn new(
        source: &TrimmedVolume,
        trimming: Trimming,
        reach: u32,
        dark: DarkValues,
        options: CacheOptions,
    ) -> Result<Held, PrepareTrimmedError> {
        let volume = source.volume();
        let coding = Coding::of(volume.scalar_type(), volume.rescale(), volume.range());
        let layout = *source.layout();
        let trimmed = trim_bricks(source.arrays(), &dark, Interpolation::Trilinear);
        let grown = trimmed.grown(reach);
        let sample_bytes = coding.format.n_bytes() as u64;
        let page = page_side(&layout, trimming, &options, sample_bytes);
        let paged = match trimming {
            Trimming::Conventional | Trimming::Envelope => PagedBricks::packed(&TrimmedBricks::whole(layout), page)?,
            Trimming::Visible => PagedBricks::packed(&grown.untrimmed(), page)?,
            Trimming::Alone => PagedBricks::alone(&grown, page)?,
            Trimming::Merged(options) => PagedBricks::merged(&merge_bricks(&grown, &options)?, page)?,
            Trimming::Packed => PagedBricks::packed(&grown, page)?,
        };
        let page_bytes = paged.n_page_texels() * sample_bytes;
        let grid = grid_for(paged.pages().len() as u64, options.n_bytes / page_bytes, page);
        let n_places = grid.element_product() as usize;
        let boxes = match trimming.draws_boxes() {
            true => kept_boxes(&trimmed),
            false => vec![Aabb { min: DVec3::NEG_INFINITY, max: DVec3::INFINITY }; grown.kept().len()],
        };
        Ok(Held {
            source: source.id(),
            trimming,
            reach,
            dark,
            boxes,
            chunks: vec![None; grown.kept().len()],
            grown,
            coding,
            grid,
            pages: vec![None; n_places],
            used: vec![0; n_places],
            places: vec![None; paged.pages().len()],
            n_batches: 0,
            paged,
            slots: None,
            kept: None,
            index: None,
        })
    }

    fn is_drawn(&self, ordinal: usize) -> bool {
        self.trimming == Trimming::Conventional || !self.grown.kept()[ordinal].is_empty()
    }

    /// Where a place of the cache begins in the texture.
    fn first_texel(&self, place: usize) -> UVec3 {
        let [nx, ny] = [self.grid.x as usize, self.grid.y as usize];
        let at = [place % nx, place / nx % ny, place / (nx * ny)].map(|i| i as u32);
        UVec3::from(at) * self.paged.texels()
    }

    /// A place for a page that is not among `needed`: one that is free, or that of the page that leaves.
    fn make_room(&mut self, needed: &BTreeSet<usize>, distance: impl Fn(usize, u64) -> u64) -> usize {
        let free = self.pages.iter().position(Option::is_none);
        free.unwrap_or_else(|| {
            let leaves = |(_, page): &(usize, usize)| !needed.contains(page);
            let there = self.pages.iter().enumerate().filter_map(|(place, page)| Some((place, (*page)?)));
            let farthest = there.filter(leaves).max_by_key(|(place, page)| distance(*page, self.used[*place]));
            let (place, page) = farthest.expect("a batch has no more pages than the cache");
            self.paged.pages()[page].iter().for_each(|brick| self.chunks[*brick] = None);
            (self.pages[place], self.places[page]) = (None, None);
            place
        })
    }

    /// Brings the pages of a batch to the cache; `distance` of a page, and of its last use, says how little it is needed.
    fn admit(
        &mut self,
        source: &TrimmedVolume,
        needed: &BTreeSet<usize>,
        distance: impl Fn(usize, u64) -> u64,
    ) -> [u64; 3] {
        self.n_batches += 1;
        let (there, missing): (Vec<usize>, Vec<usize>) = needed.iter().partition(|page| self.places[**page].is_some());
        for page in &missing {
            let place = self.make_room(needed, &distance);
            (self.pages[place], self.places[*page]) = (Some(*page), Some(place));
        }
        for page in needed {
            self.used[self.places[*page].expect("all are there")] = self.n_batches;
        }
        let (volume, coding) = (source.volume(), &self.coding);
        let bricks: Vec<usize> = missing.iter().flat_map(|page| self.paged.pages()[*page].iter().copied()).collect();
        let of_brick = |brick: &usize| {
            let place = self.paged.bricks()[*brick].expect("a brick of a page").place;
            (*brick, Arc::new(gather(volume, coding, &place)))
        };
        let chunks: Vec<(usize, Arc<Chunk>)> = bricks.par_iter().map(of_brick).collect();
        let n_bytes = chunks.iter().map(|(_, chunk)| chunk.bytes().len() as u64).sum();
        for (brick, chunk) in chunks {
            self.chunks[brick] = Some(chunk);
        }
        [there.len() as u64, missing.len() as u64, n_bytes]
    }

    /// The samples that are in the cache, each at its place.
    fn slots(&mut self) -> Arc<Slots> {
        let nowhere = Place::even(UVec3::ZERO, UVec3::ONE, Level(0), DVec3::ZERO);
        let place = |brick: &Option<brickfield_trim::PagedBrick>| {
            brick.and_then(|b| Some(b.place_from(self.first_texel(self.places[b.page]?)))).unwrap_or(nowhere)
        };
        let places = self.paged.bricks().iter().map(place).collect();
        let places = Places::Table { texels: (self.grid * self.paged.texels()).max(UVec3::ONE), places };
        let slots = Slots::new(self.coding.format, self.coding.decode(), places, self.chunks.clone());
        let slots = slots.expect("bricks fill their places");
        let slots = Arc::new(match &self.slots {
            Some(before) => slots.following(before),
            None => slots,
        });
        self.slots = Some(Arc::clone(&slots));
        slots
    }

    /// The field of a batch, and what of it is dark or another batch's.
    fn field(&mut self, layout: &BrickLayout, batch: &Batch) -> (Field, DarkRegions) {
        let slots = self.slots();
        let entry =
            |id: BrickId| (id.coords, IndexEntry::Resident { slot: layout.ordinal(id) as u32, reach: Reach(0) });
        let read = batch.drawn.iter().chain(&batch.lent).map(|id| entry(*id));
        let index = IndexGrid::new(layout.n_bricks(Level(0)), lattice(layout), read);
        let index = Arc::new(match &self.index {
            Some(before) => index.following(before),
            None => index,
        });
        self.index = Some(Arc::clone(&index));
        let field = Field::new(layout.dims(), index, slots, Join::Shared).expect("an index of bricks that are stored");
        if batch.lent.is_empty() && !self.trimming.draws_boxes() {
            return (field, DarkRegions::default());
        }
        let lent: BTreeSet<usize> = batch.lent.iter().map(|id| layout.ordinal(*id)).collect();
        let kept = KeptBoxes::lending(self.boxes.clone(), |slot| lent.contains(&slot));
        let kept = Arc::new(match &self.kept {
            Some(before) => kept.following(before),
            None => kept,
        });
        self.kept = Some(Arc::clone(&kept));
        let dark = DarkRegions::beside_boxes(&field, kept).expect("a box for each brick");
        (field, dark)
    }
}

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
        let [hits, misses, n_bytes] = held.admit(self.source, &batch.pages, distance);
        let counts = &mut self.cache.counts;
        (counts.n_hits, counts.n_misses) = (counts.n_hits + hits as usize, counts.n_misses + misses as usize);
        counts.n_bytes += n_bytes;
        let (field, dark) = held.field(self.source.layout(), batch);
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
    check_size(scene.size)?;
    check_values(source.volume().range())?;
    let (layout, grid) = (*source.layout(), source.volume().grid());
    let n_bricks = layout.n_bricks_total(Level(0));
    if n_bricks >= IndexEntry::MAX_SLOTS as usize {
        return Err(PrepareError::TooManyBricks { n_bricks, limit: IndexEntry::MAX_SLOTS }.into());
    }
    let Course { domain, sampling, rays } = Course::new(grid, scene, Level(0))?;
    let halo = halo_of(source, scene);
    let options = cache.options;
    let held = cache.hold(source, scene, trimming, reach_of(grid, scene))?;
    let in_domain = |id: &BrickId| !to_sample_space(layout.index_box(*id)).intersection(&domain).is_empty();
    let is_drawn = |id: &BrickId| held.is_drawn(layout.ordinal(*id)) && in_domain(id);
    let drawn: Vec<BrickId> = layout.bricks(Level(0)).filter(is_drawn).collect();
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
    let cells = drawn.iter().map(|id| (id.coords, IndexEntry::Resident { slot: 0, reach: Reach(0) }));
    let index = IndexGrid::new(layout.n_bricks(Level(0)), lattice(&layout), cells);
    let visible = index.resident_box(layout.dims()).unwrap_or(Aabb { min: domain.min, max: domain.min });
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

    #[test]
    fn a_grid_of_pages_is_as_large_as_may_be() {
        assert_eq!(grid_of(7, UVec3::splat(64)), UVec3::new(7, 1, 1));
        assert_eq!(grid_of(64, UVec3::splat(64)).element_product(), 64);
        assert_eq!(grid_of(37, UVec3::new(1024, 64, 64)).element_product(), 36);
        assert_eq!(grid_of(0, UVec3::splat(64)).element_product(), 0);
        // 1,793 is a prime number.
        assert_eq!(grid_for(1793, 1793, UVec3::splat(16)).element_product(), 1792);
        assert!((1793..1800).contains(&grid_for(1793, 4000, UVec3::splat(16)).element_product()));
    }
}
