//! Texture reads without the rest of a march.

use std::time::Instant;

use brickfield_frame::{Fetch, Probe, RenderError, Resource, SampleFormat, TextureLayout, TextureReads, TextureWork};
use brickfield_shaders::{Binding, PipelineKey, Variant};
use wgpu::{BufferUsages, Features};

use crate::WgpuBackend;
use crate::buffer::Reused;
use crate::clock::{Clock, milliseconds_since};
use crate::device::Device;
use crate::pipeline::{Pipeline, Program};
use crate::resources::missing;
use crate::texture::{described, sampler, stored_as, whole_view};

/// Most bytes of texels that are on their way at once, if a layer of the texture has no more.
const BYTES_AT_ONCE: usize = 64 << 20;

impl Probe for WgpuBackend {
    fn texture_reads(&mut self, work: &TextureWork, n_runs: usize) -> Result<TextureReads, RenderError> {
        let (device, clock) = (&self.device, self.clock.as_ref());
        let texture = noise(device, work)?;
        let (mut uniforms, mut means) = (
            Reused::new("the probe's uniforms", BufferUsages::UNIFORM | BufferUsages::COPY_DST),
            Reused::new("the means of rays", BufferUsages::STORAGE | BufferUsages::COPY_SRC),
        );
        uniforms.write(device, bytemuck::bytes_of(&work.uniforms()))?;
        means.reserve(device, u64::from(work.n_rays.element_product()) * size_of::<f32>() as u64)?;
        let pipeline = &*self.pipelines.of(PipelineKey::computing(Variant::probe(work.fetch)))?;
        let group = bind(device, pipeline, (&texture, work.fetch.layout()), [&uniforms, &means])?;
        let (mut device_ms, mut wall_ms) = (Vec::new(), Vec::new());
        for _ in 0..n_runs {
            let begin = Instant::now();
            read(device, pipeline, &group, work, clock)?;
            wall_ms.push(milliseconds_since(begin));
            device_ms.extend(clock.map(|c| c.milliseconds(device)).transpose()?);
        }
        Ok(TextureReads { device_ms, wall_ms, means: read_back(device, &means, work)? })
    }
}

fn noise(device: &Device, work: &TextureWork) -> Result<wgpu::Texture, RenderError> {
    let is_filtered_float = work.fetch == Fetch::Filtered && work.format == SampleFormat::Float32;
    if is_filtered_float && !device.has(Features::FLOAT32_FILTERABLE) {
        return Err(RenderError::Unsupported { what: "filter 32-bit floats in hardware (FLOAT32_FILTERABLE)" });
    }
    let limit = device.description.capabilities.max_texels(work.fetch.layout());
    if work.texels.max_element() > limit {
        return Err(RenderError::TextureTooLarge { texels: work.texels, limit });
    }
    let (format, [x, y, z]) = (stored_as(device, work.format)?, work.texels.to_array());
    let layer_bytes = x as usize * y as usize * work.format.n_bytes();
    device.checked("a texture", layer_bytes as u64 * u64::from(z), || {
        let texture = device.device.create_texture(&described("noise", work.fetch.layout(), work.texels, format));
        let n_at_once = (BYTES_AT_ONCE / layer_bytes.max(1)).max(1) as u32;
        for first in (0..z).step_by(n_at_once as usize) {
            write_layers(device, &texture, work, first, n_at_once.min(z - first));
        }
        texture
    })
}

fn write_layers(device: &Device, texture: &wgpu::Texture, work: &TextureWork, first: u32, n: u32) {
    let [width, height, _] = work.texels.to_array();
    let target =
        wgpu::TexelCopyTextureInfo { origin: wgpu::Origin3d { x: 0, y: 0, z: first }, ..texture.as_image_copy() };
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(width * work.format.n_bytes() as u32),
        rows_per_image: Some(height),
    };
    let size = wgpu::Extent3d { width, height, depth_or_array_layers: n };
    device.queue.write_texture(target, &work.layers(first, n), layout, size);
    device.queue.submit([]);
}

fn bind(
    device: &Device,
    pipeline: &Pipeline,
    (texture, layout): (&wgpu::Texture, TextureLayout),
    [uniforms, means]: [&Reused; 2],
) -> Result<wgpu::BindGroup, RenderError> {
    let (sampler, view) = (sampler(&device.device, layout), whole_view(texture, layout));
    let bound = |resource| match resource {
        Resource::Probe => uniforms.binding(),
        Resource::Atlas => Some(wgpu::BindingResource::TextureView(&view)),
        Resource::AtlasSampler | Resource::NearestSampler => Some(wgpu::BindingResource::Sampler(&sampler)),
        Resource::Means => means.binding(),
        _ => None,
    };
    let entry = |b: &Binding| {
        let resource = bound(b.resource).ok_or_else(|| missing(b.resource))?;
        Ok(wgpu::BindGroupEntry { binding: b.index, resource })
    };
    let entries = pipeline.bindings.iter().map(entry).collect::<Result<Vec<_>, RenderError>>()?;
    device.checked("binding a probe", 0, || {
        device.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("probe"),
            layout: &pipeline.layout,
            entries: &entries,
        })
    })
}

/// One run, to its end.
fn read(
    device: &Device,
    pipeline: &Pipeline,
    group: &wgpu::BindGroup,
    work: &TextureWork,
    clock: Option<&Clock>,
) -> Result<(), RenderError> {
    let Program::Compute(program) = &pipeline.program else {
        return Err(RenderError::Unsupported { what: "compute with a shader that draws" });
    };
    let [x, y, _] = pipeline.workgroup_size;
    device.checked("reading textures", 0, || {
        let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("probe"),
            timestamp_writes: clock.map(Clock::writes),
        });
        pass.set_pipeline(program);
        pass.set_bind_group(0, group, &[]);
        pass.dispatch_workgroups(work.n_rays.x.div_ceil(x), work.n_rays.y.div_ceil(y), 1);
        drop(pass);
        if let Some(clock) = clock {
            clock.resolve(&mut encoder);
        }
        device.queue.submit([encoder.finish()]);
    })?;
    device.wait("reading textures")
}

fn read_back(device: &Device, means: &Reused, work: &TextureWork) -> Result<Vec<f32>, RenderError> {
    let from = means.buffer().ok_or_else(|| missing(Resource::Means))?;
    let n_bytes = u64::from(work.n_rays.element_product()) * size_of::<f32>() as u64;
    let mut staging = Reused::new("reading the means back", BufferUsages::MAP_READ | BufferUsages::COPY_DST);
    let to = staging.reserve(device, n_bytes)?;
    device.checked("copying the means", n_bytes, || {
        let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(from, 0, to, 0, n_bytes);
        device.queue.submit([encoder.finish()]);
    })?;
    Ok(bytemuck::pod_collect_to_vec(&device.read(to, n_bytes)?))
}
