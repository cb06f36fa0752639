//! Physical devices: their kinds and limits.
#![expect(unsafe_code, reason = "Vulkan's functions are foreign")]

use std::borrow::Cow;
use std::ffi::CStr;

use ash::vk;
use brickfield_frame::Capabilities;

use super::Instance;
use super::device::PipelineIdentity;
use super::instance::version_text;
use crate::error::OfCall;
use crate::{AdapterKind, AdapterSummary, ConnectError};

/// A physical device of an instance.
#[derive(Clone)]
pub(crate) struct PhysicalDevice {
    pub(super) raw: vk::PhysicalDevice,
    pub(super) memory: vk::PhysicalDeviceMemoryProperties,
    pub(crate) summary: AdapterSummary,
    pub(crate) limits: vk::PhysicalDeviceLimits,
    pub(super) identity: PipelineIdentity,
    /// Most bytes of one allocation.
    pub(crate) max_allocation: u64,
}

impl PhysicalDevice {
    /// The limits that plans are prepared for.
    pub(crate) fn capabilities(&self) -> Capabilities {
        let mut capabilities = Capabilities::UNLIMITED;
        capabilities.max_texture_3d = self.limits.max_image_dimension3_d;
        capabilities.max_layers = self.limits.max_image_array_layers;
        capabilities.max_image = self.limits.max_image_dimension2_d;
        capabilities.max_buffer_bytes = u64::from(self.limits.max_storage_buffer_range);
        capabilities.max_storage_buffers = self.limits.max_per_stage_descriptor_storage_buffers;
        capabilities.sub_texel_bits = self.limits.sub_texel_precision_bits;
        capabilities
    }
}

/// A family of queues that computes.
#[derive(Clone, Copy)]
pub(super) struct QueueFamily {
    pub(super) index: u32,
    /// Valid bits of a timestamp; 0 if the family has none.
    pub(super) timestamp_bits: u32,
    /// Whether it rasterises.
    pub(super) draws: bool,
}

/// The devices that speak Vulkan 1.1 or later, in the loader's order.
pub(crate) fn physical_devices(instance: &Instance) -> Result<Vec<PhysicalDevice>, ConnectError> {
    // SAFETY: the instance is alive.
    let raw = unsafe { instance.raw().enumerate_physical_devices() }.of("vkEnumeratePhysicalDevices")?;
    let described = raw.into_iter().filter_map(|raw| describe(instance, raw));
    Ok(described
        .enumerate()
        .map(|(index, d)| PhysicalDevice { summary: AdapterSummary { index, ..d.summary }, ..d })
        .collect())
}

fn describe(instance: &Instance, raw: vk::PhysicalDevice) -> Option<PhysicalDevice> {
    // SAFETY: the device is one of this instance.
    let properties = unsafe { instance.raw().get_physical_device_properties(raw) };
    if properties.api_version < vk::API_VERSION_1_1 {
        return None;
    }
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut maintenance = vk::PhysicalDeviceMaintenance3Properties::default();
    let mut wanted = vk::PhysicalDeviceProperties2::default().push_next(&mut maintenance);
    if properties.api_version >= vk::API_VERSION_1_2 {
        wanted = wanted.push_next(&mut driver);
    }
    // SAFETY: the device is one of this instance and knows the chained structures, which are in its version.
    let memory = unsafe {
        instance.raw().get_physical_device_properties2(raw, &mut wanted);
        instance.raw().get_physical_device_memory_properties(raw)
    };
    let summary = AdapterSummary {
        index: 0,
        name: text(properties.device_name_as_c_str().ok()).into_owned(),
        driver: driver_text(&driver, properties.driver_version),
        kind: kind(properties.device_type),
    };
    let max_allocation = maintenance.max_memory_allocation_size;
    let identity = PipelineIdentity {
        vendor: properties.vendor_id,
        device: properties.device_id,
        driver: properties.driver_version,
        uuid: properties.pipeline_cache_uuid,
    };
    Some(PhysicalDevice { raw, memory, summary, limits: properties.limits, identity, max_allocation })
}

fn driver_text(driver: &vk::PhysicalDeviceDriverProperties<'_>, version: u32) -> String {
    let [name, info] = [driver.driver_name_as_c_str(), driver.driver_info_as_c_str()].map(|t| text(t.ok()));
    match (name.is_empty(), info.is_empty()) {
        (true, _) => format!("driver {}", version_text(version)),
        (false, true) => format!("{name} {}", version_text(version)),
        (false, false) => format!("{name} {info}"),
    }
}

fn text(c: Option<&CStr>) -> Cow<'_, str> {
    c.map(CStr::to_string_lossy).unwrap_or_default()
}

fn kind(device_type: vk::PhysicalDeviceType) -> AdapterKind {
    match device_type {
        vk::PhysicalDeviceType::DISCRETE_GPU => AdapterKind::Discrete,
        vk::PhysicalDeviceType::INTEGRATED_GPU => AdapterKind::Integrated,
        vk::PhysicalDeviceType::VIRTUAL_GPU => AdapterKind::Virtual,
        vk::PhysicalDeviceType::CPU => AdapterKind::Software,
        _ => AdapterKind::Other,
    }
}

/// The family to compute on: one that also draws, if there is one.
pub(super) fn queue_family(instance: &Instance, device: &PhysicalDevice) -> Result<QueueFamily, ConnectError> {
    // SAFETY: the device is one of this instance.
    let families = unsafe { instance.raw().get_physical_device_queue_family_properties(device.raw) };
    let has = |flags| families.iter().position(|f| f.queue_flags.contains(flags));
    let index = has(vk::QueueFlags::COMPUTE | vk::QueueFlags::GRAPHICS)
        .or_else(|| has(vk::QueueFlags::COMPUTE))
        .ok_or_else(|| ConnectError::NoComputeQueue { adapter: device.summary.to_string() })?;
    let family = &families[index];
    Ok(QueueFamily {
        index: index as u32,
        timestamp_bits: family.timestamp_valid_bits,
        draws: family.queue_flags.contains(vk::QueueFlags::GRAPHICS),
    })
}
