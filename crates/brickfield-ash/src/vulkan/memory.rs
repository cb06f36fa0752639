//! Device memory: one allocation for each buffer or image, of which there are a dozen.
#![expect(unsafe_code, reason = "Vulkan's functions are foreign")]

use std::sync::Arc;

use ash::vk;
use ash::vk::MemoryPropertyFlags as Flags;
use brickfield_frame::RenderError;

use super::Device;
use crate::error::FailedCall;

/// Where memory lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Residence {
    /// Close to the device.
    Device,
    /// The host writes it, the device copies from it.
    Upload,
    /// The device writes it, the host reads it.
    ReadBack,
}

/// An allocation of device memory.
pub(super) struct Allocation {
    pub(super) raw: vk::DeviceMemory,
    device: Arc<Device>,
}

impl Residence {
    /// The properties of memory types, from the best; Vulkan promises one of the last kind for every buffer.
    const fn preferences(self) -> [Flags; 2] {
        let coherent = Flags::from_raw(Flags::HOST_VISIBLE.as_raw() | Flags::HOST_COHERENT.as_raw());
        match self {
            Residence::Device => [Flags::DEVICE_LOCAL, Flags::empty()],
            Residence::Upload => [coherent; 2],
            Residence::ReadBack => [Flags::from_raw(coherent.as_raw() | Flags::HOST_CACHED.as_raw()), coherent],
        }
    }
}

impl Allocation {
    /// Memory for `what`, as a buffer or image requires it.
    pub(super) fn new(
        device: &Arc<Device>,
        what: &'static str,
        required: vk::MemoryRequirements,
        residence: Residence,
    ) -> Result<Allocation, RenderError> {
        let physical = device.physical();
        let memory_type = memory_type(&physical.memory, required.memory_type_bits, residence)
            .ok_or(RenderError::Unsupported { what: "offer the memory that a buffer or image needs" })?;
        let heap = physical.memory.memory_heaps[physical.memory.memory_types[memory_type].heap_index as usize].size;
        let n_bytes = required.size;
        if n_bytes > heap {
            return Err(RenderError::OutOfMemory { what, n_bytes, available: Some(heap) });
        }
        if n_bytes > physical.max_allocation {
            return Err(RenderError::BufferTooLarge { what, n_bytes, limit: physical.max_allocation });
        }
        let info = vk::MemoryAllocateInfo::default().allocation_size(n_bytes).memory_type_index(memory_type as u32);
        // SAFETY: the type is one of the device's, the size within its heap and the device's limit.
        let raw = unsafe { device.raw().allocate_memory(&info, None) }
            .map_err(|code| refused("vkAllocateMemory", code, what, n_bytes, Some(heap)))?;
        Ok(Allocation { raw, device: device.clone() })
    }
}

impl Drop for Allocation {
    fn drop(&mut self) {
        // SAFETY: buffers and images are destroyed before their memory (field order), and the device is idle.
        unsafe { self.device.raw().free_memory(self.raw, None) };
    }
}

/// The error of a call that was to provide `n_bytes` for `what`.
pub(super) fn refused(
    call: &'static str,
    code: vk::Result,
    what: &'static str,
    n_bytes: u64,
    available: Option<u64>,
) -> RenderError {
    match code {
        vk::Result::ERROR_OUT_OF_DEVICE_MEMORY => RenderError::OutOfMemory { what, n_bytes, available },
        vk::Result::ERROR_OUT_OF_HOST_MEMORY => RenderError::OutOfMemory { what, n_bytes, available: None },
        code => FailedCall { call, code }.into(),
    }
}

fn memory_type(memory: &vk::PhysicalDeviceMemoryProperties, allowed: u32, residence: Residence) -> Option<usize> {
    let types = memory.memory_types_as_slice();
    let find =
        |wanted: Flags| (0..types.len()).find(|&i| allowed >> i & 1 == 1 && types[i].property_flags.contains(wanted));
    residence.preferences().into_iter().find_map(find)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn memory(types: &[Flags]) -> vk::PhysicalDeviceMemoryProperties {
        let mut memory =
            vk::PhysicalDeviceMemoryProperties { memory_type_count: types.len() as u32, ..Default::default() };
        for (slot, flags) in memory.memory_types.iter_mut().zip(types) {
            slot.property_flags = *flags;
        }
        memory
    }

    #[test]
    fn a_card_with_its_own_memory_and_one_that_shares_it_are_both_served() {
        let coherent = Flags::HOST_VISIBLE | Flags::HOST_COHERENT;
        let card = memory(&[Flags::empty(), Flags::DEVICE_LOCAL, coherent, coherent | Flags::HOST_CACHED]);
        let on_card = |residence| memory_type(&card, 0b1111, residence);
        assert_eq!(on_card(Residence::Device), Some(1));
        assert_eq!(on_card(Residence::Upload), Some(2));
        assert_eq!(on_card(Residence::ReadBack), Some(3));
        assert_eq!(memory_type(&card, 0b0100, Residence::ReadBack), Some(2));
        assert_eq!(memory_type(&card, 0b1001, Residence::Device), Some(0));

        let shared = memory(&[coherent | Flags::DEVICE_LOCAL]);
        for residence in [Residence::Device, Residence::Upload, Residence::ReadBack] {
            assert_eq!(memory_type(&shared, 1, residence), Some(0));
        }
    }
}
