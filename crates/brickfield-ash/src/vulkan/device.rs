//! The logical device.
#![expect(unsafe_code, reason = "Vulkan's functions are foreign")]

use std::ffi::c_char;
use std::sync::Arc;

use ash::{khr, vk};

use super::adapter::{QueueFamily, queue_family};
use super::{Instance, PhysicalDevice};
use crate::ConnectError;
use crate::error::{FailedCall, OfCall};

/// A device with one queue; everything made from it holds it.
pub(crate) struct Device {
    raw: ash::Device,
    physical: PhysicalDevice,
    pub(super) family: QueueFamily,
    /// Dropped after the device.
    instance: Instance,
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
        Ok(Arc::new(Device { raw, physical, family, instance }))
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
        // SAFETY: every object that was made from the device holds it, so none is left.
        unsafe { self.raw.destroy_device(None) };
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
