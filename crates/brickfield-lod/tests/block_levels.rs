//! What a budget buys: against the best levels that there are, by dynamic programming.

mod scene;

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{
    Aabb, BlockLayout, BlockSide, BlockSummary, Knot, Level, ScalarType, TransferFunction, ValueRange,
};
use brickfield_lod::{
    BlockBudget, BlockLevels, BlockSelection, BlockView, BudgetError, BudgetSize, Culling, Importance, LevelErrors,
    OneSampleBlocks, block_weights, select_block_levels, spend_rest,
};
use proptest::prelude::*;
use scene::scene;

/// A block's bytes and cost at each of its levels, the coarsest first.
type Choices = Vec<(u64, f64)>;

fn choices(layout: &BlockLayout, errors: &[LevelErrors], weights: &[f32], budget: &BlockBudget) -> Vec<Choices> {
    let of_block = |(i, block): (usize, UVec3)| {
        let n_voxels = layout.extent(block).as_dvec3().element_product();
        let levels = layout.side().levels().rev();
        let choice = levels.map(|level| {
            let n = u64::from(layout.n_samples(block, level).element_product());
            let is_free = n == 1 && budget.one_sample == OneSampleBlocks::Free;
            let bytes = if is_free { 0 } else { n * u64::from(budget.sample_bytes) };
            (bytes, f64::from(weights[i]) * n_voxels * f64::from(errors[i][usize::from(level.0)]))
        });
        choice.collect()
    };
    layout.blocks().enumerate().map(of_block).collect()
}

/// The least cost of all combinations within a budget; every number of bytes is a multiple of `unit`.
fn least_cost(blocks: &[Choices], budget: u64, unit: u64) -> f64 {
    let n = (budget / unit) as usize + 1;
    let mut best = vec![0.0; n];
    for choices in blocks {
        let with = |left: usize| {
            let fitting = choices.iter().filter(|(bytes, _)| bytes / unit <= left as u64);
            fitting.map(|(bytes, cost)| best[left - (bytes / unit) as usize] + cost).fold(f64::INFINITY, f64::min)
        };
        best = (0..n).map(with).collect();
    }
    best[n - 1]
}

/// The greatest gain of a step between neighbours on the lower convex hull, up to the least cost.
fn greatest_step(choices: &Choices) -> f64 {
    let least = choices.iter().map(|c| c.1).fold(f64::INFINITY, f64::min);
    let is_on_hull = |j: usize| {
        let (bytes, cost) = choices[j];
        let is_below = |i: usize, k: usize| {
            let ((b0, c0), (b1, c1)) = (choices[i], choices[k]);
            let part = if b1 == b0 { 1.0 } else { (bytes - b0) as f64 / (b1 - b0) as f64 };
            c0 + (c1 - c0) * part < cost * (1.0 - 1e-12)
        };
        !(0..j).any(|i| choices[i].1 <= cost || (j + 1..choices.len()).any(|k| is_below(i, k)))
    };
    let hull: Vec<f64> = (0..choices.len()).filter(|j| is_on_hull(*j)).map(|j| choices[j].1).collect();
    assert!((hull.last().unwrap() - least).abs() <= 1e-9 * least);
    hull.windows(2).map(|pair| pair[0] - pair[1]).fold(0.0, f64::max)
}

fn cost_of(blocks: &[Choices], selection: &BlockSelection) -> (u64, f64) {
    let coarsest = selection.levels.layout().side().one_sample().0;
    let chosen = blocks.iter().zip(selection.levels.levels());
    let chosen = chosen.map(|(choices, level)| choices[usize::from(coarsest - level.0)]);
    chosen.fold((0, 0.0), |sum, choice| (sum.0 + choice.0, sum.1 + choice.1))
}

fn layouts() -> impl Strategy<Value = BlockLayout> {
    [1u32..20, 1u32..20, 1u32..12].prop_map(|dims| BlockLayout::new(dims.into(), BlockSide::V8))
}

/// Falling from level to level, or not; 0 at level 0, or not.
fn errors(n: usize) -> impl Strategy<Value = Vec<LevelErrors>> {
    let any = prop::array::uniform6(prop_oneof![Just(0.0f32), 0.0f32..50.0]);
    let falling = any.clone().prop_map(|mut errors| {
        errors.sort_by(f32::total_cmp);
        errors
    });
    proptest::collection::vec(prop_oneof![any, falling], n)
}

#[derive(Clone, Debug)]
struct Case {
    layout: BlockLayout,
    errors: Vec<LevelErrors>,
    weights: Vec<f32>,
    budget: BlockBudget,
}

fn cases() -> impl Strategy<Value = Case> {
    let parts = layouts().prop_flat_map(|layout| {
        let n = layout.n_blocks_total();
        let weights = proptest::collection::vec(prop_oneof![Just(1.0f32), Just(0.0), 0.1f32..3.0], n);
        (Just(layout), errors(n), weights, 0.0..1.1f64, (any::<bool>(), 1..6u8))
    });
    parts.prop_map(|(layout, errors, weights, part, (is_free, sample_bytes))| {
        let (scalar, n_blocks) = (ScalarType::U16, layout.n_blocks_total() as u64);
        let of_sample = u64::from(sample_bytes);
        let (least, whole) = (of_sample * n_blocks, of_sample * layout.dims().as_u64vec3().element_product());
        let size = BudgetSize::Bytes(least + ((whole - least.min(whole)) as f64 * part) as u64);
        let one_sample = if is_free { OneSampleBlocks::Free } else { OneSampleBlocks::Stored };
        Case { layout, errors, weights, budget: BlockBudget { size, scalar, sample_bytes, one_sample } }
    })
}

proptest! {
    #[test]
    fn the_cost_is_within_one_step_of_the_least(case in cases()) {
        let Case { layout, errors, weights, budget } = case;
        let BudgetSize::Bytes(budget_bytes) = budget.size else { unreachable!() };
        let selection = select_block_levels(&layout, &errors, Some(&weights), &budget).unwrap();
        let blocks = choices(&layout, &errors, &weights, &budget);
        let (n_bytes, cost) = cost_of(&blocks, &selection);
        let rounding = 1e-9 * blocks.iter().map(|c| c[0].1).sum::<f64>();
        prop_assert!(selection.n_bytes == n_bytes && n_bytes <= budget_bytes);
        prop_assert!((selection.cost - cost).abs() <= rounding, "{} {cost}", selection.cost);
        let least = least_cost(&blocks, budget_bytes, u64::from(budget.sample_bytes));
        let step = blocks.iter().map(greatest_step).fold(0.0, f64::max);
        prop_assert!(least - rounding <= cost && cost <= least + step + rounding, "{cost}: {least} + {step}");
    }

    #[test]
    fn without_a_limit_every_block_has_its_least_cost_and_no_byte_more(case in cases()) {
        let Case { layout, errors, weights, budget } = case;
        let budget = BlockBudget { size: BudgetSize::Bytes(u64::MAX), ..budget };
        let selection = select_block_levels(&layout, &errors, Some(&weights), &budget).unwrap();
        let coarsest = layout.side().one_sample().0;
        for (choices, level) in choices(&layout, &errors, &weights, &budget).iter().zip(selection.levels.levels()) {
            let least = choices.iter().map(|c| c.1).fold(f64::INFINITY, f64::min);
            let cheapest = choices.iter().filter(|c| c.1 == least).map(|c| c.0).min().unwrap();
            let chosen = choices[usize::from(coarsest - level.0)];
            prop_assert_eq!(chosen, (cheapest, least));
        }
    }

    #[test]
    fn levels_do_not_depend_on_the_number_of_threads(case in cases()) {
        let on = |n_threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
            pool.install(|| select_block_levels(&case.layout, &case.errors, None, &case.budget).unwrap())
        };
        prop_assert_eq!(on(1), on(3));
    }
}

/// 4 x 4 x 4 blocks of 16^3 voxels.
fn layout() -> BlockLayout {
    BlockLayout::new(UVec3::splat(64), BlockSide::V16)
}

fn budget(size: BudgetSize) -> BlockBudget {
    BlockBudget { size, scalar: ScalarType::U8, sample_bytes: 1, one_sample: OneSampleBlocks::Stored }
}

const FALLING: LevelErrors = [0.0, 1.0, 3.0, 7.0, 15.0, 0.0];

#[test]
fn budgets_that_cannot_be_kept_are_named() {
    let errors = vec![FALLING; 64];
    let select = |budget: BlockBudget| select_block_levels(&layout(), &errors, None, &budget);
    assert_eq!(select(budget(BudgetSize::Bytes(64))).unwrap().levels.n_blocks_per_level(), [0, 0, 0, 0, 64, 0]);
    let error = select(budget(BudgetSize::Bytes(63))).unwrap_err();
    assert_eq!(error.to_string(), "one sample for each of 64 blocks takes 64 bytes; the budget is 63");
    let free = BlockBudget { one_sample: OneSampleBlocks::Free, ..budget(BudgetSize::Bytes(7)) };
    assert_eq!(select(free).unwrap().n_bytes, 0);
    for ratio in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(select(budget(BudgetSize::Ratio(ratio))), Err(BudgetError::Ratio { .. })), "{ratio}");
    }
    let error = select_block_levels(&layout(), &errors, Some(&[1.0]), &budget(BudgetSize::Bytes(64))).unwrap_err();
    assert_eq!(error.to_string(), "1 weights for 64 blocks: each block has one");
    assert!(select_block_levels(&layout(), &errors[1..], None, &budget(BudgetSize::Bytes(64))).is_err());
}

#[test]
fn a_ratio_is_of_the_volumes_bytes() {
    let errors = vec![FALLING; 64];
    for ratio in [1.0, 8.0, 32.0, 1000.0] {
        let selection = select_block_levels(&layout(), &errors, None, &budget(BudgetSize::Ratio(ratio))).unwrap();
        assert!(selection.n_bytes as f64 <= 64f64.powi(3) / ratio, "{ratio}");
        assert_eq!(selection.n_bytes, selection.levels.n_bytes(ScalarType::U8));
    }
    let whole = select_block_levels(&layout(), &errors, None, &budget(BudgetSize::Ratio(1.0))).unwrap();
    assert_eq!((whole.cost, whole.levels), (0.0, BlockLevels::uniform(layout(), Level(0))));
}

#[test]
fn numbers_that_mean_nothing_buy_nothing() {
    let mut errors = vec![FALLING; 64];
    errors[1] = [f32::NAN; brickfield_core::N_BLOCK_LEVELS];
    errors[2] = [0.0, 0.0, 0.0, 0.0, f32::INFINITY, 0.0];
    let mut weights = vec![1.0; 64];
    weights[3..7].copy_from_slice(&[0.0, -1.0, f32::NAN, f32::INFINITY]);
    let all = budget(BudgetSize::Bytes(u64::MAX));
    let selection = select_block_levels(&layout(), &errors, Some(&weights), &all).unwrap();
    assert!(selection.levels.levels()[1..7].iter().all(|level| *level == Level(4)));
    assert_eq!(selection.levels.n_blocks_per_level(), [58, 0, 0, 0, 6, 0]);
}

#[test]
fn heavier_blocks_come_first() {
    let weights: Vec<f32> = (0..64).map(|i| if i == 20 { 2.0 } else { 1.0 }).collect();
    let selection =
        select_block_levels(&layout(), &[FALLING; 64], Some(&weights), &budget(BudgetSize::Bytes(64 + 7))).unwrap();
    assert_eq!(selection.levels.of(layout().block(20)), Level(3));
}

#[test]
fn levels_are_checked_and_counted() {
    let error = |levels| BlockLevels::new(layout(), levels).unwrap_err().to_string();
    assert_eq!(error(vec![Level(0); 63]), "63 levels for 64 blocks: each block has one");
    let mut levels = vec![Level(4); 64];
    levels[5] = Level(5);
    assert_eq!(error(levels), "block 5 of level 5: blocks of 16^3 voxels have levels 0 to 4");
    let uniform = BlockLevels::uniform(layout(), Level(1));
    assert_eq!((uniform.n_bytes(ScalarType::U16), uniform.n_blocks_per_level()[1]), (2 * 32u64.pow(3), 64));
    assert_eq!(BlockLevels::uniform(layout(), Level(9)), BlockLevels::uniform(layout(), Level(4)));
    assert_eq!(BlockLevels::new(layout(), uniform.levels().to_vec()), Ok(uniform));
}

#[test]
fn random_levels_follow_from_the_seed_and_use_all_levels_alike() {
    let layout = BlockLayout::new(UVec3::splat(320), BlockSide::V16);
    let random = |seed| BlockLevels::random(layout, seed);
    assert_eq!(random(7), random(7));
    assert_ne!(random(7), random(8));
    let n = random(7).n_blocks_per_level();
    assert!(n[..5].iter().all(|n| (1450..1750).contains(n)) && n[5] == 0, "{n:?}");
}

#[test]
fn counts_are_kept_and_ranks_obeyed() {
    let ranks: Vec<f32> = (0..64u32).map(|i| (i * 29 % 64) as f32).collect();
    let levels = BlockLevels::by_counts(layout(), &[2, 0, 5, 10], &ranks).unwrap();
    assert_eq!(levels.n_blocks_per_level(), [2, 0, 5, 10, 47, 0]);
    for (level, rank) in levels.levels().iter().zip(&ranks) {
        let expected = [(62.0, 0), (57.0, 2), (47.0, 3)].into_iter().find(|(least, _)| rank >= least);
        assert_eq!(level.0, expected.map_or(4, |(_, level)| level), "{rank}");
    }
    let more = BlockLevels::by_counts(layout(), &[usize::MAX, usize::MAX], &ranks).unwrap();
    assert_eq!(more, BlockLevels::uniform(layout(), Level(0)));
    assert!(BlockLevels::by_counts(layout(), &[1], &ranks[1..]).is_err());
}

fn index_box(layout: &BlockLayout, block: UVec3) -> Aabb {
    let min = layout.first_voxel(block);
    Aabb { min: min.as_dvec3(), max: (min + layout.extent(block)).as_dvec3() }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn no_ray_meets_a_block_without_weight(
        scene in scene(Culling::Frustum), low in prop::array::uniform3(0.0..0.8f64), size in prop::array::uniform3(0.1..0.9f64),
    ) {
        let layout = BlockLayout::new(scene.grid.dims(), BlockSide::V16);
        let dims = scene.grid.dims().as_dvec3();
        let clip = Aabb { min: DVec3::from(low) * dims, max: (DVec3::from(low) + DVec3::from(size)) * dims };
        let from = BlockView { view: scene.view, clip: Some(clip), importance: Importance::ProjectedArea };
        let weights = block_weights(&layout, &scene.grid, &from);
        prop_assert!(weights.iter().all(|w| w.is_finite() && *w >= 0.0));
        let to_index = scene.grid.world_to_index();
        let rays = scene.view.camera.pixel_rays(scene.view.size);
        let pixels = (0..scene.view.size.y).flat_map(|y| (0..scene.view.size.x).map(move |x| (x, y)));
        let hidden: Vec<Aabb> = layout.blocks().zip(&weights).filter(|(_, w)| **w == 0.0)
            .map(|(block, _)| index_box(&layout, block).intersection(&clip)).filter(|b| !b.is_empty()).collect();
        for (x, y) in pixels {
            let ray = rays.pixel_ray(x, y);
            let ray = brickfield_core::Ray {
                origin: to_index.transform_point3(ray.origin),
                direction: to_index.transform_vector3(ray.direction),
            };
            prop_assert!(hidden.iter().all(|b| ray.clip(b).is_none()), "pixel {x}, {y}");
        }
    }

    #[test]
    fn without_culling_the_clip_box_decides(scene in scene(Culling::Off), low in 0.0..0.8f64, size in 0.1..0.9f64) {
        let layout = BlockLayout::new(scene.grid.dims(), BlockSide::V8);
        let dims = scene.grid.dims().as_dvec3();
        let clip = Aabb { min: low * dims, max: (low + size) * dims };
        let from = BlockView { view: scene.view, clip: Some(clip), importance: Importance::Equal };
        for (block, weight) in layout.blocks().zip(block_weights(&layout, &scene.grid, &from)) {
            let b = index_box(&layout, block);
            let is_apart = (b.max.cmple(clip.min) | b.min.cmpge(clip.max)).any();
            prop_assert_eq!(weight, if is_apart { 0.0 } else { 1.0 });
        }
    }
}

#[test]
fn nearer_blocks_weigh_more() {
    use brickfield_core::{Camera, Grid};
    use brickfield_lod::View;
    let layout = BlockLayout::new(UVec3::new(256, 16, 16), BlockSide::V16);
    let grid = Grid::axis_aligned(layout.dims(), DVec3::ONE).unwrap();
    let camera = Camera::framing(&grid.world_box(), -DVec3::X, DVec3::Z).unwrap();
    let view = View { camera, size: [64, 64].into(), culling: Culling::Frustum };
    let weights = block_weights(&layout, &grid, &BlockView { view, clip: None, importance: Importance::default() });
    assert!(weights.windows(2).all(|pair| pair[1] < pair[0]), "{weights:?}");
    let distance =
        |i: usize| 0.5 * grid.world_box().diagonal() / 20f64.to_radians().sin() - 128.0 + 8.0 + 16.0 * i as f64;
    let expected = (distance(15) / distance(0)).powi(2);
    assert!((f64::from(weights[0] / weights[15]) / expected - 1.0).abs() < 1e-5);
}

/// Blocks of 8 in a row, every fourth of which shows something; the variance of a block that does not rises along the row.
fn row_of_blocks() -> (BlockLayout, Vec<BlockSummary>, TransferFunction) {
    let layout = BlockLayout::new(UVec3::new(16 * 8, 8, 8), BlockSide::V8);
    let summary = |i: u32| {
        let (low, high) = if i.is_multiple_of(4) { (0.0, 200.0) } else { (0.0, 90.0) };
        BlockSummary {
            range: ValueRange { min: low, max: high },
            mean: 40.0,
            counts: [4095; 16],
            kept_variance: [1.0, 0.7, 0.4, 0.0, 0.0, 0.0],
            variance: if i == 1 { 0.0 } else { f64::from(i) },
        }
    };
    let knot = |value, extinction| Knot { value, extinction, color: [1.0; 3] };
    let transfer = TransferFunction::new(vec![knot(100.0, 0.0), knot(150.0, 0.1)]).unwrap();
    (layout, (0..16).map(summary).collect(), transfer)
}

#[test]
fn what_is_left_refines_transparent_blocks_beside_visible_ones() {
    let (layout, summaries, transfer) = row_of_blocks();
    let no_errors = vec![[0.0; 6]; 16];
    let rest_of = |most: u64, one_sample, weights: Option<&[f32]>| {
        let budget = BlockBudget { one_sample, ..budget(BudgetSize::Bytes(most)) };
        let selection = select_block_levels(&layout, &no_errors, weights, &budget).unwrap();
        let n_before = selection.n_bytes;
        let rest = spend_rest(&layout, &summaries, &transfer, weights, &budget, selection).unwrap();
        let is_refined = rest.levels.levels().iter().map(|level| *level < Level(3)).collect::<Vec<_>>();
        let n_bytes: u64 = layout
            .blocks()
            .zip(rest.levels.levels())
            .map(|(block, level)| {
                let n = layout.n_samples_total(block, *level);
                if n == 1 && one_sample == OneSampleBlocks::Free { 0 } else { n }
            })
            .sum();
        assert!(rest.n_bytes == n_bytes && n_before <= n_bytes && n_bytes <= most, "{rest:?}");
        (rest, is_refined)
    };
    // Beside visible blocks 0, 4, 8 and 12, and not of one value as block 1. The last one is beside none.
    let beside: Vec<bool> = (0..16).map(|i| i % 4 != 0 && i % 4 != 2 && i != 1 && i != 15).collect();
    for (one_sample, too_few) in [(OneSampleBlocks::Free, 7), (OneSampleBlocks::Stored, 22)] {
        let (rest, is_refined) = rest_of(1 << 20, one_sample, None);
        assert_eq!(is_refined, beside);
        assert!(rest.levels.levels().iter().zip(&beside).all(|(level, beside)| (*level == Level(0)) == *beside));
        assert_eq!(rest_of(too_few, one_sample, None).0.levels, BlockLevels::uniform(layout, Level(3)));
    }
    // Bytes for one block of two samples a side: that of the greatest variance. None for blocks without weight.
    assert_eq!(rest_of(8, OneSampleBlocks::Free, None).1, (0..16).map(|i| i == 13).collect::<Vec<_>>());
    let weights: Vec<f32> = (0..16u8).map(|i| f32::from(u8::from(i < 6))).collect();
    let (_, is_refined) = rest_of(1 << 20, OneSampleBlocks::Free, Some(&weights));
    assert_eq!(is_refined, (0..16).map(|i| beside[i] && i < 6).collect::<Vec<_>>());
}

#[test]
fn every_one_of_many_blocks_is_priced() {
    // More than are priced at once.
    let layout = BlockLayout::new(UVec3::new(8 * 1030, 8, 8), BlockSide::V8);
    let errors = vec![FALLING; layout.n_blocks_total()];
    let selection = select_block_levels(&layout, &errors, None, &budget(BudgetSize::Bytes(u64::MAX))).unwrap();
    assert_eq!((selection.n_bytes, selection.cost), (1030 * 512, 0.0));
    assert_eq!(selection.levels, BlockLevels::uniform(layout, Level(0)));
}

#[test]
fn what_is_left_buys_the_part_of_a_step_that_gains_most() {
    let layout = BlockLayout::new(UVec3::splat(8), BlockSide::V8);
    // Level 0 gains most per byte: the one step is from one sample to all.
    let errors: LevelErrors = [0.0, 9.0, 9.9, 10.0, 0.0, 0.0];
    for (bytes, level) in [(512, 0), (511, 1), (64, 1), (63, 2), (8, 2), (7, 3)] {
        let selection = select_block_levels(&layout, &[errors], None, &budget(BudgetSize::Bytes(bytes))).unwrap();
        assert_eq!(selection.levels.levels(), [Level(level)], "{bytes}");
    }
    // What the first block's part takes is gone for the second's.
    let two = BlockLayout::new(UVec3::new(16, 8, 8), BlockSide::V8);
    for (bytes, levels) in [(65, [1, 3]), (71, [1, 3]), (72, [1, 2])] {
        let selection = select_block_levels(&two, &[errors; 2], None, &budget(BudgetSize::Bytes(bytes))).unwrap();
        assert_eq!(selection.levels.levels(), levels.map(Level), "{bytes}");
        assert!(selection.n_bytes <= bytes);
    }
}

#[test]
fn a_short_block_weighs_as_its_own_voxels_do() {
    use brickfield_core::{Camera, Grid};
    use brickfield_lod::View;
    // The last block has four voxels along x; the middle of its own voxels is 2 past its corner.
    let layout = BlockLayout::new(UVec3::new(36, 16, 16), BlockSide::V16);
    let grid = Grid::axis_aligned(layout.dims(), DVec3::ONE).unwrap();
    let camera = Camera::framing(&grid.world_box(), -DVec3::X, DVec3::Z).unwrap();
    let view = View { camera, size: [64, 64].into(), culling: Culling::Off };
    let weights = block_weights(&layout, &grid, &BlockView { view, clip: None, importance: Importance::default() });
    let distance = |x: f64| 0.5 * grid.world_box().diagonal() / 20f64.to_radians().sin() - 18.0 + x;
    let expected = (distance(34.0) / distance(8.0)).powi(2);
    assert!((f64::from(weights[0] / weights[2]) / expected - 1.0).abs() < 1e-5);
}
