#![no_main]

use std::io::Cursor;

use brickfield_io::{Limits, NoFiles, nifti};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let _ = nifti::read(Cursor::new(bytes), "stem", &NoFiles, &Limits { max_bytes: 1 << 20 }.into());
});
