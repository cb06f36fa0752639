//! The resources that stay on the device: the contents of plans, by name, and the picture.

use std::collections::BTreeMap;

use brickfield_core::BrickSide;
use brickfield_core::glam::UVec2;
use brickfield_frame::{AtlasShape, Content, FramePlan, FrameUniforms, RenderError, Resource, Slots, TextureLayout};
use brickfield_shaders::{Binding, BindingKind, decodings};
use wgpu::BufferUsages;

use crate::buffer::Reused;
use crate::device::Device;
use crate::picture::{Maker, Picture};
use crate::pipeline::Pipeline;
use crate::texture::{Texture, sampler};

/// The buffers, textures and sampler that shaders read, and the picture that they write.
pub(crate) struct Resources {
    buffers: BTreeMap<Resource, Reused>,
    textures: BTreeMap<Resource, Texture>,
    linear: wgpu::Sampler,
    nearest: wgpu::Sampler,
    pub(crate) picture: Option<Picture>,
}

/// The numbers of a plan, and the bytes that were brought to the device for it.
pub(crate) struct Brought {
    /// The frame's numbers, as for a single pass.
    pub(crate) uniforms: FrameUniforms,
    pub(crate) n_bytes: u64,
}

impl Resources {
    pub(crate) fn new(device: &Device) -> Resources {
        Resources {
            buffers: BTreeMap::new(),
            textures: BTreeMap::new(),
            linear: sampler(&device.device, TextureLayout::Volume),
            nearest: sampler(&device.device, TextureLayout::Layers),
            picture: None,
        }
    }

    /// The buffer of a resource.
    pub(crate) fn buffer(&mut self, resource: Resource) -> &mut Reused {
        let usage = match resource.is_uniform() {
            true => BufferUsages::UNIFORM,
            false => BufferUsages::STORAGE,
        };
        let usage = usage | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        self.buffers.entry(resource).or_insert_with(|| Reused::new(resource.name(), usage))
    }

    /// Brings to the device the contents of `plan` that `pipeline` reads and the device lacks; `decoder` unpacks slots.
    pub(crate) fn bring(
        &mut self,
        device: &Device,
        plan: &FramePlan,
        pipeline: &Pipeline,
        decoder: Option<&Pipeline>,
    ) -> Result<Brought, RenderError> {
        let mut n_bytes = 0;
        for Binding { resource, .. } in &pipeline.bindings {
            n_bytes += match plan.content(*resource) {
                Some(Content::Bytes(bytes)) => self.buffer(*resource).write(device, &bytes)?,
                Some(Content::Chunks(chunks)) => self.buffer(*resource).bring(device, chunks)?,
                Some(Content::Texture(slots)) => {
                    self.bring_slots(device, (*resource, plan.texture_layout()), slots, decoder)?
                }
                None => 0,
            };
        }
        let uniforms = FrameUniforms::of(plan, self.atlas_shape(plan));
        if pipeline.uses(Resource::Frame) {
            n_bytes += self.buffer(Resource::Frame).write(device, bytemuck::bytes_of(&uniforms))?;
        }
        Ok(Brought { uniforms, n_bytes })
    }

    /// Brings the numbers and lists of another plan, as `contents` has them, that `pipeline` reads; the bytes that were brought.
    pub(crate) fn bring_contents<'a>(
        &mut self,
        device: &Device,
        contents: &dyn Fn(Resource) -> Option<Content<'a>>,
        pipeline: &Pipeline,
    ) -> Result<u64, RenderError> {
        let mut n_bytes = 0;
        for Binding { resource, .. } in &pipeline.bindings {
            n_bytes += match contents(*resource) {
                Some(Content::Bytes(bytes)) => self.buffer(*resource).write(device, &bytes)?,
                Some(Content::Chunks(chunks)) => self.buffer(*resource).bring(device, chunks)?,
                None if *resource == Resource::Picture => 0,
                Some(Content::Texture(_)) | None => return Err(missing(*resource)),
            };
        }
        Ok(n_bytes)
    }

    /// Brings the slots that the device lacks; the bytes that were brought.
    fn bring_slots(
        &mut self,
        device: &Device,
        (resource, layout): (Resource, TextureLayout),
        slots: &Slots,
        decoder: Option<&Pipeline>,
    ) -> Result<u64, RenderError> {
        let mut texture = Texture::with_room(device, slots, layout, self.textures.remove(&resource))?;
        let missing = texture.missing(slots);
        let mut n_bytes = texture.upload(device, slots, &missing)?;
        if let Some(decoder) = decoder {
            for decoding in decodings(texture.shape(), slots, &missing) {
                self.unpack(device, decoder, &decoding, &texture)?;
                n_bytes += decoding.n_bytes();
            }
            self.shrink();
        }
        texture.hold(slots);
        self.textures.insert(resource, texture);
        Ok(n_bytes)
    }

    /// All slots are brought again for the next plan.
    pub(crate) fn forget_textures(&mut self) {
        self.textures.clear();
    }

    /// Frees a buffer of more bytes than these.
    pub(crate) fn free_if_larger(&mut self, resource: Resource, n_bytes: u64) {
        let is_larger = |reused: &Reused| reused.buffer().is_some_and(|buffer| buffer.size() > n_bytes);
        if self.buffers.get(&resource).is_some_and(is_larger) {
            self.buffers.remove(&resource);
        }
    }

    /// How the slots of a plan lie in the atlas; that of one brick if no shader reads it.
    fn atlas_shape(&self, plan: &FramePlan) -> AtlasShape {
        let shape = self.textures.get(&Resource::Atlas).and_then(Texture::atlas_shape);
        let side = plan.field().slots().brick_side();
        shape.filter(|s| Some(s.side) == side).unwrap_or(AtlasShape::least(side.unwrap_or(BrickSide::S16)))
    }

    pub(crate) fn resize(&mut self, device: &Device, size: UVec2, maker: Maker) -> Result<(), RenderError> {
        if !self.picture.as_ref().is_some_and(|p| p.fits(size, maker)) {
            self.picture = None;
            self.picture = Some(Picture::new(device, size, maker)?);
        }
        Ok(())
    }

    fn binding(&self, binding: &Binding) -> Option<wgpu::BindingResource<'_>> {
        let resource = &binding.resource;
        match binding.kind {
            BindingKind::Uniform | BindingKind::StorageRead | BindingKind::StorageReadWrite => {
                self.buffers.get(resource)?.binding()
            }
            BindingKind::Texture(_) => Some(wgpu::BindingResource::TextureView(&self.textures.get(resource)?.view)),
            BindingKind::Sampler(TextureLayout::Volume) => Some(wgpu::BindingResource::Sampler(&self.linear)),
            BindingKind::Sampler(TextureLayout::Layers) => Some(wgpu::BindingResource::Sampler(&self.nearest)),
            BindingKind::StorageImage => Some(wgpu::BindingResource::TextureView(&self.picture.as_ref()?.view)),
        }
    }

    /// Everything that a pipeline reads and writes.
    pub(crate) fn bind(&self, device: &Device, pipeline: &Pipeline) -> Result<wgpu::BindGroup, RenderError> {
        let entry = |b: &Binding| {
            let resource = self.binding(b).ok_or_else(|| missing(b.resource))?;
            Ok(wgpu::BindGroupEntry { binding: b.index, resource })
        };
        let entries = pipeline.bindings.iter().map(entry).collect::<Result<Vec<_>, RenderError>>()?;
        device.checked("binding resources", 0, || {
            device.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("frame"),
                layout: &pipeline.layout,
                entries: &entries,
            })
        })
    }
}

/// A shader reads a resource that nobody brought.
pub(crate) fn missing(resource: Resource) -> RenderError {
    RenderError::Shader { message: format!("it reads `{}`, which the plan does not bring", resource.name()) }
}
