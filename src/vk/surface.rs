//! The surface of a window, which pictures are shown on.

use super::error;
use super::instance::Instance;
use super::report::Candidate;
use super::window_handles::WindowHandles;
use crate::error::{Error, Result};
use ash::{khr, vk};
use raw_window_handle::HandleError;
use std::sync::Arc;

/// The surface of a window. It keeps the window and the instance alive.
pub struct Surface {
    pub(super) raw: vk::SurfaceKHR,
    pub(super) loader: khr::surface::Instance,
    window: Arc<dyn WindowHandles>,
    instance: Arc<Instance>,
}

impl Surface {
    pub(super) fn new(instance: &Arc<Instance>, window: Arc<dyn WindowHandles>) -> Result<Arc<Self>> {
        let gone = |e: HandleError| Error::NoWindow(format!("the window is gone: {e}"));
        let display = window.display_handle().map_err(gone)?.as_raw();
        let handle = window.window_handle().map_err(gone)?.as_raw();
        // SAFETY: the instance has the extensions of such windows; the window lives as long as the surface, which owns a share.
        let raw = unsafe { ash_window::create_surface(&instance.entry, &instance.raw, display, handle, None) }
            .map_err(|e| error(e, "making the window's surface"))?;
        let loader = khr::surface::Instance::new(&instance.entry, &instance.raw);
        Ok(Arc::new(Self { raw, loader, window, instance: Arc::clone(instance) }))
    }

    /// Another surface of the same window, after this one was lost.
    ///
    /// # Errors
    /// [`Error::NoWindow`] if the window is gone.
    pub(super) fn again(&self) -> Result<Arc<Self>> {
        Self::new(&self.instance, Arc::clone(&self.window))
    }

    /// What a device lacks to show pictures here.
    pub(super) fn missing(&self, candidate: &Candidate) -> Option<String> {
        // SAFETY: plain queries of a physical device of this surface's instance.
        let (extensions, presents) = unsafe {
            let presents = candidate.queue_family.map(|family| {
                self.loader.get_physical_device_surface_support(candidate.raw, family, self.raw).unwrap_or(false)
            });
            (self.instance.raw.enumerate_device_extension_properties(candidate.raw).unwrap_or_default(), presents)
        };
        let has_swapchain = extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(khr::swapchain::NAME));
        match (has_swapchain, presents) {
            (false, _) => Some("the extension VK_KHR_swapchain".to_owned()),
            (true, Some(false)) => Some("pictures for this window".to_owned()),
            _ => None,
        }
    }
}

impl Drop for Surface {
    fn drop(&mut self) {
        // SAFETY: swapchains hold an `Arc` of this surface, so none is left.
        unsafe { self.loader.destroy_surface(self.raw, None) };
    }
}
