//! Curvilinear cells, which rays walk through.

use std::time::Instant;

use brickfield_frame::{
    CellsBackend, CellsPlan, Cost, Frame, FrameUniforms, RenderError, Resource, Target, check_memory,
};
use brickfield_shaders::{PipelineKey, passes_of_cells};

use crate::AshBackend;
use crate::backend::timing;
use crate::march::{march, milliseconds_since, read_back, reserve_picture};
use crate::resources::missing;
use crate::vulkan::Use;

impl CellsBackend for AshBackend {
    fn render_cells(&mut self, plan: &CellsPlan) -> Result<Frame, RenderError> {
        self.check_size(plan.size())?;
        check_memory(plan.size())?;
        let started = Instant::now();
        let passes = passes_of_cells(plan)?;
        let pipeline = self.pipelines.of(PipelineKey::cells(plan))?;
        let bindings = pipeline.bindings().to_vec();
        let contents = |resource| plan.content(resource);
        let uploaded_bytes = self.resources.bring_contents(&mut self.queue, &mut self.staging, &contents, &bindings)?;
        let picture = reserve_picture(&mut self.picture, &self.device, plan.size())?;
        let resources = &self.resources;
        let bound = pipeline.bind(|binding| resources.bindable_with(picture, binding))?;
        let upload_ms = milliseconds_since(started);
        let uniforms = resources.buffer(Resource::Frame).ok_or_else(|| missing(Resource::Frame))?;
        let time = march(&mut self.queue, &bound, picture, (uniforms, FrameUniforms::of_cells(plan)), &passes)?;
        let mut timing = timing(upload_ms, &time);
        let started = Instant::now();
        let image = read_back(&mut self.queue, &mut self.staging, picture, (Target::Float32, Use::ShaderWrite))?;
        timing.read_back_ms = milliseconds_since(started);
        Ok(Frame::new(image, Cost { timing, uploaded_bytes, is_general: false }))
    }
}
