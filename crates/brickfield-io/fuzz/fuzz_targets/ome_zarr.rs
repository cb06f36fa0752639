#![no_main]

use brickfield_io::{Limits, ome_zarr};
use libfuzzer_sys::fuzz_target;

#[path = "entries.rs"]
mod entries;
#[path = "panics.rs"]
mod panics;

fuzz_target!(init: panics::abort_on_ours(), |bytes: &[u8]| {
    let _ = ome_zarr::read_entries(&entries::entries(bytes), &Limits { max_bytes: 1 << 20 }.into());
});
