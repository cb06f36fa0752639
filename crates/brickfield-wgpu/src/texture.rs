//! The samples of slots in a texture of three axes.

use brickfield_core::glam::UVec3;
use brickfield_frame::{
    AtlasShape, HeldChunks, RenderError, Room, RoomChange, SampleFormat, Slots, TextureLayout, TextureShape,
};
use wgpu::{Features, TextureFormat, TextureUsages};

use crate::device::Device;

/// A texture that holds slots.
pub(crate) struct Texture {
    texture: wgpu::Texture,
    pub(crate) view: wgpu::TextureView,
    shape: TextureShape,
    format: SampleFormat,
    layout: TextureLayout,
    held: HeldChunks,
}

/// Bytes that are handed over before the device may go on with them: so few that they stay in the caches of the host.
const BYTES_AT_ONCE: usize = 8 << 20;

impl Texture {
    /// How bricks lie in it.
    pub(crate) fn atlas_shape(&self) -> Option<AtlasShape> {
        self.shape.atlas()
    }

    /// How slots lie in it.
    pub(crate) fn shape(&self) -> TextureShape {
        self.shape
    }

    /// Its texels from one on.
    pub(crate) fn from(&self, UVec3 { x, y, z }: UVec3) -> wgpu::TexelCopyTextureInfo<'_> {
        wgpu::TexelCopyTextureInfo { origin: wgpu::Origin3d { x, y, z }, ..self.texture.as_image_copy() }
    }

    /// A texture with room for slots: the old texture, a larger texture with the old contents, or an empty texture.
    pub(crate) fn with_room(
        device: &Device,
        slots: &Slots,
        layout: TextureLayout,
        old: Option<Texture>,
    ) -> Result<Texture, RenderError> {
        let mut old = old.filter(|old| (old.format, old.layout) == (slots.format(), layout));
        if let Some(old) = old.take_if(|old| old.held.has_all(slots)) {
            return Ok(old);
        }
        let limit = device.description.capabilities.max_texels(layout);
        let room = slots.room(old.as_ref().map(|old| old.shape), limit)?;
        match (room, old) {
            (Room { change: RoomChange::Keep, .. }, Some(old)) => Ok(old),
            (Room { change: RoomChange::Grow, shape }, Some(old)) => old.grown(device, shape),
            (Room { shape, .. }, old) => {
                drop(old);
                Texture::empty(device, shape, (slots.format(), layout))
            }
        }
    }

    fn empty(
        device: &Device,
        shape: TextureShape,
        (format, layout): (SampleFormat, TextureLayout),
    ) -> Result<Texture, RenderError> {
        let texels = shape.texels();
        let n_bytes = texels.to_array().into_iter().map(u64::from).product::<u64>() * format.n_bytes() as u64;
        let stored = stored_as(device, format)?;
        device.checked("the atlas", n_bytes, || {
            let texture = device.device.create_texture(&described("atlas", layout, texels, stored));
            let view = whole_view(&texture, layout);
            Texture { texture, view, shape, format, layout, held: HeldChunks::default() }
        })
    }

    /// A larger atlas with this one's bricks at their places; without them if both do not fit the device.
    fn grown(self, device: &Device, shape: TextureShape) -> Result<Texture, RenderError> {
        let kind = (self.format, self.layout);
        let larger = match Texture::empty(device, shape, kind) {
            Err(RenderError::OutOfMemory { .. }) => {
                drop(self);
                return Texture::empty(device, shape, kind);
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

    /// The slots that are not there.
    pub(crate) fn missing(&self, slots: &Slots) -> Vec<u32> {
        self.held.missing(slots).into_iter().flatten().map(|slot| slot as u32).collect()
    }

    /// All slots are there now.
    pub(crate) fn hold(&mut self, slots: &Slots) {
        self.held.hold(slots);
    }

    /// Writes those of some slots that are not packed; their bytes.
    pub(crate) fn upload(&self, device: &Device, slots: &Slots, some: &[u32]) -> Result<u64, RenderError> {
        let boxes = some.iter().filter_map(|slot| TexelBox::of(self.shape, slots, *slot));
        let mut boxes: Vec<TexelBox> = boxes.collect();
        boxes.sort_by_key(|b| (b.origin.z, b.origin.y, b.origin.x));
        let mut rows = boxes.chunk_by(TexelBox::goes_on_with).peekable();
        while rows.peek().is_some() {
            device.checked("the atlas's samples", 0, || {
                let mut waiting = 0;
                while let Some(row) = rows.next_if(|_| waiting < BYTES_AT_ONCE) {
                    waiting += self.write_row(device, row);
                }
                device.queue.submit([]);
            })?;
            // What was handed over is freed only then.
            if rows.peek().is_some() {
                device.wait("uploading samples")?;
            }
        }
        Ok(boxes.iter().map(|b| b.samples.len() as u64).sum())
    }

    /// Writes boxes side by side at once, for the driver aligns each row of texels; returns the bytes that this takes on the way.
    fn write_row(&self, device: &Device, boxes: &[TexelBox]) -> usize {
        let (first, sample) = (boxes[0], self.format.n_bytes());
        let size = first.size.with_x(boxes.iter().map(|b| b.size.x).sum());
        match boxes {
            [one] => self.write(device, one.samples, first.origin, size),
            _ => self.write(device, &side_by_side(boxes, sample), first.origin, size),
        }
        let row = (size.x as usize * sample).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT as usize);
        row * size.y as usize * size.z as usize
    }

    fn write(&self, device: &Device, bytes: &[u8], origin: UVec3, size: UVec3) {
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(size.x * self.format.n_bytes() as u32),
            rows_per_image: Some(size.y),
        };
        device.queue.write_texture(self.from(origin), bytes, layout, extent(size));
    }
}

/// A texture that copies fill and read, and shaders read.
pub(crate) fn described(
    label: &'static str,
    layout: TextureLayout,
    texels: UVec3,
    format: TextureFormat,
) -> wgpu::TextureDescriptor<'static> {
    let (binding, copies) = (TextureUsages::TEXTURE_BINDING, TextureUsages::COPY_DST | TextureUsages::COPY_SRC);
    wgpu::TextureDescriptor {
        label: Some(label),
        size: extent(texels),
        mip_level_count: 1,
        sample_count: 1,
        dimension: match layout {
            TextureLayout::Volume => wgpu::TextureDimension::D3,
            TextureLayout::Layers => wgpu::TextureDimension::D2,
        },
        format,
        usage: binding | copies,
        view_formats: &[],
    }
}

/// All texels of a texture, as shaders see them.
pub(crate) fn whole_view(texture: &wgpu::Texture, layout: TextureLayout) -> wgpu::TextureView {
    let dimension = Some(view_dimension(layout));
    texture.create_view(&wgpu::TextureViewDescriptor { dimension, ..wgpu::TextureViewDescriptor::default() })
}

/// The kind of such views.
pub(crate) fn view_dimension(layout: TextureLayout) -> wgpu::TextureViewDimension {
    match layout {
        TextureLayout::Volume => wgpu::TextureViewDimension::D3,
        TextureLayout::Layers => wgpu::TextureViewDimension::D2Array,
    }
}

/// The sampler of textures, clamped to the edge: linear for a volume; nearest for layers, of which texels are gathered as they are.
pub(crate) fn sampler(device: &wgpu::Device, layout: TextureLayout) -> wgpu::Sampler {
    let filter = match layout {
        TextureLayout::Volume => wgpu::FilterMode::Linear,
        TextureLayout::Layers => wgpu::FilterMode::Nearest,
    };
    device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("atlas"),
        mag_filter: filter,
        min_filter: filter,
        ..wgpu::SamplerDescriptor::default()
    })
}

/// A size as wgpu takes it.
pub(crate) fn extent(size: UVec3) -> wgpu::Extent3d {
    wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: size.z }
}

/// The plain samples of a slot, and the texels where they belong.
#[derive(Clone, Copy)]
struct TexelBox<'a> {
    origin: UVec3,
    size: UVec3,
    samples: &'a [u8],
}

impl<'a> TexelBox<'a> {
    fn of(shape: TextureShape, slots: &'a Slots, slot: u32) -> Option<TexelBox<'a>> {
        let (origin, size) = shape.texels_of(slots, slot);
        slots.samples(slot).filter(|chunk| chunk.packed().is_none()).map(|chunk| TexelBox {
            origin,
            size,
            samples: chunk.bytes(),
        })
    }

    /// Whether both are one box, this one first along x.
    fn goes_on_with(&self, next: &TexelBox) -> bool {
        self.origin.with_x(self.origin.x + self.size.x) == next.origin
            && (self.size.y, self.size.z) == (next.size.y, next.size.z)
    }
}

/// The samples of boxes side by side, of `sample` bytes each, x fastest.
fn side_by_side(boxes: &[TexelBox], sample: usize) -> Vec<u8> {
    let n_rows = boxes[0].size.y as usize * boxes[0].size.z as usize;
    let row = |b: &TexelBox, i: usize| {
        let n_bytes = b.size.x as usize * sample;
        i * n_bytes..(i + 1) * n_bytes
    };
    let mut bytes = Vec::with_capacity(boxes.iter().map(|b| b.samples.len()).sum());
    (0..n_rows).for_each(|i| boxes.iter().for_each(|b| bytes.extend_from_slice(&b.samples[row(b, i)])));
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

    #[test]
    fn boxes_side_by_side_are_one() {
        let of = |x: u32, nx: u32, ny: u32, samples| TexelBox {
            origin: UVec3::new(x, 4, 8),
            size: UVec3::new(nx, ny, 1),
            samples,
        };
        let boxes = [of(0, 2, 2, &[1, 2, 11, 12]), of(2, 1, 2, &[3, 13]), of(3, 1, 1, &[4]), of(5, 1, 1, &[5])];
        let rows: Vec<usize> = boxes.chunk_by(TexelBox::goes_on_with).map(<[_]>::len).collect();
        assert_eq!(rows, [2, 1, 1]);
        assert_eq!(side_by_side(&boxes[..2], 1), [1, 2, 3, 11, 12, 13]);
    }
}
