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

/// Boxes, texels, and texels of padding.
fn numbers(account: TexelAccount) -> (usize, u64, u64) {
    (account.n_boxes, account.n_texels, account.n_padding())
}

fn trimmed(side: BrickSide) -> TrimmedBricks {
    let arrays = BrickArrays::of_volume(&ball(), side);
    trim_bricks(&arrays, &DarkValues::below(100.0).unwrap(), Interpolation::Trilinear)
}

#[test]
fn a_ball_in_texture_chunks() {
    let trimmed = trimmed(BrickSide::S64);
    assert_eq!(trimmed.counts(), ClassCounts { n_white: 93, n_grey: 24, n_black: 8 });
    let merged =
        |first, between| merge_bricks(&trimmed, &MergeOptions { first, between, ..MergeOptions::default() }).unwrap();
    use {BetweenClusters::*, FirstMerge::*};
    assert_eq!(numbers(merged(Horizontal, Apart).before()), (32, 3_768_320, 0));
    assert_eq!(numbers(merged(Horizontal, Apart).after()), (24, 3_833_856, 65_536));
    assert_eq!(numbers(merged(Horizontal, AlongZ).after()), (16, 5_373_952, 1_605_632));
    assert_eq!(numbers(merged(Vertical, AlongZ).after()), (16, 4_751_360, 983_040));
    // Chunks leave no texel between them.
    let stored = merged(Horizontal, AlongZ).store(UVec3::splat(2048)).unwrap().account();
    assert_eq!(numbers(stored), (32, 5_373_952, 1_605_632));
}

#[test]
fn a_ball_in_packed_boxes() {
    let packed = |side| numbers(pack_bricks(&trimmed(side), UVec3::splat(2048)).unwrap().account());
    assert_eq!(packed(BrickSide::S64), (32, 3_841_600, 805_684));
    assert_eq!(packed(BrickSide::S32), (151, 3_379_200, 515_823));
    assert_eq!(packed(BrickSide::S16), (890, 3_020_800, 180_873));
}
