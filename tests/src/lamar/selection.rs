//! Figures 4 and 5: how many tiles the distance filter selects.

use std::collections::BTreeMap;

use brickfield::lod::{Criterion, Culling, Selection, View, select_cut};
use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{BrickLayout, BrickSide, Camera, Grid, Projection, WorldPos};

use super::LamarArgs;
use crate::paper::{Missed, PaperError, print};

const SIDE: BrickSide = BrickSide::S16;

pub(super) fn run(_: &LamarArgs) -> Result<Vec<Missed>, PaperError> {
    print(
        "Figure 4: eight tiles in four levels; a tile is drawn if the point is farther from its centre than its width.\n\
           Tiles of each level, finest first, by the place of the point in tiles:\n",
    )?;
    let mut missed = Vec::new();
    // Worked out by hand; a mirrored point sees the mirrored cut.
    for (point, by_hand) in [(0.25, [2, 1, 1, 0]), (1.5, [4, 0, 1, 0]), (2.5, [4, 2, 0, 0]), (3.5, [4, 2, 0, 0])] {
        for point in [point, 8.0 - point] {
            let n = select(UVec3::new(8, 0, 0), DVec3::X * point)?.n_drawn_per_level();
            print(&format!("  {point:.2}: {n:?}, {} in all", n.iter().sum::<usize>()))?;
            if n != by_hand {
                missed.push(Missed::of_pictures(format!("figure 4: {n:?} tiles at {point}, by hand {by_hand:?}")));
            }
        }
    }
    // Eighths of a tile are exact, so that ties are ties.
    let eighths = || (0..=128).map(|i| f64::from(i) / 8.0);
    let mut counts = BTreeMap::new();
    for point in eighths().flat_map(|y| eighths().map(move |x| DVec3::new(x, y, 0.0))) {
        *counts.entry(select(UVec3::new(16, 16, 0), point)?.drawn().count()).or_insert(0) += 1;
    }
    let (least, most) = (counts.keys().next().copied().unwrap_or(0), counts.keys().last().copied().unwrap_or(0));
    let words: Vec<String> = counts.iter().map(|(tiles, points)| format!("{tiles}: {points}")).collect();
    print(&format!(
        "\nFigure 5: 16 x 16 tiles in five levels, points at eighths of a tile: {least} to {most} tiles (expected: 13 to 61, and 49, as in the figure, among them).\n\
         Points by their number of tiles: {}",
        words.join(", ")
    ))?;
    if (least, most) != (13, 61) || !counts.contains_key(&49) {
        missed.push(Missed::of_pictures(format!(
            "figure 5: {least} to {most} tiles, 49 among them: {}",
            counts.contains_key(&49)
        )));
    }
    Ok(missed)
}

/// The tiles for a point of interest, in tiles from the first sample.
fn select(n_tiles: UVec3, point: DVec3) -> Result<Selection, PaperError> {
    let dims = n_tiles * SIDE.n_cells() + 1;
    let grid = Grid::axis_aligned(dims, DVec3::ONE).expect("a plain grid");
    let at = point * f64::from(SIDE.n_cells()) + 0.5;
    let camera = Camera::look_at(at, at + DVec3::X, DVec3::Z, Projection::Perspective { fov_y: 1.0 })?;
    let view = View { camera, size: UVec2::ONE, culling: Culling::Off };
    let criterion = Criterion::DistanceFrom { point: WorldPos(at), factor: 1.0 };
    Ok(select_cut(&BrickLayout::new(dims, SIDE), &grid, &view, &[criterion]))
}
