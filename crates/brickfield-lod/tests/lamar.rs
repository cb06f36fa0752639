//! The selections of LaMar, Hamann and Joy 1999, figures 4 and 5.

use std::collections::BTreeSet;

use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{BrickLayout, BrickSide, Camera, Grid, Projection};
use brickfield_lod::{Criterion, Culling, Selection, View, select_cut};

const SIDE: BrickSide = BrickSide::S16;

/// Selects for a point of interest, in tiles of level 0 from the first sample.
fn select(n_tiles: UVec3, point: DVec3) -> Selection {
    let dims = n_tiles * SIDE.n_cells() + 1;
    let grid = Grid::axis_aligned(dims, DVec3::ONE).unwrap();
    let eye = point * f64::from(SIDE.n_cells()) + 0.5;
    let camera = Camera::look_at(eye, eye + DVec3::X, DVec3::Z, Projection::Perspective { fov_y: 1.0 }).unwrap();
    let view = View { camera, size: UVec2::ONE, culling: Culling::Off };
    select_cut(&BrickLayout::new(dims, SIDE), &grid, &view, &Criterion::Distance { factor: 1.0 })
}

fn line(point: f64) -> Vec<usize> {
    select(UVec3::new(8, 0, 0), DVec3::X * point).n_drawn_per_level()
}

#[test]
fn figure_4_eight_tiles_in_four_levels() {
    // Worked out by hand: a tile is drawn if its centre is farther than its width; finest level first.
    assert_eq!(line(0.25), [2, 1, 1, 0]);
    assert_eq!(line(1.5), [4, 0, 1, 0]);
    assert_eq!(line(2.5), [4, 2, 0, 0]);
    assert_eq!(line(3.5), [4, 2, 0, 0]);
    // Centres 1 and 5 are as far as the width, which is not farther.
    assert_eq!(line(3.0), [6, 1, 0, 0]);
    assert_eq!(line(-4.5), [0, 0, 0, 1]);
    for i in 0..=80 {
        let point = f64::from(i) / 10.0 + 0.003;
        assert_eq!(line(point), line(8.0 - point), "a mirrored point sees a mirrored cut");
    }
}

#[test]
fn figure_5_quadtree_of_five_levels() {
    // Eighths of a tile: exact in f64, so that a tie is a tie. 61 tiles need one.
    let eighths = || (0..=128).map(|i| f64::from(i) / 8.0);
    let points = eighths().flat_map(|y| eighths().map(move |x| DVec3::new(x, y, 0.0)));
    let counts: BTreeSet<usize> = points.map(|p| select(UVec3::new(16, 16, 0), p).drawn().count()).collect();
    assert_eq!((counts.first(), counts.last()), (Some(&13), Some(&61)), "{counts:?}");
    assert!(counts.contains(&49), "the figure draws 49 of 256 tiles: {counts:?}");
}

#[test]
fn the_diagonal_of_a_slice_is_that_of_the_tile() {
    // A root of 4 x 4 tiles is drawn from beyond 4 sqrt(2) = 5.66 tiles, whatever its thickness of one voxel.
    let from = |x: f64| select(UVec3::new(4, 4, 0), DVec3::new(2.0 + x, 2.0, 0.0)).drawn().count();
    assert!(from(5.65) > 1);
    assert_eq!(from(5.66), 1);
}
