//! The picture on the device, and its way back.

use brickfield_core::Image;
use brickfield_core::glam::UVec2;
use brickfield_frame::{RenderError, Target};
use wgpu::BufferUsages;

use crate::buffer::Reused;
use crate::device::Device;

/// The ways of making a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Maker {
    /// A shader that stores its pixels.
    Rays,
    /// Polygons that are blended into it.
    Polygons(Target),
    /// The triangles of a mesh, the nearest of each pixel.
    Mesh,
}

/// A picture of some size.
pub(crate) struct Picture {
    size: UVec2,
    maker: Maker,
    texture: wgpu::Texture,
    pub(crate) view: wgpu::TextureView,
    /// The depths of a mesh's picture.
    pub(crate) depth: Option<wgpu::TextureView>,
}

impl Maker {
    fn target(self) -> Target {
        match self {
            Maker::Rays | Maker::Mesh => Target::Float32,
            Maker::Polygons(target) => target,
        }
    }

    fn usage(self) -> wgpu::TextureUsages {
        match self {
            Maker::Rays => wgpu::TextureUsages::STORAGE_BINDING,
            Maker::Polygons(_) | Maker::Mesh => wgpu::TextureUsages::RENDER_ATTACHMENT,
        }
    }
}

/// The texels of a picture.
pub(crate) fn format(target: Target) -> wgpu::TextureFormat {
    match target {
        Target::Float32 => wgpu::TextureFormat::Rgba32Float,
        Target::Float16 => wgpu::TextureFormat::Rgba16Float,
    }
}

impl Picture {
    pub(crate) fn new(device: &Device, size: UVec2, maker: Maker) -> Result<Picture, RenderError> {
        let n_bytes = u64::from(size.x) * u64::from(size.y) * maker.target().pixel_bytes() as u64;
        device.checked("the picture", n_bytes, || {
            let texture = device.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("picture"),
                size: extent(size),
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: format(maker.target()),
                usage: maker.usage() | wgpu::TextureUsages::COPY_SRC,
                view_formats: &[],
            });
            let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
            let depth = (maker == Maker::Mesh).then(|| depth(device, size));
            Picture { size, maker, texture, view, depth }
        })
    }

    /// Whether it is of this size, for this maker.
    pub(crate) fn fits(&self, size: UVec2, maker: Maker) -> bool {
        (self.size, self.maker) == (size, maker)
    }

    /// Brings the picture back, through `staging`.
    pub(crate) fn read(&self, device: &Device, staging: &mut Reused) -> Result<Image<f32>, RenderError> {
        let target = self.maker.target();
        let row_bytes =
            (self.size.x * target.pixel_bytes() as u32).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let n_bytes = u64::from(row_bytes) * u64::from(self.size.y);
        let buffer = staging.reserve(device, n_bytes)?;
        device.checked("copying the picture", n_bytes, || {
            let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let layout =
                wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row_bytes), rows_per_image: None };
            encoder.copy_texture_to_buffer(
                self.texture.as_image_copy(),
                wgpu::TexelCopyBufferInfo { buffer, layout },
                extent(self.size),
            );
            device.queue.submit([encoder.finish()]);
        })?;
        let view = device.read(buffer, n_bytes)?;
        let image = unpadded(&view, self.size, row_bytes as usize, target);
        drop(view);
        buffer.unmap();
        Ok(image)
    }
}

/// The texels of depths.
pub(crate) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

fn depth(device: &Device, size: UVec2) -> wgpu::TextureView {
    let texture = device.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("depth"),
        size: extent(size),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: DEPTH,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

/// The buffer through which a picture comes back.
pub(crate) fn staging() -> Reused {
    Reused::new("reading the picture back", BufferUsages::MAP_READ.union(BufferUsages::COPY_DST))
}

fn extent(size: UVec2) -> wgpu::Extent3d {
    wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 }
}

fn unpadded(bytes: &[u8], size: UVec2, row_bytes: usize, target: Target) -> Image<f32> {
    let mut image = Image::transparent(size);
    let width = size.x as usize;
    for (row, from) in image.pixels_mut().chunks_exact_mut(width).zip(bytes.chunks_exact(row_bytes)) {
        target.read(from, row);
    }
    image
}
