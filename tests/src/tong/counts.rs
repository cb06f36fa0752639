//! Equation 1: the blocks of the paper's data sets.

use brickfield_core::glam::UVec3;
use brickfield_core::{BrickLayout, BrickSide, Level};

use crate::paper::{Missed, PaperError, print};

/// The data sets of table 1, their sizes, and their blocks of 64^3 by equation 1.
const DATA: [(&str, UVec3, usize); 6] = [
    ("Head I", UVec3::new(256, 256, 128), 75),
    ("Head II", UVec3::new(512, 512, 56), 81),
    ("Body I", UVec3::new(512, 512, 78), 162),
    ("Frog", UVec3::new(500, 470, 176), 192),
    ("Foot", UVec3::new(250, 512, 352), 216),
    ("Head III", UVec3::new(512, 512, 256), 405),
];

pub(super) fn run() -> Result<Vec<Missed>, PaperError> {
    let mut missed = Vec::new();
    for (name, dims, expected) in DATA {
        let n_bricks = BrickLayout::new(dims, BrickSide::S64).n_bricks_total(Level(0));
        let line = format!(
            "{name:<9} {:>3} x {} x {:<3}: {n_bricks} blocks, {expected} by equation 1",
            dims.x, dims.y, dims.z
        );
        print(&line)?;
        if n_bricks != expected {
            missed.push(Missed::of_pictures(line));
        }
    }
    Ok(missed)
}
