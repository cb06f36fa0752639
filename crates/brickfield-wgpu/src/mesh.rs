//! Meshes, rasterised with a depth buffer.

use std::time::Instant;

use brickfield_frame::{MeshBackend, MeshFrame, MeshPlan, RenderError, Resource, Timing, check_memory};
use brickfield_shaders::PipelineKey;

use crate::WgpuBackend;
use crate::clock::{Clock, milliseconds_since};
use crate::picture::Maker;
use crate::pipeline::Program;
use crate::resources::missing;

impl MeshBackend for WgpuBackend {
    fn render_mesh(&mut self, plan: &MeshPlan) -> Result<MeshFrame, RenderError> {
        self.check_size(plan.size())?;
        check_memory(plan.size())?;
        if plan.shows_nothing() {
            return Ok(MeshFrame::of_nothing(plan.size()));
        }
        let started = Instant::now();
        let key = PipelineKey::mesh(plan);
        self.pipelines.of(key)?;
        let uploaded_bytes = self.resources.bring_contents(&self.device, &|r| plan.content(r), &self.pipelines[key])?;
        self.resources.resize(&self.device, plan.size(), Maker::Mesh)?;
        self.device.queue.submit([]);
        self.device.wait("uploading")?;
        let upload_ms = milliseconds_since(started);
        let started = Instant::now();
        self.draw_mesh(plan, key)?;
        self.device.wait("rendering")?;
        let wall_ms = milliseconds_since(started);
        let device_ms = self.clock.as_ref().map(|clock| clock.milliseconds(&self.device)).transpose()?;
        let started = Instant::now();
        let picture = self.resources.picture.as_ref().ok_or_else(|| missing(Resource::Picture))?;
        let pixels = picture.read(&self.device, &mut self.staging)?;
        let timing = Timing { upload_ms, device_ms, wall_ms, read_back_ms: milliseconds_since(started) };
        Ok(MeshFrame { pixels, timing, uploaded_bytes })
    }
}

impl WgpuBackend {
    fn draw_mesh(&self, plan: &MeshPlan, key: PipelineKey) -> Result<(), RenderError> {
        let (device, resources, pipeline) = (&self.device, &self.resources, &self.pipelines[key]);
        let bound = resources.bind(device, pipeline)?;
        let picture = resources.picture.as_ref().ok_or_else(|| missing(Resource::Picture))?;
        let (Program::Mesh(program), Some(depth)) = (&pipeline.program, &picture.depth) else {
            return Err(RenderError::Unsupported { what: "draw a mesh with another shader" });
        };
        device.checked("drawing a mesh", 0, || {
            let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("mesh"),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &picture.view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                        store: wgpu::StoreOp::Store,
                    },
                })],
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: depth,
                    depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Discard }),
                    stencil_ops: None,
                }),
                timestamp_writes: self.clock.as_ref().map(Clock::draw_writes),
                occlusion_query_set: None,
                multiview_mask: None,
            });
            pass.set_pipeline(program);
            pass.set_bind_group(0, &bound, &[]);
            pass.draw(0..3 * plan.mesh().triangles().len() as u32, 0..1);
            drop(pass);
            if let Some(clock) = &self.clock {
                clock.resolve(&mut encoder);
            }
            device.queue.submit([encoder.finish()]);
        })
    }
}
