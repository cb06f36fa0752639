//! Texture reads without the rest of a march.

use std::time::Instant;

use ash::vk;
use brickfield_core::glam::UVec3;
use brickfield_frame::{Probe, RenderError, Resource, TextureReads, TextureWork};
use brickfield_shaders::{PipelineKey, Variant};

use crate::AshBackend;
use crate::march::milliseconds_since;
use crate::resources::Reused;
use crate::staging::Write;
use crate::texture::check_format;
use crate::vulkan::{Bindable, ImageBox, Sampler, Use, VulkanImage};

impl Probe for AshBackend {
    fn texture_reads(&mut self, work: &TextureWork, n_runs: usize) -> Result<TextureReads, RenderError> {
        let (texture, sampler) = (self.noise(work)?, Sampler::of(work.fetch.layout(), &self.device)?);
        let mut uniforms = Reused::new("the probe's uniforms", vk::BufferUsageFlags::UNIFORM_BUFFER);
        let mut means = Reused::new("the means of rays", vk::BufferUsageFlags::STORAGE_BUFFER);
        let contents = work.uniforms();
        let bytes = bytemuck::bytes_of(&contents);
        let target = uniforms.reserve(&self.device, bytes.len())?;
        self.staging.fill(&mut self.queue, &[Write { target, offset: 0, bytes }])?;
        let n_bytes = work.n_rays.element_product() as usize * size_of::<f32>();
        means.reserve(&self.device, n_bytes)?;
        let bound =
            self.pipelines.of(PipelineKey::computing(Variant::probe(work.fetch)))?.bind(|binding| {
                match binding.resource {
                    Resource::Probe => uniforms.bindable(),
                    Resource::Atlas => Some(Bindable::Texture(&texture)),
                    Resource::AtlasSampler | Resource::NearestSampler => Some(Bindable::Sampler(&sampler)),
                    Resource::Means => means.bindable(),
                    _ => None,
                }
            })?;
        let groups = bound.workgroups([work.n_rays.x, work.n_rays.y, 1]);
        let (mut device_ms, mut wall_ms) = (Vec::new(), Vec::new());
        for _ in 0..n_runs {
            let begin = Instant::now();
            device_ms.extend(self.queue.run_timed("reading textures", |recorder| recorder.dispatch(&bound, groups))?);
            wall_ms.push(milliseconds_since(begin));
        }
        let mut of_rays = vec![0.0; n_bytes / size_of::<f32>()];
        let bytes = self.staging.read(&mut self.queue, means.reserve(&self.device, n_bytes)?, n_bytes)?;
        bytemuck::cast_slice_mut::<f32, u8>(&mut of_rays).copy_from_slice(bytes);
        Ok(TextureReads { device_ms, wall_ms, means: of_rays })
    }
}

impl AshBackend {
    /// The texture of a probe, layers by layers.
    fn noise(&mut self, work: &TextureWork) -> Result<VulkanImage, RenderError> {
        let layout = work.fetch.layout();
        check_format(&self.device, work.format, layout)?;
        let limit = self.device.physical().capabilities().max_texels(layout);
        if work.texels.max_element() > limit {
            return Err(RenderError::TextureTooLarge { texels: work.texels, limit });
        }
        let image = VulkanImage::texture(&self.device, work.format, layout, work.texels)?;
        self.queue.run("preparing a texture", |recorder| {
            recorder.image_barrier(&image, Use::Nothing, Use::CopyTarget);
        })?;
        let UVec3 { x, y, z: depth } = work.texels;
        let layer_bytes = x as usize * y as usize * work.format.n_bytes();
        let n_at_once = self.staging.pieces_at_once(layer_bytes) as u32;
        for z in (0..depth).step_by(n_at_once as usize) {
            let n = n_at_once.min(depth - z);
            let bytes = work.layers(z, n);
            let buffer = self.staging.upload(bytes.len())?;
            buffer.write(0, &bytes);
            let (buffer, origin, extent) = (buffer.buffer(), UVec3::new(0, 0, z), UVec3::new(x, y, n));
            let part = ImageBox { buffer_offset: 0, row_bytes: None, origin, extent };
            self.queue.run("uploading a texture", |recorder| {
                recorder.fill(buffer, &image, work.format.n_bytes() as u64, &[part]);
            })?;
        }
        self.staging.shrink();
        self.queue.run("finishing a texture", |recorder| {
            recorder.image_barrier(&image, Use::CopyTarget, Use::ShaderRead);
        })?;
        Ok(image)
    }
}
