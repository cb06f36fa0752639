#![no_main]

use std::io::Cursor;

use brickfield_io::Limits;
use brickfield_io::grids::vtk_xml;
use libfuzzer_sys::fuzz_target;

#[path = "panics.rs"]
mod panics;

fuzz_target!(init: panics::abort_on_ours(), |bytes: &[u8]| {
    let _ = vtk_xml::read(Cursor::new(bytes), &Limits { max_bytes: 1 << 20 }.into());
});
