//! Stores that arrive bit by bit.

#![cfg(feature = "fetch")]

use std::path::Path;
use std::sync::Arc;

use brickfield::bricks::{BlockOptions, BlockSource, BlockVolume, build_blocks};
use brickfield::core::glam::{DVec3, UVec2, UVec3};
use brickfield::core::{Aabb, BlockSide, Camera, Grid, Knot, Level, Projection, Rescale, TransferFunction, Volume};
use brickfield::delivery::{Delivery, DeliveryError, DeliveryPlan};
use brickfield::fetch::{Client, FetchOptions};
use brickfield::io::{OpenOptions, SaveOptions, open_slices, save};
use brickfield::{Codec, Scene, StoreLimits, pack};

const DIMS: UVec3 = UVec3::new(130, 97, 70);
/// No chunk takes more bytes: 32^3 values of four, which do not get smaller.
const ANY_CHUNK: u64 = 140_000;

/// A soft ball in the upper half along x, over nothing.
fn volume() -> Volume {
    let sample = |i: u32| {
        let p = UVec3::new(i % DIMS.x, i / DIMS.x % DIMS.y, i / DIMS.x / DIMS.y).as_dvec3();
        let noise = f64::from(i.wrapping_mul(2_654_435_761) >> 30);
        (240.0 - 6.0 * p.distance(DVec3::new(95.0, 48.0, 35.0)) + noise).max(0.0) as u8
    };
    let voxels: Vec<u8> = (0..DIMS.element_product()).map(sample).collect();
    let grid = Grid::axis_aligned(DIMS, DVec3::ONE).unwrap();
    Volume::rescaled(grid, voxels, Rescale::new(0.5, -10.0).unwrap()).unwrap()
}

fn scene(volume: &Volume) -> Scene {
    let center = volume.grid().world_box().center();
    let projection = Projection::Orthographic { height: 140.0 };
    let camera = Camera::look_at(center - 300.0 * DVec3::Z, center, DVec3::Y, projection).unwrap();
    let knot = |value, extinction| Knot { value, extinction, color: [1.0; 3] };
    Scene::new(camera, UVec2::splat(16), TransferFunction::new(vec![knot(20.0, 0.0), knot(60.0, 0.3)]).unwrap())
}

fn packed(folder: &Path, volume: &Volume, codec: Codec) -> String {
    let (file, store) = (folder.join("a.nii"), folder.join(format!("{}.zarr", codec.name())));
    save(&file, volume, &SaveOptions::default()).unwrap();
    pack(&file, &mut || open_slices(&file, &OpenOptions::default()), &store, codec, &mut |_| {}).unwrap();
    store.to_string_lossy().into_owned()
}

fn begin(location: &str) -> Delivery {
    let options = FetchOptions { max_gap_bytes: 0, ..FetchOptions::default() };
    Delivery::begin(location, Client::open(location, options).unwrap(), StoreLimits::default()).unwrap()
}

fn blocks(volume: &Volume) -> BlockVolume {
    build_blocks(Arc::new(volume.clone()), &BlockOptions { side: BlockSide::V32, ..BlockOptions::default() }).unwrap()
}

/// Blocks at the levels that have arrived are those of the volume; none of a finer level can be had.
fn check(delivery: &Delivery, expected: &BlockVolume) {
    let (mut found, mut whole) = (Vec::new(), Vec::new());
    let layout = *expected.layout();
    for block in layout.blocks() {
        let level = delivery.levels()[layout.ordinal(block)];
        delivery.blocks().fetch(block, level, &mut found).unwrap();
        expected.fetch(block, level, &mut whole).unwrap();
        assert_eq!(found, whole, "{block} at level {}", level.0);
        if level > Level(0) {
            let finer = delivery.blocks().fetch(block, Level(level.0 - 1), &mut found);
            if let Err(fault) = finer {
                assert!(fault.to_string().ends_with("not arrived"), "{fault}");
            }
        }
    }
}

#[test]
fn every_prefix_has_blocks_of_the_volume() {
    let folder = tempfile::tempdir().unwrap();
    let volume = volume();
    let (scene, expected) = (scene(&volume), blocks(&volume));
    let location = packed(folder.path(), &volume, Codec::Haar);
    let mut delivery = begin(&location);
    assert_eq!(delivery.levels()[0], Level(2));
    check(&delivery, &expected);
    let overview = delivery.overview().unwrap();
    assert_eq!(overview.rescale(), volume.rescale());
    let n_plan_bytes = delivery.n_plan_bytes().unwrap();
    let before = delivery.n_bytes();
    let mut plan = delivery.plan(&scene, None).unwrap();
    assert!(delivery.n_bytes() - before <= n_plan_bytes, "{} of {n_plan_bytes}", delivery.n_bytes() - before);
    assert_eq!(delivery.blocks().range(), expected.range());
    let (mut last, mut n_steps) = (delivery.levels().to_vec(), 0);
    // Too few bytes for anything.
    assert_eq!(delivery.fetch(&mut plan, 1).unwrap(), 0);
    // Bricks of details are not longer than their samples of a byte.
    while delivery.fetch(&mut plan, ANY_CHUNK / 4).unwrap() > 0 {
        assert!(delivery.levels().iter().zip(&last).all(|(now, last)| now <= last));
        last = delivery.levels().to_vec();
        if n_steps % 5 == 0 {
            check(&delivery, &expected);
        }
        n_steps += 1;
    }
    assert_eq!((plan.n_fetched(), plan.n_bytes_left()), (plan.n_items(), 0));
    assert!(last.iter().all(|level| *level == Level(0)) && n_steps > 1);
    check(&delivery, &expected);
}

#[test]
fn a_region_comes_first_and_what_is_not_seen_comes_last() {
    let folder = tempfile::tempdir().unwrap();
    let volume = volume();
    let (scene, expected) = (scene(&volume), blocks(&volume));
    let layout = *expected.layout();
    for codec in [Codec::Haar, Codec::Zstd] {
        let location = packed(folder.path(), &volume, codec);
        let mut delivery = begin(&location);
        let region = Aabb { min: DVec3::new(96.0, 0.0, 0.0), max: DIMS.as_dvec3() };
        let mut plan = delivery.plan(&scene, Some(&region)).unwrap();
        let run_to = |delivery: &mut Delivery, plan: &mut DeliveryPlan, n: usize| {
            while plan.n_fetched() < n && delivery.fetch(plan, ANY_CHUNK).unwrap() > 0 {}
        };
        let (n_of_region, n_visible) = (plan.n_of_region(), plan.n_visible());
        assert!(0 < n_of_region && n_of_region < n_visible && n_visible < plan.n_items());
        // Half of the first phase is nearly all in the region.
        run_to(&mut delivery, &mut plan, n_of_region);
        let fine = |delivery: &Delivery, is_within: bool| {
            let of = |block: UVec3| (layout.first_voxel(block).x >= 96) == is_within;
            layout.blocks().filter(|b| of(*b) && delivery.levels()[layout.ordinal(*b)] == Level(0)).count()
        };
        assert!(fine(&delivery, true) > 0);
        if plan.n_fetched() == n_of_region {
            assert_eq!(fine(&delivery, false), 0, "{}", codec.name());
        }
        run_to(&mut delivery, &mut plan, n_visible);
        assert!(fine(&delivery, false) > 0);
    }
}

#[test]
fn other_stores_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let others = folder.path().join("others.zarr");
    save(&others, &volume(), &SaveOptions::default()).unwrap();
    let begin = |location: &Path| {
        let client = Client::open(location, FetchOptions::default()).unwrap();
        Delivery::begin(&location.to_string_lossy(), client, StoreLimits::default()).err().unwrap()
    };
    let fault = begin(&others);
    assert!(
        matches!(fault, DeliveryError::NoDocument { .. } | DeliveryError::NotPacked { .. } | DeliveryError::Open(_)),
        "{fault}"
    );
    std::fs::create_dir(folder.path().join("empty")).unwrap();
    let fault = begin(&folder.path().join("empty"));
    assert!(matches!(fault, DeliveryError::NoDocument { .. }), "{fault}");
    assert!(fault.to_string().contains("zarr.json is not there"), "{fault}");
}
