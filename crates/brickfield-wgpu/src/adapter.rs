//! Which adapters there are, and opening one.

use std::fmt;

use brickfield_frame::AdapterKind;

use crate::device::Device;

/// An adapter, as its driver states it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AdapterSummary {
    /// Its place in [`adapters`]' list.
    pub index: usize,
    /// The adapter's name.
    pub name: String,
    /// The driver's name and version.
    pub driver: String,
    /// The adapter's kind.
    pub kind: AdapterKind,
}

/// Which adapter to open.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum AdapterChoice {
    /// The first of the best [`AdapterKind`].
    #[default]
    Default,
    /// The adapter at this place in [`adapters`]' list.
    Index(usize),
    /// The first adapter whose name contains this text, regardless of case.
    Name(String),
}

/// Why no adapter was opened.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum OpenError {
    #[error(
        "no Vulkan adapter: there is no Vulkan loader, no driver, or VK_ICD_FILENAMES (VK_DRIVER_FILES) names none; \
         install your GPU's driver, or a software one (Debian: mesa-vulkan-drivers)"
    )]
    NoAdapter,
    #[error("no adapter {choice}; the adapters are {}", list(available))]
    NoSuchAdapter { choice: AdapterChoice, available: Vec<AdapterSummary> },
    #[error("adapter {adapter} gave no device: {message}")]
    NoDevice { adapter: String, message: String },
}

impl fmt::Display for AdapterSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {} ({}, {})", self.index, self.name, self.kind, self.driver)
    }
}

impl fmt::Display for AdapterChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            AdapterChoice::Default => f.write_str("at all"),
            AdapterChoice::Index(index) => write!(f, "{index}"),
            AdapterChoice::Name(name) => write!(f, "with `{name}` in its name"),
        }
    }
}

fn list(adapters: &[AdapterSummary]) -> String {
    adapters.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
}

/// The Vulkan adapters of this machine; none if there is no driver.
pub fn adapters() -> Vec<AdapterSummary> {
    summaries(&enumerate(&instance()))
}

/// Opens an adapter.
pub(crate) fn open(choice: &AdapterChoice) -> Result<Device, OpenError> {
    let mut found = enumerate(&instance());
    let available = summaries(&found);
    if available.is_empty() {
        return Err(OpenError::NoAdapter);
    }
    match place(choice, &available) {
        Some(place) => Device::open(found.swap_remove(place), driver),
        None => Err(OpenError::NoSuchAdapter { choice: choice.clone(), available }),
    }
}

/// Without wgpu's debug information, which old validation layers reject; `WGPU_VALIDATION=1` turns validation on.
fn instance() -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN;
    descriptor.flags = wgpu::InstanceFlags::empty().with_env();
    wgpu::Instance::new(descriptor)
}

fn enumerate(instance: &wgpu::Instance) -> Vec<wgpu::Adapter> {
    pollster::block_on(instance.enumerate_adapters(wgpu::Backends::VULKAN))
}

fn summaries(adapters: &[wgpu::Adapter]) -> Vec<AdapterSummary> {
    let summary = |(index, adapter): (usize, &wgpu::Adapter)| {
        let info = adapter.get_info();
        AdapterSummary { index, driver: driver(&info), kind: kind(info.device_type), name: info.name }
    };
    adapters.iter().enumerate().map(summary).collect()
}

fn driver(info: &wgpu::AdapterInfo) -> String {
    format!("{} {}", info.driver, info.driver_info).trim().to_owned()
}

fn place(choice: &AdapterChoice, available: &[AdapterSummary]) -> Option<usize> {
    match choice {
        AdapterChoice::Default => available.iter().min_by_key(|s| s.kind).map(|s| s.index),
        AdapterChoice::Index(index) => (*index < available.len()).then_some(*index),
        AdapterChoice::Name(name) => {
            let name = name.to_lowercase();
            available.iter().position(|s| s.name.to_lowercase().contains(&name))
        }
    }
}

fn kind(device_type: wgpu::DeviceType) -> AdapterKind {
    match device_type {
        wgpu::DeviceType::DiscreteGpu => AdapterKind::Discrete,
        wgpu::DeviceType::IntegratedGpu => AdapterKind::Integrated,
        wgpu::DeviceType::VirtualGpu => AdapterKind::Virtual,
        wgpu::DeviceType::Other => AdapterKind::Other,
        wgpu::DeviceType::Cpu => AdapterKind::Software,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn summary(index: usize, name: &str, kind: AdapterKind) -> AdapterSummary {
        AdapterSummary { index, name: name.to_owned(), driver: "driver 1".to_owned(), kind }
    }

    #[test]
    fn adapters_are_chosen_by_kind_place_and_name() {
        let there = [summary(0, "llvmpipe", AdapterKind::Software), summary(1, "Big One", AdapterKind::Discrete)];
        assert_eq!(place(&AdapterChoice::Default, &there), Some(1));
        assert_eq!(place(&AdapterChoice::Index(0), &there), Some(0));
        assert_eq!(place(&AdapterChoice::Index(2), &there), None);
        assert_eq!(place(&AdapterChoice::Name("big".into()), &there), Some(1));
        assert_eq!(place(&AdapterChoice::Name("small".into()), &there), None);
    }

    #[test]
    fn software_is_the_last_resort() {
        let of = |kinds: [AdapterKind; 2]| {
            let there = [summary(0, "a", kinds[0]), summary(1, "b", kinds[1])];
            place(&AdapterChoice::Default, &there)
        };
        assert_eq!(of([AdapterKind::Software, AdapterKind::Other]), Some(1));
        assert_eq!(of([AdapterKind::Other, AdapterKind::Software]), Some(0));
        assert_eq!(of([AdapterKind::Other, AdapterKind::Virtual]), Some(1));
    }

    #[test]
    fn errors_say_what_there_is() {
        let available = vec![summary(0, "llvmpipe", AdapterKind::Software)];
        let error = OpenError::NoSuchAdapter { choice: AdapterChoice::Name("x".into()), available };
        assert_eq!(
            error.to_string(),
            "no adapter with `x` in its name; the adapters are 0: llvmpipe (software, driver 1)"
        );
        assert!(OpenError::NoAdapter.to_string().contains("mesa-vulkan-drivers"));
    }
}
