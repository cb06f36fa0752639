#![no_main]

use std::io::Cursor;

use brickfield_io::Limits;
use brickfield_io::grids::plot3d;
use libfuzzer_sys::fuzz_target;

// A solution or functions for a grid of 4 x 3 x 2 nodes, all at the origin.
fuzz_target!(|bytes: &[u8]| {
    let mut grid = Vec::new();
    [4i32, 3, 2].iter().for_each(|n| grid.extend(n.to_le_bytes()));
    grid.resize(12 + 12 * 24, 0);
    let limits = Limits { max_bytes: 1 << 20 };
    let _ = plot3d::read(Cursor::new(grid), Some(&mut Cursor::new(bytes)), &limits.into());
});
