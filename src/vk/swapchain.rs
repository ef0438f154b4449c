//! The images that a window shows, of the size that it has now.

use super::device::{DeviceCore, Tracked};
use super::error;
use super::surface::Surface;
use crate::error::Error;
use ash::{khr, vk};
use std::sync::Arc;

/// Whether pictures wait for the display's next refresh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Vsync {
    /// Each waits: no tearing, no more pictures than the display shows.
    #[default]
    On,
    /// Those that come too late for a refresh do not wait for the next, and may tear.
    Adaptive,
    /// None waits.
    Off,
}

impl Vsync {
    /// All choices with the names that options use.
    pub const NAMES: [(&'static str, Self); 3] = [("on", Self::On), ("adaptive", Self::Adaptive), ("off", Self::Off)];

    /// The first of the modes it can be had by that there is; FIFO is always there.
    fn mode(self, available: &[vk::PresentModeKHR]) -> vk::PresentModeKHR {
        let wanted: &[vk::PresentModeKHR] = match self {
            Self::On => &[],
            Self::Adaptive => &[vk::PresentModeKHR::FIFO_RELAXED],
            Self::Off => &[vk::PresentModeKHR::IMMEDIATE, vk::PresentModeKHR::MAILBOX],
        };
        wanted.iter().copied().find(|mode| available.contains(mode)).unwrap_or(vk::PresentModeKHR::FIFO)
    }
}

/// Formats whose values are shown as they are: pictures come encoded, so that one that encodes once more will not do.
const FORMATS: [vk::Format; 3] =
    [vk::Format::B8G8R8A8_UNORM, vk::Format::R8G8B8A8_UNORM, vk::Format::A8B8G8R8_UNORM_PACK32];

/// Why pictures cannot be shown.
pub(super) enum Fault {
    /// The surface is lost: another can be made of the same window.
    SurfaceLost,
    /// Anything else ends the command.
    Fatal(Error),
}

impl Fault {
    pub(super) fn new(result: vk::Result, doing: &str) -> Self {
        match result {
            vk::Result::ERROR_SURFACE_LOST_KHR => Self::SurfaceLost,
            other => Self::Fatal(error(other, doing)),
        }
    }
}

/// A swapchain with its images, and for each a semaphore that tells when it may be shown.
pub(super) struct Swapchain {
    pub(super) raw: vk::SwapchainKHR,
    pub(super) loader: khr::swapchain::Device,
    pub(super) images: Vec<vk::Image>,
    pub(super) drawn: Vec<vk::Semaphore>,
    pub(super) extent: vk::Extent2D,
    tracked: Tracked,
    /// After the swapchain.
    _surface: Arc<Surface>,
}

impl Swapchain {
    /// Images for a window that wants to be of a size, in place of `old` ones; the surface has the last word. `None` while it has
    /// no area.
    pub(super) fn new(
        core: &Arc<DeviceCore>,
        surface: &Arc<Surface>,
        wanted: vk::Extent2D,
        vsync: Vsync,
        old: Option<&Self>,
    ) -> Result<Option<Self>, Fault> {
        let Some(info) = describe(core, surface, wanted, vsync)? else { return Ok(None) };
        let info = info.old_swapchain(old.map_or(vk::SwapchainKHR::null(), |old| old.raw));
        let loader = khr::swapchain::Device::new(&core.instance.raw, &core.raw);
        // SAFETY: the surface and the old swapchain are alive; the owner below undoes it on every later failure.
        let raw = unsafe { loader.create_swapchain(&info, None) }.map_err(|e| Fault::new(e, "making a swapchain"))?;
        let tracked = Tracked::new(core, raw, "swapchain");
        let (images, drawn) = (Vec::new(), Vec::new());
        let extent = info.image_extent;
        let mut made = Self { raw, loader, images, drawn, extent, tracked, _surface: Arc::clone(surface) };
        // SAFETY: the swapchain was just made.
        made.images = unsafe { made.loader.get_swapchain_images(raw) }
            .map_err(|e| Fault::new(e, "asking for a swapchain's images"))?;
        for &image in &made.images {
            core.set_name(image, "swapchain image");
            // SAFETY: see the module's contract.
            let semaphore = unsafe { core.raw.create_semaphore(&vk::SemaphoreCreateInfo::default(), None) }
                .map_err(|e| Fault::new(e, "making a semaphore"))?;
            core.set_name(semaphore, "swapchain image drawn");
            made.drawn.push(semaphore);
        }
        Ok(Some(made))
    }
}

impl Drop for Swapchain {
    fn drop(&mut self) {
        let device = &self.tracked.core.raw;
        // SAFETY: whoever drops it has waited for what was submitted for its images.
        unsafe {
            self.drawn.iter().for_each(|&semaphore| device.destroy_semaphore(semaphore, None));
            self.loader.destroy_swapchain(self.raw, None);
        }
    }
}

/// The swapchain that fits the surface as it is now.
fn describe(
    core: &DeviceCore,
    surface: &Surface,
    wanted: vk::Extent2D,
    vsync: Vsync,
) -> Result<Option<vk::SwapchainCreateInfoKHR<'static>>, Fault> {
    let (loader, physical) = (&surface.loader, core.physical);
    // SAFETY: plain queries of a physical device of the surface's instance. A window that is gone is no more supported, and must not
    // be asked for more.
    let shows = unsafe { loader.get_physical_device_surface_support(physical, core.queue_family, surface.raw) };
    if !shows.map_err(|e| Fault::new(e, "asking whether the window is there"))? {
        return Err(Fault::SurfaceLost);
    }
    // SAFETY: as above.
    let (capabilities, formats, modes) = unsafe {
        (
            loader.get_physical_device_surface_capabilities(physical, surface.raw),
            loader.get_physical_device_surface_formats(physical, surface.raw),
            loader.get_physical_device_surface_present_modes(physical, surface.raw),
        )
    };
    let doing = "asking what the window can show";
    let capabilities = capabilities.map_err(|e| Fault::new(e, doing))?;
    let formats = formats.map_err(|e| Fault::new(e, doing))?;
    let modes = modes.map_err(|e| Fault::new(e, doing))?;
    let extent = extent(&capabilities, wanted);
    if extent.width == 0 || extent.height == 0 {
        return Ok(None);
    }
    let offered =
        |f: &vk::Format| formats.iter().any(|o| o.format == *f && o.color_space == vk::ColorSpaceKHR::SRGB_NONLINEAR);
    let format = FORMATS.into_iter().find(offered).ok_or_else(|| {
        Fault::Fatal(Error::NoWindow(format!("the window shows none of the formats {FORMATS:?} in sRGB")))
    })?;
    let most = if capabilities.max_image_count == 0 { u32::MAX } else { capabilities.max_image_count };
    Ok(Some(
        vk::SwapchainCreateInfoKHR::default()
            .surface(surface.raw)
            .min_image_count((capabilities.min_image_count + 1).min(most))
            .image_format(format)
            .image_color_space(vk::ColorSpaceKHR::SRGB_NONLINEAR)
            .image_extent(extent)
            .image_array_layers(1)
            .image_usage(vk::ImageUsageFlags::TRANSFER_DST)
            .image_sharing_mode(vk::SharingMode::EXCLUSIVE)
            .pre_transform(capabilities.current_transform)
            .composite_alpha(opaque(capabilities.supported_composite_alpha))
            .present_mode(vsync.mode(&modes))
            .clipped(true),
    ))
}

/// The surface's own size, or the wanted one within limits where the surface takes that of its images (Wayland).
fn extent(capabilities: &vk::SurfaceCapabilitiesKHR, wanted: vk::Extent2D) -> vk::Extent2D {
    let vk::SurfaceCapabilitiesKHR { current_extent, min_image_extent: min, max_image_extent: max, .. } = *capabilities;
    if current_extent.width != u32::MAX {
        return current_extent;
    }
    if wanted.width == 0 || wanted.height == 0 {
        return vk::Extent2D::default();
    }
    vk::Extent2D {
        width: wanted.width.clamp(min.width, max.width),
        height: wanted.height.clamp(min.height, max.height),
    }
}

/// Pictures hide what is behind the window, where that can be chosen.
fn opaque(supported: vk::CompositeAlphaFlagsKHR) -> vk::CompositeAlphaFlagsKHR {
    let opaque = vk::CompositeAlphaFlagsKHR::OPAQUE;
    if supported.contains(opaque) { opaque } else { vk::CompositeAlphaFlagsKHR::INHERIT }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vsync_takes_what_there_is() {
        use vk::PresentModeKHR as Mode;
        let all = [Mode::FIFO, Mode::MAILBOX, Mode::FIFO_RELAXED, Mode::IMMEDIATE];
        let of = |available: &[Mode]| Vsync::NAMES.map(|(_, vsync)| vsync.mode(available));
        assert_eq!(of(&all), [Mode::FIFO, Mode::FIFO_RELAXED, Mode::IMMEDIATE]);
        assert_eq!(of(&all[..2]), [Mode::FIFO, Mode::FIFO, Mode::MAILBOX]);
        assert_eq!(of(&all[..1]), [Mode::FIFO; 3]);
    }

    #[test]
    fn the_surface_has_the_last_word_on_the_size() {
        let size = |width, height| vk::Extent2D { width, height };
        let mut capabilities = vk::SurfaceCapabilitiesKHR {
            current_extent: size(640, 480),
            min_image_extent: size(1, 1),
            max_image_extent: size(1000, 500),
            ..vk::SurfaceCapabilitiesKHR::default()
        };
        assert_eq!(extent(&capabilities, size(800, 600)), size(640, 480));
        capabilities.current_extent = size(u32::MAX, u32::MAX);
        assert_eq!(extent(&capabilities, size(800, 600)), size(800, 500));
        assert_eq!(extent(&capabilities, size(800, 0)), size(0, 0), "minimised");
    }
}
