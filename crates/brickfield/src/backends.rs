//! The backends that this build and this machine have.

use std::fmt;

use brickfield_cpu::CpuBackend;
#[cfg(any(feature = "wgpu", feature = "ash"))]
use brickfield_frame::AdapterKind;
use brickfield_frame::Backend;

/// A backend by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum BackendKind {
    /// The fast f32 renderer; needs no driver.
    Cpu,
    /// Through wgpu.
    Wgpu,
    /// Raw Vulkan through ash.
    Ash,
}

/// An adapter that a backend could use.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AdapterInfo {
    /// Its place in the backend's list: `--adapter` takes it.
    pub index: usize,
    /// Its name as the driver states it: `--adapter` takes a part of it.
    pub name: String,
    /// The driver's name and version.
    pub driver: String,
    /// Whether it renders on the processor: then the CPU backend is quicker.
    pub is_software: bool,
}

/// The adapters of a backend, or the reason for having none.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BackendStatus {
    /// Which backend.
    pub kind: BackendKind,
    /// Its adapters, at least one; or why there is none, in a line.
    pub adapters: Result<Vec<AdapterInfo>, String>,
}

/// Whether a backend's calls are checked by the driver's validation layer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Validation {
    #[default]
    Off,
    On,
}

/// Why a backend could not be opened.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum BackendError {
    #[error("no backend {name:?}: there are cpu, wgpu and ash")]
    Name { name: String },
    #[error("backend {kind} is not in this build: enable the cargo feature {kind:?}", kind = kind.name())]
    NotBuilt { kind: BackendKind },
    #[error("backend {kind}: {reason}", kind = kind.name())]
    Unavailable { kind: BackendKind, reason: String },
}

impl BackendKind {
    /// All backends; backends that need no driver first.
    pub const ALL: [BackendKind; 3] = [BackendKind::Cpu, BackendKind::Wgpu, BackendKind::Ash];

    /// The name in reports and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            BackendKind::Cpu => "cpu",
            BackendKind::Wgpu => "wgpu",
            BackendKind::Ash => "ash",
        }
    }
}

impl fmt::Display for BackendKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl std::str::FromStr for BackendKind {
    type Err = BackendError;
    fn from_str(name: &str) -> Result<BackendKind, BackendError> {
        let kind = BackendKind::ALL.into_iter().find(|k| k.name() == name);
        kind.ok_or_else(|| BackendError::Name { name: name.to_owned() })
    }
}

/// Every backend with its adapters, or the reason why it is absent.
pub fn backends() -> Vec<BackendStatus> {
    BackendKind::ALL.map(|kind| BackendStatus { kind, adapters: adapters(kind) }).to_vec()
}

/// Opens a backend on an adapter: its number, a part of its name, or the backend's choice.
///
/// # Errors
/// A backend that is not in this build, not on this machine, or has no such adapter.
pub fn open_backend(
    kind: BackendKind,
    adapter: Option<&str>,
    validation: Validation,
) -> Result<Box<dyn Backend>, BackendError> {
    match kind {
        BackendKind::Cpu => open_cpu(adapter),
        BackendKind::Wgpu => open_wgpu(adapter, validation),
        BackendKind::Ash => open_ash(adapter, validation),
    }
}

fn adapters(kind: BackendKind) -> Result<Vec<AdapterInfo>, String> {
    match kind {
        BackendKind::Cpu => {
            let backend = CpuBackend::new();
            let d = backend.describe();
            Ok(vec![AdapterInfo { index: 0, name: d.adapter.clone(), driver: d.driver.clone(), is_software: true }])
        }
        BackendKind::Wgpu => wgpu_adapters(),
        BackendKind::Ash => ash_adapters(),
    }
}

fn open_cpu(adapter: Option<&str>) -> Result<Box<dyn Backend>, BackendError> {
    let backend = CpuBackend::new();
    let name = &backend.describe().adapter;
    match adapter {
        Some(wanted) if wanted != "0" && !name.contains(wanted) => {
            let reason = format!("no adapter {wanted:?}; the only one is 0: {name}");
            Err(BackendError::Unavailable { kind: BackendKind::Cpu, reason })
        }
        _ => Ok(Box::new(backend)),
    }
}

#[cfg(feature = "wgpu")]
fn wgpu_adapters() -> Result<Vec<AdapterInfo>, String> {
    let info = |a: brickfield_wgpu::AdapterSummary| {
        let is_software = a.kind == AdapterKind::Software;
        AdapterInfo { index: a.index, name: a.name, driver: a.driver, is_software }
    };
    let list: Vec<_> = brickfield_wgpu::adapters().into_iter().map(info).collect();
    if list.is_empty() { Err(brickfield_wgpu::OpenError::NoAdapter.to_string()) } else { Ok(list) }
}

#[cfg(feature = "wgpu")]
fn open_wgpu(adapter: Option<&str>, validation: Validation) -> Result<Box<dyn Backend>, BackendError> {
    use brickfield_wgpu::{AdapterChoice, WgpuBackend};
    if validation == Validation::On {
        let reason = "the driver's validation layer is asked through ash; wgpu checks its calls itself".to_owned();
        return Err(BackendError::Unavailable { kind: BackendKind::Wgpu, reason });
    }
    let choice = choose(adapter, AdapterChoice::Default, AdapterChoice::Index, AdapterChoice::Name);
    let backend = WgpuBackend::new(&choice).map_err(|e| unavailable(BackendKind::Wgpu, &e))?;
    Ok(Box::new(backend))
}

#[cfg(feature = "ash")]
fn ash_adapters() -> Result<Vec<AdapterInfo>, String> {
    let info = |a: brickfield_ash::AdapterSummary| {
        let is_software = a.kind == AdapterKind::Software;
        AdapterInfo { index: a.index, name: a.name, driver: a.driver, is_software }
    };
    let list: Vec<_> = brickfield_ash::adapters().map_err(|e| e.to_string())?.into_iter().map(info).collect();
    if list.is_empty() { Err(brickfield_ash::ConnectError::NoDevice.to_string()) } else { Ok(list) }
}

#[cfg(feature = "ash")]
fn open_ash(adapter: Option<&str>, validation: Validation) -> Result<Box<dyn Backend>, BackendError> {
    use brickfield_ash::{AdapterChoice, AshBackend, Options};
    let adapter = choose(adapter, AdapterChoice::Default, AdapterChoice::Index, AdapterChoice::Name);
    let validation = match validation {
        Validation::Off => brickfield_ash::Validation::Off,
        Validation::On => brickfield_ash::Validation::On,
    };
    let options = Options { adapter, validation, ..Options::default() };
    let backend = AshBackend::new(&options).map_err(|e| unavailable(BackendKind::Ash, &e))?;
    Ok(Box::new(backend))
}

/// The meaning of `--adapter` for a backend: none, a number, or a part of a name.
#[cfg(any(feature = "wgpu", feature = "ash"))]
fn choose<C>(adapter: Option<&str>, default: C, index: fn(usize) -> C, name: fn(String) -> C) -> C {
    match adapter {
        None => default,
        Some(text) => text.parse().map_or_else(|_| name(text.to_owned()), index),
    }
}

#[cfg(any(feature = "wgpu", feature = "ash"))]
fn unavailable(kind: BackendKind, error: &dyn std::error::Error) -> BackendError {
    BackendError::Unavailable { kind, reason: error.to_string() }
}

#[cfg(not(feature = "wgpu"))]
fn wgpu_adapters() -> Result<Vec<AdapterInfo>, String> {
    Err(BackendError::NotBuilt { kind: BackendKind::Wgpu }.to_string())
}

#[cfg(not(feature = "wgpu"))]
fn open_wgpu(_: Option<&str>, _: Validation) -> Result<Box<dyn Backend>, BackendError> {
    Err(BackendError::NotBuilt { kind: BackendKind::Wgpu })
}

#[cfg(not(feature = "ash"))]
fn ash_adapters() -> Result<Vec<AdapterInfo>, String> {
    Err(BackendError::NotBuilt { kind: BackendKind::Ash }.to_string())
}

#[cfg(not(feature = "ash"))]
fn open_ash(_: Option<&str>, _: Validation) -> Result<Box<dyn Backend>, BackendError> {
    Err(BackendError::NotBuilt { kind: BackendKind::Ash })
}
