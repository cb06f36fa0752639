//! Time to choose the levels of 65,536 blocks after an edit of the transfer function.

use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{
    BlockLayout, BlockSide, BlockSummary, Camera, Grid, Knot, N_BLOCK_BINS, ScalarType, TransferFunction, ValueRange,
};
use brickfield_lod::{
    BlockBudget, BlockErrors, BlockSelection, BlockView, BudgetSize, Culling, Importance, OneSampleBlocks, Slab, View,
    block_weights, select_block_levels,
};
use divan::Bencher;

fn main() {
    divan::main();
}

const BUDGET: BlockBudget = BlockBudget {
    size: BudgetSize::Ratio(32.0),
    scalar: ScalarType::U16,
    sample_bytes: 1,
    one_sample: OneSampleBlocks::Stored,
};

/// All of it: errors of every block, and the budget spent.
#[divan::bench]
fn edit_everywhere(bencher: Bencher<'_, '_>) {
    edit(bencher, &transfer(1.0, 1.0));
}

/// An edit of the upper half of the values.
#[divan::bench]
fn edit_above_the_middle(bencher: Bencher<'_, '_>) {
    edit(bencher, &transfer(0.2, 1.0));
}

#[divan::bench]
fn estimate_everywhere(bencher: Bencher<'_, '_>) {
    let scene = Scene::new();
    bencher.bench(|| scene.errors(&transfer(0.2, 0.5)));
}

#[divan::bench]
fn spend(bencher: Bencher<'_, '_>) {
    let scene = Scene::new();
    let errors = scene.errors(&transfer(0.2, 0.5));
    bencher.bench(|| scene.select(&errors, None));
}

#[divan::bench]
fn weigh_and_spend(bencher: Bencher<'_, '_>) {
    let scene = Scene::new();
    let errors = scene.errors(&transfer(0.2, 0.5));
    let grid = Grid::axis_aligned(scene.layout.dims(), DVec3::ONE).expect("a plain grid");
    let camera = Camera::framing(&grid.world_box(), DVec3::new(1.0, 0.5, 0.3), DVec3::Z).expect("a plain camera");
    let view = View { camera, size: UVec2::new(1920, 1080), culling: Culling::Frustum };
    let from = BlockView { view, clip: None, importance: Importance::ProjectedArea };
    bencher.bench(|| scene.select(&errors, Some(&block_weights(&scene.layout, &grid, &from))));
}

fn edit(bencher: Bencher<'_, '_>, edited: &TransferFunction) {
    let scene = Scene::new();
    let errors = scene.errors(&transfer(0.2, 0.5));
    bencher.with_inputs(|| errors.clone()).bench_refs(|errors| {
        errors.update(&scene.summaries, edited).expect("a summary for each block");
        scene.select(errors, None)
    });
}

struct Scene {
    layout: BlockLayout,
    summaries: Vec<BlockSummary>,
}

impl Scene {
    /// 64 x 32 x 32 blocks of 16^3, all of them visible: one in two has an edge in it, the others are smooth.
    fn new() -> Scene {
        let layout = BlockLayout::new(UVec3::new(1024, 512, 512), BlockSide::V16);
        let summaries = (0..layout.n_blocks_total()).map(|i| summary(i as u32)).collect();
        Scene { layout, summaries }
    }

    fn errors(&self, transfer: &TransferFunction) -> BlockErrors {
        let slab = Slab::new(16.0, [0.0; 3]).expect("a plain slab");
        BlockErrors::estimate(&self.layout, &self.summaries, transfer, slab).expect("a summary for each block")
    }

    fn select(&self, errors: &BlockErrors, weights: Option<&[f32]>) -> BlockSelection {
        select_block_levels(&self.layout, errors.levels(), weights, &BUDGET).expect("a budget above one sample a block")
    }
}

fn summary(i: u32) -> BlockSummary {
    let unit = |salt: u32| f64::from((i ^ salt).wrapping_mul(2_654_435_761) >> 8) / f64::from(1 << 24);
    let (min, width) = (unit(1) * 0.6, if i.is_multiple_of(2) { 0.4 } else { 0.02 + 0.1 * unit(2) });
    let peak = N_BLOCK_BINS as f64 * unit(3);
    let height = |bin: usize| 1.0 / (1.0 + (bin as f64 - peak).powi(2));
    let total: f64 = (0..N_BLOCK_BINS).map(height).sum();
    let part = 0.1 + 0.2 * unit(4);
    BlockSummary {
        range: ValueRange { min, max: min + width },
        mean: min + width * (peak / N_BLOCK_BINS as f64).clamp(0.2, 0.8),
        counts: std::array::from_fn(|bin| (65_535.0 * height(bin) / total) as u16),
        kept_variance: [1.0, 0.9, 0.7, 0.4, 0.0, 0.0],
        variance: (part * width).powi(2),
    }
}

/// Extinction rises from 0 at the first value on; the lower half of the values stays, the upper half has a `height`.
fn transfer(first: f64, height: f64) -> TransferFunction {
    let first = first.min(0.4);
    let knot = |value, extinction, red| Knot { value, extinction, color: [red, 0.6, 0.3] };
    let knots = vec![knot(0.0, 0.001 * first, 0.1), knot(0.5, 0.02, 0.4), knot(0.75, 0.1, 0.9), knot(1.0, height, 1.0)];
    TransferFunction::new(knots).expect("ascending knots")
}
