//! The texture cache: pages of trimmed bricks that come and leave.

use std::collections::BTreeSet;
use std::sync::Arc;

use brickfield_bricks::SourceId;
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Aabb, BrickId, BrickLayout};
use brickfield_frame::{Chunk, DarkRegions, Field, IndexGrid, Join, KeptBoxes, Places, Slots, Upload};
use brickfield_trim::{
    DarkValues, Interpolation, PagedBrick, PagedBricks, TexelAccount, TrimmedBricks, merge_bricks, trim_bricks,
};
use rayon::prelude::*;

use crate::block_residency::MAX_TEXELS;
use crate::encode::Coding;
use crate::trimmed::{gather, index_of, kept_boxes, nowhere};
use crate::{PrepareTrimmedError, Scene, TrimmedVolume, Trimming};

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
    pub(super) options: CacheOptions,
    pub(super) held: Option<Held>,
    pub(super) counts: CacheCounts,
}

/// The cache of the bricks of one volume under one transfer function.
#[derive(Debug)]
pub(super) struct Held {
    source: SourceId,
    trimming: Trimming,
    reach: u32,
    dark: DarkValues,
    /// What may be seen of each brick; what is read of it.
    boxes: Vec<Aabb>,
    pub(super) grown: TrimmedBricks,
    pub(super) paged: PagedBricks,
    pub(super) coding: Coding,
    /// Pages along the texture's axes.
    grid: UVec3,
    /// For each place of the cache its page, and the batch that used it last; for each page its place.
    pub(super) pages: Vec<Option<usize>>,
    used: Vec<u64>,
    pub(super) places: Vec<Option<usize>>,
    n_batches: u64,
    /// By brick.
    chunks: Vec<Option<Arc<Chunk>>>,
    slots: Option<Arc<Slots>>,
    kept: Option<Arc<KeptBoxes>>,
    index: Option<Arc<IndexGrid>>,
}

/// The pages of a batch: those that were there, and those that were brought, with their bytes.
pub(super) struct Admitted {
    pub(super) n_there: usize,
    pub(super) n_brought: usize,
    pub(super) n_bytes: u64,
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

    pub(super) fn hold(
        &mut self,
        source: &TrimmedVolume,
        scene: &Scene,
        trimming: Trimming,
        reach: u32,
    ) -> Result<&mut Held, PrepareTrimmedError> {
        let dark = DarkValues::of(&scene.transfer);
        let is_kept = |held: &Held| {
            (held.source, held.trimming, held.reach, held.coding.upload) == (source.id(), trimming, reach, scene.upload)
                && held.dark == dark
        };
        if !self.held.as_ref().is_some_and(is_kept) {
            self.held = Some(Held::new(source, (trimming, reach, scene.upload), dark, self.options)?);
        }
        Ok(self.held.as_mut().expect("bricks of before, or new ones"))
    }
}

/// Texels of a page along x, y, z, for samples of so many bytes.
fn page_texels(layout: &BrickLayout, trimming: Trimming, options: &CacheOptions, sample_bytes: u64) -> UVec3 {
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
        (trimming, reach, upload): (Trimming, u32, Upload),
        dark: DarkValues,
        options: CacheOptions,
    ) -> Result<Held, PrepareTrimmedError> {
        let volume = source.volume();
        let coding = Coding::of(volume.scalar_type(), volume.rescale(), volume.range()).brought(upload);
        let layout = *source.layout();
        let trimmed = trim_bricks(source.arrays(), &dark, Interpolation::Trilinear);
        let grown = trimmed.grown(reach);
        let sample_bytes = coding.format.n_bytes() as u64;
        let page = page_texels(&layout, trimming, &options, sample_bytes);
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
    pub(super) fn admit(
        &mut self,
        source: &TrimmedVolume,
        needed: &BTreeSet<usize>,
        distance: impl Fn(usize, u64) -> u64,
    ) -> Admitted {
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
        Admitted { n_there: there.len(), n_brought: missing.len(), n_bytes }
    }

    /// The samples that are in the cache, each at its place.
    fn slots(&mut self) -> Arc<Slots> {
        let place = |brick: &Option<PagedBrick>| {
            brick.and_then(|b| Some(b.place_from(self.first_texel(self.places[b.page]?)))).unwrap_or_else(nowhere)
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
    pub(super) fn field(&mut self, layout: &BrickLayout, drawn: &[BrickId], lent: &[BrickId]) -> (Field, DarkRegions) {
        let slots = self.slots();
        let index = Arc::new(index_of(layout, drawn.iter().chain(lent), self.index.as_deref()));
        self.index = Some(Arc::clone(&index));
        let field = Field::new(layout.dims(), index, slots, Join::Shared).expect("an index of bricks that are stored");
        if lent.is_empty() && !self.trimming.draws_boxes() {
            return (field, DarkRegions::default());
        }
        let lent: BTreeSet<usize> = lent.iter().map(|id| layout.ordinal(*id)).collect();
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

#[cfg(test)]
mod tests {
    use super::*;

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
