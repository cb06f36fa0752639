//! The figures of README.md: texels of a ball, stored in every way.

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{BrickSide, Grid, Volume};
use brickfield_trim::*;

/// 256^3 voxels: a ball of the values 0 to 220 in noise of 0 to 15.
fn ball() -> Volume {
    const N: u32 = 256;
    let value = |i: u32| {
        let p = UVec3::new(i % N, i / N % N, i / (N * N)).as_dvec3() - 128.0;
        let noise = f64::from(i.wrapping_mul(2_654_435_761) >> 28);
        ((220.0 * (1.0 - p.length() / 128.0)).max(0.0) + noise) as u8
    };
    let grid = Grid::axis_aligned(UVec3::splat(N), DVec3::ONE).unwrap();
    Volume::new(grid, (0..N.pow(3)).map(value).collect::<Vec<u8>>()).unwrap()
}

#[test]
fn texels_of_a_ball() {
    let arrays = BrickArrays::of_volume(&ball(), BrickSide::S64);
    let trimmed = trim_bricks(&arrays, &DarkValues::below(100.0).unwrap(), Interpolation::Trilinear);
    let merged = |first, between| {
        let options = MergeOptions { first, between, ..MergeOptions::default() };
        merge_bricks(&trimmed, &options).unwrap().after()
    };
    let first = merge_bricks(&trimmed, &MergeOptions::default()).unwrap();
    let account = |a: TexelAccount| (a.n_boxes, a.n_texels >> 10, a.n_padding() >> 10);
    println!("{:?}", trimmed.counts());
    println!("{:?}", account(first.before()));
    println!("HA {:?}", account(merged(FirstMerge::Horizontal, BetweenClusters::Apart)));
    println!("HZ {:?}", account(merged(FirstMerge::Horizontal, BetweenClusters::AlongZ)));
    println!("VA {:?}", account(merged(FirstMerge::Vertical, BetweenClusters::Apart)));
    println!("VZ {:?}", account(merged(FirstMerge::Vertical, BetweenClusters::AlongZ)));
    println!("store {:?}", account(first.store(UVec3::splat(2048)).unwrap().account()));
    for side in BrickSide::ALL {
        let arrays = BrickArrays::of_volume(&ball(), side);
        let trimmed = trim_bricks(&arrays, &DarkValues::below(100.0).unwrap(), Interpolation::Trilinear);
        println!("pack {side} {:?}", account(pack_bricks(&trimmed, UVec3::splat(2048)).unwrap().account()));
    }
}
