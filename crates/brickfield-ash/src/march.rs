//! A frame: pass by pass, and the picture's way back.

use std::sync::Arc;
use std::time::Instant;

use brickfield_core::Image as Picture;
use brickfield_core::glam::{UVec2, UVec3};
use brickfield_frame::{FrameUniforms, Pass, RenderError, Target};

use crate::staging::Staging;
use crate::vulkan::{BoundPipeline, Buffer, Device, ImageBox, Queue, Use, VulkanImage};

/// Bytes of a pixel, and of a ray's emission and depth.
pub(crate) const PIXEL_BYTES: usize = size_of::<[f32; 4]>();

/// How long rendering took, in milliseconds.
pub(crate) struct RenderTime {
    pub(crate) device_ms: Option<f64>,
    pub(crate) wall_ms: f64,
}

/// The image to render to, of exactly this size.
pub(crate) fn reserve_picture<'a>(
    slot: &'a mut Option<VulkanImage>,
    device: &Arc<Device>,
    size: UVec2,
) -> Result<&'a VulkanImage, RenderError> {
    slot.take_if(|i| i.extent() != size.extend(1));
    match slot {
        Some(image) => Ok(image),
        none => Ok(none.insert(VulkanImage::picture(device, size)?)),
    }
}

/// Renders into `picture`, pass by pass; each has its own uniforms in their buffer.
pub(crate) fn march(
    queue: &mut Queue,
    bound: &BoundPipeline<'_>,
    picture: &VulkanImage,
    (buffer, uniforms): (&Buffer, FrameUniforms),
    passes: &[Pass],
) -> Result<RenderTime, RenderError> {
    let started = Instant::now();
    let mut device_ms = Some(0.0);
    let mut before = Use::Nothing;
    for pass in passes {
        let groups = bound.workgroups([picture.extent().x, pass.rows.len() as u32, 1]);
        let pass_ms = queue.run_timed("rendering", |recorder| {
            recorder.update(buffer, bytemuck::bytes_of(&uniforms.in_pass(pass)));
            recorder.barrier(Use::CopyTarget, Use::ShaderRead);
            // The pass before has written the emission and depth of its rays.
            recorder.barrier(Use::ShaderWrite, Use::ShaderWrite);
            recorder.image_barrier(picture, before, Use::ShaderWrite);
            recorder.dispatch(bound, groups);
        })?;
        device_ms = device_ms.zip(pass_ms).map(|(sum, ms)| sum + ms);
        before = Use::ShaderWrite;
    }
    Ok(RenderTime { device_ms, wall_ms: milliseconds_since(started) })
}

/// Brings a rendered picture of a format to the host, band by band; `before` is how it was made.
pub(crate) fn read_back(
    queue: &mut Queue,
    staging: &mut Staging,
    picture: &VulkanImage,
    (target, mut before): (Target, Use),
) -> Result<Picture<f32>, RenderError> {
    let UVec3 { x: width, y: height, .. } = picture.extent();
    let mut image = Picture::transparent(UVec2::new(width, height));
    let rows_per_band = staging.pieces_at_once(width as usize * target.pixel_bytes());
    for (i, rows) in image.pixels_mut().chunks_mut(rows_per_band * width as usize).enumerate() {
        let origin = UVec3::new(0, (i * rows_per_band) as u32, 0);
        let extent = UVec3::new(width, rows.len() as u32 / width, 1);
        let n_bytes = rows.len() * target.pixel_bytes();
        let host = &*staging.read_back(n_bytes)?;
        queue.run("reading the picture back", |recorder| {
            recorder.image_barrier(picture, before, Use::CopySource);
            let part = ImageBox { buffer_offset: 0, row_bytes: None, origin, extent };
            recorder.read_back(picture, host, target.pixel_bytes() as u64, part);
            recorder.barrier(Use::CopyTarget, Use::HostRead);
        })?;
        target.read(host.read(n_bytes), rows);
        before = Use::CopySource;
    }
    Ok(image)
}

/// Milliseconds since a moment.
pub(crate) fn milliseconds_since(moment: Instant) -> f64 {
    moment.elapsed().as_secs_f64() * 1e3
}
