//! The backend: a device, the resources on it, and how a plan is replayed.

use std::sync::Arc;
use std::time::Instant;

use brickfield_core::Image as Picture;
use brickfield_core::glam::UVec2;
use brickfield_frame::{
    Backend, Cost, Description, Evaluate, Frame, FramePlan, ProxyGeometry, RenderError, Resource, ShaderChoice,
    ShaderFunction, Target, Timing, check_memory, draw_batches,
};
use brickfield_shaders::{Chosen, PipelineKey, Pipelines, ShaderLibrary, n_rays_that_go_on, passes};

use crate::march::{RenderTime, march, milliseconds_since, read_back, reserve_picture};
use crate::options::choose;
use crate::polygons::{Polygons, reserve_canvas};
use crate::resources::{Brought, Resources, missing};
use crate::staging::Staging;
use crate::stored_pipelines::StoredPipelines;
use crate::vulkan::{
    Canvas, CanvasKind, Device, Instance, PhysicalDevice, Pipeline, Queue, Use, VulkanImage, physical_devices,
};
use crate::{ConnectError, Options, PipelineFile, SaveError, ValidationLog};

/// Replays frame plans through Vulkan, without a window.
pub struct AshBackend {
    pub(crate) device: Arc<Device>,
    pub(crate) queue: Queue,
    pub(crate) pipelines: Pipelines<Pipeline>,
    pub(crate) resources: Resources,
    pub(crate) staging: Staging,
    pub(crate) picture: Option<VulkanImage>,
    pub(crate) canvas: Option<Canvas>,
    polygons: Polygons,
    description: Description,
    /// After the pipelines, so that those of other threads are in it.
    stored: Option<StoredPipelines>,
}

impl AshBackend {
    /// Connects to an adapter.
    ///
    /// # Errors
    /// No Vulkan loader, no device or not the one asked for, no validation layer if asked for, a driver that fails.
    pub fn new(options: &Options) -> Result<AshBackend, ConnectError> {
        let instance = Instance::new(options.validation)?;
        let mut there = physical_devices(&instance)?;
        let summaries: Vec<_> = there.iter().map(|d| d.summary.clone()).collect();
        let chosen = there.swap_remove(choose(&options.adapter, &summaries)?);
        let description = describe(&chosen);
        let device = Device::new(instance, chosen)?;
        Ok(AshBackend {
            queue: Queue::new(&device)?,
            pipelines: pipelines(&device, ShaderLibrary::embedded()),
            resources: Resources::new(&device)?,
            staging: Staging::new(&device, options.copy_bytes),
            picture: None,
            canvas: None,
            polygons: Polygons::new(),
            description,
            stored: options.pipelines.as_deref().map(|path| StoredPipelines::open(&device, path)),
            device,
        })
    }

    /// What came of the file of pipelines; `None` without [`Options::pipelines`].
    pub fn pipeline_file(&self) -> Option<&PipelineFile> {
        self.stored.as_ref().map(StoredPipelines::file)
    }

    /// Writes the file of pipelines now, if there is one and more to keep than it has.
    ///
    /// # Errors
    /// A driver that does not give them, a file that cannot be written.
    pub fn save_pipelines(&mut self) -> Result<(), SaveError> {
        self.stored.as_mut().map_or(Ok(()), StoredPipelines::save)
    }

    /// The backend with other shader sources: conformance runs see by them whether their cases notice a defect.
    #[must_use]
    pub fn with_library(mut self, library: ShaderLibrary) -> AshBackend {
        self.set_library(library);
        self
    }

    /// Replaces the shader sources; the samples that they have unpacked are dropped.
    pub fn set_library(&mut self, library: ShaderLibrary) {
        let choice = self.pipelines.choice();
        self.pipelines = pipelines(&self.device, library);
        self.pipelines.set_choice(choice);
        self.resources.forget_textures();
    }

    /// The messages of the validation layer, as a log that outlives the backend: messages about its end are in it, too.
    pub fn validation_log(&self) -> ValidationLog {
        self.device.instance().log().clone()
    }

    pub(crate) fn check_size(&self, size: UVec2) -> Result<(), RenderError> {
        let limit = self.description.capabilities.max_image;
        match size.max_element() > limit {
            true => Err(RenderError::ImageTooLarge { size, limit }),
            false => Ok(()),
        }
    }

    /// Draws a batch, over those before it.
    fn draw(&mut self, plan: &FramePlan, is_first: bool) -> Result<Cost, RenderError> {
        let started = Instant::now();
        let chosen = self.pipelines.choose(PipelineKey::of(plan))?;
        let (timing, uploaded_bytes) = match plan.proxy() {
            Some(proxy) => self.rasterise(plan, proxy, is_first, (chosen, started))?,
            None => self.replay(plan, is_first, (chosen, started))?,
        };
        self.pipelines.note(chosen, timing.device_ms.unwrap_or(timing.wall_ms));
        Ok(Cost { timing, uploaded_bytes, is_general: chosen.is_general() })
    }

    /// Casts the rays of a batch into the picture; how long it took, and the bytes that were brought to the device.
    fn replay(
        &mut self,
        plan: &FramePlan,
        is_first: bool,
        (chosen, started): (Chosen, Instant),
    ) -> Result<(Timing, u64), RenderError> {
        let pipeline = (&mut self.pipelines, chosen.key);
        let Brought { uniforms, n_bytes } = self.resources.bring(&mut self.queue, &mut self.staging, plan, pipeline)?;
        let pipeline = self.pipelines.of(chosen.key)?;
        let picture = reserve_picture(&mut self.picture, &self.device, plan.size())?;
        let group_height = pipeline.workgroup_size()[1];
        if pipeline.uses(Resource::SeenBefore) {
            self.resources.reserve_rays(n_rays_that_go_on(plan, group_height))?;
        }
        let resources = &self.resources;
        let bound = pipeline.bind(|binding| resources.bindable_with(picture, binding))?;
        let upload_ms = milliseconds_since(started);
        let target = resources.buffer(Resource::Frame).ok_or_else(|| missing(Resource::Frame))?;
        let passes = passes(plan, group_height, is_first);
        let time = march(&mut self.queue, &bound, picture, (target, uniforms), &passes)?;
        Ok((timing(upload_ms, &time), n_bytes))
    }

    /// As [`replay`](Self::replay), by rasterising polygons.
    fn rasterise(
        &mut self,
        plan: &FramePlan,
        proxy: &Arc<ProxyGeometry>,
        is_first: bool,
        (chosen, started): (Chosen, Instant),
    ) -> Result<(Timing, u64), RenderError> {
        let canvas = reserve_canvas(&mut self.canvas, &self.device, CanvasKind::Polygons(proxy.target()), plan.size())?;
        let pipeline = (&mut self.pipelines, chosen.key);
        let brought = self.resources.bring(&mut self.queue, &mut self.staging, plan, pipeline)?;
        let of_polygons = self.polygons.bring(&self.device, &mut self.queue, &mut self.staging, proxy)?;
        let resources = &self.resources;
        let bound = self.pipelines.of(chosen.key)?.bind(|binding| resources.bindable(binding))?;
        let upload_ms = milliseconds_since(started);
        let time = self.polygons.draw(&mut self.queue, &bound, canvas, proxy, is_first)?;
        Ok((timing(upload_ms, &time), brought.n_bytes + of_polygons))
    }

    /// Brings back what the plans so far have made, the last of them this way.
    fn bring_back(&mut self, drawn: Drawn) -> Result<Picture<f32>, RenderError> {
        let (image, from) = match drawn {
            Drawn::Rays => (self.picture.as_ref(), (Target::Float32, Use::ShaderWrite)),
            Drawn::Polygons(target) => (self.canvas.as_ref().map(|canvas| &canvas.image), (target, Use::Canvas)),
        };
        let image = image.ok_or_else(|| missing(Resource::Picture))?;
        read_back(&mut self.queue, &mut self.staging, image, from)
    }
}

/// How a picture was made.
#[derive(Clone, Copy)]
enum Drawn {
    Rays,
    Polygons(Target),
}

/// The pipelines of a device, none yet.
fn pipelines(device: &Arc<Device>, library: ShaderLibrary) -> Pipelines<Pipeline> {
    let device = Arc::clone(device);
    Pipelines::new(move |key| {
        let limit = device.physical().limits.max_per_stage_descriptor_storage_buffers;
        Pipeline::new(&device, &library.specialise_within(&key.variant, limit)?, key.target)
    })
}

pub(crate) fn timing(upload_ms: f64, time: &RenderTime) -> Timing {
    Timing { upload_ms, device_ms: time.device_ms, wall_ms: time.wall_ms, read_back_ms: 0.0 }
}

impl Backend for AshBackend {
    fn describe(&self) -> &Description {
        &self.description
    }

    fn validation_messages(&self) -> Vec<String> {
        self.validation_log().messages()
    }

    fn render_batches(
        &mut self,
        size: UVec2,
        batches: &mut dyn Iterator<Item = FramePlan>,
    ) -> Result<Frame, RenderError> {
        self.check_size(size)?;
        check_memory(size)?;
        let mut drawn = Drawn::Rays;
        let cost = draw_batches(size, batches, |plan, is_first| {
            drawn = plan.proxy().map_or(Drawn::Rays, |proxy| Drawn::Polygons(proxy.target()));
            self.draw(plan, is_first)
        })?;
        let Some(mut cost) = cost else { return Ok(Frame::new(Picture::transparent(size), Cost::default())) };
        let started = Instant::now();
        let image = self.bring_back(drawn)?;
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

impl Evaluate for AshBackend {
    fn evaluate(
        &mut self,
        plan: &FramePlan,
        function: ShaderFunction,
        inputs: &[[f32; 4]],
    ) -> Result<Vec<[f32; 4]>, RenderError> {
        match inputs.is_empty() {
            true => Ok(Vec::new()),
            false => self.evaluate_all(plan, function, inputs),
        }
    }
}

fn describe(device: &PhysicalDevice) -> Description {
    Description::new("ash", device.summary.name.clone(), device.summary.driver.clone(), device.capabilities())
}

#[cfg(test)]
#[path = "../tests/replay/plans.rs"]
#[expect(dead_code, reason = "the integration tests use the rest")]
mod plans;

#[cfg(test)]
mod tests {
    use std::panic::{AssertUnwindSafe, catch_unwind};

    use brickfield_frame::{Mode, QuadratureRule, SampleFormat};

    use super::plans::{bumps, plan, rising};
    use super::*;
    use crate::Validation;
    use crate::vulkan::Use;

    #[test]
    fn after_a_panic_while_recording_the_next_frame_is_the_same_and_the_layer_silent() {
        let mut backend = match AshBackend::new(&Options { validation: Validation::On, ..Options::default() }) {
            Ok(backend) => backend,
            Err(e @ (ConnectError::NoLoader { .. } | ConnectError::NoDevice | ConnectError::NoValidationLayer)) => {
                return println!("no device: {e}");
            }
            Err(e) => panic!("{e}"),
        };
        let plan = plan(bumps(SampleFormat::Unorm8), rising(0.05), QuadratureRule::MidpointExponential, Mode::Exact);
        let before = backend.render(&plan).unwrap().image;
        let panicked = catch_unwind(AssertUnwindSafe(|| {
            backend.queue.run("testing", |recorder| {
                recorder.barrier(Use::Nothing, Use::ShaderRead);
                panic!("on purpose");
            })
        }));
        assert!(panicked.is_err());
        assert_eq!(backend.render(&plan).unwrap().image, before);
        assert_eq!(backend.validation_messages(), Vec::<String>::new());
    }
}
