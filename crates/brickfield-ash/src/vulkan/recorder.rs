//! The commands of a command buffer.
#![expect(unsafe_code, reason = "Vulkan's functions are foreign")]

use std::marker::PhantomData;
use std::ops::Range;

use ash::vk;
use brickfield_core::glam::UVec3;
use brickfield_shaders::DecodedTexels;

use super::image::WHOLE;
use super::{BoundPipeline, Buffer, Canvas, HostBuffer, VulkanImage};

/// Records commands; their objects are borrowed for `'a`.
pub(crate) struct Recorder<'q, 'a> {
    device: &'q ash::Device,
    commands: vk::CommandBuffer,
    recorded: PhantomData<fn(&'a ()) -> &'a ()>,
}

/// How a resource is used before or after a barrier.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Use {
    /// Not at all: an image's content is undefined.
    Nothing,
    /// A copy or clear writes it.
    CopyTarget,
    /// A copy reads it.
    CopySource,
    /// A shader that computes reads it.
    ShaderRead,
    /// Drawing reads it: as corners and triangles, or in its shaders.
    DrawRead,
    /// A shader writes it, and perhaps reads it.
    ShaderWrite,
    /// Polygons are blended into it.
    Canvas,
    /// The host reads it.
    HostRead,
}

/// A box of an image, and where its texels lie in a buffer: x fastest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ImageBox {
    pub(crate) buffer_offset: u64,
    /// Bytes from one row to the next; `None` without gaps. A slice follows the one before without a gap.
    pub(crate) row_bytes: Option<u32>,
    pub(crate) origin: UVec3,
    pub(crate) extent: UVec3,
}

impl ImageBox {
    /// The texels of a slot that was unpacked.
    pub(crate) fn of(texels: &DecodedTexels) -> ImageBox {
        let DecodedTexels { offset, row_bytes, origin, size } = *texels;
        ImageBox { buffer_offset: offset, row_bytes: Some(row_bytes), origin, extent: size }
    }

    /// Bytes from its first texel to the end of its last one.
    fn n_bytes(&self, texel_bytes: u64) -> u64 {
        let [x, y, z] = self.extent.to_array().map(u64::from);
        let own = x * texel_bytes;
        let row = self.row_bytes.map_or(own, u64::from);
        row * (y * z).saturating_sub(1) + own
    }
}

impl<'q, 'a> Recorder<'q, 'a> {
    pub(super) fn new(device: &'q ash::Device, commands: vk::CommandBuffer) -> Recorder<'q, 'a> {
        Recorder { device, commands, recorded: PhantomData }
    }

    /// All that was done before with `before` ends, and is seen by `after`.
    pub(crate) fn barrier(&mut self, before: Use, after: Use) {
        let ((from_stage, from), (to_stage, to)) = (before.scope(), after.scope());
        let barrier = vk::MemoryBarrier::default().src_access_mask(from).dst_access_mask(to);
        let none = vk::DependencyFlags::empty();
        // SAFETY: stages and accesses belong together (`Use::scope`).
        unsafe { self.device.cmd_pipeline_barrier(self.commands, from_stage, to_stage, none, &[barrier], &[], &[]) };
    }

    /// As [`barrier`](Self::barrier) for an image, which changes its layout.
    pub(crate) fn image_barrier(&mut self, image: &'a VulkanImage, before: Use, after: Use) {
        let ((from_stage, from), (to_stage, to)) = (before.scope(), after.scope());
        let barrier = vk::ImageMemoryBarrier::default()
            .image(image.raw)
            .subresource_range(WHOLE)
            .src_access_mask(from)
            .dst_access_mask(to)
            .old_layout(before.layout())
            .new_layout(after.layout())
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED);
        let none = vk::DependencyFlags::empty();
        // SAFETY: the image outlives the run; stages, accesses and layouts belong together.
        unsafe { self.device.cmd_pipeline_barrier(self.commands, from_stage, to_stage, none, &[], &[], &[barrier]) };
    }

    /// Copies bytes between buffers.
    pub(crate) fn copy(&mut self, from: (&'a Buffer, u64), to: (&'a Buffer, u64), n_bytes: u64) {
        let inside = |(buffer, offset): (&Buffer, u64)| offset + n_bytes <= buffer.n_bytes();
        assert!(inside(from) && inside(to), "a copy past the end of a buffer");
        let region = vk::BufferCopy { src_offset: from.1, dst_offset: to.1, size: n_bytes };
        // SAFETY: both ranges are inside (asserted), both buffers outlive the run and allow copies.
        unsafe { self.device.cmd_copy_buffer(self.commands, from.0.raw, to.0.raw, &[region]) };
    }

    /// Copies texels into an image that is a [`Use::CopyTarget`].
    pub(crate) fn fill(&mut self, from: &'a Buffer, to: &'a VulkanImage, texel_bytes: u64, boxes: &[ImageBox]) {
        let regions = regions(from, to, texel_bytes, boxes);
        let layout = Use::CopyTarget.layout();
        // SAFETY: the boxes are inside both (asserted by `regions`), buffer and image outlive the run and allow copies.
        unsafe { self.device.cmd_copy_buffer_to_image(self.commands, from.raw, to.raw, layout, &regions) };
    }

    /// Copies texels out of an image that is a [`Use::CopySource`].
    pub(crate) fn read_back(&mut self, from: &'a VulkanImage, to: &'a HostBuffer, texel_bytes: u64, part: ImageBox) {
        let regions = regions(to.buffer(), from, texel_bytes, &[part]);
        let layout = Use::CopySource.layout();
        // SAFETY: as in `fill`.
        unsafe { self.device.cmd_copy_image_to_buffer(self.commands, from.raw, layout, to.buffer().raw, &regions) };
    }

    /// Copies all texels of a [`Use::CopySource`] to the same place in a [`Use::CopyTarget`] that is as large or larger.
    pub(crate) fn copy_image(&mut self, from: &'a VulkanImage, to: &'a VulkanImage) {
        assert!(from.extent().cmple(to.extent()).all(), "a copy past the end of an image");
        let (layers, _, extent) = from.part(UVec3::ZERO, from.extent());
        let region = vk::ImageCopy::default().src_subresource(layers).dst_subresource(layers).extent(extent);
        let (source, target) = (Use::CopySource.layout(), Use::CopyTarget.layout());
        // SAFETY: all of the source is inside the target (asserted), both outlive the run, are of one format and allow copies.
        unsafe { self.device.cmd_copy_image(self.commands, from.raw, source, to.raw, target, &[region]) };
    }

    /// Sets all texels of an image that is a [`Use::CopyTarget`] to 0.
    pub(crate) fn clear(&mut self, image: &'a VulkanImage) {
        let (zero, layout) = (vk::ClearColorValue { float32: [0.0; 4] }, Use::CopyTarget.layout());
        // SAFETY: the image outlives the run, is a colour image, and allows transfers.
        unsafe { self.device.cmd_clear_color_image(self.commands, image.raw, layout, &zero, &[WHOLE]) };
    }

    /// Writes the start of a buffer: at most 64 KiB, a multiple of 4 bytes.
    pub(crate) fn update(&mut self, buffer: &'a Buffer, bytes: &[u8]) {
        assert!(bytes.len() as u64 <= buffer.n_bytes().min(1 << 16) && bytes.len().is_multiple_of(4), "an odd update");
        // SAFETY: the bytes are copied now, they are inside the buffer (asserted), which outlives the run and allows copies.
        unsafe { self.device.cmd_update_buffer(self.commands, buffer.raw, 0, bytes) };
    }

    /// Runs `n` workgroups along x, y, z.
    pub(crate) fn dispatch(&mut self, bound: &'a BoundPipeline<'a>, n: [u32; 3]) {
        let (pipeline, compute) = (bound.pipeline, vk::PipelineBindPoint::COMPUTE);
        // SAFETY: the pipeline, its set and the bound resources outlive the run; callers keep the number of workgroups within
        // 65,535, which every device allows.
        unsafe {
            self.device.cmd_bind_pipeline(self.commands, compute, pipeline.raw);
            self.device.cmd_bind_descriptor_sets(self.commands, compute, pipeline.layout, 0, &[pipeline.set], &[]);
            self.device.cmd_dispatch(self.commands, n[0], n[1], n[2]);
        }
    }

    /// Draws triangles of `indices` into a canvas, over the pixels that are there.
    pub(crate) fn draw(&mut self, bound: &'a BoundPipeline<'a>, canvas: &'a Canvas, triangles: Triangles<'a>) {
        let Triangles { corners, indices, range } = triangles;
        assert!(u64::from(range.end) * 4 <= indices.n_bytes(), "a draw past the end of the triangles");
        let pass = canvas.begin_info();
        // SAFETY: canvas, pipeline, its set, the bound resources, and both buffers outlive the run. The pipeline was made for a pass
        // like the canvas's; indices are inside their buffer (asserted), and name corners that are there (`Polygons::hold` looks).
        unsafe {
            self.device.cmd_begin_render_pass(self.commands, &pass, vk::SubpassContents::INLINE);
            self.prepare_drawing(bound, canvas);
            self.device.cmd_bind_vertex_buffers(self.commands, 0, &[corners.raw], &[0]);
            self.device.cmd_bind_index_buffer(self.commands, indices.raw, 0, vk::IndexType::UINT32);
            self.device.cmd_draw_indexed(self.commands, range.end - range.start, 1, range.start, 0, 0);
            self.device.cmd_end_render_pass(self.commands);
        }
    }
}

impl<'a> Recorder<'_, 'a> {
    /// Draws a mesh of so many triangles into a canvas of its kind, which is cleared before.
    pub(crate) fn draw_mesh(&mut self, bound: &'a BoundPipeline<'a>, canvas: &'a Canvas, n_triangles: u32) {
        let clear = [vk::ClearValue::default(); 2];
        let pass = canvas.begin_info().clear_values(&clear);
        // SAFETY: canvas, pipeline, its set and the bound resources outlive the run. The pipeline was made for a pass like the canvas's. The
        // shader finds corners by their numbers, and its reads are restricted to their buffers.
        unsafe {
            self.device.cmd_begin_render_pass(self.commands, &pass, vk::SubpassContents::INLINE);
            self.prepare_drawing(bound, canvas);
            self.device.cmd_draw(self.commands, 3 * n_triangles, 1, 0, 0);
            self.device.cmd_end_render_pass(self.commands);
        }
    }

    /// Binds a pipeline, and draws into the whole canvas.
    ///
    /// # Safety
    /// Within a render pass of the canvas.
    unsafe fn prepare_drawing(&mut self, bound: &'a BoundPipeline<'a>, canvas: &'a Canvas) {
        let (pipeline, graphics) = (bound.pipeline, vk::PipelineBindPoint::GRAPHICS);
        let area = canvas.area();
        let (width, height) = (area.extent.width as f32, area.extent.height as f32);
        // y upwards, as naga's shaders have it.
        let viewport = vk::Viewport { x: 0.0, y: height, width, height: -height, min_depth: 0.0, max_depth: 1.0 };
        // SAFETY: pipeline, its set and the canvas outlive the run; viewport and scissor are those of the canvas.
        unsafe {
            self.device.cmd_bind_pipeline(self.commands, graphics, pipeline.raw);
            self.device.cmd_bind_descriptor_sets(self.commands, graphics, pipeline.layout, 0, &[pipeline.set], &[]);
            self.device.cmd_set_viewport(self.commands, 0, &[viewport]);
            self.device.cmd_set_scissor(self.commands, 0, &[area]);
        }
    }
}

/// Triangles to be drawn: some of the indices, three for each, into the corners.
#[derive(Clone)]
pub(crate) struct Triangles<'a> {
    pub(crate) corners: &'a Buffer,
    pub(crate) indices: &'a Buffer,
    pub(crate) range: Range<u32>,
}

impl Use {
    fn scope(self) -> (vk::PipelineStageFlags, vk::AccessFlags) {
        use vk::{AccessFlags as Access, PipelineStageFlags as Stage};
        match self {
            Use::Nothing => (Stage::TOP_OF_PIPE, Access::empty()),
            Use::CopyTarget => (Stage::TRANSFER, Access::TRANSFER_WRITE),
            Use::CopySource => (Stage::TRANSFER, Access::TRANSFER_READ),
            Use::ShaderRead => (Stage::COMPUTE_SHADER, Access::SHADER_READ | Access::UNIFORM_READ),
            Use::DrawRead => (
                Stage::VERTEX_INPUT | Stage::VERTEX_SHADER | Stage::FRAGMENT_SHADER,
                Access::VERTEX_ATTRIBUTE_READ | Access::INDEX_READ | Access::UNIFORM_READ | Access::SHADER_READ,
            ),
            Use::Canvas => {
                (Stage::COLOR_ATTACHMENT_OUTPUT, Access::COLOR_ATTACHMENT_READ | Access::COLOR_ATTACHMENT_WRITE)
            }
            Use::ShaderWrite => (Stage::COMPUTE_SHADER, Access::SHADER_READ | Access::SHADER_WRITE),
            Use::HostRead => (Stage::HOST, Access::HOST_READ),
        }
    }

    fn layout(self) -> vk::ImageLayout {
        match self {
            Use::Nothing => vk::ImageLayout::UNDEFINED,
            Use::CopyTarget => vk::ImageLayout::TRANSFER_DST_OPTIMAL,
            Use::CopySource => vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
            Use::ShaderRead | Use::DrawRead => vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
            Use::Canvas => vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
            Use::ShaderWrite | Use::HostRead => vk::ImageLayout::GENERAL,
        }
    }
}

fn regions(buffer: &Buffer, image: &VulkanImage, texel_bytes: u64, boxes: &[ImageBox]) -> Vec<vk::BufferImageCopy> {
    let region = |b: &ImageBox| {
        assert!(b.buffer_offset + b.n_bytes(texel_bytes) <= buffer.n_bytes(), "a copy past the end of a buffer");
        assert!((b.origin + b.extent).cmple(image.extent()).all(), "a copy past the end of an image");
        let (layers, offset, extent) = image.part(b.origin, b.extent);
        vk::BufferImageCopy::default()
            .buffer_offset(b.buffer_offset)
            .buffer_row_length(b.row_bytes.map_or(0, |row| row / texel_bytes as u32))
            .image_subresource(layers)
            .image_offset(offset)
            .image_extent(extent)
    };
    boxes.iter().map(region).collect()
}
