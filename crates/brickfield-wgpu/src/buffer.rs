//! Buffers that are kept from frame to frame.

use brickfield_frame::RenderError;
use wgpu::BufferUsages;

use crate::device::Device;

/// A buffer that grows when it must.
pub(crate) struct Reused {
    what: &'static str,
    usage: BufferUsages,
    buffer: Option<wgpu::Buffer>,
    /// Bytes in use.
    n_bytes: u64,
}

impl Reused {
    pub(crate) const fn new(what: &'static str, usage: BufferUsages) -> Reused {
        Reused { what, usage, buffer: None, n_bytes: 0 }
    }

    /// Makes room for `n_bytes`.
    pub(crate) fn reserve(&mut self, device: &Device, n_bytes: u64) -> Result<&wgpu::Buffer, RenderError> {
        let limit = self.limit(device);
        if n_bytes > limit {
            return Err(RenderError::BufferTooLarge { what: self.what, n_bytes, limit });
        }
        self.n_bytes = n_bytes.max(16);
        let kept = self.buffer.take().filter(|b| b.size() >= self.n_bytes);
        let buffer = match kept {
            Some(buffer) => buffer,
            None => device.checked(self.what, n_bytes, || {
                device.device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some(self.what),
                    size: self.n_bytes.next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT),
                    usage: self.usage,
                    mapped_at_creation: false,
                })
            })?,
        };
        Ok(self.buffer.insert(buffer))
    }

    /// Writes `bytes`, a multiple of four.
    pub(crate) fn write(&mut self, device: &Device, bytes: &[u8]) -> Result<(), RenderError> {
        let what = self.what;
        let buffer = self.reserve(device, bytes.len() as u64)?;
        device.checked(what, bytes.len() as u64, || device.queue.write_buffer(buffer, 0, bytes))
    }

    /// The bytes in use, to be bound; `None` before the first write.
    pub(crate) fn binding(&self) -> Option<wgpu::BindingResource<'_>> {
        let buffer = self.buffer.as_ref()?;
        let size = std::num::NonZeroU64::new(self.n_bytes);
        Some(wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset: 0, size }))
    }

    /// The buffer, if there is one.
    pub(crate) fn buffer(&self) -> Option<&wgpu::Buffer> {
        self.buffer.as_ref()
    }

    fn limit(&self, device: &Device) -> u64 {
        let limits = device.device.limits();
        if self.usage.contains(BufferUsages::STORAGE) {
            device.description.capabilities.max_buffer_bytes
        } else {
            limits.max_buffer_size
        }
    }
}
