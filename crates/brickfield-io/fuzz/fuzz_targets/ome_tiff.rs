#![no_main]

use std::io::Cursor;

use brickfield_io::{Limits, tiff};
use libfuzzer_sys::fuzz_target;

#[path = "entries.rs"]
mod entries;
#[path = "panics.rs"]
mod panics;

// The first file is opened; the others are those that its document may name.
fuzz_target!(init: panics::abort_on_ours(), |bytes: &[u8]| {
    let files = entries::entries(bytes);
    let Some(first) = files.values().next() else { return };
    let _ = tiff::read(Cursor::new(first), &files, &Limits { max_bytes: 1 << 20 }.into());
});
