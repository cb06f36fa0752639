//! The backends that are measured.

use brickfield::frame::{Description, Probe};
use brickfield::{BackendKind, BackendStatus, backends};
use serde::{Deserialize, Serialize};

/// A backend on a device, or why there is none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct DeviceInfo {
    pub backend: String,
    pub adapter: Option<String>,
    pub driver: Option<String>,
    /// Whether the driver renders on the processor.
    pub is_software: bool,
    pub max_texture_3d: Option<u32>,
    pub max_buffer_bytes: Option<u64>,
    pub absent: Option<String>,
}

/// The GPU backends that are there.
pub(super) type Devices = Vec<(BackendKind, Box<dyn Probe>)>;

/// The backends that are measured on a GPU.
pub(super) const KINDS: [BackendKind; 2] = [BackendKind::Wgpu, BackendKind::Ash];

/// Opens both GPU backends on the adapter that `adapter` names, or on their default.
pub(super) fn open(adapter: Option<&str>) -> (Devices, Vec<DeviceInfo>) {
    let (mut devices, mut infos) = (Devices::new(), Vec::new());
    for kind in KINDS {
        let opened = match kind {
            BackendKind::Wgpu => open_wgpu(adapter),
            _ => open_ash(adapter),
        };
        match opened {
            Ok(probe) => {
                infos.push(present(kind, probe.describe()));
                devices.push((kind, probe));
            }
            Err(reason) => infos.push(absent(kind, &reason)),
        }
    }
    (devices, infos)
}

fn present(kind: BackendKind, d: &Description) -> DeviceInfo {
    let status = backends().into_iter().find(|s| s.kind == kind);
    let is_software = match status {
        Some(BackendStatus { adapters: Ok(adapters), .. }) => {
            adapters.iter().any(|a| a.name == d.adapter && a.is_software)
        }
        _ => false,
    };
    DeviceInfo {
        backend: kind.name().to_owned(),
        adapter: Some(d.adapter.clone()),
        driver: Some(d.driver.clone()),
        is_software,
        max_texture_3d: Some(d.capabilities.max_texture_3d),
        max_buffer_bytes: Some(d.capabilities.max_buffer_bytes),
        absent: None,
    }
}

fn absent(kind: BackendKind, reason: &str) -> DeviceInfo {
    DeviceInfo {
        backend: kind.name().to_owned(),
        adapter: None,
        driver: None,
        is_software: false,
        max_texture_3d: None,
        max_buffer_bytes: None,
        absent: Some(reason.split_whitespace().collect::<Vec<_>>().join(" ")),
    }
}

#[cfg(feature = "wgpu")]
fn open_wgpu(adapter: Option<&str>) -> Result<Box<dyn Probe>, String> {
    use brickfield_wgpu::{AdapterChoice, WgpuBackend};
    let choice = choose(adapter, AdapterChoice::Default, AdapterChoice::Index, AdapterChoice::Name);
    Ok(Box::new(WgpuBackend::new(&choice).map_err(|e| e.to_string())?))
}

#[cfg(feature = "ash")]
fn open_ash(adapter: Option<&str>) -> Result<Box<dyn Probe>, String> {
    use brickfield_ash::{AdapterChoice, AshBackend, Options};
    let adapter = choose(adapter, AdapterChoice::Default, AdapterChoice::Index, AdapterChoice::Name);
    Ok(Box::new(AshBackend::new(&Options { adapter, ..Options::default() }).map_err(|e| e.to_string())?))
}

#[cfg(any(feature = "wgpu", feature = "ash"))]
fn choose<C>(adapter: Option<&str>, default: C, index: fn(usize) -> C, name: fn(String) -> C) -> C {
    match adapter {
        None => default,
        Some(text) => text.parse().map_or_else(|_| name(text.to_owned()), index),
    }
}

#[cfg(not(feature = "wgpu"))]
fn open_wgpu(_: Option<&str>) -> Result<Box<dyn Probe>, String> {
    Err("wgpu is not in this build".to_owned())
}

#[cfg(not(feature = "ash"))]
fn open_ash(_: Option<&str>) -> Result<Box<dyn Probe>, String> {
    Err("ash is not in this build".to_owned())
}
