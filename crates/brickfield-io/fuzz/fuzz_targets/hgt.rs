#![no_main]

use std::io::Cursor;

use brickfield_io::Limits;
use brickfield_io::grids::hgt::{self, TileCorner};
use libfuzzer_sys::fuzz_target;

// The bytes are the first rows of a tile if there are enough of them, and the corner's latitude.
fuzz_target!(|bytes: &[u8]| {
    let mut tile = bytes.to_vec();
    if tile.len() > 64 {
        tile.resize(2 * 1201 * 1201, 0);
    }
    let latitude = i32::from(bytes.first().copied().unwrap_or(0)) - 128;
    let corner = TileCorner { longitude: 0, latitude };
    let _ = hgt::read(Cursor::new(tile), corner, &Limits { max_bytes: 8 << 20 }.into());
});
