//! A byte budget, spent where it removes the most visible error.

use brickfield_core::{BlockLayout, Level, N_BLOCK_LEVELS, ScalarType};
use rayon::prelude::*;

use super::errors::LevelErrors;
use super::levels::BlockLevels;

/// The bytes that the samples of all blocks may take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockBudget {
    /// How many bytes.
    pub size: BudgetSize,
    /// The type of the volume's voxels: a ratio is one of their bytes.
    pub scalar: ScalarType,
    /// Bytes that a sample takes where it is kept, those of its companions included.
    pub sample_bytes: u8,
    /// Whether a block of one sample takes bytes.
    pub one_sample: OneSampleBlocks,
}

/// The size of a budget.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BudgetSize {
    /// So many bytes.
    Bytes(u64),
    /// The volume's bytes divided by so much: 32.0 for 32:1.
    Ratio(f64),
}

/// Whether a block of one sample takes bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum OneSampleBlocks {
    /// Its sample is stored like others.
    #[default]
    Stored,
    /// It takes none: its value stands in an index, or nobody sees it (as in Ljung, Lundstroem and Ynnerman 2006, figure 9).
    Free,
}

/// The levels that a budget buys.
#[derive(Clone, Debug, PartialEq)]
pub struct BlockSelection {
    /// A level for each block.
    pub levels: BlockLevels,
    /// Bytes of the blocks' samples and their companions: never more than the budget.
    pub n_bytes: u64,
    /// The sum over all blocks of weight times voxels times error.
    pub cost: f64,
}

/// A budget that cannot be kept, or weights that are not those of the blocks.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum BudgetError {
    #[error("one sample for each of {n_blocks} blocks takes {needed_bytes} bytes; the budget is {budget_bytes}")]
    TooSmall { n_blocks: usize, needed_bytes: u64, budget_bytes: u64 },
    #[error("a budget of {ratio}:1; the ratio must be finite and above 0")]
    Ratio { ratio: f64 },
    #[error("{n_errors} errors for {n_blocks} blocks: each block has one for every level")]
    Errors { n_errors: usize, n_blocks: usize },
    #[error("{n_blocks} blocks; levels are chosen for at most {limit}")]
    TooManyBlocks { n_blocks: usize, limit: usize },
    #[error("{n_weights} weights for {n_blocks} blocks: each block has one")]
    Weights { n_weights: usize, n_blocks: usize },
}

/// The levels of all blocks, so that the cost, the sum of weight times voxels times error, is small and the budget kept.
///
/// `errors` and `weights` are by [`BlockLayout::ordinal`]; no weights are equal ones. A weight of 0 leaves a block at one
/// sample; so do one below 0 and NaN. Errors that are not finite and above 0 count as 0. Every block starts with one sample.
/// Its steps to finer levels are those of the lower convex hull of cost over bytes; steps of all blocks are taken in the order
/// of gain per byte, unless they exceed the budget or gain nothing; what is left buys parts of these steps. The cost is then above the least possible by no more than
/// the greatest gain of one step (Dantzig's bound: the steps up to the first that does not fit solve the relaxed problem).
///
/// O(n log n); runs on rayon's current thread pool, and does not depend on the number of threads.
///
/// # Errors
/// If one sample per block exceeds the budget, its ratio is none, or errors or weights are not one for each block.
pub fn select_block_levels(
    layout: &BlockLayout,
    errors: &[LevelErrors],
    weights: Option<&[f32]>,
    budget: &BlockBudget,
) -> Result<BlockSelection, BudgetError> {
    check_lengths(layout, errors, weights)?;
    let budget_bytes = budget.bytes(layout)?;
    let tariff =
        |ordinal: usize| Tariff::new(layout, ordinal, errors[ordinal], weights.map_or(1.0, |w| w[ordinal]), budget);
    let priced = |ordinal| tariff(ordinal).price();
    let (mut n_bytes, mut cost, steps) = start(errors.len(), priced);
    if n_bytes > budget_bytes {
        return Err(BudgetError::TooSmall { n_blocks: errors.len(), needed_bytes: n_bytes, budget_bytes });
    }
    let mut levels = vec![layout.side().one_sample(); errors.len()];
    let mut refused = Vec::new();
    for step in in_order(&steps) {
        let level = &mut levels[step.block as usize];
        if *level != step.from {
            continue;
        }
        if u64::from(step.n_bytes) > budget_bytes - n_bytes {
            refused.push(step);
            continue;
        }
        *level = step.to;
        n_bytes += u64::from(step.n_bytes);
        cost -= step.gain;
    }
    // The rest buys a part of a step that is too dear as a whole.
    for step in refused {
        let tariff = tariff(step.block as usize);
        if let Some(part) = tariff.part_of(step, budget_bytes - n_bytes) {
            levels[step.block as usize] = part.to;
            n_bytes += u64::from(part.n_bytes);
            cost -= part.gain;
        }
    }
    let levels = BlockLevels::of_valid(*layout, levels);
    Ok(BlockSelection { levels, n_bytes, cost: cost.max(0.0) })
}

/// Steps are numbered in 32 bits, and a block has at most five.
const MAX_BLOCKS: usize = (u32::MAX / N_STEPS as u32) as usize;

const N_STEPS: usize = N_BLOCK_LEVELS - 1;

fn check_lengths(layout: &BlockLayout, errors: &[LevelErrors], weights: Option<&[f32]>) -> Result<(), BudgetError> {
    let (n_blocks, n_errors) = (layout.n_blocks_total(), errors.len());
    if n_blocks > MAX_BLOCKS {
        return Err(BudgetError::TooManyBlocks { n_blocks, limit: MAX_BLOCKS });
    }
    if n_errors != n_blocks {
        return Err(BudgetError::Errors { n_errors, n_blocks });
    }
    match weights.map(<[f32]>::len) {
        Some(n_weights) if n_weights != n_blocks => Err(BudgetError::Weights { n_weights, n_blocks }),
        _ => Ok(()),
    }
}

impl BlockBudget {
    /// The bytes of the budget for a volume.
    pub(super) fn bytes(&self, layout: &BlockLayout) -> Result<u64, BudgetError> {
        let n_voxels = layout.dims().as_u64vec3().element_product();
        match self.size {
            BudgetSize::Bytes(bytes) => Ok(bytes),
            BudgetSize::Ratio(ratio) if ratio.is_finite() && ratio > 0.0 => {
                Ok((n_voxels as f64 * self.scalar.n_bytes() as f64 / ratio) as u64)
            }
            BudgetSize::Ratio(ratio) => Err(BudgetError::Ratio { ratio }),
        }
    }
}

/// A block from one level to a finer one.
#[derive(Clone, Copy, Debug)]
struct Step {
    gain: f64,
    n_bytes: u32,
    block: u32,
    from: Level,
    to: Level,
}

impl Step {
    /// Infinite for a gain without bytes.
    fn rate(&self) -> f64 {
        self.gain / f64::from(self.n_bytes)
    }
}

/// Bytes and cost of one sample, and the steps to finer levels, of falling rates.
#[derive(Default)]
struct Price {
    n_bytes: u64,
    cost: f64,
    steps: [Option<Step>; N_STEPS],
}

/// What the levels of a block take, and what they are worth.
struct Tariff<'a> {
    layout: &'a BlockLayout,
    ordinal: usize,
    /// Cost of each level.
    costs: [f64; N_BLOCK_LEVELS],
    budget: &'a BlockBudget,
}

impl<'a> Tariff<'a> {
    fn new(layout: &'a BlockLayout, ordinal: usize, errors: LevelErrors, weight: f32, budget: &'a BlockBudget) -> Self {
        let n_voxels = layout.extent(layout.block(ordinal)).as_dvec3().element_product();
        let per_error = f64::from(finite(weight)) * n_voxels;
        Tariff { layout, ordinal, costs: errors.map(|error| per_error * f64::from(finite(error))), budget }
    }

    /// Bytes and cost of a level.
    fn at(&self, level: Level) -> (u64, f64) {
        let n = self.layout.n_samples_total(self.layout.block(self.ordinal), level);
        let n = if n == 1 && self.budget.one_sample == OneSampleBlocks::Free { 0 } else { n };
        (n * u64::from(self.budget.sample_bytes), self.costs[usize::from(level.0)])
    }

    /// The part of a step that gains most for at most so many bytes.
    fn part_of(&self, step: &Step, n_bytes: u64) -> Option<Step> {
        let (bytes_before, cost_before) = self.at(step.from);
        let between = (step.to.0 + 1..step.from.0).map(Level);
        let parts = between.filter_map(|to| {
            let (bytes, cost) = self.at(to);
            let part = Step { to, n_bytes: (bytes - bytes_before) as u32, gain: cost_before - cost, ..*step };
            (part.gain > 0.0 && u64::from(part.n_bytes) <= n_bytes).then_some(part)
        });
        parts.max_by(|a, b| a.gain.total_cmp(&b.gain))
    }

    /// The lower convex hull of the levels in the plane of bytes and cost.
    fn price(&self) -> Price {
        price(self.layout, self.ordinal, |level| self.at(level))
    }
}

/// Bytes and cost of one sample, and the steps of the lower convex hull.
fn price(layout: &BlockLayout, ordinal: usize, at: impl Fn(Level) -> (u64, f64)) -> Price {
    let mut level = layout.side().one_sample();
    let (n_bytes, cost) = at(level);
    let mut price = Price { n_bytes, cost, ..Price::default() };
    let (mut n_steps, mut here) = (0usize, (n_bytes, cost));
    for finer in layout.side().levels().rev().skip(1) {
        let there = at(finer);
        if there.1 >= here.1 {
            continue;
        }
        let mut step = Step {
            block: ordinal as u32,
            from: level,
            to: finer,
            n_bytes: (there.0 - here.0) as u32,
            gain: here.1 - there.1,
        };
        // A step that gains less per byte than the next is made together with it.
        while let Some(before) = n_steps.checked_sub(1).and_then(|last| price.steps[last])
            && before.rate() < step.rate()
        {
            step = Step {
                from: before.from,
                n_bytes: before.n_bytes + step.n_bytes,
                gain: before.gain + step.gain,
                ..step
            };
            n_steps -= 1;
        }
        price.steps[n_steps] = Some(step);
        (n_steps, level, here) = (n_steps + 1, finer, there);
    }
    price.steps[n_steps..].fill(None);
    price
}

/// 0 for what is not a finite number above 0.
fn finite(x: f32) -> f32 {
    if x.is_finite() && x > 0.0 { x } else { 0.0 }
}

/// Bytes and cost of all blocks at one sample, and their steps, block by block.
fn start(n_blocks: usize, price: impl Fn(usize) -> Price + Sync) -> (u64, f64, Vec<Step>) {
    const N_AT_ONCE: usize = 1024;
    let parts: Vec<_> = (0..n_blocks.div_ceil(N_AT_ONCE))
        .into_par_iter()
        .map(|part| {
            let (mut n_bytes, mut cost, mut steps) = (0, 0.0, Vec::new());
            for ordinal in part * N_AT_ONCE..n_blocks.min((part + 1) * N_AT_ONCE) {
                let price = price(ordinal);
                n_bytes += price.n_bytes;
                cost += price.cost;
                steps.extend(price.steps.into_iter().flatten());
            }
            (n_bytes, cost, steps)
        })
        .collect();
    let (n_bytes, cost) = (parts.iter().map(|part| part.0).sum(), parts.iter().map(|part| part.1).sum());
    (n_bytes, cost, parts.into_iter().flat_map(|part| part.2).collect())
}

/// Steps by falling rate; of equal rates the first comes first, so that each block's are in order.
fn in_order(steps: &[Step]) -> impl Iterator<Item = &Step> {
    // Bits of positive f32 are ordered as their values.
    let key = |(i, step): (usize, &Step)| u64::from(!(step.rate() as f32).to_bits()) << 32 | i as u64;
    let mut keys: Vec<u64> = steps.par_iter().enumerate().map(key).collect();
    keys.par_sort_unstable();
    keys.into_iter().map(|key| &steps[key as u32 as usize])
}
