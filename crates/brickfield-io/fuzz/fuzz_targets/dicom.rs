#![no_main]

use std::collections::BTreeMap;

use brickfield_io::{Limits, dicom};
use libfuzzer_sys::fuzz_target;

#[path = "panics.rs"]
mod panics;

fuzz_target!(init: panics::abort_on_ours(), |bytes: &[u8]| {
    let name = "slice".to_owned();
    let files = BTreeMap::from([(name.clone(), bytes.to_vec())]);
    let _ = dicom::read(&[name], &files, &Limits { max_bytes: 1 << 20 }.into());
});
