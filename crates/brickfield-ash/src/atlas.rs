//! The bricks of a plan in one 3-D texture.

use std::sync::Arc;

use ash::vk;
use brickfield_core::glam::UVec3;
use brickfield_frame::{AtlasShape, BrickSet, Held, RenderError, SampleFormat};

use crate::staging::Staging;
use crate::vulkan::{Device, Image, ImageBox, Queue, Use, vulkan_format};

/// A set of bricks on the device.
pub(crate) struct Atlas {
    image: Image,
    set: Held<BrickSet>,
}

impl Atlas {
    /// Whether this is the atlas of that set.
    pub(crate) fn holds(&self, set: &Arc<BrickSet>) -> bool {
        self.set.is(set)
    }

    /// The texture.
    pub(crate) fn image(&self) -> &Image {
        &self.image
    }

    /// Brings a set to the device, chunk by chunk.
    pub(crate) fn upload(
        device: &Arc<Device>,
        queue: &mut Queue,
        staging: &mut Staging,
        set: &Arc<BrickSet>,
        shape: AtlasShape,
    ) -> Result<Atlas, RenderError> {
        let image = Image::texture_3d(device, set.format(), shape.texels())?;
        queue.run("preparing the brick atlas", |recorder| {
            recorder.image_barrier(&image, Use::Nothing, Use::CopyTarget);
            if shape.bricks.element_product() > set.n_bricks() {
                // What no brick fills is never part of a sample, but a filter may read it with weight 0: no NaN there.
                recorder.clear(&image);
                recorder.barrier(Use::CopyTarget, Use::CopyTarget);
            }
        })?;
        let bricks_per_chunk = staging.pieces_at_once(set.brick_bytes());
        for (i, bytes) in set.bytes().chunks(bricks_per_chunk * set.brick_bytes()).enumerate() {
            let first_slot = (i * bricks_per_chunk) as u32;
            copy_chunk(queue, staging, &image, &chunk_boxes(set, shape, first_slot, bytes), bytes, set.format())?;
        }
        staging.shrink();
        queue.run("finishing the brick atlas", |recorder| {
            recorder.image_barrier(&image, Use::CopyTarget, Use::ShaderRead);
        })?;
        Ok(Atlas { image, set: Held::of(set) })
    }
}

/// The shape of a set's atlas on a device with 3-D textures of at most `limit` texels a side.
pub(crate) fn atlas_shape(set: &BrickSet, limit: u32) -> Result<AtlasShape, RenderError> {
    let too_large = RenderError::AtlasTooLarge { n_bricks: set.n_bricks(), side: set.side().n_samples(), limit };
    set.atlas(limit).ok_or(too_large)
}

/// Checks that shaders can read a format, through a filter if they use a sampler.
pub(crate) fn check_format(
    device: &Device,
    format: SampleFormat,
    needed: vk::FormatFeatureFlags,
) -> Result<(), RenderError> {
    let filtered = needed.contains(vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR);
    let what = match (format, filtered) {
        (SampleFormat::Unorm8, false) => "read textures of 8-bit samples",
        (SampleFormat::Unorm8, true) => "filter textures of 8-bit samples, as fast mode does",
        (SampleFormat::Unorm16, false) => "read textures of 16-bit samples",
        (SampleFormat::Unorm16, true) => "filter textures of 16-bit samples, as fast mode does",
        (SampleFormat::Float32, false) => "read textures of 32-bit floats",
        (SampleFormat::Float32, true) => "filter textures of 32-bit floats, as fast mode does",
    };
    match device.format_features(vulkan_format(format)).contains(needed) {
        true => Ok(()),
        false => Err(RenderError::Unsupported { what }),
    }
}

fn copy_chunk(
    queue: &mut Queue,
    staging: &mut Staging,
    image: &Image,
    boxes: &[ImageBox],
    bytes: &[u8],
    format: SampleFormat,
) -> Result<(), RenderError> {
    let buffer = staging.upload(bytes.len())?;
    buffer.write(0, bytes);
    let buffer = &*buffer;
    queue.run("uploading bricks", |recorder| recorder.fill(buffer, image, format.n_bytes() as u64, boxes))
}

/// One copy for each brick, from its place in the chunk to its slot.
fn chunk_boxes(set: &BrickSet, shape: AtlasShape, first_slot: u32, bytes: &[u8]) -> Vec<ImageBox> {
    let n = (bytes.len() / set.brick_bytes()) as u32;
    let at = |i: u32| ImageBox {
        buffer_offset: u64::from(i) * set.brick_bytes() as u64,
        origin: shape.origin(first_slot + i),
        extent: UVec3::splat(set.side().n_samples()),
    };
    (0..n).map(at).collect()
}
