//! The logical device.
#![expect(unsafe_code, reason = "Vulkan's functions are foreign")]

use std::ffi::c_char;
use std::sync::Arc;

use ash::{khr, vk};

use super::adapter::{QueueFamily, queue_family};
use super::{Instance, PhysicalDevice};
use crate::ConnectError;
use crate::error::{FailedCall, OfCall};
use brickfield_frame::RenderError;

/// A device with one queue; everything made from it holds it.
pub(crate) struct Device {
    raw: ash::Device,
    physical: PhysicalDevice,
    pub(super) family: QueueFamily,
    /// What the driver has compiled; shared by all threads.
    pub(super) pipelines: vk::PipelineCache,
    /// Dropped after the device.
    instance: Instance,
}

/// What must be equal for a compiled pipeline to be of use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PipelineIdentity {
    pub(crate) vendor: u32,
    pub(crate) device: u32,
    /// The driver's version.
    pub(crate) driver: u32,
    pub(crate) uuid: [u8; vk::UUID_SIZE],
}

const CREATE_CACHE: &str = "vkCreatePipelineCache";

impl PipelineIdentity {
    pub(crate) const BYTES: usize = 12 + vk::UUID_SIZE;

    pub(crate) fn to_bytes(self) -> [u8; PipelineIdentity::BYTES] {
        let mut bytes = [0; PipelineIdentity::BYTES];
        for (to, number) in bytes.chunks_exact_mut(4).zip([self.vendor, self.device, self.driver]) {
            to.copy_from_slice(&number.to_le_bytes());
        }
        bytes[12..].copy_from_slice(&self.uuid);
        bytes
    }
}

impl Device {
    /// Opens a physical device of the instance.
    pub(crate) fn new(instance: Instance, physical: PhysicalDevice) -> Result<Arc<Device>, ConnectError> {
        let family = queue_family(&instance, &physical)?;
        let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(family.index).queue_priorities(&[1.0])];
        let extensions = extensions(&instance, &physical)?;
        let info = vk::DeviceCreateInfo::default().queue_create_infos(&queues).enabled_extension_names(&extensions);
        // SAFETY: the physical device is one of this instance; the structures live until the call returns.
        let raw = unsafe { instance.raw().create_device(physical.raw, &info, None) }.of("vkCreateDevice")?;
        let mut device = Device { raw, physical, family, pipelines: vk::PipelineCache::null(), instance };
        device.pipelines = device.pipeline_cache(&[]).map_err(|code| FailedCall { call: CREATE_CACHE, code })?;
        Ok(Arc::new(device))
    }

    /// Whose compiled pipelines the device can use.
    pub(crate) fn identity(&self) -> PipelineIdentity {
        self.physical.identity
    }

    /// Adds compiled pipelines of this device and driver, of another process.
    pub(crate) fn add_pipelines(&self, data: &[u8]) -> Result<(), RenderError> {
        let added = self.pipeline_cache(data).of(CREATE_CACHE)?;
        // SAFETY: both caches are the device's; the one that is added is used by nobody else, and the driver locks the other.
        let merged = unsafe { self.raw.merge_pipeline_caches(self.pipelines, &[added]) };
        // SAFETY: nothing names it any more.
        unsafe { self.raw.destroy_pipeline_cache(added, None) };
        Ok(merged.of("vkMergePipelineCaches")?)
    }

    /// The pipelines that were compiled so far, for another process.
    pub(crate) fn pipelines(&self) -> Result<Vec<u8>, RenderError> {
        // SAFETY: the cache is the device's; the driver locks it.
        Ok(unsafe { self.raw.get_pipeline_cache_data(self.pipelines) }.of("vkGetPipelineCacheData")?)
    }

    fn pipeline_cache(&self, data: &[u8]) -> Result<vk::PipelineCache, vk::Result> {
        let info = vk::PipelineCacheCreateInfo::default().initial_data(data);
        // SAFETY: the data live until the call returns, and are empty or what this driver wrote for this device.
        unsafe { self.raw.create_pipeline_cache(&info, None) }
    }

    pub(super) fn raw(&self) -> &ash::Device {
        &self.raw
    }

    /// The device's kind and limits.
    pub(crate) fn physical(&self) -> &PhysicalDevice {
        &self.physical
    }

    /// The instance, with its validation log.
    pub(crate) fn instance(&self) -> &Instance {
        &self.instance
    }

    /// Whether the queue rasterises.
    pub(crate) fn draws(&self) -> bool {
        self.family.draws
    }

    /// The features of optimally tiled images of a format.
    pub(crate) fn format_features(&self, format: vk::Format) -> vk::FormatFeatureFlags {
        // SAFETY: the physical device is one of this instance.
        let properties =
            unsafe { self.instance.raw().get_physical_device_format_properties(self.physical.raw, format) };
        properties.optimal_tiling_features
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: every other object that was made from the device holds it, so none is left; a null handle is allowed.
        unsafe {
            self.raw.destroy_pipeline_cache(self.pipelines, None);
            self.raw.destroy_device(None);
        }
    }
}

/// An implementation over another interface says so by this extension, which must then be enabled.
fn extensions(instance: &Instance, physical: &PhysicalDevice) -> Result<Vec<*const c_char>, FailedCall> {
    let subset = khr::portability_subset::NAME;
    // SAFETY: the physical device is one of this instance.
    let there = unsafe { instance.raw().enumerate_device_extension_properties(physical.raw) }
        .of("vkEnumerateDeviceExtensionProperties")?;
    let is_subset = there.iter().any(|e| e.extension_name_as_c_str() == Ok(subset));
    Ok(is_subset.then_some(subset.as_ptr()).into_iter().collect())
}
