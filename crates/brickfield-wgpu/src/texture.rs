//! The samples of slots in a 3-D texture.

use std::collections::BTreeMap;
use std::ops::Range;

use brickfield_core::glam::UVec3;
use brickfield_frame::{
    AtlasShape, HeldChunks, RenderError, Resource, Room, RoomChange, SampleFormat, Slots, TextureShape,
};
use wgpu::{Features, TextureFormat};

use crate::device::Device;

/// A texture that holds slots.
pub(crate) struct Texture {
    texture: wgpu::Texture,
    pub(crate) view: wgpu::TextureView,
    shape: TextureShape,
    format: SampleFormat,
    held: HeldChunks,
}

/// Bytes that are handed over before the device may go on with them.
const BYTES_AT_ONCE: usize = 64 << 20;

impl Texture {
    /// Brings the slots that the device lacks; returns the bytes that were brought.
    pub(crate) fn bring(
        device: &Device,
        slots: &Slots,
        textures: &mut BTreeMap<Resource, Texture>,
        resource: Resource,
    ) -> Result<u64, RenderError> {
        let old = textures.remove(&resource);
        let mut texture = match old {
            Some(texture) if texture.held.has_all(slots) => texture,
            old => Texture::with_room(device, slots, old)?,
        };
        let n_bytes = texture.upload(device, slots)?;
        textures.insert(resource, texture);
        Ok(n_bytes)
    }

    /// How bricks lie in it.
    pub(crate) fn atlas_shape(&self) -> Option<AtlasShape> {
        self.shape.atlas()
    }

    /// A texture with room for slots: the old texture, a larger texture with the old contents, or an empty texture.
    fn with_room(device: &Device, slots: &Slots, old: Option<Texture>) -> Result<Texture, RenderError> {
        let limit = device.description.capabilities.max_texture_3d;
        let old = old.filter(|old| old.format == slots.format());
        let room = slots.room(old.as_ref().map(|old| old.shape), limit)?;
        match (room, old) {
            (Room { change: RoomChange::Keep, .. }, Some(old)) => Ok(old),
            (Room { change: RoomChange::Grow, shape }, Some(old)) => old.grown(device, shape),
            (Room { shape, .. }, old) => {
                drop(old);
                Texture::empty(device, shape, slots.format())
            }
        }
    }

    fn empty(device: &Device, shape: TextureShape, format: SampleFormat) -> Result<Texture, RenderError> {
        let texels = shape.texels();
        let n_bytes = texels.to_array().into_iter().map(u64::from).product::<u64>() * format.n_bytes() as u64;
        let stored = stored_as(device, format)?;
        device.checked("the atlas", n_bytes, || {
            let texture = device.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("atlas"),
                size: extent(texels),
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D3,
                format: stored,
                usage: wgpu::TextureUsages::TEXTURE_BINDING
                    | wgpu::TextureUsages::COPY_DST
                    | wgpu::TextureUsages::COPY_SRC,
                view_formats: &[],
            });
            let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
            Texture { texture, view, shape, format, held: HeldChunks::default() }
        })
    }

    /// A larger atlas with this one's bricks at their places; without them if both do not fit the device.
    fn grown(self, device: &Device, shape: TextureShape) -> Result<Texture, RenderError> {
        let larger = match Texture::empty(device, shape, self.format) {
            Err(RenderError::OutOfMemory { .. }) => {
                let format = self.format;
                drop(self);
                return Texture::empty(device, shape, format);
            }
            larger => larger?,
        };
        device.checked("moving the atlas", 0, || {
            let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let (from, to) = (self.texture.as_image_copy(), larger.texture.as_image_copy());
            encoder.copy_texture_to_texture(from, to, extent(self.shape.texels()));
            device.queue.submit([encoder.finish()]);
        })?;
        Ok(Texture { held: self.held, ..larger })
    }

    /// Writes the slots that are not there.
    fn upload(&mut self, device: &Device, slots: &Slots) -> Result<u64, RenderError> {
        let missing: Vec<u32> = self.held.missing(slots).into_iter().flatten().map(|slot| slot as u32).collect();
        if missing.is_empty() {
            self.held.hold(slots);
            return Ok(0);
        }
        let mut n_bytes = 0;
        device.checked("the atlas's samples", 0, || {
            n_bytes = match self.shape {
                TextureShape::Atlas(shape) => self.write_bricks(device, slots, shape, &missing),
                TextureShape::Table(_) => missing.iter().map(|slot| self.write_slot(device, slots, *slot)).sum(),
            };
            device.queue.submit([]);
        })?;
        self.held.hold(slots);
        Ok(n_bytes)
    }

    /// Writes bricks one by one, or a layer at once if most of it is missing and nothing is held: of a slot without samples the
    /// device may still hold the last ones.
    fn write_bricks(&self, device: &Device, slots: &Slots, shape: AtlasShape, missing: &[u32]) -> u64 {
        let per_layer = shape.bricks.x * shape.bricks.y;
        let (mut n_bytes, mut waiting) = (0, 0);
        for layer in missing.chunk_by(|a, b| a / per_layer == b / per_layer) {
            let z = layer[0] / per_layer;
            let is_new = !(z * per_layer..(z + 1) * per_layer).any(|slot| self.held.has_any(slot as usize));
            let written = match is_new && 2 * layer.len() as u32 > per_layer {
                true => self.write_layer(device, slots, shape, z),
                false => layer.iter().map(|slot| self.write_slot(device, slots, *slot)).sum(),
            };
            (n_bytes, waiting) = (n_bytes + written, waiting + written as usize);
            if waiting >= BYTES_AT_ONCE {
                device.queue.submit([]);
                waiting = 0;
            }
        }
        n_bytes
    }

    fn write_slot(&self, device: &Device, slots: &Slots, slot: u32) -> u64 {
        let Some(samples) = slots.samples(slot) else { return 0 };
        let (origin, size) = self.shape.texels_of(slots, slot);
        self.write(device, samples.bytes(), origin, size);
        samples.bytes().len() as u64
    }

    /// Writes the bricks at height `layer` of the atlas.
    fn write_layer(&self, device: &Device, slots: &Slots, shape: AtlasShape, layer: u32) -> u64 {
        let (texels, side) = (shape.texels(), shape.side.n_samples());
        let bytes = layer_bytes(slots, shape, layer);
        self.write(device, &bytes, UVec3::new(0, 0, layer * side), UVec3::new(texels.x, texels.y, side));
        bytes.len() as u64
    }

    fn write(&self, device: &Device, bytes: &[u8], origin: UVec3, size: UVec3) {
        let to = wgpu::TexelCopyTextureInfo {
            origin: wgpu::Origin3d { x: origin.x, y: origin.y, z: origin.z },
            ..self.texture.as_image_copy()
        };
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(size.x * self.format.n_bytes() as u32),
            rows_per_image: Some(size.y),
        };
        device.queue.write_texture(to, bytes, layout, extent(size));
    }
}

fn extent(size: UVec3) -> wgpu::Extent3d {
    wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: size.z }
}

/// The slots of a layer of an atlas; fewer in the last layer, or none.
fn slots_of_layer(slots: &Slots, shape: AtlasShape, layer: u32) -> Range<u32> {
    let per_layer = shape.bricks.x * shape.bricks.y;
    layer * per_layer..slots.n_slots().min((layer + 1) * per_layer)
}

/// The texels of a layer of bricks, x fastest; where there is no brick they are 0.
fn layer_bytes(slots: &Slots, shape: AtlasShape, layer: u32) -> Vec<u8> {
    let (texels, side) = (shape.texels(), shape.side.n_samples() as usize);
    let sample = slots.format().n_bytes();
    let (row, image) = (texels.x as usize * sample, texels.x as usize * texels.y as usize * sample);
    let mut bytes = vec![0; image * side];
    for slot in slots_of_layer(slots, shape, layer) {
        let Some(samples) = slots.samples(slot) else { continue };
        let origin = shape.origin(slot);
        let corner = origin.x as usize * sample + origin.y as usize * row;
        for (i, from) in samples.bytes().chunks_exact(side * sample).enumerate() {
            let to = corner + (i / side) * image + (i % side) * row;
            bytes[to..to + from.len()].copy_from_slice(from);
        }
    }
    bytes
}

/// A texel's format on a device.
pub(crate) fn stored_as(device: &Device, format: SampleFormat) -> Result<TextureFormat, RenderError> {
    match format {
        SampleFormat::Unorm8 => Ok(TextureFormat::R8Unorm),
        SampleFormat::Unorm8x4 => Ok(TextureFormat::Rgba8Unorm),
        SampleFormat::Unorm16 if device.has(Features::TEXTURE_FORMAT_16BIT_NORM) => Ok(TextureFormat::R16Unorm),
        SampleFormat::Unorm16 => {
            Err(RenderError::Unsupported { what: "hold 16-bit samples in textures (TEXTURE_FORMAT_16BIT_NORM)" })
        }
        SampleFormat::Float32 => Ok(TextureFormat::R32Float),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::BrickSide;
    use brickfield_frame::Decode;

    #[test]
    fn layers_hold_every_brick_at_its_origin() {
        let brick = |b: u8| (0..4096u32).map(move |i| (i % 251) as u8 ^ b);
        let bytes: Vec<u8> = (0..5).flat_map(brick).collect();
        let decode = Decode { scale: 255.0, offset: 0.0 };
        let slots = Slots::even(BrickSide::S16, SampleFormat::Unorm8, decode, &bytes).unwrap();
        let shape = slots.room(None, 64).unwrap().shape.atlas().unwrap();
        let texels = shape.texels();
        for slot in 0..5 {
            let o = shape.origin(slot);
            let layer = layer_bytes(&slots, shape, o.z / 16);
            for (x, y, z) in [(0, 0, 0), (15, 0, 0), (3, 7, 11), (15, 15, 15)] {
                let at = (o.x + x) + texels.x * (o.y + y + texels.y * z);
                let expected = bytes[(slot * 4096 + x + 16 * (y + 16 * z)) as usize];
                assert_eq!(layer[at as usize], expected);
            }
        }
    }
}
