#![no_main]

use std::io::Cursor;

use brickfield_io::Limits;
use brickfield_io::grids::vtk_legacy;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let _ = vtk_legacy::read(Cursor::new(bytes), &Limits { max_bytes: 1 << 20 }.into());
});
