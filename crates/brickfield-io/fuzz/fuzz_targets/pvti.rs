#![no_main]

use std::io::Cursor;

use brickfield_io::{Limits, vti};
use libfuzzer_sys::fuzz_target;

#[path = "entries.rs"]
mod entries;
#[path = "panics.rs"]
mod panics;

// The entry whose name ends with .pvti names the others.
fuzz_target!(init: panics::abort_on_ours(), |bytes: &[u8]| {
    let entries = entries::entries(bytes);
    let Some((_, first)) = entries.iter().find(|(name, _)| name.ends_with(".pvti")) else { return };
    let _ = vti::read(Cursor::new(first), &entries, &Limits { max_bytes: 1 << 20 }.into());
});
