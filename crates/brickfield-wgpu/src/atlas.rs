//! The bricks of a frame in one 3-D texture.

use std::sync::Arc;

use brickfield_frame::{AtlasShape, BrickSet, Held, RenderError, SampleFormat};
use wgpu::{Features, TextureFormat};

use crate::device::Device;

/// The texture that holds a brick set.
pub(crate) struct Atlas {
    bricks: Held<BrickSet>,
    pub(crate) view: wgpu::TextureView,
}

impl Atlas {
    /// Whether the texture holds this very set.
    pub(crate) fn holds(&self, bricks: &Arc<BrickSet>) -> bool {
        self.bricks.is(bricks)
    }

    /// Uploads a brick set, laid out in `shape`.
    pub(crate) fn upload(device: &Device, bricks: &Arc<BrickSet>, shape: AtlasShape) -> Result<Atlas, RenderError> {
        let format = format(device, bricks.format())?;
        let texels = shape.texels();
        let size = wgpu::Extent3d { width: texels.x, height: texels.y, depth_or_array_layers: texels.z };
        let n_bytes =
            u64::from(texels.x) * u64::from(texels.y) * u64::from(texels.z) * bricks.format().n_bytes() as u64;
        device.checked("the brick atlas", n_bytes, || {
            let texture = device.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("atlas"),
                size,
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D3,
                format,
                usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
                view_formats: &[],
            });
            for layer in 0..shape.bricks.z {
                write_layer(device, &texture, bricks, shape, layer);
            }
            let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
            Atlas { bricks: Held::of(bricks), view }
        })
    }
}

/// The atlas's shape on a device.
pub(crate) fn shape(device: &Device, bricks: &BrickSet) -> Result<AtlasShape, RenderError> {
    let limit = device.description.capabilities.max_texture_3d;
    bricks.atlas(limit).ok_or_else(|| RenderError::AtlasTooLarge {
        n_bricks: bricks.n_bricks(),
        side: bricks.side().n_samples(),
        limit,
    })
}

/// Copies the bricks at height `layer` of the atlas: staging memory is that of one layer.
fn write_layer(device: &Device, texture: &wgpu::Texture, bricks: &BrickSet, shape: AtlasShape, layer: u32) {
    let texels = shape.texels();
    let side = shape.side.n_samples();
    let row_bytes = texels.x as usize * bricks.format().n_bytes();
    let texture_copy = wgpu::TexelCopyTextureInfo {
        origin: wgpu::Origin3d { x: 0, y: 0, z: layer * side },
        ..texture.as_image_copy()
    };
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(row_bytes as u32),
        rows_per_image: Some(texels.y),
    };
    let size = wgpu::Extent3d { width: texels.x, height: texels.y, depth_or_array_layers: side };
    device.queue.write_texture(texture_copy, &layer_bytes(bricks, shape, layer), layout, size);
    device.queue.submit([]);
}

/// The texels of a layer of bricks, x fastest; what no brick fills is 0.
fn layer_bytes(bricks: &BrickSet, shape: AtlasShape, layer: u32) -> Vec<u8> {
    let (texels, side) = (shape.texels(), shape.side.n_samples() as usize);
    let sample = bricks.format().n_bytes();
    let (row, image) = (texels.x as usize * sample, texels.x as usize * texels.y as usize * sample);
    let mut bytes = vec![0; image * side];
    let per_layer = shape.bricks.x * shape.bricks.y;
    for slot in (layer * per_layer..(layer + 1) * per_layer).take_while(|s| *s < bricks.n_bricks()) {
        let origin = shape.origin(slot);
        let corner = origin.x as usize * sample + origin.y as usize * row;
        let brick = &bricks.bytes()[slot as usize * bricks.brick_bytes()..][..bricks.brick_bytes()];
        for (i, from) in brick.chunks_exact(side * sample).enumerate() {
            let to = corner + (i / side) * image + (i % side) * row;
            bytes[to..to + from.len()].copy_from_slice(from);
        }
    }
    bytes
}

/// A texel's format on a device.
pub(crate) fn format(device: &Device, format: SampleFormat) -> Result<TextureFormat, RenderError> {
    match format {
        SampleFormat::Unorm8 => Ok(TextureFormat::R8Unorm),
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
        let bricks = BrickSet::new(BrickSide::S16, SampleFormat::Unorm8, decode, bytes).unwrap();
        let shape = bricks.atlas(64).unwrap();
        let texels = shape.texels();
        for slot in 0..5 {
            let o = shape.origin(slot);
            let layer = layer_bytes(&bricks, shape, o.z / 16);
            for (x, y, z) in [(0, 0, 0), (15, 0, 0), (3, 7, 11), (15, 15, 15)] {
                let at = (o.x + x) + texels.x * (o.y + y + texels.y * z);
                let expected = bricks.bytes()[(slot * 4096 + x + 16 * (y + 16 * z)) as usize];
                assert_eq!(layer[at as usize], expected);
            }
        }
    }
}
