#![no_main]

use brickfield_io::{Limits, pictures};
use libfuzzer_sys::fuzz_target;

#[path = "entries.rs"]
mod entries;
#[path = "panics.rs"]
mod panics;

fuzz_target!(init: panics::abort_on_ours(), |bytes: &[u8]| {
    let files = entries::entries(bytes);
    let names: Vec<String> = files.keys().cloned().collect();
    let _ = pictures::read(&names, &files, &Limits { max_bytes: 1 << 20 }.into());
});
