//! Shader variants as pipelines.

use std::borrow::Cow;
use std::collections::HashMap;

use brickfield_frame::RenderError;
use brickfield_shaders::{Binding, BindingKind, ShaderLibrary, Specialised, Variant};

use crate::device::Device;

/// A variant, ready to run.
pub(crate) struct Pipeline {
    pub(crate) pipeline: wgpu::ComputePipeline,
    pub(crate) layout: wgpu::BindGroupLayout,
    pub(crate) bindings: Vec<Binding>,
    pub(crate) workgroup_size: [u32; 3],
}

/// The pipelines built so far.
#[derive(Default)]
pub(crate) struct Pipelines {
    library: ShaderLibrary,
    built: HashMap<Variant, Pipeline>,
}

impl Pipelines {
    pub(crate) fn new(library: ShaderLibrary) -> Pipelines {
        Pipelines { library, built: HashMap::new() }
    }

    /// The pipeline of a variant, built if it is new.
    pub(crate) fn of(&mut self, device: &Device, variant: Variant) -> Result<&Pipeline, RenderError> {
        if !self.built.contains_key(&variant) {
            let pipeline = build(device, &self.library, &variant)?;
            self.built.insert(variant, pipeline);
        }
        Ok(&self.built[&variant])
    }
}

impl Pipeline {
    pub(crate) fn binds(&self, index: u32) -> bool {
        self.bindings.iter().any(|b| b.index == index)
    }
}

fn build(device: &Device, library: &ShaderLibrary, variant: &Variant) -> Result<Pipeline, RenderError> {
    let shader = library.specialise(variant).map_err(|e| RenderError::Shader { message: e.to_string() })?;
    let n_bytes = shader.wgsl.len() as u64;
    device.checked("building a shader variant", n_bytes, || from_shader(&device.device, shader))
}

fn from_shader(device: &wgpu::Device, shader: Specialised) -> Pipeline {
    let entry_point = shader.entry_point();
    let filtered = shader.bindings.iter().any(|b| b.kind == BindingKind::Sampler);
    let entries: Vec<_> = shader.bindings.iter().map(|b| entry(b, filtered)).collect();
    let layout = device
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(entry_point), entries: &entries });
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(entry_point),
        bind_group_layouts: &[Some(&layout)],
        immediate_size: 0,
    });
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(entry_point),
        source: wgpu::ShaderSource::Naga(Cow::Owned(shader.module)),
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(entry_point),
        layout: Some(&pipeline_layout),
        module: &module,
        entry_point: Some(entry_point),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    });
    Pipeline { pipeline, layout, bindings: shader.bindings, workgroup_size: shader.workgroup_size }
}

fn entry(binding: &Binding, filtered: bool) -> wgpu::BindGroupLayoutEntry {
    let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let storage = |read_only| buffer(wgpu::BufferBindingType::Storage { read_only });
    let ty = match binding.kind {
        BindingKind::Uniform => buffer(wgpu::BufferBindingType::Uniform),
        BindingKind::Texture3d => wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: filtered },
            view_dimension: wgpu::TextureViewDimension::D3,
            multisampled: false,
        },
        BindingKind::Sampler => wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
        BindingKind::StorageRead => storage(true),
        BindingKind::StorageReadWrite => storage(false),
        BindingKind::StorageImage => wgpu::BindingType::StorageTexture {
            access: wgpu::StorageTextureAccess::WriteOnly,
            format: crate::picture::FORMAT,
            view_dimension: wgpu::TextureViewDimension::D2,
        },
    };
    wgpu::BindGroupLayoutEntry { binding: binding.index, visibility: wgpu::ShaderStages::COMPUTE, ty, count: None }
}
