//! Packed slots, which the device unpacks.

use brickfield_frame::{RenderError, Resource};
use brickfield_shaders::{DecodedTexels, Decoding};

use crate::backend::dispatch;
use crate::device::Device;
use crate::pipeline::Pipeline;
use crate::resources::{Resources, missing};
use crate::texture::{Texture, extent};

/// Buffers of more bytes are not kept for the next slots.
const KEPT_BYTES: u64 = 4 << 20;

impl Resources {
    /// Brings packed slots, unpacks them, and puts their texels into a texture.
    pub(crate) fn unpack(
        &mut self,
        device: &Device,
        pipeline: &Pipeline,
        decoding: &Decoding,
        texture: &Texture,
    ) -> Result<(), RenderError> {
        self.buffer(Resource::PackedBricks).write(device, bytemuck::cast_slice(&decoding.bricks))?;
        self.buffer(Resource::PackedWords).write(device, bytemuck::cast_slice(&decoding.words))?;
        self.buffer(Resource::Coefficients).reserve(device, 4 * u64::from(decoding.n_coefficients))?;
        self.buffer(Resource::Texels).reserve(device, 4 * u64::from(decoding.n_texel_words))?;
        let size = pipeline.workgroup_size;
        for task in decoding.tasks() {
            self.buffer(Resource::Decoding).write(device, bytemuck::bytes_of(&task.uniforms))?;
            let groups = std::array::from_fn(|i| task.n[i].div_ceil(size[i].max(1)));
            dispatch(device, pipeline, self, groups, None)?;
        }
        let texels = self.buffer(Resource::Texels).buffer().ok_or_else(|| missing(Resource::Texels))?;
        device.checked("the atlas's samples", 0, || {
            let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            decoding.texels.iter().for_each(|of_slot| copy(&mut encoder, texels, texture, of_slot));
            device.queue.submit([encoder.finish()]);
        })?;
        device.wait("unpacking samples")
    }

    /// Frees large buffers that only unpacking needs.
    pub(crate) fn shrink(&mut self) {
        for resource in [Resource::PackedBricks, Resource::PackedWords, Resource::Coefficients, Resource::Texels] {
            self.free_if_larger(resource, KEPT_BYTES);
        }
    }
}

fn copy(encoder: &mut wgpu::CommandEncoder, texels: &wgpu::Buffer, texture: &Texture, of_slot: &DecodedTexels) {
    let DecodedTexels { offset, row_bytes, origin, size } = *of_slot;
    let layout = wgpu::TexelCopyBufferLayout { offset, bytes_per_row: Some(row_bytes), rows_per_image: Some(size.y) };
    let from = wgpu::TexelCopyBufferInfo { buffer: texels, layout };
    encoder.copy_buffer_to_texture(from, texture.from(origin), extent(size));
}
