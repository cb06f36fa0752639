//! Images with their views, and the sampler.
#![expect(unsafe_code, reason = "Vulkan's functions are foreign")]

use std::sync::Arc;

use ash::vk;
use brickfield_core::glam::{UVec2, UVec3};
use brickfield_frame::{RenderError, SampleFormat, Target, TextureLayout};

use super::memory::{Allocation, refused};
use super::{Device, Residence};
use crate::error::{FailedCall, OfCall};

/// The colour aspect of all layers of an image without mip levels.
pub(super) const WHOLE: vk::ImageSubresourceRange = vk::ImageSubresourceRange {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    base_mip_level: 0,
    level_count: 1,
    base_array_layer: 0,
    layer_count: vk::REMAINING_ARRAY_LAYERS,
};

/// An image with its view and memory.
pub(crate) struct VulkanImage {
    pub(super) raw: vk::Image,
    pub(super) view: vk::ImageView,
    extent: UVec3,
    view_type: vk::ImageViewType,
    device: Arc<Device>,
    /// Dropped after the image is destroyed.
    memory: Option<Allocation>,
}

impl VulkanImage {
    /// A texture of three axes that copies fill and read, and shaders read.
    pub(crate) fn texture(
        device: &Arc<Device>,
        format: SampleFormat,
        layout: TextureLayout,
        extent: UVec3,
    ) -> Result<VulkanImage, RenderError> {
        let n_bytes = format.n_bytes() as u64 * n_texels(extent);
        let format = vulkan_format(format);
        let copies = vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::TRANSFER_DST;
        let usage = vk::ImageUsageFlags::SAMPLED | copies;
        let (image_type, view_type) = match layout {
            TextureLayout::Volume => (vk::ImageType::TYPE_3D, vk::ImageViewType::TYPE_3D),
            TextureLayout::Layers => (vk::ImageType::TYPE_2D, vk::ImageViewType::TYPE_2D_ARRAY),
        };
        let info = vk::ImageCreateInfo::default().image_type(image_type).format(format).usage(usage);
        VulkanImage::new(device, ("the atlas", n_bytes), view_type, info, extent)
    }

    /// A picture of four floats a pixel that shaders write and copies read.
    pub(crate) fn picture(device: &Arc<Device>, size: UVec2) -> Result<VulkanImage, RenderError> {
        let usage = vk::ImageUsageFlags::STORAGE | vk::ImageUsageFlags::TRANSFER_SRC;
        let format = vk::Format::R32G32B32A32_SFLOAT;
        let info = vk::ImageCreateInfo::default().image_type(vk::ImageType::TYPE_2D).format(format).usage(usage);
        let extent = size.extend(1);
        VulkanImage::new(device, ("the picture", 16 * n_texels(extent)), vk::ImageViewType::TYPE_2D, info, extent)
    }

    /// A picture that polygons are blended into, that is cleared before and copied after.
    pub(crate) fn canvas(device: &Arc<Device>, target: Target, size: UVec2) -> Result<VulkanImage, RenderError> {
        let copies = vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::TRANSFER_DST;
        let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | copies;
        let format = target_format(target);
        let info = vk::ImageCreateInfo::default().image_type(vk::ImageType::TYPE_2D).format(format).usage(usage);
        let n_bytes = target.pixel_bytes() as u64 * n_texels(size.extend(1));
        VulkanImage::new(device, ("the picture", n_bytes), vk::ImageViewType::TYPE_2D, info, size.extend(1))
    }

    /// The depths of a mesh's picture.
    pub(crate) fn depth(device: &Arc<Device>, size: UVec2) -> Result<VulkanImage, RenderError> {
        let usage = vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT;
        let info = vk::ImageCreateInfo::default().image_type(vk::ImageType::TYPE_2D).format(DEPTH_FORMAT).usage(usage);
        let n_bytes = 4 * n_texels(size.extend(1));
        VulkanImage::new(device, ("the depths", n_bytes), vk::ImageViewType::TYPE_2D, info, size.extend(1))
    }

    fn new(
        device: &Arc<Device>,
        (what, n_bytes): (&'static str, u64),
        view_type: vk::ImageViewType,
        info: vk::ImageCreateInfo<'_>,
        extent: UVec3,
    ) -> Result<VulkanImage, RenderError> {
        let (axes, layers) = axes_and_layers(view_type, extent);
        let info =
            info.extent(extent_3d(axes)).mip_levels(1).array_layers(layers).samples(vk::SampleCountFlags::TYPE_1);
        // SAFETY: callers keep the extent within the device's limits and the format within its features.
        let raw = unsafe { device.raw().create_image(&info, None) }
            .map_err(|code| refused("vkCreateImage", code, what, n_bytes, None))?;
        let mut image =
            VulkanImage { raw, view: vk::ImageView::null(), extent, view_type, device: device.clone(), memory: None };
        // SAFETY: the image is new.
        let required = unsafe { device.raw().get_image_memory_requirements(raw) };
        let memory = image.memory.insert(Allocation::new(device, what, required, Residence::Device)?);
        // SAFETY: the memory is as required, new, and bound once; `image` holds it.
        unsafe { device.raw().bind_image_memory(raw, memory.raw, 0) }.of("vkBindImageMemory")?;
        let view = vk::ImageViewCreateInfo::default()
            .image(raw)
            .view_type(view_type)
            .format(info.format)
            .subresource_range(vk::ImageSubresourceRange { aspect_mask: aspect(info.format), ..WHOLE });
        // SAFETY: the image is bound to memory and of this format and dimension.
        image.view = unsafe { device.raw().create_image_view(&view, None) }.of("vkCreateImageView")?;
        Ok(image)
    }

    /// Its size in texels, layers along z.
    pub(crate) fn extent(&self) -> UVec3 {
        self.extent
    }

    /// A box of its texels, as copies name it: layers, offset, extent.
    pub(super) fn part(
        &self,
        origin: UVec3,
        extent: UVec3,
    ) -> (vk::ImageSubresourceLayers, vk::Offset3D, vk::Extent3D) {
        let (axes, layer_count) = axes_and_layers(self.view_type, extent);
        let (first, base_array_layer) = match self.view_type {
            vk::ImageViewType::TYPE_2D_ARRAY => (origin.with_z(0), origin.z),
            _ => (origin, 0),
        };
        let aspect_mask = vk::ImageAspectFlags::COLOR;
        let layers = vk::ImageSubresourceLayers { aspect_mask, mip_level: 0, base_array_layer, layer_count };
        let offset = vk::Offset3D { x: first.x as i32, y: first.y as i32, z: first.z as i32 };
        (layers, offset, extent_3d(axes))
    }
}

impl Drop for VulkanImage {
    fn drop(&mut self) {
        // SAFETY: the device is idle, and nothing else names image or view; a null view is allowed.
        unsafe {
            self.device.raw().destroy_image_view(self.view, None);
            self.device.raw().destroy_image(self.raw, None);
        }
    }
}

/// A sampler, clamped to the edge.
pub(crate) struct Sampler {
    pub(super) raw: vk::Sampler,
    device: Arc<Device>,
}

impl Sampler {
    /// The sampler of textures: linear for a volume; nearest for layers, of which texels are gathered as they are.
    pub(crate) fn of(layout: TextureLayout, device: &Arc<Device>) -> Result<Sampler, FailedCall> {
        let filter = match layout {
            TextureLayout::Volume => vk::Filter::LINEAR,
            TextureLayout::Layers => vk::Filter::NEAREST,
        };
        let edge = vk::SamplerAddressMode::CLAMP_TO_EDGE;
        let info = vk::SamplerCreateInfo::default()
            .mag_filter(filter)
            .min_filter(filter)
            .mipmap_mode(vk::SamplerMipmapMode::NEAREST)
            .address_mode_u(edge)
            .address_mode_v(edge)
            .address_mode_w(edge);
        // SAFETY: a plain description without optional features.
        let raw = unsafe { device.raw().create_sampler(&info, None) }.of("vkCreateSampler")?;
        Ok(Sampler { raw, device: device.clone() })
    }
}

impl Drop for Sampler {
    fn drop(&mut self) {
        // SAFETY: the device is idle, and nothing else names the sampler.
        unsafe { self.device.raw().destroy_sampler(self.raw, None) };
    }
}

/// The axes of an image of so many texels, and its layers.
fn axes_and_layers(view_type: vk::ImageViewType, extent: UVec3) -> (UVec3, u32) {
    match view_type {
        vk::ImageViewType::TYPE_2D_ARRAY => (extent.with_z(1), extent.z),
        _ => (extent, 1),
    }
}

/// A size as Vulkan takes it.
pub(super) fn extent_3d(UVec3 { x, y, z }: UVec3) -> vk::Extent3D {
    vk::Extent3D { width: x, height: y, depth: z }
}

/// The format of an atlas.
pub(crate) fn vulkan_format(format: SampleFormat) -> vk::Format {
    match format {
        SampleFormat::Unorm8 => vk::Format::R8_UNORM,
        SampleFormat::Unorm8x4 => vk::Format::R8G8B8A8_UNORM,
        SampleFormat::Unorm16 => vk::Format::R16_UNORM,
        SampleFormat::Float32 => vk::Format::R32_SFLOAT,
    }
}

/// The format of depths.
pub(super) const DEPTH_FORMAT: vk::Format = vk::Format::D32_SFLOAT;

fn aspect(format: vk::Format) -> vk::ImageAspectFlags {
    if format == DEPTH_FORMAT { vk::ImageAspectFlags::DEPTH } else { vk::ImageAspectFlags::COLOR }
}

/// The format of the image that polygons are blended into.
pub(crate) fn target_format(target: Target) -> vk::Format {
    match target {
        Target::Float32 => vk::Format::R32G32B32A32_SFLOAT,
        Target::Float16 => vk::Format::R16G16B16A16_SFLOAT,
    }
}

fn n_texels(extent: UVec3) -> u64 {
    extent.to_array().into_iter().map(u64::from).product()
}

#[cfg(test)]
mod tests {
    use super::super::{Instance, physical_devices};
    use super::*;
    use crate::Validation;

    #[test]
    fn a_texture_that_no_device_holds_is_refused_with_its_size() {
        let Ok(instance) = Instance::new(Validation::Off) else { return println!("no device") };
        let Some(physical) = physical_devices(&instance).unwrap().pop() else { return println!("no device") };
        let limit = physical.limits.max_image_dimension3_d;
        let device = Device::new(instance, physical).unwrap();
        let least = 4 * u64::from(limit).pow(3);
        match VulkanImage::texture(&device, SampleFormat::Float32, TextureLayout::Volume, UVec3::splat(limit))
            .map(|_| ())
        {
            Err(RenderError::OutOfMemory { n_bytes, .. } | RenderError::BufferTooLarge { n_bytes, .. }) => {
                assert!(n_bytes >= least, "{n_bytes} of {least}");
            }
            other => panic!("{other:?}"),
        }
    }
}
