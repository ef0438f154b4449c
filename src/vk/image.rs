//! Two-dimensional images with one view: attachments that later passes read.

use super::device::{Device, Tracked};
use super::{error, memory};
use crate::error::{Error, Result};
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;

/// An image, its view and its memory.
pub struct Image {
    pub(super) raw: vk::Image,
    pub(super) view: vk::ImageView,
    pub(super) format: vk::Format,
    pub(super) size: vk::Extent2D,
    allocation: Option<Allocation>,
    tracked: Tracked,
}

impl Image {
    /// A colour image: attachment, sampled, copied from.
    ///
    /// # Errors
    /// [`Error::Exhausted`] when memory runs out, [`Error::Usage`] for a size that the device does not allow.
    pub fn colour(device: &Device, name: &str, size: vk::Extent2D, format: vk::Format) -> Result<Self> {
        let usage =
            vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_SRC;
        Self::new(device, name, size, format, usage)
    }

    /// The picture of a window: a colour image that is also copied to.
    ///
    /// # Errors
    /// [`Error::Exhausted`] when memory runs out, [`Error::Usage`] for a size that the device does not allow.
    pub fn picture(device: &Device, name: &str, size: vk::Extent2D, format: vk::Format) -> Result<Self> {
        let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT
            | vk::ImageUsageFlags::TRANSFER_SRC
            | vk::ImageUsageFlags::TRANSFER_DST;
        Self::new(device, name, size, format, usage)
    }

    /// A depth image, with stencil where the format has it; `copied`: [`super::Pass::copy_depth`] may read it.
    ///
    /// # Errors
    /// [`Error::Exhausted`] when memory runs out, [`Error::Usage`] for a size that the device does not allow.
    pub fn depth_stencil(
        device: &Device,
        name: &str,
        size: vk::Extent2D,
        format: vk::Format,
        copied: bool,
    ) -> Result<Self> {
        let copy = if copied { vk::ImageUsageFlags::TRANSFER_SRC } else { vk::ImageUsageFlags::empty() };
        Self::new(device, name, size, format, vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT | copy)
    }

    fn new(
        device: &Device,
        name: &str,
        size: vk::Extent2D,
        format: vk::Format,
        usage: vk::ImageUsageFlags,
    ) -> Result<Self> {
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .extent(vk::Extent3D { width: size.width, height: size.height, depth: 1 })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(usage);
        check_size(device, name, &info)?;
        let core = &device.core;
        // SAFETY: see the module's contract; the owner below undoes it on every later failure.
        let raw = unsafe { core.raw.create_image(&info, None) }.map_err(|e| error(e, &format!("creating `{name}`")))?;
        let tracked = Tracked::new(core, raw, name);
        let mut image = Self { raw, view: vk::ImageView::null(), format, size, allocation: None, tracked };
        // SAFETY: `raw` was just created.
        let requirements = unsafe { core.raw.get_image_memory_requirements(raw) };
        let allocation = core.memory.allocate(name, requirements, MemoryLocation::GpuOnly, false)?;
        // SAFETY: the allocation fits the requirements and is bound once.
        let bound = unsafe { core.raw.bind_image_memory(raw, allocation.memory(), allocation.offset()) };
        image.allocation = Some(allocation);
        bound.map_err(|e| memory::bind_error(e, name))?;
        let view = vk::ImageViewCreateInfo::default()
            .image(raw)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(format)
            .subresource_range(image.whole());
        // SAFETY: the image has memory.
        image.view = unsafe { core.raw.create_image_view(&view, None) }
            .map_err(|e| error(e, &format!("creating the view of `{name}`")))?;
        core.set_name(image.view, name);
        Ok(image)
    }

    /// Size in pixels.
    pub const fn size(&self) -> vk::Extent2D {
        self.size
    }

    /// Whether it holds depth, with stencil or without.
    pub(super) const fn is_depth(&self) -> bool {
        matches!(self.format, vk::Format::D16_UNORM) || self.has_stencil()
    }

    /// Whether it holds stencil.
    pub(super) const fn has_stencil(&self) -> bool {
        has_stencil(self.format)
    }

    /// The one layout the image is ever in: GENERAL costs colour images nothing measurable and saves the
    /// transitions; depth keeps the layout that lets hardware compress it.
    pub(super) const fn layout(&self) -> vk::ImageLayout {
        if self.is_depth() { vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL } else { vk::ImageLayout::GENERAL }
    }

    pub(super) fn whole(&self) -> vk::ImageSubresourceRange {
        let aspect = match (self.has_stencil(), self.is_depth()) {
            (true, _) => vk::ImageAspectFlags::DEPTH | vk::ImageAspectFlags::STENCIL,
            (false, true) => vk::ImageAspectFlags::DEPTH,
            (false, false) => vk::ImageAspectFlags::COLOR,
        };
        vk::ImageSubresourceRange::default().aspect_mask(aspect).level_count(1).layer_count(1)
    }
}

/// Whether a depth format has a stencil.
pub(super) const fn has_stencil(format: vk::Format) -> bool {
    matches!(format, vk::Format::D32_SFLOAT_S8_UINT | vk::Format::D24_UNORM_S8_UINT | vk::Format::D16_UNORM_S8_UINT)
}

/// Whether the device allows an image of this size at all: to create one beyond its limits is an error of the program, not
/// one that Vulkan reports.
fn check_size(device: &Device, name: &str, info: &vk::ImageCreateInfo<'_>) -> Result<()> {
    let vk::Extent3D { width, height, .. } = info.extent;
    let too_large = format!("a picture of {width}x{height} pixels is too large: {}", device.report().name);
    let limits = device.core.image_limits(info)?;
    let max = device.report().max_image_side.min(limits.max_extent.width).min(limits.max_extent.height);
    if width.max(height) > max {
        return Err(Error::Usage(format!("{too_large} allows {max} a side")));
    }
    let bytes = u64::from(width) * u64::from(height) * texel_bytes(info.format);
    if bytes > limits.max_resource_size {
        let [needed, allowed] = [bytes, limits.max_resource_size].map(|b| b >> 20);
        return Err(Error::Exhausted(format!(
            "{too_large} allows {allowed} MiB an image, `{name}` needs {needed}; try a smaller --size"
        )));
    }
    Ok(())
}

/// Bytes of a pixel in the formats that passes draw into, at least: padding of depth formats is the driver's.
const fn texel_bytes(format: vk::Format) -> u64 {
    match format {
        vk::Format::R32G32B32A32_SFLOAT => 16,
        vk::Format::R16G16B16A16_SFLOAT => 8,
        vk::Format::D32_SFLOAT_S8_UINT => 5,
        vk::Format::D16_UNORM_S8_UINT => 3,
        vk::Format::D16_UNORM => 2,
        _ => 4,
    }
}

impl Drop for Image {
    fn drop(&mut self) {
        let core = &self.tracked.core;
        // SAFETY: no recording borrows the image any more, and each is waited for; null views are ignored.
        unsafe {
            core.raw.destroy_image_view(self.view, None);
            core.raw.destroy_image(self.raw, None);
        }
        if let Some(allocation) = self.allocation.take() {
            core.memory.free(allocation);
        }
    }
}
