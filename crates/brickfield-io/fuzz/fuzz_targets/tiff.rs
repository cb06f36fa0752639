#![no_main]

use std::io::Cursor;

use brickfield_io::{Limits, tiff};
use libfuzzer_sys::fuzz_target;

#[path = "panics.rs"]
mod panics;

fuzz_target!(init: panics::abort_on_ours(), |bytes: &[u8]| {
    let _ = tiff::read(Cursor::new(bytes), &Limits { max_bytes: 1 << 20 });
});
