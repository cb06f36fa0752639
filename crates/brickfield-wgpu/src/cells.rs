//! Curvilinear cells, which rays walk through.

use std::time::Instant;

use brickfield_core::Image;
use brickfield_frame::{
    CellsBackend, CellsPlan, Cost, Frame, FrameUniforms, RenderError, Resource, Timing, check_memory,
};
use brickfield_shaders::{PipelineKey, passes_of_cells};

use crate::WgpuBackend;
use crate::clock::milliseconds_since;
use crate::picture::Maker;
use crate::resources::missing;

impl CellsBackend for WgpuBackend {
    fn render_cells(&mut self, plan: &CellsPlan) -> Result<Frame, RenderError> {
        self.check_size(plan.size())?;
        check_memory(plan.size())?;
        let started = Instant::now();
        let passes = passes_of_cells(plan)?;
        let key = PipelineKey::cells(plan);
        self.pipelines.of(key)?;
        let uploaded_bytes = self.resources.bring_contents(&self.device, &|r| plan.content(r), &self.pipelines[key])?;
        self.resources.resize(&self.device, plan.size(), Maker::Rays)?;
        self.device.queue.submit([]);
        self.device.wait("uploading")?;
        let upload_ms = milliseconds_since(started);
        let (device_ms, wall_ms) = self.march(plan.size().x, key, FrameUniforms::of_cells(plan), &passes)?;
        let started = Instant::now();
        let picture = self.resources.picture.as_ref().ok_or_else(|| missing(Resource::Picture))?;
        let image: Image<f32> = picture.read(&self.device, &mut self.staging)?;
        let timing = Timing { upload_ms, device_ms, wall_ms, read_back_ms: milliseconds_since(started) };
        Ok(Frame::new(image, Cost { timing, uploaded_bytes, is_general: false }))
    }
}
