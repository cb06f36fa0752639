//! The backend: the replay of a plan.

use std::sync::Arc;
use std::time::Instant;

use brickfield_core::Image;
use brickfield_core::glam::UVec2;
use brickfield_frame::{
    Backend, Cost, Description, Evaluate, Feature, Frame, FramePlan, FrameUniforms, Pass, RenderError, Resource,
    SampleFormat, ShaderChoice, ShaderFunction, Target, Timing, check_memory, draw_batches,
};
use brickfield_shaders::{
    Entry, PipelineKey, Pipelines, ShaderLibrary, Variant, n_rays_that_go_on, passes, shader_inputs, shader_outputs,
};
use wgpu::{BufferUsages, Features};

use crate::buffer::Reused;
use crate::clock::{Clock, milliseconds_since};
use crate::device::Device;
use crate::picture::{self, Maker};
use crate::pipeline::{Pipeline, Program, pipelines};
use crate::polygons::{Drawing, Polygons};
use crate::resources::{Brought, Resources, missing};
use crate::{AdapterChoice, OpenError, adapter};

/// Renders frame plans through wgpu, without a window.
///
/// On the device stay: the contents of the last plan, so that the next plan brings only the chunks that differ; the pipeline of each shader
/// variant, the picture, and buffers that grow when they must.
pub struct WgpuBackend {
    pub(crate) device: Arc<Device>,
    pub(crate) pipelines: Pipelines<Pipeline>,
    pub(crate) clock: Option<Clock>,
    pub(crate) resources: Resources,
    polygons: Polygons,
    pub(crate) staging: Reused,
    outputs: Outputs,
}

/// The outputs of evaluated functions, on their way back.
struct Outputs {
    staging: Reused,
}

/// Inputs of a function that are evaluated at a time.
const EVALUATED_AT_ONCE: usize = 1 << 20;

impl WgpuBackend {
    /// Opens an adapter.
    ///
    /// # Errors
    /// If there is none, not the one chosen, or if it gives no device. The message says which there are.
    pub fn new(choice: &AdapterChoice) -> Result<WgpuBackend, OpenError> {
        let device = Arc::new(adapter::open(choice)?);
        Ok(WgpuBackend {
            pipelines: pipelines(&device, ShaderLibrary::embedded()),
            clock: Clock::new(&device),
            resources: Resources::new(&device),
            polygons: Polygons::new(),
            staging: picture::staging(),
            outputs: Outputs {
                staging: Reused::new("reading results back", BufferUsages::MAP_READ | BufferUsages::COPY_DST),
            },
            device,
        })
    }

    /// Takes another shader library; the pipelines built so far are dropped, and the samples that they have unpacked.
    ///
    /// For conformance runs, which must notice a library that is wrong in one place.
    pub fn set_library(&mut self, library: ShaderLibrary) {
        let choice = self.pipelines.choice();
        self.pipelines = pipelines(&self.device, library);
        self.pipelines.set_choice(choice);
        self.resources.forget_textures();
    }

    pub(crate) fn check_size(&self, size: UVec2) -> Result<(), RenderError> {
        let limit = self.device.description.capabilities.max_image;
        if size.max_element() > limit {
            return Err(RenderError::ImageTooLarge { size, limit });
        }
        Ok(())
    }

    fn check_features(&self, plan: &FramePlan) -> Result<(), RenderError> {
        let filtered_floats =
            plan.features().contains(Feature::HardwareFilter) && plan.field().slots().format() == SampleFormat::Float32;
        if filtered_floats && !self.device.has(Features::FLOAT32_FILTERABLE) {
            return Err(RenderError::Unsupported { what: "filter 32-bit floats in hardware (FLOAT32_FILTERABLE)" });
        }
        Ok(())
    }

    /// Whether the device blends the pixel format that a plan's polygons are drawn into.
    fn check_blending(&self, plan: &FramePlan) -> Result<(), RenderError> {
        let blends_floats = plan.proxy().is_some_and(|proxy| proxy.target() == Target::Float32);
        if blends_floats && !self.device.has(Features::FLOAT32_BLENDABLE) {
            return Err(RenderError::Unsupported { what: "blend 32-bit floats (FLOAT32_BLENDABLE): take rgba16float" });
        }
        Ok(())
    }

    /// The passes of a plan, with room for what their rays have seen.
    fn passes(&mut self, plan: &FramePlan, key: PipelineKey, is_first_batch: bool) -> Result<Vec<Pass>, RenderError> {
        let pipeline = &self.pipelines[key];
        let group_height = pipeline.workgroup_size[1];
        if pipeline.uses(Resource::SeenBefore) {
            let n_bytes = n_rays_that_go_on(plan, group_height) * size_of::<[f32; 4]>() as u64;
            self.resources.buffer(Resource::SeenBefore).reserve(&self.device, n_bytes)?;
        }
        Ok(passes(plan, group_height, is_first_batch))
    }

    /// Runs the march over a picture of `width` pixels, pass by pass; device and wall time in milliseconds.
    pub(crate) fn march(
        &mut self,
        width: u32,
        key: PipelineKey,
        uniforms: FrameUniforms,
        passes: &[Pass],
    ) -> Result<(Option<f64>, f64), RenderError> {
        let pipeline = &self.pipelines[key];
        let [x, y, _] = pipeline.workgroup_size;
        let clock = self.clock.as_ref();
        let (mut device_ms, mut wall_ms) = (clock.map(|_| 0.0), 0.0);
        for pass in passes {
            let started = Instant::now();
            let groups = [width.div_ceil(x), (pass.rows.len() as u32).div_ceil(y), 1];
            let uniforms = uniforms.in_pass(pass);
            self.resources.buffer(Resource::Frame).write(&self.device, bytemuck::bytes_of(&uniforms))?;
            dispatch(&self.device, pipeline, &self.resources, groups, clock)?;
            self.device.wait("rendering")?;
            wall_ms += milliseconds_since(started);
            let pass_ms = clock.map(|c| c.milliseconds(&self.device)).transpose()?;
            device_ms = device_ms.zip(pass_ms).map(|(sum, ms)| sum + ms);
        }
        Ok((device_ms, wall_ms))
    }

    fn evaluate_some(&mut self, variant: Variant, inputs: &[[f32; 4]]) -> Result<Vec<[f32; 4]>, RenderError> {
        let n_bytes = size_of_val(inputs) as u64;
        self.resources.buffer(Resource::Inputs).write(&self.device, bytemuck::cast_slice(inputs))?;
        self.resources.buffer(Resource::Outputs).reserve(&self.device, n_bytes)?;
        let pipeline = self.pipelines.of(PipelineKey::computing(variant))?;
        let groups = (inputs.len() as u32).div_ceil(pipeline.workgroup_size[0]);
        dispatch(&self.device, pipeline, &self.resources, [groups, 1, 1], None)?;
        self.outputs.read(&self.device, self.resources.buffer(Resource::Outputs), n_bytes)
    }
}

impl Backend for WgpuBackend {
    fn describe(&self) -> &Description {
        &self.device.description
    }

    fn render_batches(
        &mut self,
        size: UVec2,
        batches: &mut dyn Iterator<Item = FramePlan>,
    ) -> Result<Frame, RenderError> {
        self.check_size(size)?;
        check_memory(size)?;
        let cost = draw_batches(size, batches, |plan, is_first| self.draw(plan, is_first))?;
        let Some(mut cost) = cost else { return Ok(Frame::new(Image::transparent(size), Cost::default())) };
        let started = Instant::now();
        let picture = self.resources.picture.as_ref().ok_or_else(|| missing(Resource::Picture))?;
        let image = picture.read(&self.device, &mut self.staging)?;
        cost.timing.read_back_ms = milliseconds_since(started);
        Ok(Frame::new(image, cost))
    }

    fn choose_shaders(&mut self, choice: ShaderChoice) {
        self.pipelines.set_choice(choice);
    }

    fn as_evaluate(&mut self) -> Option<&mut dyn Evaluate> {
        Some(self)
    }
}

impl WgpuBackend {
    /// The pipeline that unpacks a plan's slots, built; `None` if none is packed.
    fn decoder(&mut self, plan: &FramePlan) -> Result<Option<PipelineKey>, RenderError> {
        let key = PipelineKey::decoding(plan);
        key.map(|key| self.pipelines.of(key).map(|_| key)).transpose()
    }

    /// Draws a batch, over those before it.
    fn draw(&mut self, plan: &FramePlan, is_first: bool) -> Result<Cost, RenderError> {
        self.check_features(plan)?;
        self.check_blending(plan)?;
        let started = Instant::now();
        let maker = plan.proxy().map_or(Maker::Rays, |proxy| Maker::Polygons(proxy.target()));
        let chosen = self.pipelines.choose(PipelineKey::of(plan))?;
        let decoder = self.decoder(plan)?;
        let pipeline = &self.pipelines[chosen.key];
        let decoder = decoder.map(|key| &self.pipelines[key]);
        let Brought { uniforms, mut n_bytes } = self.resources.bring(&self.device, plan, pipeline, decoder)?;
        self.resources.resize(&self.device, plan.size(), maker)?;
        if let Some(proxy) = plan.proxy() {
            n_bytes += self.polygons.bring(&self.device, proxy)?;
        }
        self.device.queue.submit([]);
        self.device.wait("uploading")?;
        let upload_ms = milliseconds_since(started);
        let (device_ms, wall_ms) = match plan.proxy() {
            None => {
                let passes = self.passes(plan, chosen.key, is_first)?;
                self.march(plan.size().x, chosen.key, uniforms, &passes)?
            }
            Some(proxy) => {
                let drawing =
                    Drawing { device: &self.device, pipeline, resources: &self.resources, clock: self.clock.as_ref() };
                self.polygons.draw(&drawing, proxy, is_first)?
            }
        };
        self.pipelines.note(chosen, device_ms.unwrap_or(wall_ms));
        let timing = Timing { upload_ms, device_ms, wall_ms, read_back_ms: 0.0 };
        Ok(Cost { timing, uploaded_bytes: n_bytes, is_general: chosen.is_general() })
    }
}

impl Evaluate for WgpuBackend {
    fn evaluate(
        &mut self,
        plan: &FramePlan,
        function: ShaderFunction,
        inputs: &[[f32; 4]],
    ) -> Result<Vec<[f32; 4]>, RenderError> {
        self.check_features(plan)?;
        let variant = Variant::of(plan, Entry::Evaluate(function));
        self.pipelines.of(PipelineKey::computing(variant))?;
        let decoder = self.decoder(plan)?.map(|key| &self.pipelines[key]);
        let pipeline = &self.pipelines[PipelineKey::computing(variant)];
        self.resources.bring(&self.device, plan, pipeline, decoder)?;
        let mut results = Vec::with_capacity(inputs.len());
        for some in shader_inputs(plan, function, inputs).chunks(EVALUATED_AT_ONCE) {
            results.extend(self.evaluate_some(variant, some)?);
        }
        Ok(shader_outputs(plan, function, &results))
    }
}

impl Outputs {
    fn read(&mut self, device: &Device, results: &Reused, n_bytes: u64) -> Result<Vec<[f32; 4]>, RenderError> {
        let from = results.buffer().ok_or_else(|| missing(Resource::Outputs))?;
        let to = self.staging.reserve(device, n_bytes)?;
        device.checked("copying the results", n_bytes, || {
            let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.copy_buffer_to_buffer(from, 0, to, 0, n_bytes);
            device.queue.submit([encoder.finish()]);
        })?;
        let view = device.read(to, n_bytes)?;
        let results = bytemuck::pod_collect_to_vec(&view);
        drop(view);
        to.unmap();
        Ok(results)
    }
}

/// Runs a pipeline that computes, once.
pub(crate) fn dispatch(
    device: &Device,
    pipeline: &Pipeline,
    resources: &Resources,
    groups: [u32; 3],
    clock: Option<&Clock>,
) -> Result<(), RenderError> {
    let bound = resources.bind(device, pipeline)?;
    let Program::Compute(program) = &pipeline.program else {
        return Err(RenderError::Unsupported { what: "compute with a shader that draws" });
    };
    device.checked("running a shader", 0, || {
        let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("brickfield"),
            timestamp_writes: clock.map(Clock::writes),
        });
        pass.set_pipeline(program);
        pass.set_bind_group(0, &bound, &[]);
        pass.dispatch_workgroups(groups[0], groups[1], groups[2]);
        drop(pass);
        if let Some(clock) = clock {
            clock.resolve(&mut encoder);
        }
        device.queue.submit([encoder.finish()]);
    })
}
