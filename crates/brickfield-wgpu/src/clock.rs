//! Device time by timestamp queries.

use std::time::Instant;

use brickfield_frame::RenderError;

use crate::device::Device;

/// Timestamps around a pass.
pub(crate) struct Clock {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    read: wgpu::Buffer,
}

const N_BYTES: u64 = 16;

impl Clock {
    /// A clock, if the device has timestamps.
    pub(crate) fn new(device: &Device) -> Option<Clock> {
        if !device.has(wgpu::Features::TIMESTAMP_QUERY) {
            return None;
        }
        let buffer = |usage| {
            device.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("timestamps"),
                size: N_BYTES,
                usage,
                mapped_at_creation: false,
            })
        };
        let clock = || Clock {
            queries: device.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("timestamps"),
                ty: wgpu::QueryType::Timestamp,
                count: 2,
            }),
            resolved: buffer(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC),
            read: buffer(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST),
        };
        device.checked("making a clock", N_BYTES, clock).ok()
    }

    /// The timestamps that a compute pass writes when it begins and ends.
    pub(crate) fn writes(&self) -> wgpu::ComputePassTimestampWrites<'_> {
        wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(0),
            end_of_pass_write_index: Some(1),
        }
    }

    /// The timestamps that a render pass writes when it begins and ends.
    pub(crate) fn draw_writes(&self) -> wgpu::RenderPassTimestampWrites<'_> {
        wgpu::RenderPassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(0),
            end_of_pass_write_index: Some(1),
        }
    }

    /// Makes the timestamps readable, after the pass.
    pub(crate) fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.resolve_query_set(&self.queries, 0..2, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.read, 0, N_BYTES);
    }

    /// The pass's milliseconds.
    pub(crate) fn milliseconds(&self, device: &Device) -> Result<f64, RenderError> {
        let view = device.read(&self.read, N_BYTES)?;
        let ticks: Vec<u64> = bytemuck::pod_collect_to_vec(&view);
        drop(view);
        self.read.unmap();
        let nanoseconds = ticks[1].saturating_sub(ticks[0]) as f64 * f64::from(device.queue.get_timestamp_period());
        Ok(nanoseconds * 1e-6)
    }
}

/// Milliseconds of the host's clock.
pub(crate) fn milliseconds_since(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
