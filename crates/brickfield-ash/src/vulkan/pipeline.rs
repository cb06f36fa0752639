//! Compute pipelines, and what is bound to them.
#![expect(unsafe_code, reason = "Vulkan's functions are foreign")]

use std::ffi::CString;
use std::sync::Arc;

use ash::vk;
use brickfield_frame::RenderError;
use brickfield_shaders::{Binding, BindingKind, Specialised};

use super::{Buffer, Device, Image, Sampler};
use crate::error::OfCall;

/// A shader variant, ready to be dispatched.
pub(crate) struct Pipeline {
    pub(super) raw: vk::Pipeline,
    pub(super) layout: vk::PipelineLayout,
    pub(super) set: vk::DescriptorSet,
    set_layout: vk::DescriptorSetLayout,
    pool: vk::DescriptorPool,
    bindings: Vec<Binding>,
    workgroup_size: [u32; 3],
    device: Arc<Device>,
}

/// What a shader's binding is bound to; buffers from their start, with the bytes that the shader sees.
#[derive(Clone, Copy)]
pub(crate) enum Resource<'a> {
    Buffer { buffer: &'a Buffer, n_bytes: u64 },
    Texture(&'a Image),
    Sampler(&'a Sampler),
    Picture(&'a Image),
}

/// A pipeline with everything bound that it needs; the pipeline and its resources are borrowed until it is dropped.
pub(crate) struct BoundPipeline<'a> {
    pub(super) pipeline: &'a Pipeline,
}

impl Pipeline {
    /// The pipeline of a shader.
    pub(crate) fn new(device: &Arc<Device>, shader: &Specialised) -> Result<Pipeline, RenderError> {
        let spirv = shader.spirv().map_err(|e| RenderError::Shader { message: e.to_string() })?;
        let mut pipeline = Pipeline {
            raw: vk::Pipeline::null(),
            layout: vk::PipelineLayout::null(),
            set: vk::DescriptorSet::null(),
            set_layout: vk::DescriptorSetLayout::null(),
            pool: vk::DescriptorPool::null(),
            bindings: shader.bindings.clone(),
            workgroup_size: shader.workgroup_size,
            device: device.clone(),
        };
        pipeline.lay_out()?;
        pipeline.allocate_set()?;
        pipeline.compile(&spirv, shader.entry_point())?;
        Ok(pipeline)
    }

    /// Whether the shader has a binding of this number.
    pub(crate) fn binds(&self, index: u32) -> bool {
        self.bindings.iter().any(|b| b.index == index)
    }

    /// Whether the shader has a binding of a kind.
    pub(crate) fn needs(&self, kind: BindingKind) -> bool {
        self.bindings.iter().any(|b| b.kind == kind)
    }

    /// Invocations along x, y, z of a workgroup.
    pub(crate) fn workgroup_size(&self) -> [u32; 3] {
        self.workgroup_size
    }

    /// Binds what the shader needs; `resource` says what a binding index stands for.
    pub(crate) fn bind<'a>(
        &'a mut self,
        resource: impl Fn(u32) -> Option<Resource<'a>>,
    ) -> Result<BoundPipeline<'a>, RenderError> {
        for binding in &self.bindings {
            let resource = resource(binding.index).ok_or_else(|| RenderError::Shader {
                message: format!("binding {} ({:?}) is none that a plan fills", binding.index, binding.kind),
            })?;
            self.write(*binding, resource)?;
        }
        Ok(BoundPipeline { pipeline: self })
    }

    fn write(&self, Binding { index, kind }: Binding, resource: Resource<'_>) -> Result<(), RenderError> {
        let buffer = match resource {
            Resource::Buffer { buffer, n_bytes } => {
                vk::DescriptorBufferInfo::default().buffer(buffer.raw).range(n_bytes.min(buffer.n_bytes()))
            }
            _ => vk::DescriptorBufferInfo::default(),
        };
        let image = vk::DescriptorImageInfo::default();
        let image = match resource {
            Resource::Texture(t) => image.image_view(t.view).image_layout(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL),
            Resource::Picture(p) => image.image_view(p.view).image_layout(vk::ImageLayout::GENERAL),
            Resource::Sampler(s) => image.sampler(s.raw),
            Resource::Buffer { .. } => image,
        };
        let (buffers, images) = ([buffer], [image]);
        let write = vk::WriteDescriptorSet::default()
            .dst_set(self.set)
            .dst_binding(index)
            .descriptor_type(descriptor_type(kind));
        let write = match (kind, resource) {
            (
                BindingKind::Uniform | BindingKind::StorageRead | BindingKind::StorageReadWrite,
                Resource::Buffer { .. },
            ) => write.buffer_info(&buffers),
            (BindingKind::Texture3d, Resource::Texture(_))
            | (BindingKind::Sampler, Resource::Sampler(_))
            | (BindingKind::StorageImage, Resource::Picture(_)) => write.image_info(&images),
            _ => return Err(RenderError::Shader { message: format!("binding {index} is unexpectedly a {kind:?}") }),
        };
        // SAFETY: the set is of this layout and not in use: the device is idle, and binding borrows the pipeline mutably.
        unsafe { self.device.raw().update_descriptor_sets(&[write], &[]) };
        Ok(())
    }

    fn lay_out(&mut self) -> Result<(), RenderError> {
        let binding = |b: &Binding| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(b.index)
                .descriptor_type(descriptor_type(b.kind))
                .descriptor_count(1)
                .stage_flags(vk::ShaderStageFlags::COMPUTE)
        };
        let bindings: Vec<_> = self.bindings.iter().map(binding).collect();
        let set_layout = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        let device = self.device.raw();
        // SAFETY: the bindings live until the call returns; their types are known to every device.
        self.set_layout =
            unsafe { device.create_descriptor_set_layout(&set_layout, None) }.of("vkCreateDescriptorSetLayout")?;
        let set_layouts = [self.set_layout];
        let layout = vk::PipelineLayoutCreateInfo::default().set_layouts(&set_layouts);
        // SAFETY: the set layout is alive.
        self.layout = unsafe { device.create_pipeline_layout(&layout, None) }.of("vkCreatePipelineLayout")?;
        Ok(())
    }

    fn allocate_set(&mut self) -> Result<(), RenderError> {
        let size = |b: &Binding| vk::DescriptorPoolSize { ty: descriptor_type(b.kind), descriptor_count: 1 };
        let sizes: Vec<_> = self.bindings.iter().map(size).collect();
        let pool = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
        let device = self.device.raw();
        // SAFETY: the sizes live until the call returns.
        self.pool = unsafe { device.create_descriptor_pool(&pool, None) }.of("vkCreateDescriptorPool")?;
        let set_layouts = [self.set_layout];
        let sets = vk::DescriptorSetAllocateInfo::default().descriptor_pool(self.pool).set_layouts(&set_layouts);
        // SAFETY: the pool is new and as large as the layout.
        self.set = unsafe { device.allocate_descriptor_sets(&sets) }.of("vkAllocateDescriptorSets")?[0];
        Ok(())
    }

    fn compile(&mut self, spirv: &[u32], entry_point: &str) -> Result<(), RenderError> {
        let name = CString::new(entry_point).map_err(|e| RenderError::Shader { message: e.to_string() })?;
        let device = self.device.raw();
        // SAFETY: naga validated the module that it wrote this code from.
        let module = unsafe { device.create_shader_module(&vk::ShaderModuleCreateInfo::default().code(spirv), None) };
        let module = module.of("vkCreateShaderModule")?;
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module)
            .name(&name);
        let info = vk::ComputePipelineCreateInfo::default().stage(stage).layout(self.layout);
        // SAFETY: module and layout are alive; the layout was made from the module's own bindings.
        let made = unsafe { device.create_compute_pipelines(vk::PipelineCache::null(), &[info], None) };
        // SAFETY: a pipeline does not need its module any more.
        unsafe { device.destroy_shader_module(module, None) };
        self.raw = made.map_err(|(_, code)| code).of("vkCreateComputePipelines")?[0];
        Ok(())
    }
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        let device = self.device.raw();
        // SAFETY: the device is idle, and nothing else names these; null handles are allowed. The set goes with its pool.
        unsafe {
            device.destroy_pipeline(self.raw, None);
            device.destroy_pipeline_layout(self.layout, None);
            device.destroy_descriptor_pool(self.pool, None);
            device.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}

impl BoundPipeline<'_> {
    /// Workgroups that cover `n` invocations along x, y, z.
    pub(crate) fn workgroups(&self, n: [u32; 3]) -> [u32; 3] {
        let size = self.pipeline.workgroup_size;
        std::array::from_fn(|i| n[i].div_ceil(size[i].max(1)))
    }
}

fn descriptor_type(kind: BindingKind) -> vk::DescriptorType {
    match kind {
        BindingKind::Uniform => vk::DescriptorType::UNIFORM_BUFFER,
        BindingKind::Texture3d => vk::DescriptorType::SAMPLED_IMAGE,
        BindingKind::Sampler => vk::DescriptorType::SAMPLER,
        BindingKind::StorageRead | BindingKind::StorageReadWrite => vk::DescriptorType::STORAGE_BUFFER,
        BindingKind::StorageImage => vk::DescriptorType::STORAGE_IMAGE,
    }
}
