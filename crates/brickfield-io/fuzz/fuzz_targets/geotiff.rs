#![no_main]

use std::io::Cursor;

use brickfield_io::Limits;
use brickfield_io::grids::geotiff;
use libfuzzer_sys::fuzz_target;

#[path = "panics.rs"]
mod panics;

fuzz_target!(init: panics::abort_on_ours(), |bytes: &[u8]| {
    let _ = geotiff::read(Cursor::new(bytes), &Limits { max_bytes: 1 << 20 }.into());
});
