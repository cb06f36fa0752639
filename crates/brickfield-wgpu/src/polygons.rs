//! Polygons, rasterised and blended over each other.

use std::time::Instant;

use brickfield_frame::{ContentId, ProxyGeometry, RenderError};
use wgpu::BufferUsages;

use crate::buffer::Reused;
use crate::clock::{Clock, milliseconds_since};
use crate::device::Device;
use crate::pipeline::{Pipeline, Program};
use crate::resources::Resources;

/// The polygons on the device.
pub(crate) struct Polygons {
    held: Option<ContentId>,
    corners: Reused,
    indices: Reused,
}

/// What polygons are drawn by and into.
pub(crate) struct Drawing<'a> {
    pub(crate) device: &'a Device,
    pub(crate) pipeline: &'a Pipeline,
    pub(crate) resources: &'a Resources,
    pub(crate) clock: Option<&'a Clock>,
}

impl Polygons {
    pub(crate) fn new() -> Polygons {
        Polygons {
            held: None,
            corners: Reused::new("the polygons' corners", BufferUsages::VERTEX | BufferUsages::COPY_DST),
            indices: Reused::new("the polygons' triangles", BufferUsages::INDEX | BufferUsages::COPY_DST),
        }
    }

    /// Brings polygons to the device, if they are not there; the bytes that were brought.
    pub(crate) fn bring(&mut self, device: &Device, proxy: &ProxyGeometry) -> Result<u64, RenderError> {
        if self.held == Some(proxy.id()) {
            return Ok(0);
        }
        self.held = None;
        let corners = self.corners.write(device, bytemuck::cast_slice(proxy.corners()))?;
        let indices = self.indices.write(device, bytemuck::cast_slice(proxy.indices()))?;
        self.held = Some(proxy.id());
        Ok(corners + indices)
    }

    /// Draws them into the picture, which may be cleared before, run by run; device and wall time in milliseconds.
    pub(crate) fn draw(
        &self,
        drawing: &Drawing<'_>,
        proxy: &ProxyGeometry,
        clears: bool,
    ) -> Result<(Option<f64>, f64), RenderError> {
        let (mut device_ms, started) = (drawing.clock.map(|_| 0.0), Instant::now());
        let nothing = 0..0;
        // Without a batch there is still a picture to be cleared.
        let batches = if proxy.batches().is_empty() { std::slice::from_ref(&nothing) } else { proxy.batches() };
        for (i, batch) in batches.iter().enumerate() {
            let load =
                if i == 0 && clears { wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT) } else { wgpu::LoadOp::Load };
            self.draw_batch(drawing, batch.clone(), load)?;
            drawing.device.wait("rendering")?;
            let batch_ms = drawing.clock.map(|c| c.milliseconds(drawing.device)).transpose()?;
            device_ms = device_ms.zip(batch_ms).map(|(sum, ms)| sum + ms);
        }
        Ok((device_ms, milliseconds_since(started)))
    }

    fn draw_batch(
        &self,
        drawing: &Drawing<'_>,
        batch: std::ops::Range<u32>,
        load: wgpu::LoadOp<wgpu::Color>,
    ) -> Result<(), RenderError> {
        let Drawing { device, pipeline, resources, clock } = *drawing;
        let bound = resources.bind(device, pipeline)?;
        let (corners, indices) = (self.corners.buffer(), self.indices.buffer());
        let (Program::Polygons(program), Some(picture), Some(corners), Some(indices)) =
            (&pipeline.program, &resources.picture, corners, indices)
        else {
            return Err(RenderError::Shader { message: "polygons are drawn before they are brought".to_owned() });
        };
        device.checked("drawing polygons", 0, || {
            let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("polygons"),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &picture.view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
                })],
                depth_stencil_attachment: None,
                timestamp_writes: clock.map(Clock::draw_writes),
                occlusion_query_set: None,
                multiview_mask: None,
            });
            pass.set_pipeline(program);
            pass.set_bind_group(0, &bound, &[]);
            pass.set_vertex_buffer(0, corners.slice(..));
            pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(batch, 0, 0..1);
            drop(pass);
            if let Some(clock) = clock {
                clock.resolve(&mut encoder);
            }
            device.queue.submit([encoder.finish()]);
        })
    }
}
