#![no_main]

use std::io::Cursor;

use brickfield_io::Limits;
use brickfield_io::grids::plot3d;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let _ = plot3d::read(Cursor::new(bytes), None, &Limits { max_bytes: 1 << 20 }.into());
});
