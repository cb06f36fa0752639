//! The canvas that polygons and meshes are drawn into: an image with a render pass and a framebuffer, for meshes with depths.
#![expect(unsafe_code, reason = "Vulkan's functions are foreign")]

use std::sync::Arc;

use ash::vk;
use brickfield_core::glam::UVec2;
use brickfield_frame::{RenderError, Target};

use super::image::{DEPTH_FORMAT, target_format};
use super::{Device, VulkanImage};
use crate::error::{FailedCall, OfCall};

/// A render pass over one colour image, whose layout is that of [`Use::Canvas`](super::Use::Canvas) afterwards. One of polygons keeps the
/// pixels that are there, and finds the image in that layout; one of meshes clears them, and has depths.
pub(super) struct RenderPass {
    pub(super) raw: vk::RenderPass,
    device: Arc<Device>,
}

/// What is drawn into a canvas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CanvasKind {
    /// Polygons that are blended.
    Polygons(Target),
    /// The triangles of a mesh, of which the nearest stays.
    Mesh,
}

impl CanvasKind {
    fn target(self) -> Target {
        match self {
            CanvasKind::Polygons(target) => target,
            CanvasKind::Mesh => Target::Float32,
        }
    }
}

/// An image that is drawn into.
pub(crate) struct Canvas {
    pub(super) framebuffer: vk::Framebuffer,
    pub(super) pass: RenderPass,
    pub(crate) image: VulkanImage,
    /// Of meshes; the framebuffer names its view.
    _depth: Option<VulkanImage>,
    kind: CanvasKind,
    device: Arc<Device>,
}

impl RenderPass {
    /// The render pass for a kind; render passes of one kind are compatible.
    pub(super) fn new(device: &Arc<Device>, kind: CanvasKind) -> Result<RenderPass, FailedCall> {
        let layout = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
        let depth_layout = vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL;
        let (load, before) = match kind {
            CanvasKind::Polygons(_) => (vk::AttachmentLoadOp::LOAD, layout),
            CanvasKind::Mesh => (vk::AttachmentLoadOp::CLEAR, vk::ImageLayout::UNDEFINED),
        };
        let color = attachment(target_format(kind.target()))
            .load_op(load)
            .store_op(vk::AttachmentStoreOp::STORE)
            .initial_layout(before)
            .final_layout(layout);
        let depth = attachment(DEPTH_FORMAT)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(vk::AttachmentStoreOp::DONT_CARE)
            .initial_layout(vk::ImageLayout::UNDEFINED)
            .final_layout(depth_layout);
        let has_depth = kind == CanvasKind::Mesh;
        let attachments = if has_depth { vec![color, depth] } else { vec![color] };
        let references = [vk::AttachmentReference::default().attachment(0).layout(layout)];
        let depth_reference = vk::AttachmentReference::default().attachment(1).layout(depth_layout);
        let subpass = vk::SubpassDescription::default()
            .pipeline_bind_point(vk::PipelineBindPoint::GRAPHICS)
            .color_attachments(&references);
        let subpasses = [if has_depth { subpass.depth_stencil_attachment(&depth_reference) } else { subpass }];
        let dependencies = [depths_before_depths()];
        let info = vk::RenderPassCreateInfo::default().attachments(&attachments).subpasses(&subpasses);
        let info = if has_depth { info.dependencies(&dependencies) } else { info };
        // SAFETY: the descriptions live until the call returns and name each other's attachments.
        let raw = unsafe { device.raw().create_render_pass(&info, None) }.of("vkCreateRenderPass")?;
        Ok(RenderPass { raw, device: device.clone() })
    }
}

impl Canvas {
    /// A canvas, undefined until it is cleared.
    ///
    /// # Errors
    /// A queue that does not draw, a format that does not blend, a size that is not drawn in one piece, no memory.
    pub(crate) fn new(device: &Arc<Device>, kind: CanvasKind, size: UVec2) -> Result<Canvas, RenderError> {
        check(device, kind)?;
        check_size(&device.physical().limits, size)?;
        let image = VulkanImage::canvas(device, kind.target(), size)?;
        let depth = (kind == CanvasKind::Mesh).then(|| VulkanImage::depth(device, size)).transpose()?;
        let pass = RenderPass::new(device, kind)?;
        let views: Vec<vk::ImageView> = std::iter::once(&image).chain(&depth).map(|image| image.view).collect();
        let info = vk::FramebufferCreateInfo::default()
            .render_pass(pass.raw)
            .attachments(&views)
            .width(size.x)
            .height(size.y)
            .layers(1);
        // SAFETY: the views are of the pass's formats and of this size.
        let framebuffer = unsafe { device.raw().create_framebuffer(&info, None) }.of("vkCreateFramebuffer")?;
        Ok(Canvas { framebuffer, pass, image, _depth: depth, kind, device: device.clone() })
    }

    /// All of it.
    pub(super) fn area(&self) -> vk::Rect2D {
        let [width, height, _] = self.image.extent().to_array();
        vk::Rect2D::default().extent(vk::Extent2D { width, height })
    }

    /// The beginning of its render pass.
    pub(super) fn begin_info(&self) -> vk::RenderPassBeginInfo<'_> {
        vk::RenderPassBeginInfo::default()
            .render_pass(self.pass.raw)
            .framebuffer(self.framebuffer)
            .render_area(self.area())
    }

    /// Whether it is of this kind and size.
    pub(crate) fn fits(&self, kind: CanvasKind, size: UVec2) -> bool {
        self.kind == kind && self.image.extent() == size.extend(1)
    }
}

fn attachment(format: vk::Format) -> vk::AttachmentDescription {
    vk::AttachmentDescription::default()
        .format(format)
        .samples(vk::SampleCountFlags::TYPE_1)
        .stencil_load_op(vk::AttachmentLoadOp::DONT_CARE)
        .stencil_store_op(vk::AttachmentStoreOp::DONT_CARE)
}

/// The depths of a picture before are done with when those of a new one are cleared, and so is what became of its pixels.
fn depths_before_depths() -> vk::SubpassDependency {
    let stages = vk::PipelineStageFlags::EARLY_FRAGMENT_TESTS
        | vk::PipelineStageFlags::LATE_FRAGMENT_TESTS
        | vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT;
    vk::SubpassDependency::default()
        .src_subpass(vk::SUBPASS_EXTERNAL)
        .dst_subpass(0)
        .src_stage_mask(stages)
        .src_access_mask(vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_WRITE)
        .dst_stage_mask(stages)
        .dst_access_mask(
            vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_READ
                | vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_WRITE
                | vk::AccessFlags::COLOR_ATTACHMENT_WRITE,
        )
}

fn check(device: &Device, kind: CanvasKind) -> Result<(), RenderError> {
    if !device.draws() {
        return Err(RenderError::Unsupported { what: "rasterise polygons: its queue only computes" });
    }
    let color = device.format_features(target_format(kind.target()));
    let (is_supported, what) = match kind {
        CanvasKind::Polygons(target) => {
            let what = match target {
                Target::Float32 => "blend 32-bit floats: take rgba16float",
                Target::Float16 => "blend 16-bit floats",
            };
            (color.contains(vk::FormatFeatureFlags::COLOR_ATTACHMENT_BLEND), what)
        }
        // Every device has depths of 32-bit floats, or of 24 bits, which are too few.
        CanvasKind::Mesh => {
            let depth = device.format_features(DEPTH_FORMAT);
            let is_there = depth.contains(vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT);
            let what = "draw meshes into 32-bit floats, with depths of 32 bits";
            (color.contains(vk::FormatFeatureFlags::COLOR_ATTACHMENT) && is_there, what)
        }
    };
    match is_supported {
        true => Ok(()),
        false => Err(RenderError::Unsupported { what }),
    }
}

/// Images may be larger than the part that is drawn into.
fn check_size(limits: &vk::PhysicalDeviceLimits, size: UVec2) -> Result<(), RenderError> {
    let viewport = UVec2::from(limits.max_viewport_dimensions);
    let most = UVec2::new(limits.max_framebuffer_width, limits.max_framebuffer_height).min(viewport);
    match size.cmple(most).all() {
        true => Ok(()),
        false => Err(RenderError::ImageTooLarge { size, limit: most.min_element() }),
    }
}

impl Drop for RenderPass {
    fn drop(&mut self) {
        // SAFETY: the device is idle; framebuffers and pipelines do not need their pass to be destroyed.
        unsafe { self.device.raw().destroy_render_pass(self.raw, None) };
    }
}

impl Drop for Canvas {
    fn drop(&mut self) {
        // SAFETY: the device is idle, and nothing else names the framebuffer; image and pass are dropped after it.
        unsafe { self.device.raw().destroy_framebuffer(self.framebuffer, None) };
    }
}
