//! The selections of LaMar, Hamann and Joy 1999, figures 4, 5 and 6.

use std::collections::BTreeSet;

use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{BrickLayout, BrickSide, Camera, Grid, Projection, WorldPos};
use brickfield_lod::{Criterion, Culling, Selection, View, select_cut};

const SIDE: BrickSide = BrickSide::S16;

fn layout(n_tiles: UVec3) -> (BrickLayout, Grid) {
    let dims = n_tiles * SIDE.n_cells() + 1;
    (BrickLayout::new(dims, SIDE), Grid::axis_aligned(dims, DVec3::ONE).unwrap())
}

fn view(eye: DVec3, toward: DVec3, projection: Projection) -> View {
    let camera = Camera::look_at(eye, eye + toward, DVec3::Y, projection).unwrap();
    View { camera, size: UVec2::splat(64), culling: Culling::Off }
}

/// Selects for a point of interest, in tiles of level 0 from the first sample.
fn select(n_tiles: UVec3, point: DVec3) -> Selection {
    let (layout, grid) = layout(n_tiles);
    let point = point * f64::from(SIDE.n_cells()) + 0.5;
    let select = |eye: DVec3, criterion| {
        let view = view(eye, DVec3::X, Projection::Perspective { fov_y: 1.0 });
        select_cut(&layout, &grid, &view, &[criterion])
    };
    let of_interest = select(DVec3::ZERO, Criterion::DistanceFrom { point: WorldPos(point), factor: 1.0 });
    assert_eq!(of_interest, select(point, Criterion::Distance { factor: 1.0 }), "the viewpoint is a point of interest");
    of_interest
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

/// Number of tiles that a criterion takes of a slice of 4 x 4, 60 voxels wide, seen straight from a distance from its
/// middle.
fn slice(distance: f64, projection: Projection, criterion: Criterion) -> usize {
    let (layout, grid) = layout(UVec3::new(4, 4, 0));
    let view = view(DVec3::new(30.5, 30.5, 0.5 - distance), DVec3::Z, projection);
    select_cut(&layout, &grid, &view, &[criterion]).drawn().count()
}

#[test]
fn figure_6_the_projected_angle_is_less_than_half_the_field_of_view() {
    let lens = Projection::Perspective { fov_y: 60f64.to_radians() };
    let tiles = |distance| slice(distance, lens, Criterion::FieldOfView { fraction: 0.5 });
    // The root's corners are 30 sqrt(2) from its middle: 30 degrees from 30 sqrt(2) / tan(15 degrees) = 158.34.
    assert_eq!((tiles(158.3), tiles(158.4)), (4, 1));
    // The corners of a quarter that lie beside the middle are (30, 0, d) and (0, 30, d) from the eye. The cosine of their
    // angle is d^2 / (900 + d^2): 30 degrees at 30 sqrt(cos / (1 - cos)) = 76.27. The other two need 73.49.
    assert_eq!((tiles(76.2), tiles(76.3)), (16, 4));
}

#[test]
fn figure_6_without_perspective() {
    // The root's diagonal is 60 sqrt(2) = 84.85 wherever the eye is, a quarter's 42.43.
    let tiles = |height| slice(100.0, Projection::Orthographic { height }, Criterion::FieldOfView { fraction: 0.5 });
    assert_eq!((tiles(169.6), tiles(169.8)), (4, 1));
    assert_eq!((tiles(84.8), tiles(84.9)), (16, 4));
}
