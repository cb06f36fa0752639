//! Packed slots, which the device unpacks.

use brickfield_frame::{RenderError, Resource};
use brickfield_shaders::Decoding;

use crate::resources::{Resources, missing};
use crate::staging::{Staging, Write};
use crate::texture::Texture;
use crate::vulkan::{ImageBox, Pipeline, Queue, Use};

/// Buffers of more bytes are not kept for the next slots.
const KEPT_BYTES: u64 = 4 << 20;

impl Resources {
    /// Brings packed slots, unpacks them, and puts their texels into a texture that is open for copies.
    pub(crate) fn unpack(
        &mut self,
        queue: &mut Queue,
        staging: &mut Staging,
        pipeline: &mut Pipeline,
        decoding: &Decoding,
        texture: &Texture,
    ) -> Result<(), RenderError> {
        self.reserve(Resource::Decoding, size_of_val(&decoding.tasks()[0].uniforms))?;
        self.reserve(Resource::Coefficients, 4 * decoding.n_coefficients as usize)?;
        self.reserve(Resource::Texels, 4 * decoding.n_texel_words as usize)?;
        let bricks: &[u8] = bytemuck::cast_slice(&decoding.bricks);
        let words: &[u8] = bytemuck::cast_slice(&decoding.words);
        self.reserve(Resource::PackedBricks, bricks.len())?;
        self.reserve(Resource::PackedWords, words.len())?;
        let buffer = |resource| self.buffer(resource).ok_or_else(|| missing(resource));
        let write = |resource, bytes| Ok::<_, RenderError>(Write { target: buffer(resource)?, offset: 0, bytes });
        let writes = [write(Resource::PackedBricks, bricks)?, write(Resource::PackedWords, words)?];
        staging.fill(queue, &writes)?;
        let (uniforms, texels) = (buffer(Resource::Decoding)?, buffer(Resource::Texels)?);
        let bound = pipeline.bind(|binding| self.bindable(binding))?;
        let boxes: Vec<ImageBox> = decoding.texels.iter().map(ImageBox::of).collect();
        queue.run("unpacking samples", |recorder| {
            for task in decoding.tasks() {
                recorder.barrier(Use::ShaderWrite, Use::CopyTarget);
                recorder.update(uniforms, bytemuck::bytes_of(&task.uniforms));
                recorder.barrier(Use::CopyTarget, Use::ShaderRead);
                recorder.barrier(Use::ShaderWrite, Use::ShaderWrite);
                recorder.dispatch(&bound, bound.workgroups(task.n));
            }
            recorder.barrier(Use::ShaderWrite, Use::CopySource);
            recorder.fill(texels, texture.image(), texture.texel_bytes(), &boxes);
        })
    }

    /// Frees large buffers that only unpacking needs.
    pub(crate) fn shrink(&mut self) {
        for resource in [Resource::PackedBricks, Resource::PackedWords, Resource::Coefficients, Resource::Texels] {
            self.free_if_larger(resource, KEPT_BYTES);
        }
    }
}
