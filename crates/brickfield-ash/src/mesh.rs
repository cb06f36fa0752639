//! Meshes, rasterised with a depth buffer.

use std::time::Instant;

use brickfield_frame::{MeshBackend, MeshFrame, MeshPlan, RenderError, Target, Timing, check_memory};
use brickfield_shaders::PipelineKey;

use crate::AshBackend;
use crate::march::{milliseconds_since, read_back};
use crate::polygons::reserve_canvas;
use crate::vulkan::{CanvasKind, Use};

impl MeshBackend for AshBackend {
    fn render_mesh(&mut self, plan: &MeshPlan) -> Result<MeshFrame, RenderError> {
        self.check_size(plan.size())?;
        check_memory(plan.size())?;
        if plan.shows_nothing() {
            return Ok(MeshFrame::of_nothing(plan.size()));
        }
        let started = Instant::now();
        let pipeline = self.pipelines.of(PipelineKey::mesh(plan))?;
        let bindings = pipeline.bindings().to_vec();
        let uploaded_bytes =
            self.resources.bring_contents(&mut self.queue, &mut self.staging, &|r| plan.content(r), &bindings)?;
        let canvas = reserve_canvas(&mut self.canvas, &self.device, CanvasKind::Mesh, plan.size())?;
        let resources = &self.resources;
        let bound = pipeline.bind(|binding| resources.bindable(binding))?;
        let upload_ms = milliseconds_since(started);
        let started = Instant::now();
        let device_ms = self.queue.run_timed("drawing a mesh", |recorder| {
            // Resources were brought to the device for compute shaders.
            recorder.barrier(Use::ShaderRead, Use::DrawRead);
            recorder.draw_mesh(&bound, canvas, plan.mesh().triangles().len() as u32);
        })?;
        let wall_ms = milliseconds_since(started);
        let started = Instant::now();
        let pixels = read_back(&mut self.queue, &mut self.staging, &canvas.image, (Target::Float32, Use::Canvas))?;
        let timing = Timing { upload_ms, device_ms, wall_ms, read_back_ms: milliseconds_since(started) };
        Ok(MeshFrame { pixels, timing, uploaded_bytes })
    }
}
