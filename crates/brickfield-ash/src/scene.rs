//! What a plan brings to the device: bricks, index, transfer function, uniforms.

use std::sync::Arc;

use ash::vk;
use brickfield_core::glam::UVec3;
use brickfield_frame::{AtlasShape, FramePlan, FrameUniforms, Held, KnotUniform, Occupancy, RenderError};
use brickfield_shaders::BindingKind;

use crate::atlas::{Atlas, atlas_shape, check_format};
use crate::error::FailedCall;
use crate::march::PIXEL_BYTES;
use crate::staging::Staging;
use crate::vulkan::{Buffer, Device, Pipeline, Queue, Resource, Sampler};

/// A plan's data on the device.
pub(crate) struct Scene {
    device: Arc<Device>,
    atlas: Option<Atlas>,
    sampler: Sampler,
    uniforms: Slot,
    index: Slot,
    knots: Slot,
    seen_before: Slot,
    /// And the map that is in it.
    occupancy: (Slot, Held<Occupancy>),
    beams: Slot,
    facets: Slot,
    drawn: Slot,
}

/// A buffer that grows when it must, and how much of it is used.
pub(crate) struct Slot {
    what: &'static str,
    usage: vk::BufferUsageFlags,
    used_bytes: u64,
    buffer: Option<Buffer>,
}

impl Scene {
    /// Nothing yet.
    pub(crate) fn new(device: &Arc<Device>) -> Result<Scene, FailedCall> {
        Ok(Scene {
            device: device.clone(),
            atlas: None,
            sampler: Sampler::linear(device)?,
            uniforms: Slot::new("the uniform block", vk::BufferUsageFlags::UNIFORM_BUFFER),
            index: Slot::new("the brick index", vk::BufferUsageFlags::STORAGE_BUFFER),
            knots: Slot::new("the transfer function", vk::BufferUsageFlags::STORAGE_BUFFER),
            seen_before: Slot::new("rays between passes", vk::BufferUsageFlags::STORAGE_BUFFER),
            occupancy: (Slot::new("the occupancy of bricks", vk::BufferUsageFlags::STORAGE_BUFFER), Held::nothing()),
            beams: Slot::new("the beams", vk::BufferUsageFlags::STORAGE_BUFFER),
            facets: Slot::new("the facets", vk::BufferUsageFlags::STORAGE_BUFFER),
            drawn: Slot::new("the bricks of polygons", vk::BufferUsageFlags::STORAGE_BUFFER),
        })
    }

    /// Brings to the device what `pipeline` needs of `plan`, and is not there; returns the uniforms, as for a single pass.
    pub(crate) fn upload(
        &mut self,
        queue: &mut Queue,
        staging: &mut Staging,
        plan: &FramePlan,
        pipeline: &Pipeline,
    ) -> Result<FrameUniforms, RenderError> {
        let shape = match pipeline.needs(BindingKind::Texture3d) {
            true => self.upload_bricks(queue, staging, plan, pipeline)?,
            false => AtlasShape { bricks: UVec3::ONE, side: plan.bricks.side() },
        };
        let (uniforms, knots) = (FrameUniforms::of(plan, shape), KnotUniform::of(plan));
        let contents: [&[u8]; 3] =
            [bytemuck::bytes_of(&uniforms), bytemuck::cast_slice(plan.index.words()), bytemuck::cast_slice(&knots)];
        let slots = [&mut self.uniforms, &mut self.index, &mut self.knots];
        let mut copies = Vec::new();
        for (slot, bytes) in slots.into_iter().zip(contents) {
            copies.push((slot.reserve(&self.device, bytes.len())?, bytes));
        }
        staging.fill(queue, &copies)?;
        let missing =
            |what: &str| RenderError::Shader { message: format!("it reads {what} that the plan does not have") };
        if pipeline.binds(9) {
            let occupancy = plan.occupancy.as_ref().ok_or_else(|| missing("an occupancy"))?;
            self.hold_occupancy(queue, staging, occupancy)?;
        }
        if pipeline.binds(10) {
            let spans = plan.beams.as_ref().ok_or_else(|| missing("beams"))?.spans();
            let bytes = bytemuck::cast_slice(&spans);
            staging.fill(queue, &[(self.beams.reserve(&self.device, bytes.len())?, bytes)])?;
        }
        if pipeline.binds(11) {
            let proxy = plan.proxy.as_ref().ok_or_else(|| missing("polygons"))?;
            let bytes = bytemuck::cast_slice(proxy.bricks());
            staging.fill(queue, &[(self.drawn.reserve(&self.device, bytes.len())?, bytes)])?;
        }
        if pipeline.binds(12) {
            let planes = plan.rays.facet_planes();
            let bytes = bytemuck::cast_slice(&planes);
            staging.fill(queue, &[(self.facets.reserve(&self.device, bytes.len())?, bytes)])?;
        }
        Ok(uniforms)
    }

    fn hold_occupancy(
        &mut self,
        queue: &mut Queue,
        staging: &mut Staging,
        occupancy: &Arc<Occupancy>,
    ) -> Result<(), RenderError> {
        let (slot, held) = &mut self.occupancy;
        if !held.is(occupancy) {
            *held = Held::nothing();
            let bytes = bytemuck::cast_slice(occupancy.distances());
            staging.fill(queue, &[(slot.reserve(&self.device, bytes.len())?, bytes)])?;
            *held = Held::of(occupancy);
        }
        Ok(())
    }

    /// Makes room for what `n_pixels` rays saw in one pass, and the next must know.
    pub(crate) fn reserve_rays(&mut self, n_pixels: u64) -> Result<(), RenderError> {
        self.seen_before.reserve(&self.device, n_pixels as usize * PIXEL_BYTES).map(drop)
    }

    /// The buffer of the uniforms, once there was an upload.
    pub(crate) fn uniforms(&self) -> Option<&Buffer> {
        self.uniforms.buffer()
    }

    /// What the shader's bindings of a plan's data stand for.
    pub(crate) fn resource(&self, binding: u32) -> Option<Resource<'_>> {
        match binding {
            0 => self.uniforms.resource(),
            1 => self.atlas.as_ref().map(|a| Resource::Texture(a.image())),
            2 => Some(Resource::Sampler(&self.sampler)),
            3 => self.index.resource(),
            4 => self.knots.resource(),
            8 => self.seen_before.resource(),
            9 => self.occupancy.0.resource(),
            10 => self.beams.resource(),
            11 => self.drawn.resource(),
            12 => self.facets.resource(),
            _ => None,
        }
    }

    fn upload_bricks(
        &mut self,
        queue: &mut Queue,
        staging: &mut Staging,
        plan: &FramePlan,
        pipeline: &Pipeline,
    ) -> Result<AtlasShape, RenderError> {
        let filtered = match pipeline.needs(BindingKind::Sampler) {
            true => vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR,
            false => vk::FormatFeatureFlags::empty(),
        };
        check_format(&self.device, plan.bricks.format(), vk::FormatFeatureFlags::SAMPLED_IMAGE | filtered)?;
        let shape = atlas_shape(&plan.bricks, self.device.physical().limits.max_image_dimension3_d)?;
        if !self.atlas.as_ref().is_some_and(|a| a.holds(&plan.bricks)) {
            self.atlas = None; // before its successor needs memory
            self.atlas = Some(Atlas::upload(&self.device, queue, staging, &plan.bricks, shape)?);
        }
        Ok(shape)
    }
}

impl Slot {
    /// A slot without a buffer.
    pub(crate) fn new(what: &'static str, usage: vk::BufferUsageFlags) -> Slot {
        Slot { what, usage, used_bytes: 0, buffer: None }
    }

    /// The slot's buffer, of at least `n_bytes` bytes; its content is lost if it had to grow.
    pub(crate) fn reserve(&mut self, device: &Arc<Device>, n_bytes: usize) -> Result<&Buffer, RenderError> {
        let (what, n_bytes) = (self.what, (n_bytes as u64).max(16));
        let limit = u64::from(device.physical().limits.max_storage_buffer_range);
        if n_bytes > limit && self.usage.contains(vk::BufferUsageFlags::STORAGE_BUFFER) {
            return Err(RenderError::BufferTooLarge { what, n_bytes, limit });
        }
        self.used_bytes = n_bytes;
        self.buffer.take_if(|b| b.n_bytes() < n_bytes);
        match &mut self.buffer {
            Some(buffer) => Ok(buffer),
            none => Ok(none.insert(Buffer::on_device(device, what, n_bytes, self.usage)?)),
        }
    }

    /// The slot's buffer, once something was reserved.
    pub(crate) fn buffer(&self) -> Option<&Buffer> {
        self.buffer.as_ref()
    }

    /// The slot's used bytes as a shader's binding; `None` if nothing was reserved.
    pub(crate) fn resource(&self) -> Option<Resource<'_>> {
        self.buffer.as_ref().map(|buffer| Resource::Buffer { buffer, n_bytes: self.used_bytes })
    }
}
