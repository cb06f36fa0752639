#![no_main]

use std::io::Cursor;

use brickfield_io::{Limits, NoFiles, nrrd};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let _ = nrrd::read(Cursor::new(bytes), &NoFiles, &Limits { max_bytes: 1 << 20 }.into());
});
