//! Shader variants as pipelines.

use std::borrow::Cow;
use std::sync::Arc;

use brickfield_frame::{ProxyCorner, RenderError, Resource, Target, TextureLayout};
use brickfield_shaders::{Binding, BindingKind, Entry, PipelineKey, Pipelines, ShaderLibrary, Specialised};

use crate::device::Device;
use crate::picture::{DEPTH, format};
use crate::texture::view_dimension;

/// A variant, ready to run.
pub(crate) struct Pipeline {
    pub(crate) program: Program,
    pub(crate) layout: wgpu::BindGroupLayout,
    pub(crate) bindings: Vec<Binding>,
    pub(crate) workgroup_size: [u32; 3],
}

/// The kind of pipeline that runs a variant.
pub(crate) enum Program {
    Compute(wgpu::ComputePipeline),
    Polygons(wgpu::RenderPipeline),
    Mesh(wgpu::RenderPipeline),
}

/// The pipelines of a device, none yet.
pub(crate) fn pipelines(device: &Arc<Device>, library: ShaderLibrary) -> Pipelines<Pipeline> {
    let device = Arc::clone(device);
    Pipelines::new(move |key| build(&device, &library, key))
}

impl Pipeline {
    /// Whether the shader reads or writes a resource.
    pub(crate) fn uses(&self, resource: Resource) -> bool {
        self.bindings.iter().any(|b| b.resource == resource)
    }
}

fn build(device: &Device, library: &ShaderLibrary, key: &PipelineKey) -> Result<Pipeline, RenderError> {
    let shader = library.specialise_within(&key.variant, device.description.capabilities.max_storage_buffers)?;
    let n_bytes = shader.wgsl.len() as u64;
    device.checked("building a shader variant", n_bytes, || from_shader(&device.device, shader, key.target))
}

fn from_shader(device: &wgpu::Device, shader: Specialised, target: Target) -> Pipeline {
    let entry = shader.variant.entry;
    let label = entry.entry_points()[0];
    let entries: Vec<_> = shader.bindings.iter().map(|b| layout_entry(b, entry)).collect();
    let layout =
        device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries });
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(label),
        bind_group_layouts: &[Some(&layout)],
        immediate_size: 0,
    });
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(label),
        source: wgpu::ShaderSource::Naga(Cow::Owned(shader.module)),
    });
    let program = match entry {
        Entry::Proxy(_) => Program::Polygons(triangles(device, &pipeline_layout, &module, (entry, target))),
        Entry::Mesh(_) => Program::Mesh(triangles(device, &pipeline_layout, &module, (entry, Target::Float32))),
        Entry::March | Entry::Evaluate(_) | Entry::Probe(_) | Entry::Decode | Entry::Cells(_) => {
            Program::Compute(compute(device, &pipeline_layout, &module, label))
        }
    };
    Pipeline { program, layout, bindings: shader.bindings, workgroup_size: shader.workgroup_size }
}

fn compute(
    device: &wgpu::Device,
    layout: &wgpu::PipelineLayout,
    module: &wgpu::ShaderModule,
    entry_point: &str,
) -> wgpu::ComputePipeline {
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(entry_point),
        layout: Some(layout),
        module,
        entry_point: Some(entry_point),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    })
}

/// Triangles seen from both sides. Polygons have corners of their own, and are blended; the corners of a mesh the shader finds by their
/// numbers, and of each pixel the nearest triangle stays.
fn triangles(
    device: &wgpu::Device,
    layout: &wgpu::PipelineLayout,
    module: &wgpu::ShaderModule,
    (entry, target): (Entry, Target),
) -> wgpu::RenderPipeline {
    let [vertex, fragment] = [0, 1].map(|i| Some(entry.entry_points()[i]));
    let compilation_options = wgpu::PipelineCompilationOptions::default;
    let is_mesh = matches!(entry, Entry::Mesh(_));
    let corners = Some(wgpu::VertexBufferLayout {
        array_stride: size_of::<ProxyCorner>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &wgpu::vertex_attr_array![0 => Float32x2, 1 => Float32, 2 => Uint32, 3 => Uint32],
    });
    let depths = wgpu::DepthStencilState {
        format: DEPTH,
        depth_write_enabled: Some(true),
        depth_compare: Some(wgpu::CompareFunction::Greater),
        stencil: wgpu::StencilState::default(),
        bias: wgpu::DepthBiasState::default(),
    };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(if is_mesh { "mesh" } else { "polygons" }),
        layout: Some(layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: vertex,
            compilation_options: compilation_options(),
            buffers: if is_mesh { &[] } else { std::slice::from_ref(&corners) },
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: is_mesh.then_some(depths),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: fragment,
            compilation_options: compilation_options(),
            targets: &[Some(wgpu::ColorTargetState {
                format: format(target),
                blend: (!is_mesh).then_some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
                write_mask: wgpu::ColorWrites::ALL,
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}

fn layout_entry(binding: &Binding, entry: Entry) -> wgpu::BindGroupLayoutEntry {
    let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let storage = |read_only| buffer(wgpu::BufferBindingType::Storage { read_only });
    let ty = match binding.kind {
        BindingKind::Uniform => buffer(wgpu::BufferBindingType::Uniform),
        BindingKind::Texture(layout) => wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: layout == TextureLayout::Volume },
            view_dimension: view_dimension(layout),
            multisampled: false,
        },
        BindingKind::Sampler(TextureLayout::Volume) => wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
        BindingKind::Sampler(TextureLayout::Layers) => {
            wgpu::BindingType::Sampler(wgpu::SamplerBindingType::NonFiltering)
        }
        BindingKind::StorageRead => storage(true),
        BindingKind::StorageReadWrite => storage(false),
        BindingKind::StorageImage => wgpu::BindingType::StorageTexture {
            access: wgpu::StorageTextureAccess::WriteOnly,
            format: format(Target::Float32),
            view_dimension: wgpu::TextureViewDimension::D2,
        },
    };
    let visibility = match entry {
        Entry::Proxy(_) | Entry::Mesh(_) => wgpu::ShaderStages::VERTEX_FRAGMENT,
        Entry::March | Entry::Evaluate(_) | Entry::Probe(_) | Entry::Decode | Entry::Cells(_) => {
            wgpu::ShaderStages::COMPUTE
        }
    };
    wgpu::BindGroupLayoutEntry { binding: binding.index, visibility, ty, count: None }
}
