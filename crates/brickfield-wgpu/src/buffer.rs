//! Buffers that are kept from frame to frame.

use brickfield_frame::{Chunked, HeldChunks, RenderError};
use wgpu::BufferUsages;

use crate::device::Device;

/// A buffer that grows when it must.
pub(crate) struct Reused {
    what: &'static str,
    usage: BufferUsages,
    buffer: Option<wgpu::Buffer>,
    /// Bytes in use.
    n_bytes: u64,
    /// The chunks that are in it.
    held: HeldChunks,
}

/// Most bytes of chunks that are gathered on the host at a time.
const BYTES_AT_ONCE: usize = 16 << 20;

impl Reused {
    pub(crate) fn new(what: &'static str, usage: BufferUsages) -> Reused {
        Reused { what, usage, buffer: None, n_bytes: 0, held: HeldChunks::default() }
    }

    /// Makes room for `n_bytes`; a buffer that must grow loses its content.
    pub(crate) fn reserve(&mut self, device: &Device, n_bytes: u64) -> Result<&wgpu::Buffer, RenderError> {
        self.check(device, n_bytes)?;
        self.n_bytes = n_bytes.max(16);
        let kept = self.buffer.take().filter(|b| b.size() >= self.n_bytes);
        let buffer = match kept {
            Some(buffer) => buffer,
            None => {
                self.held.forget();
                self.create(device, self.n_bytes)?
            }
        };
        Ok(self.buffer.insert(buffer))
    }

    /// Writes `bytes`, a multiple of four; how many they are.
    pub(crate) fn write(&mut self, device: &Device, bytes: &[u8]) -> Result<u64, RenderError> {
        let (what, n_bytes) = (self.what, bytes.len() as u64);
        let buffer = self.reserve(device, n_bytes)?;
        device.checked(what, n_bytes, || device.queue.write_buffer(buffer, 0, bytes))?;
        Ok(n_bytes)
    }

    /// Brings the chunks that are not there, each a multiple of four bytes; the bytes that were brought.
    pub(crate) fn bring(&mut self, device: &Device, content: &dyn Chunked) -> Result<u64, RenderError> {
        if self.held.has_all(content) {
            return Ok(0);
        }
        self.make_room(device, content.n_bytes())?;
        let written = self.write_missing(device, content);
        // A list that was not written whole may have lost chunks that it had.
        if written.is_ok() {
            self.held.hold(content)
        } else {
            self.held.forget()
        }
        written
    }

    fn write_missing(&self, device: &Device, content: &dyn Chunked) -> Result<u64, RenderError> {
        let (what, Some(buffer)) = (self.what, &self.buffer) else { return Ok(0) };
        let (mut n_bytes, chunk_bytes) = (0, content.chunk_bytes());
        for run in self.held.missing(content) {
            for first in run.clone().step_by((BYTES_AT_ONCE / chunk_bytes).max(1)) {
                let last = run.end.min(first + (BYTES_AT_ONCE / chunk_bytes).max(1));
                let chunks = (first..last).filter_map(|i| content.chunk(i));
                let bytes: Vec<u8> = chunks.flat_map(|(_, bytes)| bytes).copied().collect();
                let offset = (first * chunk_bytes) as u64;
                device.checked(what, bytes.len() as u64, || device.queue.write_buffer(buffer, offset, &bytes))?;
                n_bytes += bytes.len() as u64;
            }
        }
        Ok(n_bytes)
    }

    /// Makes room for `n_bytes` in all, and keeps the bytes that are there; a buffer that must grow gets a quarter more than it had.
    fn make_room(&mut self, device: &Device, n_bytes: u64) -> Result<(), RenderError> {
        let Some(old) = self.buffer.as_ref().filter(|b| b.size() < n_bytes) else {
            return self.reserve(device, n_bytes).map(drop);
        };
        // Until the larger buffer is filled the old one stays: a list that is refused leaves everything as it was.
        self.check(device, n_bytes)?;
        let size = n_bytes.max((old.size() + old.size() / 4).min(self.limit(device)));
        let larger = self.create(device, size)?;
        device.checked(self.what, size, || {
            let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.copy_buffer_to_buffer(old, 0, &larger, 0, old.size());
            device.queue.submit([encoder.finish()]);
        })?;
        (self.n_bytes, self.buffer) = (n_bytes, Some(larger));
        Ok(())
    }

    fn create(&self, device: &Device, n_bytes: u64) -> Result<wgpu::Buffer, RenderError> {
        device.checked(self.what, n_bytes, || {
            device.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(self.what),
                size: n_bytes.next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT),
                usage: self.usage,
                mapped_at_creation: false,
            })
        })
    }

    fn check(&self, device: &Device, n_bytes: u64) -> Result<(), RenderError> {
        let limit = self.limit(device);
        match n_bytes > limit {
            true => Err(RenderError::BufferTooLarge { what: self.what, n_bytes, limit }),
            false => Ok(()),
        }
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
