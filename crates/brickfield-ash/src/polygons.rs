//! Polygons, rasterised and blended over each other.

use std::sync::Arc;
use std::time::Instant;

use ash::vk;
use brickfield_core::glam::UVec2;
use brickfield_frame::{ContentId, ProxyGeometry, RenderError};

use crate::march::{RenderTime, milliseconds_since};
use crate::resources::Reused;
use crate::staging::{Staging, Write};
use crate::vulkan::{BoundPipeline, Canvas, CanvasKind, Device, Queue, Triangles, Use};

/// The polygons on the device.
pub(crate) struct Polygons {
    held: Option<ContentId>,
    corners: Reused,
    indices: Reused,
}

impl Polygons {
    /// None yet.
    pub(crate) fn new() -> Polygons {
        Polygons {
            held: None,
            corners: Reused::new("the polygons' corners", vk::BufferUsageFlags::VERTEX_BUFFER),
            indices: Reused::new("the polygons' triangles", vk::BufferUsageFlags::INDEX_BUFFER),
        }
    }

    /// Brings polygons to the device, if they are not there; the bytes that were brought.
    pub(crate) fn bring(
        &mut self,
        device: &Arc<Device>,
        queue: &mut Queue,
        staging: &mut Staging,
        proxy: &ProxyGeometry,
    ) -> Result<u64, RenderError> {
        if self.held == Some(proxy.id()) {
            return Ok(0);
        }
        self.held = None;
        let n_corners = proxy.corners().len();
        if proxy.indices().iter().any(|i| *i as usize >= n_corners) {
            return Err(RenderError::Unsupported { what: "draw triangles without corners" });
        }
        let (corners, indices) = (bytemuck::cast_slice(proxy.corners()), bytemuck::cast_slice(proxy.indices()));
        let writes = [
            Write { target: self.corners.reserve(device, corners.len())?, offset: 0, bytes: corners },
            Write { target: self.indices.reserve(device, indices.len())?, offset: 0, bytes: indices },
        ];
        staging.fill(queue, &writes)?;
        self.held = Some(proxy.id());
        Ok((corners.len() + indices.len()) as u64)
    }

    /// Draws the polygons into a canvas, which may be cleared before, run by run.
    pub(crate) fn draw(
        &self,
        queue: &mut Queue,
        bound: &BoundPipeline<'_>,
        canvas: &Canvas,
        proxy: &ProxyGeometry,
        clears: bool,
    ) -> Result<RenderTime, RenderError> {
        let started = Instant::now();
        let mut device_ms = queue.run_timed("clearing the picture", |recorder| {
            if clears {
                recorder.image_barrier(&canvas.image, Use::Nothing, Use::CopyTarget);
                recorder.clear(&canvas.image);
                recorder.image_barrier(&canvas.image, Use::CopyTarget, Use::Canvas);
            }
            // Resources were brought to the device for compute shaders.
            recorder.barrier(Use::ShaderRead, Use::DrawRead);
        })?;
        let (Some(corners), Some(indices)) = (self.corners.buffer(), self.indices.buffer()) else {
            return Err(RenderError::Shader { message: "polygons are drawn before they are uploaded".to_owned() });
        };
        for range in proxy.batches() {
            let triangles = Triangles { corners, indices, range: range.clone() };
            let batch_ms = queue.run_timed("drawing polygons", |recorder| {
                recorder.image_barrier(&canvas.image, Use::Canvas, Use::Canvas);
                recorder.draw(bound, canvas, triangles);
            })?;
            device_ms = device_ms.zip(batch_ms).map(|(sum, ms)| sum + ms);
        }
        Ok(RenderTime { device_ms, wall_ms: milliseconds_since(started) })
    }
}

/// The canvas to draw into, of exactly this kind and size.
pub(crate) fn reserve_canvas<'a>(
    slot: &'a mut Option<Canvas>,
    device: &Arc<Device>,
    kind: CanvasKind,
    size: UVec2,
) -> Result<&'a Canvas, RenderError> {
    slot.take_if(|canvas| !canvas.fits(kind, size));
    match slot {
        Some(canvas) => Ok(canvas),
        none => Ok(none.insert(Canvas::new(device, kind, size)?)),
    }
}
