//! Buffers, on the device and on the host.
#![expect(unsafe_code, reason = "Vulkan's functions are foreign, and host buffers are mapped memory")]

use std::ptr::NonNull;
use std::sync::Arc;

use ash::vk;
use brickfield_frame::RenderError;

use super::memory::{Allocation, refused};
use super::{Device, Residence};
use crate::error::OfCall;

/// A buffer with its memory.
pub(crate) struct Buffer {
    pub(super) raw: vk::Buffer,
    n_bytes: u64,
    device: Arc<Device>,
    /// Dropped after the buffer is destroyed.
    memory: Option<Allocation>,
}

impl Buffer {
    /// A buffer on the device that shaders read or write, and copies fill or read.
    pub(crate) fn on_device(
        device: &Arc<Device>,
        what: &'static str,
        n_bytes: u64,
        shader_use: vk::BufferUsageFlags,
    ) -> Result<Buffer, RenderError> {
        let copies = vk::BufferUsageFlags::TRANSFER_DST | vk::BufferUsageFlags::TRANSFER_SRC;
        Buffer::new(device, what, n_bytes, shader_use | copies, Residence::Device)
    }

    fn new(
        device: &Arc<Device>,
        what: &'static str,
        n_bytes: u64,
        usage: vk::BufferUsageFlags,
        residence: Residence,
    ) -> Result<Buffer, RenderError> {
        let info = vk::BufferCreateInfo::default().size(n_bytes).usage(usage);
        // SAFETY: a plain description; the size is above 0, as callers ask for at least one element.
        let raw = unsafe { device.raw().create_buffer(&info, None) }
            .map_err(|code| refused("vkCreateBuffer", code, what, n_bytes, None))?;
        let mut buffer = Buffer { raw, n_bytes, device: device.clone(), memory: None };
        // SAFETY: the buffer is new.
        let required = unsafe { device.raw().get_buffer_memory_requirements(raw) };
        let memory = buffer.memory.insert(Allocation::new(device, what, required, residence)?);
        // SAFETY: the memory is as required, new, and bound once; `buffer` holds it.
        unsafe { device.raw().bind_buffer_memory(raw, memory.raw, 0) }.of("vkBindBufferMemory")?;
        Ok(buffer)
    }

    /// Its size.
    pub(crate) fn n_bytes(&self) -> u64 {
        self.n_bytes
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        // SAFETY: the device is idle, and nothing else names the buffer.
        unsafe { self.device.raw().destroy_buffer(self.raw, None) };
    }
}

/// A buffer in the host's reach, for copies to and from the device.
pub(crate) struct HostBuffer {
    buffer: Buffer,
    mapped: NonNull<u8>,
}

// SAFETY: the mapping belongs to the buffer alone, and is reached only through borrows of it.
unsafe impl Send for HostBuffer {}

impl HostBuffer {
    /// A buffer that the host fills (`Residence::Upload`) or reads (`Residence::ReadBack`).
    pub(crate) fn new(device: &Arc<Device>, n_bytes: u64, residence: Residence) -> Result<HostBuffer, RenderError> {
        let usage = vk::BufferUsageFlags::TRANSFER_SRC | vk::BufferUsageFlags::TRANSFER_DST;
        let buffer = Buffer::new(device, "a staging buffer", n_bytes, usage, residence)?;
        let memory = buffer.memory.as_ref().map_or(vk::DeviceMemory::null(), |m| m.raw);
        // SAFETY: the memory is host-visible by its residence, bound, and mapped once; freeing it unmaps it.
        let mapped = unsafe { device.raw().map_memory(memory, 0, vk::WHOLE_SIZE, vk::MemoryMapFlags::empty()) };
        let mapped = NonNull::new(mapped.of("vkMapMemory")?.cast::<u8>())
            .ok_or(RenderError::Unsupported { what: "map memory for the host" })?;
        Ok(HostBuffer { buffer, mapped })
    }

    /// The buffer, to be copied to or from.
    pub(crate) fn buffer(&self) -> &Buffer {
        &self.buffer
    }

    /// Writes bytes at an offset; work that is submitted afterwards sees them.
    pub(crate) fn write(&mut self, offset: usize, bytes: &[u8]) {
        assert!(offset + bytes.len() <= self.buffer.n_bytes as usize, "a write past the end of a staging buffer");
        // SAFETY: within the mapping (asserted), which nobody else touches: `self` is borrowed, the device is idle.
        unsafe { self.mapped.as_ptr().add(offset).copy_from_nonoverlapping(bytes.as_ptr(), bytes.len()) };
    }

    /// The first `n_bytes` bytes, as the device left them.
    pub(crate) fn read(&self, n_bytes: usize) -> &[u8] {
        assert!(n_bytes <= self.buffer.n_bytes as usize, "a read past the end of a staging buffer");
        // SAFETY: within the mapping (asserted) of initialised memory that nobody writes while `self` is borrowed.
        unsafe { std::slice::from_raw_parts(self.mapped.as_ptr(), n_bytes) }
    }
}
