//! Memory, limits, progress, and independence of the number of threads.

use std::sync::Mutex;

use brickfield_bricks::{
    BuildError, BuildOptions, Downsampling, LevelMemory, build_tree, build_tree_observed, tree_memory,
};
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{BrickLayout, BrickSide, Grid, Level, ScalarType, Volume, with_voxels};
use proptest::prelude::*;

fn ramp(dims: UVec3) -> Volume {
    let voxels: Vec<u16> = (0..dims.element_product()).map(|i| (i % 60_013) as u16).collect();
    Volume::new(Grid::axis_aligned(dims, DVec3::ONE).unwrap(), voxels).unwrap()
}

fn options(side: BrickSide) -> BuildOptions {
    BuildOptions { side, downsampling: Downsampling::Average, max_bytes: None }
}

#[test]
fn waste_per_brick_is_lamars() {
    // LaMar, Hamann and Joy 1999, section 3.1: n^3 - (n - 1)^3 voxels a brick, and the paper's numbers for 64.
    for side in BrickSide::ALL {
        let (k, n) = (5u64, u64::from(side.n_samples()));
        let dims = UVec3::splat((k * (n - 1) + 1) as u32);
        let memory = tree_memory(&BrickLayout::new(dims, side), ScalarType::U8).levels[0];
        let effective = (k * (n - 1)).pow(3);
        assert_eq!(memory.n_bricks, k.pow(3));
        assert_eq!(memory.stored_bytes - effective, k.pow(3) * (n.pow(3) - (n - 1).pow(3)));
        // The volume's own last layer of samples is in no other brick, so it is not shared.
        assert_eq!(memory.shared_bytes, memory.stored_bytes - u64::from(dims.x).pow(3));
        assert_eq!(memory.padding_bytes, 0);
    }
    assert_eq!(64u64.pow(3) - 63u64.pow(3), 12_097);
}

#[test]
fn the_readme_states_the_cost() {
    let factor = |dims: UVec3, side| {
        let total = tree_memory(&BrickLayout::new(dims, side), ScalarType::U8).total;
        total.stored_bytes as f64 / dims.as_dvec3().element_product()
    };
    let cube = |side: BrickSide| factor(UVec3::splat(64 * side.n_cells() + 1), side);
    for (side, expected) in BrickSide::ALL.into_iter().zip([1.39, 1.26, 1.20]) {
        assert!((cube(side) - expected).abs() < 0.01, "{side}: {}", cube(side));
    }
    let thread = factor(UVec3::new(1, 1, (15 << 10) + 1), BrickSide::S16);
    assert!((thread - 546.0).abs() < 1.0, "{thread}");
    assert_eq!(size_of::<brickfield_bricks::BrickSummary>(), 272);
}

/// Counts, sample by sample, how often each is stored.
fn counted(layout: &BrickLayout, level: Level) -> LevelMemory {
    let (n, dims) = (layout.side().n_samples(), layout.level_dims(level));
    let slots = |axis: usize| {
        let starts = (0..layout.n_bricks(level)[axis]).map(|b| b * (n - 1));
        starts.flat_map(|start| start..start + n).collect::<Vec<u32>>()
    };
    let product = |count: &dyn Fn(usize) -> usize| (0..3).map(|a| count(a) as u64).product::<u64>();
    let stored_bytes = product(&|a| slots(a).len());
    let inside = product(&|a| slots(a).iter().filter(|s| **s < dims[a]).count());
    let unique_bytes = product(&|a| dims[a] as usize);
    LevelMemory {
        n_bricks: layout.n_bricks_total(level) as u64,
        stored_bytes,
        unique_bytes,
        shared_bytes: inside - unique_bytes,
        padding_bytes: stored_bytes - inside,
        summary_bytes: 0,
    }
}

proptest! {
    #[test]
    fn the_account_is_that_of_counting(x in 1u32..300, y in 1u32..100, z in 1u32..70, side in 0usize..3) {
        let layout = BrickLayout::new(UVec3::new(x, y, z), BrickSide::ALL[side]);
        let memory = tree_memory(&layout, ScalarType::I8);
        for (level, got) in memory.levels.iter().enumerate() {
            let got = LevelMemory { summary_bytes: 0, ..*got };
            prop_assert_eq!(got, counted(&layout, Level(level as u8)));
            prop_assert_eq!(got.stored_bytes, got.unique_bytes + got.shared_bytes + got.padding_bytes);
        }
        let stored: u64 = memory.levels.iter().map(LevelMemory::bytes).sum();
        prop_assert_eq!(memory.total.bytes(), stored);
    }
}

#[test]
fn the_account_is_what_the_tree_holds() {
    let tree = build_tree(&ramp(UVec3::new(40, 17, 50)), &options(BrickSide::S16)).unwrap();
    for (level, memory) in tree.memory().levels.iter().enumerate() {
        let level = Level(level as u8);
        let n_bytes = with_voxels!(&**tree.level_samples(level), v => size_of_val(&v[..]));
        assert_eq!(n_bytes as u64, memory.stored_bytes);
        assert_eq!(size_of_val(tree.summaries(level)) as u64, memory.summary_bytes);
    }
}

#[test]
fn the_limit_is_checked_first_and_named() {
    let volume = ramp(UVec3::new(40, 17, 50));
    let needed = build_tree(&volume, &options(BrickSide::S32)).unwrap().memory().total.bytes();
    let limited = |max_bytes| BuildOptions { max_bytes: Some(max_bytes), ..options(BrickSide::S32) };
    assert!(build_tree(&volume, &limited(needed)).is_ok());
    let error = build_tree(&volume, &limited(needed - 1)).unwrap_err();
    assert!(matches!(error, BuildError::TooLarge { needed_bytes, .. } if needed_bytes == needed));
    assert_eq!(error.to_string(), format!("5 bricks of 32^3 samples take {needed} bytes; the limit is {}", needed - 1));
}

#[test]
fn progress_counts_every_brick_once() {
    let seen = Mutex::new(Vec::new());
    let observe = |p| seen.lock().unwrap().push(p);
    let tree = build_tree_observed(&ramp(UVec3::new(50, 40, 30)), &options(BrickSide::S16), &observe).unwrap();
    let mut seen = seen.into_inner().unwrap();
    seen.sort_by_key(|p: &brickfield_bricks::Progress| p.n_done);
    let n_bricks = tree.memory().total.n_bricks as usize;
    assert!(seen.iter().map(|p| (p.n_done, p.n_total)).eq((1..=n_bricks).map(|i| (i, n_bricks))));
}

#[test]
fn the_tree_does_not_depend_on_the_number_of_threads() {
    let volume = ramp(UVec3::new(70, 40, 30));
    let on = |n_threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
        pool.install(|| build_tree(&volume, &options(BrickSide::S16)).unwrap())
    };
    assert!(on(1) == on(3));
}

#[test]
fn bytes_are_little_endian() {
    let tree = build_tree(&ramp(UVec3::new(20, 3, 1)), &options(BrickSide::S16)).unwrap();
    for id in tree.layout().bricks(Level(0)) {
        let mut bytes = vec![0; tree.n_brick_bytes()];
        tree.samples(id).copy_le_bytes(&mut bytes);
        let values = bytes.chunks(2).map(|b| f64::from(u16::from_le_bytes([b[0], b[1]])));
        assert!(values.eq((0..tree.samples(id).len()).map(|i| tree.samples(id).at(i))));
    }
}
