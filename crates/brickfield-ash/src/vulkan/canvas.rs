//! The canvas that polygons are drawn into: an image with a render pass and a framebuffer.
#![expect(unsafe_code, reason = "Vulkan's functions are foreign")]

use std::sync::Arc;

use ash::vk;
use brickfield_core::glam::UVec2;
use brickfield_frame::{RenderError, Target};

use super::image::target_format;
use super::{Device, VulkanImage};
use crate::error::{FailedCall, OfCall};

/// A render pass over one colour image that keeps the image's pixels; the image's layout is that of [`Use::Canvas`](super::Use::Canvas) before and after.
pub(super) struct RenderPass {
    pub(super) raw: vk::RenderPass,
    device: Arc<Device>,
}

/// An image that polygons are blended into.
pub(crate) struct Canvas {
    pub(super) framebuffer: vk::Framebuffer,
    pub(super) pass: RenderPass,
    pub(crate) image: VulkanImage,
    target: Target,
    device: Arc<Device>,
}

impl RenderPass {
    /// The render pass for a target; render passes of one target are compatible.
    pub(super) fn new(device: &Arc<Device>, target: Target) -> Result<RenderPass, FailedCall> {
        let layout = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
        let attachments = [vk::AttachmentDescription::default()
            .format(target_format(target))
            .samples(vk::SampleCountFlags::TYPE_1)
            .load_op(vk::AttachmentLoadOp::LOAD)
            .store_op(vk::AttachmentStoreOp::STORE)
            .stencil_load_op(vk::AttachmentLoadOp::DONT_CARE)
            .stencil_store_op(vk::AttachmentStoreOp::DONT_CARE)
            .initial_layout(layout)
            .final_layout(layout)];
        let references = [vk::AttachmentReference::default().attachment(0).layout(layout)];
        let subpasses = [vk::SubpassDescription::default()
            .pipeline_bind_point(vk::PipelineBindPoint::GRAPHICS)
            .color_attachments(&references)];
        let info = vk::RenderPassCreateInfo::default().attachments(&attachments).subpasses(&subpasses);
        // SAFETY: the descriptions live until the call returns and name each other's only attachment.
        let raw = unsafe { device.raw().create_render_pass(&info, None) }.of("vkCreateRenderPass")?;
        Ok(RenderPass { raw, device: device.clone() })
    }
}

impl Canvas {
    /// A canvas, undefined until it is cleared.
    ///
    /// # Errors
    /// A queue that does not draw, a format that does not blend, a size that is not drawn in one piece, no memory.
    pub(crate) fn new(device: &Arc<Device>, target: Target, size: UVec2) -> Result<Canvas, RenderError> {
        check(device, target)?;
        check_size(&device.physical().limits, size)?;
        let image = VulkanImage::canvas(device, target, size)?;
        let pass = RenderPass::new(device, target)?;
        let views = [image.view];
        let info = vk::FramebufferCreateInfo::default()
            .render_pass(pass.raw)
            .attachments(&views)
            .width(size.x)
            .height(size.y)
            .layers(1);
        // SAFETY: the view is of the pass's format and of this size.
        let framebuffer = unsafe { device.raw().create_framebuffer(&info, None) }.of("vkCreateFramebuffer")?;
        Ok(Canvas { framebuffer, pass, image, target, device: device.clone() })
    }

    /// Whether it is of this kind and size.
    pub(crate) fn fits(&self, target: Target, size: UVec2) -> bool {
        self.target == target && self.image.extent() == size.extend(1)
    }
}

fn check(device: &Device, target: Target) -> Result<(), RenderError> {
    if !device.draws() {
        return Err(RenderError::Unsupported { what: "rasterise polygons: its queue only computes" });
    }
    let blends = vk::FormatFeatureFlags::COLOR_ATTACHMENT_BLEND;
    let what = match target {
        Target::Float32 => "blend 32-bit floats: take rgba16float",
        Target::Float16 => "blend 16-bit floats",
    };
    match device.format_features(target_format(target)).contains(blends) {
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
