#![no_main]

use std::io::Cursor;

use brickfield_io::{Limits, NoFiles, vti};
use libfuzzer_sys::fuzz_target;

#[path = "panics.rs"]
mod panics;

fuzz_target!(init: panics::abort_on_ours(), |bytes: &[u8]| {
    let _ = vti::read(Cursor::new(bytes), &NoFiles, &Limits { max_bytes: 1 << 20 }.into());
});
