//! Pipelines, and the resources that are bound to them.
#![expect(unsafe_code, reason = "Vulkan's functions are foreign")]

use std::ffi::CString;
use std::mem::offset_of;
use std::sync::Arc;

use ash::vk;
use brickfield_frame::{ProxyCorner, RenderError, Resource, Target};
use brickfield_shaders::{Binding, BindingKind, Entry, Specialised};

use super::canvas::{CanvasKind, RenderPass};
use super::{Buffer, Device, Sampler, VulkanImage};
use crate::error::OfCall;
use crate::resources::missing;

/// A shader variant, ready to be dispatched or drawn with.
pub(crate) struct Pipeline {
    pub(super) raw: vk::Pipeline,
    pub(super) layout: vk::PipelineLayout,
    pub(super) set: vk::DescriptorSet,
    set_layout: vk::DescriptorSetLayout,
    pool: vk::DescriptorPool,
    bindings: Vec<Binding>,
    entry: Entry,
    workgroup_size: [u32; 3],
    device: Arc<Device>,
}

/// The resource of a shader's binding; buffers from their start, with the bytes that the shader sees.
#[derive(Clone, Copy)]
pub(crate) enum Bindable<'a> {
    Buffer { buffer: &'a Buffer, n_bytes: u64 },
    Texture(&'a VulkanImage),
    Sampler(&'a Sampler),
    Picture(&'a VulkanImage),
}

/// A pipeline with everything bound that it needs; the pipeline and its resources are borrowed until it is dropped.
pub(crate) struct BoundPipeline<'a> {
    pub(super) pipeline: &'a Pipeline,
}

impl Pipeline {
    /// The pipeline of a shader; one of polygons blends them into `target`.
    pub(crate) fn new(device: &Arc<Device>, shader: &Specialised, target: Target) -> Result<Pipeline, RenderError> {
        let spirv = shader.spirv().map_err(|e| RenderError::Shader { message: e.to_string() })?;
        let mut pipeline = Pipeline {
            raw: vk::Pipeline::null(),
            layout: vk::PipelineLayout::null(),
            set: vk::DescriptorSet::null(),
            set_layout: vk::DescriptorSetLayout::null(),
            pool: vk::DescriptorPool::null(),
            bindings: shader.bindings.clone(),
            entry: shader.variant.entry,
            workgroup_size: shader.workgroup_size,
            device: device.clone(),
        };
        pipeline.lay_out()?;
        pipeline.allocate_set()?;
        pipeline.compile(&spirv, target)?;
        Ok(pipeline)
    }

    /// All that the shader reads and writes.
    pub(crate) fn bindings(&self) -> &[Binding] {
        &self.bindings
    }

    /// Whether the shader reads or writes a resource.
    pub(crate) fn uses(&self, resource: Resource) -> bool {
        self.bindings.iter().any(|b| b.resource == resource)
    }

    /// Invocations along x, y, z of a workgroup.
    pub(crate) fn workgroup_size(&self) -> [u32; 3] {
        self.workgroup_size
    }

    /// Binds the resources that the shader names; `bindable` finds the resource of a binding.
    pub(crate) fn bind<'a>(
        &'a mut self,
        bindable: impl Fn(&Binding) -> Option<Bindable<'a>>,
    ) -> Result<BoundPipeline<'a>, RenderError> {
        for binding in &self.bindings {
            self.write(*binding, bindable(binding).ok_or_else(|| missing(binding.resource))?)?;
        }
        Ok(BoundPipeline { pipeline: self })
    }

    fn write(&self, Binding { index, resource, kind }: Binding, bindable: Bindable<'_>) -> Result<(), RenderError> {
        let buffer = match bindable {
            Bindable::Buffer { buffer, n_bytes } => {
                vk::DescriptorBufferInfo::default().buffer(buffer.raw).range(n_bytes.min(buffer.n_bytes()))
            }
            _ => vk::DescriptorBufferInfo::default(),
        };
        let image = vk::DescriptorImageInfo::default();
        let image = match bindable {
            Bindable::Texture(t) => image.image_view(t.view).image_layout(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL),
            Bindable::Picture(p) => image.image_view(p.view).image_layout(vk::ImageLayout::GENERAL),
            Bindable::Sampler(s) => image.sampler(s.raw),
            Bindable::Buffer { .. } => image,
        };
        let (buffers, images) = ([buffer], [image]);
        let write = vk::WriteDescriptorSet::default()
            .dst_set(self.set)
            .dst_binding(index)
            .descriptor_type(descriptor_type(kind));
        let write = match (kind, bindable) {
            (
                BindingKind::Uniform | BindingKind::StorageRead | BindingKind::StorageReadWrite,
                Bindable::Buffer { .. },
            ) => write.buffer_info(&buffers),
            (BindingKind::Texture(_), Bindable::Texture(_))
            | (BindingKind::Sampler(_), Bindable::Sampler(_))
            | (BindingKind::StorageImage, Bindable::Picture(_)) => write.image_info(&images),
            _ => {
                return Err(RenderError::Shader {
                    message: format!("`{}` is unexpectedly a {kind:?}", resource.name()),
                });
            }
        };
        // SAFETY: the set is of this layout and not in use: the device is idle, and binding borrows the pipeline mutably.
        unsafe { self.device.raw().update_descriptor_sets(&[write], &[]) };
        Ok(())
    }

    fn lay_out(&mut self) -> Result<(), RenderError> {
        let stages = match self.entry {
            Entry::Proxy(_) | Entry::Mesh(_) => vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT,
            Entry::March | Entry::Evaluate(_) | Entry::Probe(_) | Entry::Decode | Entry::Cells(_) => {
                vk::ShaderStageFlags::COMPUTE
            }
        };
        let binding = |b: &Binding| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(b.index)
                .descriptor_type(descriptor_type(b.kind))
                .descriptor_count(1)
                .stage_flags(stages)
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

    fn compile(&mut self, spirv: &[u32], target: Target) -> Result<(), RenderError> {
        let device = self.device.clone();
        // SAFETY: naga validated the module that it wrote this code from.
        let module =
            unsafe { device.raw().create_shader_module(&vk::ShaderModuleCreateInfo::default().code(spirv), None) };
        let module = module.of("vkCreateShaderModule")?;
        let made = match self.entry {
            Entry::Proxy(_) => self.compile_triangles(module, CanvasKind::Polygons(target)),
            Entry::Mesh(_) => self.compile_triangles(module, CanvasKind::Mesh),
            Entry::March | Entry::Evaluate(_) | Entry::Probe(_) | Entry::Decode | Entry::Cells(_) => {
                self.compile_compute(module)
            }
        };
        // SAFETY: a pipeline does not need its module any more.
        unsafe { device.raw().destroy_shader_module(module, None) };
        self.raw = made?;
        Ok(())
    }

    fn compile_compute(&self, module: vk::ShaderModule) -> Result<vk::Pipeline, RenderError> {
        let names = names(self.entry)?;
        let stage = stage(vk::ShaderStageFlags::COMPUTE, module, &names[0]);
        let info = vk::ComputePipelineCreateInfo::default().stage(stage).layout(self.layout);
        // SAFETY: module and layout are alive; the layout was made from the module's own bindings.
        let made = unsafe { self.device.raw().create_compute_pipelines(self.device.pipelines, &[info], None) };
        Ok(made.map_err(|(_, code)| code).of("vkCreateComputePipelines")?[0])
    }

    /// Triangles seen from both sides: of [`ProxyCorner`]s, blended over the pixels that are there; or of a mesh, whose corners the shader finds
    /// by their numbers, and of which the nearest stays. Viewport and scissor are set when drawing.
    fn compile_triangles(&self, module: vk::ShaderModule, kind: CanvasKind) -> Result<vk::Pipeline, RenderError> {
        let names = names(self.entry)?;
        let stages = [
            stage(vk::ShaderStageFlags::VERTEX, module, &names[0]),
            stage(vk::ShaderStageFlags::FRAGMENT, module, &names[1]),
        ];
        let buffers = [vk::VertexInputBindingDescription::default().stride(size_of::<ProxyCorner>() as u32)];
        let attributes = corner_attributes();
        let vertices = vk::PipelineVertexInputStateCreateInfo::default();
        let vertices = match kind {
            CanvasKind::Polygons(_) => {
                vertices.vertex_binding_descriptions(&buffers).vertex_attribute_descriptions(&attributes)
            }
            CanvasKind::Mesh => vertices,
        };
        let triangles =
            vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        let raster = vk::PipelineRasterizationStateCreateInfo::default()
            .polygon_mode(vk::PolygonMode::FILL)
            .cull_mode(vk::CullModeFlags::NONE)
            .line_width(1.0);
        let samples =
            vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let blended = [if kind == CanvasKind::Mesh { instead() } else { over() }];
        let depth = nearest();
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blended);
        let changing = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&changing);
        let pass = RenderPass::new(&self.device, kind)?;
        let info = vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&vertices)
            .input_assembly_state(&triangles)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&samples)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(self.layout)
            .render_pass(pass.raw);
        let info = if kind == CanvasKind::Mesh { info.depth_stencil_state(&depth) } else { info };
        // SAFETY: all objects of the description are alive; stages and layout are of one module. The render pass may go: the ones that
        // the pipeline is used in are compatible.
        let made = unsafe { self.device.raw().create_graphics_pipelines(self.device.pipelines, &[info], None) };
        Ok(made.map_err(|(_, code)| code).of("vkCreateGraphicsPipelines")?[0])
    }
}

fn names(entry: Entry) -> Result<Vec<CString>, RenderError> {
    let name = |name: &&str| CString::new(*name).map_err(|e| RenderError::Shader { message: e.to_string() });
    entry.entry_points().iter().map(name).collect()
}

fn stage(
    stage: vk::ShaderStageFlags,
    module: vk::ShaderModule,
    name: &CString,
) -> vk::PipelineShaderStageCreateInfo<'_> {
    vk::PipelineShaderStageCreateInfo::default().stage(stage).module(module).name(name)
}

/// Where the members of a [`ProxyCorner`] go: locations in the order of its members.
fn corner_attributes() -> [vk::VertexInputAttributeDescription; 4] {
    let members = [
        (offset_of!(ProxyCorner, pixel), vk::Format::R32G32_SFLOAT),
        (offset_of!(ProxyCorner, surface), vk::Format::R32_SFLOAT),
        (offset_of!(ProxyCorner, brick), vk::Format::R32_UINT),
        (offset_of!(ProxyCorner, owner), vk::Format::R32_UINT),
    ];
    std::array::from_fn(|location| {
        let (offset, format) = members[location];
        vk::VertexInputAttributeDescription::default().location(location as u32).format(format).offset(offset as u32)
    })
}

/// Premultiplied colours over the pixels that are there.
fn over() -> vk::PipelineColorBlendAttachmentState {
    let (one, rest) = (vk::BlendFactor::ONE, vk::BlendFactor::ONE_MINUS_SRC_ALPHA);
    vk::PipelineColorBlendAttachmentState::default()
        .blend_enable(true)
        .src_color_blend_factor(one)
        .dst_color_blend_factor(rest)
        .color_blend_op(vk::BlendOp::ADD)
        .src_alpha_blend_factor(one)
        .dst_alpha_blend_factor(rest)
        .alpha_blend_op(vk::BlendOp::ADD)
        .color_write_mask(vk::ColorComponentFlags::RGBA)
}

/// Colours instead of those that are there.
fn instead() -> vk::PipelineColorBlendAttachmentState {
    vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA)
}

/// Depths fall with the distance: the greater one stays.
fn nearest() -> vk::PipelineDepthStencilStateCreateInfo<'static> {
    vk::PipelineDepthStencilStateCreateInfo::default()
        .depth_test_enable(true)
        .depth_write_enable(true)
        .depth_compare_op(vk::CompareOp::GREATER)
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
        BindingKind::Texture(_) => vk::DescriptorType::SAMPLED_IMAGE,
        BindingKind::Sampler(_) => vk::DescriptorType::SAMPLER,
        BindingKind::StorageRead | BindingKind::StorageReadWrite => vk::DescriptorType::STORAGE_BUFFER,
        BindingKind::StorageImage => vk::DescriptorType::STORAGE_IMAGE,
    }
}
