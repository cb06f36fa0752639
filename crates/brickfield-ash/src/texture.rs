//! The samples of slots in a texture of three axes.

use std::sync::Arc;

use ash::vk;
use brickfield_frame::{
    AtlasShape, Chunked, HeldChunks, RenderError, Room, RoomChange, SampleFormat, Slots, TextureLayout, TextureShape,
};

use crate::staging::Staging;
use crate::vulkan::{Device, ImageBox, Queue, Use, VulkanImage, vulkan_format};

/// A texture that holds slots.
pub(crate) struct Texture {
    image: VulkanImage,
    shape: TextureShape,
    format: SampleFormat,
    layout: TextureLayout,
    held: HeldChunks,
}

/// Slots lie in staging memory at multiples of so many bytes.
const ALIGNMENT: usize = 16;

impl Texture {
    /// A texture with room for slots: the old texture, a larger texture with the old contents, or an empty texture.
    pub(crate) fn with_room(
        device: &Arc<Device>,
        queue: &mut Queue,
        slots: &Slots,
        layout: TextureLayout,
        old: Option<Texture>,
    ) -> Result<Texture, RenderError> {
        check_format(device, slots.format(), layout)?;
        let limit = device.physical().capabilities().max_texels(layout);
        let mut old = old.filter(|old| (old.format, old.layout) == (slots.format(), layout));
        if let Some(old) = old.take_if(|old| old.held.has_all(slots)) {
            return Ok(old);
        }
        let room = slots.room(old.as_ref().map(|old| old.shape), limit)?;
        match (room, old) {
            (Room { change: RoomChange::Keep, .. }, Some(old)) => Ok(old),
            (Room { change: RoomChange::Grow, shape }, Some(old)) => old.grown(device, queue, shape),
            (Room { shape, .. }, old) => {
                drop(old);
                Texture::empty(device, queue, shape, (slots.format(), layout))
            }
        }
    }

    /// How bricks lie in it.
    pub(crate) fn atlas_shape(&self) -> Option<AtlasShape> {
        self.shape.atlas()
    }

    /// The image that shaders read.
    pub(crate) fn image(&self) -> &VulkanImage {
        &self.image
    }

    /// A texture of zeros: where there is no slot, a filter may still read with weight 0, and must find no NaN.
    fn empty(
        device: &Arc<Device>,
        queue: &mut Queue,
        shape: TextureShape,
        (format, layout): (SampleFormat, TextureLayout),
    ) -> Result<Texture, RenderError> {
        let image = VulkanImage::texture(device, format, layout, shape.texels())?;
        queue.run("preparing the atlas", |recorder| {
            recorder.image_barrier(&image, Use::Nothing, Use::CopyTarget);
            recorder.clear(&image);
            recorder.image_barrier(&image, Use::CopyTarget, Use::ShaderRead);
        })?;
        Ok(Texture { image, shape, format, layout, held: HeldChunks::default() })
    }

    /// A larger atlas with this one's bricks at their places; without them if both do not fit the device.
    fn grown(self, device: &Arc<Device>, queue: &mut Queue, shape: TextureShape) -> Result<Texture, RenderError> {
        let kind = (self.format, self.layout);
        let larger = match Texture::empty(device, queue, shape, kind) {
            Err(RenderError::OutOfMemory { .. }) => {
                drop(self);
                return Texture::empty(device, queue, shape, kind);
            }
            larger => larger?,
        };
        queue.run("moving the atlas", |recorder| {
            recorder.image_barrier(&self.image, Use::ShaderRead, Use::CopySource);
            recorder.image_barrier(&larger.image, Use::ShaderRead, Use::CopyTarget);
            recorder.copy_image(&self.image, &larger.image);
            recorder.image_barrier(&larger.image, Use::CopyTarget, Use::ShaderRead);
        })?;
        Ok(Texture { held: self.held, ..larger })
    }

    /// Bytes of a texel.
    pub(crate) fn texel_bytes(&self) -> u64 {
        self.format.n_bytes() as u64
    }

    /// How slots lie in it.
    pub(crate) fn shape(&self) -> TextureShape {
        self.shape
    }

    /// The slots that are not there.
    pub(crate) fn missing(&self, slots: &Slots) -> Vec<u32> {
        self.held.missing(slots).into_iter().flatten().map(|slot| slot as u32).collect()
    }

    /// All slots are there now.
    pub(crate) fn hold(&mut self, slots: &Slots) {
        self.held.hold(slots);
    }

    /// Lets copies write it, until it is [`close`](Self::close)d.
    pub(crate) fn open(&self, queue: &mut Queue) -> Result<(), RenderError> {
        queue.run("opening the atlas", |recorder| {
            recorder.image_barrier(&self.image, Use::ShaderRead, Use::CopyTarget);
        })
    }

    /// Lets shaders read it again.
    pub(crate) fn close(&self, queue: &mut Queue) -> Result<(), RenderError> {
        queue.run("finishing the atlas", |recorder| {
            recorder.image_barrier(&self.image, Use::CopyTarget, Use::ShaderRead);
        })
    }

    /// Writes those of some slots that are not packed, while it is open; their bytes.
    pub(crate) fn upload(
        &self,
        queue: &mut Queue,
        staging: &mut Staging,
        slots: &Slots,
        some: &[u32],
    ) -> Result<u64, RenderError> {
        let is_plain = |slot: &u32| slots.samples(*slot).is_some_and(|chunk| chunk.packed().is_none());
        let plain: Vec<u32> = some.iter().copied().filter(is_plain).collect();
        let slot_bytes = slots.chunk_bytes().next_multiple_of(ALIGNMENT);
        let mut n_bytes = 0;
        for some in plain.chunks(staging.pieces_at_once(slot_bytes)) {
            n_bytes += self.copy(queue, staging, slots, some)?;
        }
        staging.shrink();
        Ok(n_bytes)
    }

    fn copy(&self, queue: &mut Queue, staging: &mut Staging, slots: &Slots, some: &[u32]) -> Result<u64, RenderError> {
        let slot_bytes = slots.chunk_bytes().next_multiple_of(ALIGNMENT);
        let buffer = staging.upload(slot_bytes * some.len())?;
        let (mut boxes, mut n_bytes) = (Vec::with_capacity(some.len()), 0);
        for (i, slot) in some.iter().enumerate() {
            let Some(samples) = slots.samples(*slot) else { continue };
            buffer.write(i * slot_bytes, samples.bytes());
            n_bytes += samples.bytes().len() as u64;
            boxes.push(self.place(slots, *slot, (i * slot_bytes) as u64));
        }
        let buffer = buffer.buffer();
        queue.run("uploading samples", |recorder| recorder.fill(buffer, &self.image, self.texel_bytes(), &boxes))?;
        Ok(n_bytes)
    }

    /// From a slot's place in staging memory to its place in the texture.
    fn place(&self, slots: &Slots, slot: u32, buffer_offset: u64) -> ImageBox {
        let (origin, extent) = self.shape.texels_of(slots, slot);
        ImageBox { buffer_offset, row_bytes: None, origin, extent }
    }
}

/// Checks that shaders can read a format: a volume through a filter.
pub(crate) fn check_format(device: &Device, format: SampleFormat, layout: TextureLayout) -> Result<(), RenderError> {
    use TextureLayout::{Layers, Volume};
    let what = match (format, layout) {
        (SampleFormat::Unorm8, Layers) => "read textures of 8-bit samples",
        (SampleFormat::Unorm8, Volume) => "filter textures of 8-bit samples, as fast mode does",
        (SampleFormat::Unorm8x4, Layers) => "read textures of four 8-bit numbers",
        (SampleFormat::Unorm8x4, Volume) => "filter textures of four 8-bit numbers, as fast mode does",
        (SampleFormat::Unorm16, Layers) => "read textures of 16-bit samples",
        (SampleFormat::Unorm16, Volume) => "filter textures of 16-bit samples, as fast mode does",
        (SampleFormat::Float32, Layers) => "read textures of 32-bit floats",
        (SampleFormat::Float32, Volume) => "filter textures of 32-bit floats, as fast mode does",
    };
    let needed = match layout {
        TextureLayout::Volume => {
            vk::FormatFeatureFlags::SAMPLED_IMAGE | vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR
        }
        TextureLayout::Layers => vk::FormatFeatureFlags::SAMPLED_IMAGE,
    };
    match device.format_features(vulkan_format(format)).contains(needed) {
        true => Ok(()),
        false => Err(RenderError::Unsupported { what }),
    }
}
