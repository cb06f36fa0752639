#![no_main]

use std::io::Cursor;

use brickfield_io::Limits;
use brickfield_io::grids::usgs_dem;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let _ = usgs_dem::read(Cursor::new(bytes), &Limits { max_bytes: 1 << 20 }.into());
});
