//! The GPU backends on this machine's default device. Where there is none, `no device` is printed.

#![allow(dead_code, unused_imports, unused_macros, reason = "each test program uses a part of it")]

use brickfield_ash::{AshBackend, ConnectError, Options};
use brickfield_wgpu::{AdapterChoice, OpenError, WgpuBackend};

/// wgpu; `None` without a device.
pub(crate) fn wgpu() -> Option<WgpuBackend> {
    match WgpuBackend::new(&AdapterChoice::Default) {
        Err(e @ OpenError::NoAdapter) => no_device(&e),
        opened => Some(opened.unwrap()),
    }
}

/// ash; `None` without a device, or without the validation layer that is asked for.
pub(crate) fn ash(options: &Options) -> Option<AshBackend> {
    match AshBackend::new(options) {
        Err(e @ (ConnectError::NoLoader { .. } | ConnectError::NoDevice | ConnectError::NoValidationLayer)) => {
            no_device(&e)
        }
        connected => Some(connected.unwrap()),
    }
}

fn no_device<B>(why: &dyn std::error::Error) -> Option<B> {
    println!("no device: {why}");
    None
}

/// Each test, generic over the backend, on both.
macro_rules! on_both_backends {
    ($($test:ident)*) => {
        mod wgpu { $(#[test] fn $test() { super::$test::<super::WgpuBackend>(); })* }
        mod ash { $(#[test] fn $test() { super::$test::<super::AshBackend>(); })* }
    };
}

pub(crate) use on_both_backends;
