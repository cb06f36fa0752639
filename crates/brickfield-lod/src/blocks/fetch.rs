//! The order in which the chunks of a store are fetched for a view.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use brickfield_core::glam::UVec3;
use brickfield_core::{BlockLayout, Level};

use super::errors::LevelErrors;

/// Samples of a level that are fetched together: a chunk of a store.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FetchItem {
    /// The level of the samples.
    pub level: Level,
    /// The first of the blocks that lie in it.
    pub first_block: UVec3,
    /// One behind the last of them.
    pub end_block: UVec3,
    /// Bytes to be fetched.
    pub n_bytes: u64,
    /// The item that this one refines: it is of no use without that one.
    pub refines: Option<usize>,
}

impl FetchItem {
    /// The blocks that lie in it, x fastest.
    pub fn blocks(&self) -> impl Iterator<Item = UVec3> + use<> {
        let (first, end) = (self.first_block, self.end_block);
        (first.z..end.z)
            .flat_map(move |z| (first.y..end.y).flat_map(move |y| (first.x..end.x).map(move |x| UVec3::new(x, y, z))))
    }
}

/// What is fetched, in which order.
#[derive(Clone, Debug, PartialEq)]
pub struct FetchOrder {
    /// Items by number, each once: what gains most visible error per byte comes first, then all that no phase asks for.
    pub items: Vec<usize>,
    /// For each phase, how many items are fetched at its end. Those behind the last one change nothing that is seen.
    pub phase_ends: Vec<usize>,
}

/// Items or weights that are not those of the blocks.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum FetchOrderError {
    #[error("{n_errors} errors for {n_blocks} blocks: each block has one for every level")]
    Errors { n_errors: usize, n_blocks: usize },
    #[error("{n_weights} weights for {n_blocks} blocks in phase {phase}: each block has one")]
    Weights { phase: usize, n_weights: usize, n_blocks: usize },
    #[error("item {item} has blocks {first} to {end}; there are {n_blocks} along x, y, z")]
    Blocks { item: usize, first: UVec3, end: UVec3, n_blocks: UVec3 },
    #[error(
        "item {item} refines item {refined}, which must be another one of level {level}, one above, and refine nothing"
    )]
    Refines { item: usize, refined: usize, level: u8 },
    #[error("item {item} of level {level}; blocks have levels 0 to {most}")]
    Level { item: usize, level: u8, most: u8 },
}

/// The order of items by which the visible error falls fastest, when every block has `known` at first.
///
/// `errors` are by [`BlockLayout::ordinal`], as of [`BlockErrors`](super::BlockErrors). Each phase has a weight for each block, such as
/// [`block_weights`](super::block_weights): the first one those of a region of interest alone, a later one those of all blocks. A phase ends
/// when nothing is left that gains; then the next begins. A gain is the sum over an item's blocks of weight times voxels times the fall of
/// the error, where the item is finer than what the block has. Its price are the item's bytes, with those of the item that it refines, if
/// that has not been fetched. Greedy: the item with the greatest gain per byte is next.
///
/// After the phases come, finest last, the items that the volume is incomplete without: those of the levels that another item refines, and
/// of level 0.
///
/// # Errors
/// Items, errors or weights that are not those of the blocks.
pub fn fetch_order(
    layout: &BlockLayout,
    errors: &[LevelErrors],
    phases: &[Vec<f32>],
    known: Level,
    items: &[FetchItem],
) -> Result<FetchOrder, FetchOrderError> {
    check(layout, errors, phases, items)?;
    let mut fetching = Fetching {
        layout,
        errors,
        items,
        levels: vec![known; layout.n_blocks_total()],
        is_fetched: vec![false; items.len()],
        refined_by: refined_by(items),
        order: Vec::with_capacity(items.len()),
    };
    let mut phase_ends = Vec::with_capacity(phases.len());
    for weights in phases {
        fetching.run(weights);
        phase_ends.push(fetching.order.len());
    }
    fetching.complete();
    Ok(FetchOrder { items: fetching.order, phase_ends })
}

fn check(
    layout: &BlockLayout,
    errors: &[LevelErrors],
    phases: &[Vec<f32>],
    items: &[FetchItem],
) -> Result<(), FetchOrderError> {
    let (n_blocks, n_errors, most) = (layout.n_blocks_total(), errors.len(), layout.side().one_sample());
    if n_errors != n_blocks {
        return Err(FetchOrderError::Errors { n_errors, n_blocks });
    }
    if let Some(phase) = phases.iter().position(|weights| weights.len() != n_blocks) {
        return Err(FetchOrderError::Weights { phase, n_weights: phases[phase].len(), n_blocks });
    }
    for (i, item) in items.iter().enumerate() {
        if item.level > most {
            return Err(FetchOrderError::Level { item: i, level: item.level.0, most: most.0 });
        }
        let (first, end, n_blocks) = (item.first_block, item.end_block, layout.n_blocks());
        if first.cmpge(end).any() || end.cmpgt(n_blocks).any() {
            return Err(FetchOrderError::Blocks { item: i, first, end, n_blocks });
        }
        let level = item.level.0 + 1;
        let is_fit = |refined: usize| items.get(refined).is_some_and(|r| r.level.0 == level && r.refines.is_none());
        match item.refines {
            Some(refined) if !is_fit(refined) => return Err(FetchOrderError::Refines { item: i, refined, level }),
            _ => {}
        }
    }
    Ok(())
}

/// The items that refine each item.
fn refined_by(items: &[FetchItem]) -> Vec<Vec<usize>> {
    let mut all = vec![Vec::new(); items.len()];
    for (i, item) in items.iter().enumerate() {
        item.refines.into_iter().for_each(|refined| all[refined].push(i));
    }
    all
}

struct Fetching<'a> {
    layout: &'a BlockLayout,
    errors: &'a [LevelErrors],
    items: &'a [FetchItem],
    /// What each block has.
    levels: Vec<Level>,
    is_fetched: Vec<bool>,
    refined_by: Vec<Vec<usize>>,
    order: Vec<usize>,
}

/// An item with its gain per byte, which may have changed since.
struct Offer {
    rate: f64,
    item: usize,
}

impl Fetching<'_> {
    /// Fetches what gains by some weights.
    fn run(&mut self, weights: &[f32]) {
        let offer = |fetching: &Self, item: usize| Offer { rate: fetching.rate(item, weights), item };
        let open = (0..self.items.len()).filter(|item| !self.is_fetched[*item]);
        let mut offers: BinaryHeap<Offer> = open.map(|item| offer(self, item)).filter(|o| o.rate > 0.0).collect();
        while let Some(best) = offers.pop() {
            if self.is_fetched[best.item] {
                continue;
            }
            // Rates fall as blocks become finer; those that rise are offered again below.
            let now = offer(self, best.item);
            if now.rate < best.rate {
                if now.rate > 0.0 {
                    offers.push(now);
                }
                continue;
            }
            if let Some(refined) = self.items[best.item].refines
                && !self.is_fetched[refined]
            {
                self.fetch(refined);
                let cheaper = self.refined_by[refined].iter().map(|item| offer(self, *item));
                offers.extend(cheaper.filter(|offer| offer.rate > 0.0));
            }
            self.fetch(best.item);
            let cheaper = self.refined_by[best.item].iter().map(|item| offer(self, *item));
            offers.extend(cheaper.filter(|offer| offer.rate > 0.0));
        }
    }

    /// Fetches what is left of the levels that make the volume whole.
    fn complete(&mut self) {
        let is_needed = |i: &usize| self.items[*i].level == Level(0) || !self.refined_by[*i].is_empty();
        let mut rest: Vec<usize> = (0..self.items.len()).filter(|i| !self.is_fetched[*i]).filter(is_needed).collect();
        rest.sort_by_key(|i| std::cmp::Reverse(self.items[*i].level));
        self.order.extend(rest);
    }

    fn fetch(&mut self, item: usize) {
        self.is_fetched[item] = true;
        self.order.push(item);
        let level = self.items[item].level;
        for block in self.items[item].blocks() {
            let has = &mut self.levels[self.layout.ordinal(block)];
            *has = level.min(*has);
        }
    }

    fn rate(&self, item: usize, weights: &[f32]) -> f64 {
        let FetchItem { level, n_bytes, refines, .. } = self.items[item];
        let gain = |block: UVec3| {
            let ordinal = self.layout.ordinal(block);
            let errors = self.errors[ordinal].map(|error| f64::from(positive(error)));
            let fall = errors[usize::from(self.levels[ordinal].0)] - errors[usize::from(level.0)];
            let n_voxels = self.layout.extent(block).as_dvec3().element_product();
            if level < self.levels[ordinal] {
                f64::from(positive(weights[ordinal])) * n_voxels * fall.max(0.0)
            } else {
                0.0
            }
        };
        let gain: f64 = self.items[item].blocks().map(gain).sum();
        let refined =
            refines.filter(|refined| !self.is_fetched[*refined]).map_or(0, |refined| self.items[refined].n_bytes);
        gain / (n_bytes + refined).max(1) as f64
    }
}

/// 0 for what is not a finite number above 0.
fn positive(x: f32) -> f32 {
    if x.is_finite() && x > 0.0 { x } else { 0.0 }
}

impl PartialEq for Offer {
    fn eq(&self, other: &Offer) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Offer {}

impl PartialOrd for Offer {
    fn partial_cmp(&self, other: &Offer) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Offer {
    /// The greater rate; of equal rates the first item.
    fn cmp(&self, other: &Offer) -> Ordering {
        self.rate.total_cmp(&other.rate).then(other.item.cmp(&self.item))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::BlockSide;

    /// 64 x 32 x 32 voxels as two blocks of 32: level 1 in one item, level 0 in two.
    fn two_blocks() -> (BlockLayout, Vec<FetchItem>) {
        let layout = BlockLayout::new(UVec3::new(64, 32, 32), BlockSide::V32);
        let item = |level, first: u32, end: u32, n_bytes, refines| FetchItem {
            level: Level(level),
            first_block: UVec3::new(first, 0, 0),
            end_block: UVec3::new(end, 1, 1),
            n_bytes,
            refines,
        };
        (layout, vec![item(0, 0, 1, 700, Some(2)), item(0, 1, 2, 700, Some(2)), item(1, 0, 2, 200, None)])
    }

    fn order(errors: [LevelErrors; 2], phases: Vec<Vec<f32>>) -> FetchOrder {
        let (layout, items) = two_blocks();
        fetch_order(&layout, &errors, &phases, Level(5), &items).unwrap()
    }

    const SEEN: LevelErrors = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0];
    const UNSEEN: LevelErrors = [0.0; 6];

    #[test]
    fn what_is_seen_comes_first_and_the_rest_completes_the_volume() {
        let all = vec![1.0; 2];
        assert_eq!(order([UNSEEN, SEEN], vec![all.clone()]), FetchOrder { items: vec![2, 1, 0], phase_ends: vec![2] });
        assert_eq!(order([SEEN, UNSEEN], vec![all.clone()]), FetchOrder { items: vec![2, 0, 1], phase_ends: vec![2] });
        assert_eq!(order([UNSEEN, UNSEEN], vec![all]), FetchOrder { items: vec![2, 0, 1], phase_ends: vec![0] });
    }

    #[test]
    fn a_region_of_interest_comes_before_what_gains_more() {
        let (much, all) = (SEEN.map(|error| 9.0 * error), vec![1.0; 2]);
        assert_eq!(order([much, SEEN], vec![all.clone()]).items, [2, 0, 1]);
        assert_eq!(
            order([much, SEEN], vec![vec![0.0, 1.0], all]),
            FetchOrder { items: vec![2, 1, 0], phase_ends: vec![2, 3] }
        );
    }

    /// Level 1 gains nothing of its own here; details are of no use without it.
    #[test]
    fn what_is_refined_comes_before_what_refines_it() {
        let errors = [[0.0, 5.0, 5.0, 5.0, 5.0, 5.0], UNSEEN];
        assert_eq!(order(errors, vec![vec![1.0; 2]]), FetchOrder { items: vec![2, 0, 1], phase_ends: vec![2] });
    }

    #[test]
    fn errors_that_fall_little_wait_for_coarse_items_that_gain_much() {
        let layout = BlockLayout::new(UVec3::new(64, 32, 32), BlockSide::V32);
        let item = |level, first: u32, end: u32, n_bytes| FetchItem {
            level: Level(level),
            first_block: UVec3::new(first, 0, 0),
            end_block: UVec3::new(end, 1, 1),
            n_bytes,
            refines: None,
        };
        let items = [item(0, 0, 1, 800), item(0, 1, 2, 800), item(1, 0, 2, 200), item(3, 0, 2, 10)];
        let order = fetch_order(&layout, &[SEEN; 2], &[vec![1.0; 2]], Level(5), &items).unwrap();
        assert_eq!(order, FetchOrder { items: vec![3, 2, 0, 1], phase_ends: vec![4] });
    }

    #[test]
    fn what_does_not_fit_is_named() {
        let (layout, mut items) = two_blocks();
        let fault = |items: &[FetchItem], errors: &[LevelErrors], weights: Vec<f32>| {
            fetch_order(&layout, errors, &[weights], Level(5), items).unwrap_err().to_string()
        };
        let fits = vec![1.0; 2];
        assert!(fault(&items, &[SEEN], fits.clone()).starts_with("1 errors for 2 blocks"));
        assert!(fault(&items, &[SEEN; 2], vec![1.0]).starts_with("1 weights for 2 blocks in phase 0"));
        items[2].level = Level(2);
        assert!(fault(&items, &[SEEN; 2], fits.clone()).contains("item 0 refines item 2"));
        items[2].level = Level(6);
        assert!(fault(&items[2..], &[SEEN; 2], fits.clone()).contains("item 0 of level 6; blocks have levels 0 to 5"));
        items[2].level = Level(1);
        items[1].end_block.x = 3;
        assert!(fault(&items, &[SEEN; 2], fits).contains("item 1 has blocks"));
    }
}
