//! The resources that stay on the device: the contents of plans, by name.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use ash::vk;
use brickfield_core::BrickSide;
use brickfield_frame::{
    AtlasShape, Chunked, Content, FramePlan, FrameUniforms, HeldChunks, RenderError, Resource, Slots, TextureLayout,
};
use brickfield_shaders::{Binding, BindingKind, PipelineKey, Pipelines, decodings};

use crate::error::FailedCall;
use crate::march::PIXEL_BYTES;
use crate::staging::{Staging, Write};
use crate::texture::Texture;
use crate::vulkan::{Bindable, Buffer, Device, Pipeline, Queue, Sampler, VulkanImage};

/// The buffers and textures that shaders read and write.
pub(crate) struct Resources {
    device: Arc<Device>,
    buffers: BTreeMap<Resource, Reused>,
    textures: BTreeMap<Resource, Texture>,
    linear: Sampler,
    nearest: Sampler,
}

/// A buffer that grows when it must, how much of it is used, and the chunks that are in it.
pub(crate) struct Reused {
    what: &'static str,
    usage: vk::BufferUsageFlags,
    used_bytes: u64,
    buffer: Option<Buffer>,
    held: HeldChunks,
}

/// The numbers of a plan, and the bytes that were brought to the device for it.
pub(crate) struct Brought {
    /// The frame's numbers, as for a single pass.
    pub(crate) uniforms: FrameUniforms,
    pub(crate) n_bytes: u64,
}

impl Resources {
    /// Nothing yet.
    pub(crate) fn new(device: &Arc<Device>) -> Result<Resources, FailedCall> {
        Ok(Resources {
            device: device.clone(),
            buffers: BTreeMap::new(),
            textures: BTreeMap::new(),
            linear: Sampler::of(TextureLayout::Volume, device)?,
            nearest: Sampler::of(TextureLayout::Layers, device)?,
        })
    }

    /// Makes room for `n_bytes` in the buffer of a resource.
    pub(crate) fn reserve(&mut self, resource: Resource, n_bytes: usize) -> Result<&Buffer, RenderError> {
        let device = self.device.clone();
        self.entry(resource).reserve(&device, n_bytes)
    }

    /// Makes room for the emission and depth of `n_pixels` rays, which one pass hands to the next.
    pub(crate) fn reserve_rays(&mut self, n_pixels: u64) -> Result<(), RenderError> {
        self.reserve(Resource::SeenBefore, n_pixels as usize * PIXEL_BYTES).map(drop)
    }

    /// The buffer of a resource, once there was something in it.
    pub(crate) fn buffer(&self, resource: Resource) -> Option<&Buffer> {
        self.buffers.get(&resource)?.buffer.as_ref()
    }

    fn entry(&mut self, resource: Resource) -> &mut Reused {
        let usage = match resource.is_uniform() {
            true => vk::BufferUsageFlags::UNIFORM_BUFFER,
            false => vk::BufferUsageFlags::STORAGE_BUFFER,
        };
        self.buffers.entry(resource).or_insert_with(|| Reused::new(resource.name(), usage))
    }

    /// Brings to the device the contents of `plan` that the pipeline of `key` reads and the device lacks: numbers and lists in one submit.
    pub(crate) fn bring(
        &mut self,
        queue: &mut Queue,
        staging: &mut Staging,
        plan: &FramePlan,
        (pipelines, key): (&mut Pipelines<Pipeline>, PipelineKey),
    ) -> Result<Brought, RenderError> {
        let device = self.device.clone();
        let decoder = PipelineKey::decoding(plan).map(|key| pipelines.of(key).map(|_| key)).transpose()?;
        let bindings = pipelines.of(key)?.bindings().to_vec();
        let (mut n_bytes, mut numbers, mut lists) = (0, Vec::new(), Vec::new());
        for Binding { resource, .. } in &bindings {
            match plan.content(*resource) {
                Some(Content::Bytes(bytes)) => numbers.push((*resource, bytes)),
                Some(Content::Chunks(chunks)) => lists.push((*resource, chunks)),
                Some(Content::Texture(slots)) => {
                    let texture = self.textures.remove(resource);
                    let mut texture = Texture::with_room(&device, queue, slots, plan.texture_layout(), texture)?;
                    let decoder = decoder.map(|key| pipelines.of(key)).transpose()?;
                    n_bytes += self.fill_texture(queue, staging, slots, decoder, &texture)?;
                    texture.hold(slots);
                    self.textures.insert(*resource, texture);
                }
                None => {}
            }
        }
        let uniforms = FrameUniforms::of(plan, self.atlas_shape(plan));
        if bindings.iter().any(|b| b.resource == Resource::Frame) {
            numbers.push((Resource::Frame, Cow::Borrowed(bytemuck::bytes_of(&uniforms))));
        }
        n_bytes += self.bring_buffers(queue, staging, &numbers, &lists)?;
        Ok(Brought { uniforms, n_bytes })
    }

    /// Brings the numbers and lists of another plan, as `contents` has them, that a shader of these bindings reads; the bytes that were brought.
    pub(crate) fn bring_contents<'a>(
        &mut self,
        queue: &mut Queue,
        staging: &mut Staging,
        contents: &dyn Fn(Resource) -> Option<Content<'a>>,
        bindings: &[Binding],
    ) -> Result<u64, RenderError> {
        let (mut numbers, mut lists) = (Vec::new(), Vec::new());
        for Binding { resource, .. } in bindings {
            match contents(*resource) {
                Some(Content::Bytes(bytes)) => numbers.push((*resource, bytes)),
                Some(Content::Chunks(chunks)) => lists.push((*resource, chunks)),
                None if *resource == Resource::Picture => {}
                Some(Content::Texture(_)) | None => return Err(missing(*resource)),
            }
        }
        self.bring_buffers(queue, staging, &numbers, &lists)
    }

    /// Brings numbers, and the chunks of lists that the device lacks, in one submit.
    fn bring_buffers(
        &mut self,
        queue: &mut Queue,
        staging: &mut Staging,
        numbers: &[(Resource, Cow<'_, [u8]>)],
        lists: &[(Resource, &dyn Chunked)],
    ) -> Result<u64, RenderError> {
        let device = self.device.clone();
        for (resource, bytes) in numbers {
            self.entry(*resource).reserve(&device, bytes.len())?;
        }
        for (resource, chunks) in lists {
            self.entry(*resource).make_room(&device, queue, *chunks)?;
        }
        let filled = self.fill(queue, staging, numbers, lists);
        for (resource, chunks) in lists {
            let held = &mut self.entry(*resource).held;
            // A list that was not written whole may have lost chunks that it had.
            if filled.is_ok() { held.hold(*chunks) } else { held.forget() }
        }
        filled
    }

    /// Brings the slots that a texture lacks; the bytes that were brought.
    fn fill_texture(
        &mut self,
        queue: &mut Queue,
        staging: &mut Staging,
        slots: &Slots,
        decoder: Option<&mut Pipeline>,
        texture: &Texture,
    ) -> Result<u64, RenderError> {
        let missing = texture.missing(slots);
        if missing.is_empty() {
            return Ok(0);
        }
        texture.open(queue)?;
        let mut n_bytes = texture.upload(queue, staging, slots, &missing)?;
        if let Some(decoder) = decoder {
            for decoding in decodings(texture.shape(), slots, &missing) {
                self.unpack(queue, staging, decoder, &decoding, texture)?;
                n_bytes += decoding.n_bytes();
            }
            staging.shrink();
            self.shrink();
        }
        texture.close(queue)?;
        Ok(n_bytes)
    }

    /// All slots are brought again for the next plan.
    pub(crate) fn forget_textures(&mut self) {
        self.textures.clear();
    }

    /// Frees a buffer of more bytes than these.
    pub(crate) fn free_if_larger(&mut self, resource: Resource, n_bytes: u64) {
        let is_larger = |reused: &Reused| reused.buffer.as_ref().is_some_and(|buffer| buffer.n_bytes() > n_bytes);
        if self.buffers.get(&resource).is_some_and(is_larger) {
            self.buffers.remove(&resource);
        }
    }

    /// Fills buffers that have room.
    fn fill(
        &self,
        queue: &mut Queue,
        staging: &mut Staging,
        numbers: &[(Resource, Cow<'_, [u8]>)],
        lists: &[(Resource, &dyn Chunked)],
    ) -> Result<u64, RenderError> {
        let mut writes = Vec::new();
        for (resource, bytes) in numbers {
            let target = self.buffer(*resource).ok_or_else(|| missing(*resource))?;
            writes.push(Write { target, offset: 0, bytes });
        }
        for (resource, chunks) in lists {
            let target = self.buffer(*resource).ok_or_else(|| missing(*resource))?;
            let runs = self.buffers[resource].held.missing(*chunks);
            let of = |i: usize| {
                let (_, bytes) = chunks.chunk(i)?;
                Some(Write { target, offset: (i * chunks.chunk_bytes()) as u64, bytes })
            };
            writes.extend(runs.into_iter().flatten().filter_map(of));
        }
        staging.fill(queue, &writes)?;
        Ok(writes.iter().map(|w| w.bytes.len() as u64).sum())
    }

    /// How the slots of a plan lie in the atlas; that of one brick if no shader reads it.
    fn atlas_shape(&self, plan: &FramePlan) -> AtlasShape {
        let shape = self.textures.get(&Resource::Atlas).and_then(Texture::atlas_shape);
        let side = plan.field().slots().brick_side();
        shape.filter(|s| Some(s.side) == side).unwrap_or(AtlasShape::least(side.unwrap_or(BrickSide::S16)))
    }

    /// As [`bindable`](Self::bindable), of a shader that writes to a picture.
    pub(crate) fn bindable_with<'a>(&'a self, picture: &'a VulkanImage, binding: &Binding) -> Option<Bindable<'a>> {
        match binding.resource {
            Resource::Picture => Some(Bindable::Picture(picture)),
            _ => self.bindable(binding),
        }
    }

    /// The buffer, texture or sampler of a shader's binding.
    pub(crate) fn bindable(&self, binding: &Binding) -> Option<Bindable<'_>> {
        match binding.kind {
            BindingKind::Uniform | BindingKind::StorageRead | BindingKind::StorageReadWrite => {
                self.buffers.get(&binding.resource)?.bindable()
            }
            BindingKind::Texture(_) => Some(Bindable::Texture(self.textures.get(&binding.resource)?.image())),
            BindingKind::Sampler(TextureLayout::Volume) => Some(Bindable::Sampler(&self.linear)),
            BindingKind::Sampler(TextureLayout::Layers) => Some(Bindable::Sampler(&self.nearest)),
            BindingKind::StorageImage => None,
        }
    }
}

/// A shader reads a resource that nobody brought.
pub(crate) fn missing(resource: Resource) -> RenderError {
    RenderError::Shader { message: format!("it reads `{}`, which the plan does not bring", resource.name()) }
}

impl Reused {
    /// Without a buffer yet.
    pub(crate) fn new(what: &'static str, usage: vk::BufferUsageFlags) -> Reused {
        Reused { what, usage, used_bytes: 0, buffer: None, held: HeldChunks::default() }
    }

    /// The buffer, of at least `n_bytes` bytes; its content is lost if it had to grow.
    pub(crate) fn reserve(&mut self, device: &Arc<Device>, n_bytes: usize) -> Result<&Buffer, RenderError> {
        let n_bytes = (n_bytes as u64).max(16);
        self.check(device, n_bytes)?;
        self.used_bytes = n_bytes;
        if self.buffer.take_if(|b| b.n_bytes() < n_bytes).is_some() {
            self.held.forget();
        }
        match &mut self.buffer {
            Some(buffer) => Ok(buffer),
            none => Ok(none.insert(Buffer::on_device(device, self.what, n_bytes, self.usage)?)),
        }
    }

    /// Makes room for chunks, and keeps the chunks that are there; a buffer that must grow gets a quarter more than it had.
    fn make_room(&mut self, device: &Arc<Device>, queue: &mut Queue, content: &dyn Chunked) -> Result<(), RenderError> {
        let n_bytes = content.n_bytes();
        let Some(old) = self.buffer.as_ref().filter(|b| b.n_bytes() < n_bytes) else {
            return self.reserve(device, n_bytes as usize).map(drop);
        };
        // Until the larger buffer is filled the old one stays: a list that is refused leaves everything as it was.
        self.check(device, n_bytes)?;
        let limit = u64::from(device.physical().limits.max_storage_buffer_range);
        let size = n_bytes.max((old.n_bytes() + old.n_bytes() / 4).next_multiple_of(4).min(limit));
        let larger = Buffer::on_device(device, self.what, size, self.usage)?;
        queue.run("moving a list", |recorder| recorder.copy((old, 0), (&larger, 0), old.n_bytes()))?;
        (self.used_bytes, self.buffer) = (n_bytes, Some(larger));
        Ok(())
    }

    fn check(&self, device: &Device, n_bytes: u64) -> Result<(), RenderError> {
        let limit = u64::from(device.physical().limits.max_storage_buffer_range);
        match n_bytes > limit && self.usage.contains(vk::BufferUsageFlags::STORAGE_BUFFER) {
            true => Err(RenderError::BufferTooLarge { what: self.what, n_bytes, limit }),
            false => Ok(()),
        }
    }

    /// The buffer, once something was reserved.
    pub(crate) fn buffer(&self) -> Option<&Buffer> {
        self.buffer.as_ref()
    }

    /// The used bytes as a shader's binding; `None` if nothing was reserved.
    pub(crate) fn bindable(&self) -> Option<Bindable<'_>> {
        self.buffer.as_ref().map(|buffer| Bindable::Buffer { buffer, n_bytes: self.used_bytes })
    }
}
