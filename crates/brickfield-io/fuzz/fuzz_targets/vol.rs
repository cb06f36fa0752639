#![no_main]

use std::io::Cursor;

use brickfield_io::{Limits, vol};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let _ = vol::read(Cursor::new(bytes), &Limits { max_bytes: 1 << 20 }.into());
});
