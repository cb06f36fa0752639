//! Curvilinear cells, which rays walk through.

use std::time::Instant;

use brickfield_core::Image;
use brickfield_frame::{
    CellsBackend, CellsPlan, Cost, Frame, FrameUniforms, Pass, RenderError, Resource, Timing, check_memory,
};
use brickfield_shaders::{PipelineKey, rows_of_cells};

use crate::WgpuBackend;
use crate::backend::dispatch;
use crate::clock::milliseconds_since;
use crate::picture::Maker;
use crate::resources::missing;

impl CellsBackend for WgpuBackend {
    fn render_cells(&mut self, plan: &CellsPlan) -> Result<Frame, RenderError> {
        self.check_size(plan.size())?;
        check_memory(plan.size())?;
        let started = Instant::now();
        let bands = rows_of_cells(plan)?;
        let key = PipelineKey::cells(plan);
        self.pipelines.of(key)?;
        let uploaded_bytes = self.resources.bring_contents(&self.device, &|r| plan.content(r), &self.pipelines[key])?;
        self.resources.resize(&self.device, plan.size(), Maker::Rays)?;
        self.device.queue.submit([]);
        self.device.wait("uploading")?;
        let upload_ms = milliseconds_since(started);
        let (uniforms, pipeline) = (FrameUniforms::of_cells(plan), &self.pipelines[key]);
        let [x, y, _] = pipeline.workgroup_size;
        let (mut device_ms, started) = (self.clock.as_ref().map(|_| 0.0), Instant::now());
        for rows in bands {
            let groups = [plan.size().x.div_ceil(x), (rows.len() as u32).div_ceil(y), 1];
            let of_band = uniforms.in_pass(&Pass::whole_rays(rows));
            self.resources.buffer(Resource::Frame).write(&self.device, bytemuck::bytes_of(&of_band))?;
            dispatch(&self.device, pipeline, &self.resources, groups, self.clock.as_ref())?;
            self.device.wait("rendering")?;
            let band_ms = self.clock.as_ref().map(|c| c.milliseconds(&self.device)).transpose()?;
            device_ms = device_ms.zip(band_ms).map(|(sum, ms)| sum + ms);
        }
        let wall_ms = milliseconds_since(started);
        let started = Instant::now();
        let picture = self.resources.picture.as_ref().ok_or_else(|| missing(Resource::Picture))?;
        let image: Image<f32> = picture.read(&self.device, &mut self.staging)?;
        let timing = Timing { upload_ms, device_ms, wall_ms, read_back_ms: milliseconds_since(started) };
        Ok(Frame::new(image, Cost { timing, uploaded_bytes, is_general: false }))
    }
}
