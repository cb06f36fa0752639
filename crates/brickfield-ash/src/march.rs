//! A frame: rows of pixels, submit by submit, and the picture's way back.

use std::sync::Arc;
use std::time::Instant;

use brickfield_core::Image as Picture;
use brickfield_core::glam::{UVec2, UVec3};
use brickfield_frame::{FramePlan, RenderError};

use crate::staging::{CHUNK_BYTES, Staging};
use crate::vulkan::{BoundPipeline, Device, Image, ImageBox, Queue, Use};

/// Most nodes that one submit may evaluate: about a second on a slow device, whose driver may end what takes longer.
const NODES_PER_SUBMIT: f64 = (1u32 << 28) as f64;

/// Bytes of a pixel.
const PIXEL_BYTES: usize = size_of::<[f32; 4]>();

/// How long the march took, in milliseconds.
pub(crate) struct MarchTime {
    pub(crate) device_ms: Option<f64>,
    pub(crate) wall_ms: f64,
}

/// The image to render to, of exactly this size.
pub(crate) fn reserve_picture<'a>(
    slot: &'a mut Option<Image>,
    device: &Arc<Device>,
    size: UVec2,
) -> Result<&'a Image, RenderError> {
    slot.take_if(|i| i.extent() != size.extend(1));
    match slot {
        Some(image) => Ok(image),
        none => Ok(none.insert(Image::picture(device, size)?)),
    }
}

/// Rows of workgroups to submit at once.
pub(crate) fn groups_per_submit(plan: &FramePlan, group_height: u32) -> u32 {
    let voxels_per_segment = plan.rays.direction[0].length() * plan.sampling.step_world();
    let segments_per_ray = (plan.visible.diagonal() / voxels_per_segment).max(1.0);
    let nodes_per_row = segments_per_ray * plan.sampling.rule().nodes().len() as f64 * f64::from(plan.size().x);
    // a float that is too large, or not a number, becomes the largest or 0
    ((NODES_PER_SUBMIT / nodes_per_row) as u32 / group_height).max(1)
}

/// Renders into `picture`, `groups_per_submit` rows of workgroups at once.
pub(crate) fn march(
    queue: &mut Queue,
    bound: &BoundPipeline<'_>,
    picture: &Image,
    groups_per_submit: u32,
) -> Result<MarchTime, RenderError> {
    let started = Instant::now();
    let [n_x, n_y, _] = bound.workgroups(picture.extent().to_array());
    let mut device_ms = Some(0.0);
    let mut before = Use::Nothing;
    for first in (0..n_y).step_by(groups_per_submit as usize) {
        let n_rows = groups_per_submit.min(n_y - first);
        let band_ms = queue.run_timed("rendering", |recorder| {
            recorder.image_barrier(picture, before, Use::ShaderWrite);
            recorder.dispatch(bound, [0, first, 0], [n_x, n_rows, 1]);
        })?;
        device_ms = device_ms.zip(band_ms).map(|(sum, ms)| sum + ms);
        before = Use::ShaderWrite;
    }
    Ok(MarchTime { device_ms, wall_ms: milliseconds_since(started) })
}

/// Brings a rendered picture to the host, band by band.
pub(crate) fn read_back(
    queue: &mut Queue,
    staging: &mut Staging,
    picture: &Image,
) -> Result<Picture<f32>, RenderError> {
    let UVec3 { x: width, y: height, .. } = picture.extent();
    let mut image = Picture::transparent(UVec2::new(width, height));
    let rows_per_band = (CHUNK_BYTES / (width as usize * PIXEL_BYTES)).max(1);
    let mut before = Use::ShaderWrite;
    for (i, rows) in image.pixels_mut().chunks_mut(rows_per_band * width as usize).enumerate() {
        let origin = UVec3::new(0, (i * rows_per_band) as u32, 0);
        let extent = UVec3::new(width, rows.len() as u32 / width, 1);
        let n_bytes = size_of_val(rows);
        let target = &*staging.read_back(n_bytes)?;
        queue.run("reading the picture back", |recorder| {
            recorder.image_barrier(picture, before, Use::CopySource);
            recorder.read_back(picture, target, PIXEL_BYTES as u64, ImageBox { buffer_offset: 0, origin, extent });
            recorder.barrier(Use::CopyTarget, Use::HostRead);
        })?;
        bytemuck::cast_slice_mut(rows).copy_from_slice(target.read(n_bytes));
        before = Use::CopySource;
    }
    Ok(image)
}

/// Milliseconds since a moment.
pub(crate) fn milliseconds_since(moment: Instant) -> f64 {
    moment.elapsed().as_secs_f64() * 1e3
}
