//! A store that arrives bit by bit: the whole volume coarse first, then what a view shows (Saladi, Pinnamaneni and Meyer 2003).
//!
//! ```text
//! documents -> a coarse level, whole -> summaries of blocks, indices of shards -> chunks, in the order of a view
//!                      |                                                            |
//!                      v                                                            v
//!               the first picture                                a level for each block: the finest that has arrived
//! ```
//!
//! Pictures are drawn from the bytes that have arrived, and from no others: [`Delivery::blocks`] reads nothing else.

mod chunks;
mod one_level;

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use brickfield_bricks::BlockSource;
use brickfield_core::glam::UVec3;
use brickfield_core::{Aabb, BlockSide, Level, Objects, Volume};
use brickfield_fetch::{Arrived, ArrivedError, Client, FetchError, Request};
use brickfield_io::ome_zarr::{ObjectRange, ROOT_DOCUMENT, StatedDocuments, ZarrLevels, stated_documents};
use brickfield_io::{Limits, OpenError, OpenOptions, ReadError};
use brickfield_lod::{
    BlockErrors, BlockView, EstimateError, FetchItem, FetchOrder, FetchOrderError, Importance, Slab, block_weights,
    fetch_order,
};

use crate::store::finest_above;
use crate::{Scene, StoreBlocks, StoreLimits};
use chunks::Chunks;
use one_level::of_one_level;

/// Why a store is not delivered. What had arrived stays.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum DeliveryError {
    #[error(transparent)]
    Fetch(#[from] FetchError),
    #[error(transparent)]
    Arrived(#[from] ArrivedError),
    #[error(transparent)]
    Open(#[from] OpenError),
    #[error(transparent)]
    Read(#[from] ReadError),
    #[error("{key}: {source}")]
    Document { key: String, source: io::Error },
    #[error("{key} is not there: it is no store of brickfield")]
    NoDocument { key: String },
    #[error(
        "{location}: it was not packed by brickfield, and has no summaries of blocks: `brickfield pack` makes such a store"
    )]
    NotPacked { location: String },
    #[error(
        "level {level} has a chunk of {extent} samples from {first} on, which holds no whole blocks of {side} voxels"
    )]
    Chunks { level: usize, first: UVec3, extent: UVec3, side: BlockSide },
    #[error(transparent)]
    Estimate(#[from] EstimateError),
    #[error(transparent)]
    Order(#[from] FetchOrderError),
}

/// A store of which a part has arrived.
pub struct Delivery {
    location: String,
    client: Client,
    arrived: Arc<Arrived>,
    limits: StoreLimits,
    known: Level,
    blocks: StoreBlocks,
    levels: Vec<Level>,
    /// Bytes of documents that another one states: they did not arrive.
    n_stated_bytes: u64,
}

/// What is fetched of a store for a view, in order.
#[derive(Clone, Debug)]
pub struct DeliveryPlan {
    items: Vec<FetchItem>,
    bytes: Vec<ObjectRange>,
    order: FetchOrder,
    n_fetched: usize,
}

/// How many bytes of samples a level has at most that is fetched whole, at once.
const OVERVIEW_BYTES: u64 = 64 << 10;

/// The blocks of deliveries: each lies in one chunk of every level.
const SIDE: BlockSide = BlockSide::V32;

/// Ranges of so many bytes are asked for at once, neighbours in one request.
const BYTES_AT_ONCE: u64 = 256 << 10;

impl Delivery {
    /// Fetches the documents of a store and a coarse level, the finest of at most 64 KiB of samples, so that there is something to draw.
    ///
    /// `location` is for messages. Blocks have 32 voxels a side.
    ///
    /// # Errors
    /// What the client or the reader says; a store that `brickfield pack` did not make.
    pub fn begin(location: &str, client: Client, limits: StoreLimits) -> Result<Delivery, DeliveryError> {
        let arrived = Arc::new(Arrived::default());
        client.deliver(&[Request::whole(ROOT_DOCUMENT)], &arrived)?;
        let StatedDocuments { stated, others } = stated_documents(&whole(&arrived, ROOT_DOCUMENT)?)?;
        for (key, bytes) in &stated {
            arrived.insert_whole(key, bytes)?;
        }
        client.deliver(&others.into_iter().map(Request::whole).collect::<Vec<_>>(), &arrived)?;
        let n_stated_bytes = stated.iter().map(|(_, bytes)| bytes.len() as u64).sum();
        let levels = opened(&arrived, location, limits)?;
        if !levels.is_packed() {
            return Err(DeliveryError::NotPacked { location: location.to_owned() });
        }
        let known = overview_level(&levels);
        client.deliver(&requests(levels.whole_level(finest_above(&levels, known))), &arrived)?;
        let blocks = of_one_level(Path::new(location), levels, SIDE, known)?;
        let levels = vec![known; blocks.layout().n_blocks_total()];
        let location = location.to_owned();
        Ok(Delivery { location, client, arrived, limits, known, blocks, levels, n_stated_bytes })
    }

    /// The blocks, of which the levels that have arrived can be fetched; nothing else is read.
    pub fn blocks(&self) -> &StoreBlocks {
        &self.blocks
    }

    /// The finest level of each block that has arrived, by [`BlockLayout::ordinal`](brickfield_core::BlockLayout::ordinal).
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// Bytes that have arrived.
    pub fn n_bytes(&self) -> u64 {
        self.arrived.n_arrived_bytes() - self.n_stated_bytes
    }

    /// What the client has done.
    pub fn client(&self) -> &Client {
        &self.client
    }

    /// The volume at the level that arrived first.
    ///
    /// # Errors
    /// What the reader says.
    pub fn overview(&self) -> Result<Volume, DeliveryError> {
        Ok(self.blocks.at_level(self.known)?)
    }

    /// How many bytes [`plan`](Self::plan) fetches at most.
    ///
    /// # Errors
    /// What the reader says.
    pub fn n_plan_bytes(&self) -> Result<u64, DeliveryError> {
        let levels = self.blocks.stored_levels();
        let summaries = levels.n_stored_summary_bytes(SIDE)?;
        let summaries = summaries.ok_or_else(|| DeliveryError::NotPacked { location: self.location.clone() })?;
        let indices = (0..levels.n_levels()).flat_map(|level| levels.indices(level));
        let n_index_bytes: u64 = indices.filter_map(|index| index.range).map(|range| range.end - range.start).sum();
        let n_coarsest = levels.dims(levels.n_levels() - 1).as_u64vec3().element_product();
        // Samples that no codec makes smaller, and a checksum for each chunk.
        Ok(summaries + n_index_bytes + n_coarsest * levels.facts().scalar.n_bytes() as u64 * 2 + 1024)
    }

    fn plan_requests(&self) -> Result<Vec<Request>, DeliveryError> {
        let levels = self.blocks.stored_levels();
        let coarsest = levels.n_levels() - 1;
        let mut ranges = levels.stored_summaries(SIDE)?;
        ranges.extend((0..levels.n_levels()).flat_map(|level| levels.indices(level)));
        // The digest of the store is made of its coarsest level.
        ranges.extend(levels.whole_level(coarsest));
        Ok(requests(ranges))
    }

    /// Fetches summaries and indices, and orders all that is left for a view: first what it shows of a region of index space, then the
    /// rest of what it shows, then what it does not show.
    ///
    /// # Errors
    /// What the client or the reader says.
    pub fn plan(&mut self, scene: &Scene, region: Option<&Aabb>) -> Result<DeliveryPlan, DeliveryError> {
        self.client.deliver(&self.plan_requests()?, &self.arrived)?;
        let levels = opened(&self.arrived, &self.location, self.limits)?;
        let chunks = Chunks::below(self.known, &levels, self.blocks.layout())?;
        let path = PathBuf::from(&self.location);
        self.blocks = StoreBlocks::of_levels(&path, levels, SIDE, self.limits, &mut |_| {})?;
        let (layout, grid) = (*self.blocks.layout(), *self.blocks.grid());
        let slab = Slab::of_block(&layout, &grid);
        let errors = BlockErrors::estimate(&layout, self.blocks.summaries(), &scene.transfer, slab)?;
        let seen_in = |clip: Option<Aabb>| {
            let view = BlockView { view: scene.view(), clip, importance: Importance::default() };
            block_weights(&layout, &grid, &view)
        };
        let region = region.map(|region| scene.clip.map_or(*region, |clip| clip.intersection(region)));
        let phases: Vec<Vec<f32>> =
            region.map(|region| seen_in(Some(region))).into_iter().chain([seen_in(scene.clip)]).collect();
        let order = fetch_order(&layout, errors.levels(), &phases, self.known, &chunks.items)?;
        Ok(DeliveryPlan { items: chunks.items, bytes: chunks.bytes, order, n_fetched: 0 })
    }

    /// Fetches the next items of a plan: those that fit so many bytes, at most some hundred KiB of them. Returns how many that were: 0 if
    /// the next one does not fit, or if there is none.
    ///
    /// # Errors
    /// What the client says; then none of these items counts as arrived.
    pub fn fetch(&mut self, plan: &mut DeliveryPlan, max_bytes: u64) -> Result<usize, DeliveryError> {
        let (mut n, mut n_bytes) = (0, 0);
        let rest = &plan.order.items[plan.n_fetched..];
        for &item in rest {
            let next = n_bytes + plan.items[item].n_bytes;
            if next > max_bytes || n_bytes >= BYTES_AT_ONCE {
                break;
            }
            (n, n_bytes) = (n + 1, next);
        }
        let fetched: Vec<usize> = rest[..n].to_vec();
        let ranges = fetched.iter().map(|item| plan.bytes[*item].clone()).collect();
        self.client.deliver(&requests(ranges), &self.arrived)?;
        for item in fetched {
            let FetchItem { level, .. } = plan.items[item];
            for block in plan.items[item].blocks() {
                let has = &mut self.levels[self.blocks.layout().ordinal(block)];
                *has = level.min(*has);
            }
        }
        plan.n_fetched += n;
        Ok(n)
    }
}

impl DeliveryPlan {
    /// The number of items.
    pub fn n_items(&self) -> usize {
        self.order.items.len()
    }

    /// The items that have been fetched.
    pub fn n_fetched(&self) -> usize {
        self.n_fetched
    }

    /// How many items are fetched when the region that was asked for is complete, as far as the view shows it; of a plan without one, all
    /// that the view shows.
    pub fn n_of_region(&self) -> usize {
        self.order.phase_ends.first().copied().unwrap_or(0)
    }

    /// How many items are fetched when all that the view shows is complete.
    pub fn n_visible(&self) -> usize {
        self.order.phase_ends.last().copied().unwrap_or(0)
    }

    /// The plan of an ordinary pyramid, for comparison: level by level, each in the order of its chunks, whatever a view shows.
    #[must_use]
    pub fn level_by_level(mut self) -> DeliveryPlan {
        let mut items: Vec<usize> = (0..self.items.len()).collect();
        items.sort_by_key(|item| std::cmp::Reverse(self.items[*item].level));
        let n_items = items.len();
        self.order = FetchOrder { items, phase_ends: vec![n_items] };
        self
    }

    /// The bytes of all items that are not fetched yet.
    pub fn n_bytes_left(&self) -> u64 {
        self.order.items[self.n_fetched..].iter().map(|item| self.items[*item].n_bytes).sum()
    }

    /// The ranges of bytes, in order.
    pub fn ranges(&self) -> impl Iterator<Item = &ObjectRange> {
        self.order.items.iter().map(|item| &self.bytes[*item])
    }
}

/// The level that is fetched whole: the finest of few bytes, else the coarsest that blocks have.
fn overview_level(levels: &ZarrLevels) -> Level {
    let scalar_bytes = levels.facts().scalar.n_bytes() as u64;
    let n_bytes =
        |level: &Level| levels.dims(finest_above(levels, *level)).as_u64vec3().element_product() * scalar_bytes;
    SIDE.levels().find(|level| n_bytes(level) <= OVERVIEW_BYTES).unwrap_or(SIDE.one_sample())
}

fn opened(arrived: &Arc<Arrived>, location: &str, limits: StoreLimits) -> Result<ZarrLevels, DeliveryError> {
    let mut options = OpenOptions::default();
    options.limits = Limits { max_bytes: limits.max_bytes };
    Ok(ZarrLevels::of_objects(arrived.clone(), Path::new(location), &options, limits.cache_bytes)?)
}

fn whole(arrived: &Arrived, key: &str) -> Result<Vec<u8>, DeliveryError> {
    let fault = |source| DeliveryError::Document { key: key.to_owned(), source };
    let n_bytes = arrived.n_bytes(key).map_err(fault)?;
    let missing = || DeliveryError::NoDocument { key: key.to_owned() };
    let all = 0..n_bytes.ok_or_else(missing)?;
    let parts = arrived.read(key, std::slice::from_ref(&all)).map_err(fault)?;
    parts.into_iter().flatten().next().ok_or_else(missing)
}

/// Requests of ranges that are not empty.
fn requests(ranges: Vec<ObjectRange>) -> Vec<Request> {
    let ranges = ranges.into_iter().filter(|r| r.range.as_ref().is_none_or(|range| !range.is_empty()));
    ranges.map(|ObjectRange { key, range }| Request { key, range }).collect()
}
